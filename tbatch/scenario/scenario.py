"""A scenario: read from TOML, checked, with every default filled in, and built when it is asked for."""

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from tbatch.scenario.contact import build_contact
from tbatch.scenario.document import Document
from tbatch.scenario.errors import Findings, Path, Problem, ScenarioError, dotted, place
from tbatch.scenario.keep import Keep
from tbatch.scenario.limits import DivergedLimit
from tbatch.scenario.load import Loaded, load
from tbatch.scenario.matrices import FILES
from tbatch.scenario.positions import key_lines
from tbatch.scenario.source import Source, parse_override, set_value
from tbatch.scenario.track import build_track
from tbatch.scenario.vary import varied_section
from tbatch.scenario.vehicle import build_vehicle

if TYPE_CHECKING:
    from tbatch.engine.model import Model
    from tbatch.engine.runs import Runs
    from tbatch.physics.irregularity import Irregularity

T = TypeVar("T")
Pair = tuple[int, int]


@dataclass(frozen=True, eq=False)
class Scenario:
    """What a campaign runs: one model, some speeds, some samples. It never changes."""

    document: Document
    """All tables with every number, in SI."""
    source_text: str
    """The TOML text as given; empty for a scenario made from tables."""
    file: str
    """The file as given."""
    warnings: tuple[str, ...]
    """What will run but may not be meant, a line each."""
    _loaded: Loaded

    @classmethod
    def load(cls, path_or_name: str | FilePath, overrides: Iterable[str] = ()) -> "Scenario":
        """Read a scenario file or a shipped scenario.

        Args:
            path_or_name: Path of a TOML file, or a name that ``tbatch list scenarios`` shows.
            overrides: Changes such as ``"track.length=120 m"``, later ones last.

        Raises:
            ScenarioError: Everything that is wrong, at once.
        """
        return cls._of(Source.find(path_or_name), overrides)

    @classmethod
    def from_text(cls, text: str, *, file: str = "scenario", overrides: Iterable[str] = ()) -> "Scenario":
        """Read a scenario from TOML text.

        Args:
            text: The text.
            file: Name for messages; its stem names the campaign if the text does not.
            overrides: Changes such as ``"track.length=120 m"``.
        """
        return cls._of(Source(text, file, FilePath.cwd()), overrides)

    @classmethod
    def from_tables(cls, tables: Mapping[str, Any], *, file: str = "scenario") -> "Scenario":
        """Read a scenario from tables, such as those that ``resolved`` gave.

        Args:
            tables: The tables.
            file: Name for messages; its stem names the campaign if the tables do not.
        """
        return cls._checked(Source("", file, FilePath.cwd()), json.loads(json.dumps(tables)), {})

    @classmethod
    def _of(cls, source: Source, overrides: Iterable[str]) -> "Scenario":
        tables = source.parse()
        problems: list[Problem] = []
        given: dict[Path, str] = {}
        for text in overrides:
            try:
                path, value = parse_override(text)
            except ScenarioError as error:
                problems += error.problems
                continue
            given[_place(path)] = text
            if (blocked := set_value(tables, path, value)) is not None:
                problems.append(
                    Problem(path, f"cannot be set: {dotted(blocked)} is not a table with such an entry", file="--set")
                )
        return cls._checked(source, tables, given, problems)

    @classmethod
    def _checked(
        cls, source: Source, tables: dict[str, Any], given: Mapping[Path, str], problems: Sequence[Problem] = ()
    ) -> "Scenario":
        findings = Findings()
        loaded = load(tables, stem=FilePath(source.file).stem, folder=source.folder, findings=findings)
        if findings.problems or problems or loaded is None:
            found = place(findings.problems, source.file, key_lines(source.text), given)
            raise ScenarioError([*found, *problems])
        return cls(loaded.document, source.text, source.file, tuple(findings.warnings), loaded)

    @property
    def name(self) -> str:
        """Name of the campaign."""
        return self.document.campaign.name

    @property
    def seed(self) -> int:
        """Seed of all random numbers."""
        return self.document.campaign.seed

    @property
    def samples(self) -> int:
        """Samples per speed."""
        return self.document.campaign.runs

    @property
    def speeds(self) -> tuple[float, ...]:
        """Speed of each case [m/s]."""
        return self.document.speed.values

    @property
    def keep(self) -> Keep:
        """Which runs are kept with their full histories: timelines, channels, every [s]."""
        return self.document.keep

    @property
    def limits_diverged(self) -> int:
        """How many runs may diverge."""
        limits: DivergedLimit = self.document.limits
        return limits.diverged.max

    def evaluated_length(self, case: int = 0, wheel: int = 1) -> float:
        """Return the length over which a wheel counts in a run [m].

        Args:
            case: Index of the speed; all speeds have the same length.
            wheel: Wheel, counted from 1 at the front.
        """
        return self._loaded.passage.evaluated_length(wheel)

    def resolved(self) -> dict[str, Any]:
        """Return all tables with every default, in SI, ready for JSON; ``from_tables`` reads them back."""
        return self.document.model_dump(mode="json", exclude_none=True)

    @cached_property
    def hash(self) -> str:
        """SHA-256 of what decides the results: all tables but ``campaign.runs``, file paths, [limits] and [keep]."""
        tables = {name: table for name, table in self.resolved().items() if name not in ("keep", "limits")}
        del tables["campaign"]["runs"]
        tables["irregularity"].get("measured", {}).pop("file", None)
        for name in FILES:
            tables["track"].get("matrices", {}).pop(name, None)
        return hashlib.sha256(json.dumps(tables, sort_keys=True, separators=(",", ":")).encode()).hexdigest()

    def model(self) -> "Model":
        """Return the vehicle, the track and the contact, factorised for the step; built once."""
        return self._model

    @cached_property
    def _model(self) -> "Model":
        from tbatch.engine.model import Model

        document = self.document
        try:
            return Model.build(
                build_vehicle(document.vehicle),
                self._loaded.imported or build_track(document.track),
                build_contact(document.contact),
                step=document.integration.step,
                splitting=document.integration.splitting,
                local_compliance=document.contact.local_compliance,
            )
        except (ValueError, ArithmeticError, np.linalg.LinAlgError) as error:
            problem = Problem((), f"the model cannot be built: {error}", file=self.file)
            raise ScenarioError([problem]) from error

    def irregularity(self, sample: int) -> "Irregularity":
        """Return the running surface of a sample, faded in.

        Args:
            sample: Index of the sample, from 0.
        """
        surface = self._loaded.surface
        varied = varied_section("irregularity", surface.section, self.varied(sample))
        return (surface if varied is surface.section else replace(surface, section=varied)).sample(sample)

    def varied(self, sample: int) -> dict[str, float]:
        """Return the numbers of a sample that differ from those of others, by dotted key, in SI.

        Args:
            sample: Index of the sample, from 0.
        """
        return self._loaded.sampling.numbers(sample)

    def runs(self, pairs: Sequence[tuple[int, int]]) -> tuple["Runs", NDArray[np.float64]]:
        """Return the table of inputs of some runs; runs of one sample share its running surface.

        Args:
            pairs: (case, sample) of each run.

        Returns:
            The runs and how long each lasts [s], shape (run,).
        """
        from tbatch.engine.runs import Runs

        for case, sample in pairs:
            if not 0 <= case < len(self.speeds) or sample < 0:
                raise ValueError(
                    f"run (case {case}, sample {sample}): case must be 0 to {len(self.speeds) - 1}, sample 0 or more"
                )
        samples = sorted({sample for _, sample in pairs})
        surfaces = {sample: self.irregularity(sample) for sample in samples}
        numbers = {sample: self.varied(sample) for sample in samples}
        speed = np.array([numbers[sample].get("speed", self.speeds[case]) for case, sample in pairs])
        passage = self._loaded.passage
        runs = Runs(
            speed=speed,
            irregularity=[surfaces[sample] for _, sample in pairs],
            start=passage.start,
            evaluate_from=passage.evaluate_from,
            vehicle=self._built("vehicle", build_vehicle, numbers, pairs),
            contact=self._built("contact", build_contact, numbers, pairs),
        )
        return runs, passage.distance / speed

    def _built(
        self, name: str, build: Callable[[Any], T], numbers: Mapping[int, Mapping[str, float]], pairs: Sequence[Pair]
    ) -> list[T] | None:
        """The vehicle or contact of each run; None where they are the model's own."""
        if not any(key.startswith(f"{name}.") for key in self.document.vary or ()):
            return None
        section = getattr(self.document, name)
        built = {sample: build(varied_section(name, section, given)) for sample, given in numbers.items()}
        return [built[sample] for _, sample in pairs]

    @staticmethod
    def json_schema() -> dict[str, Any]:
        """Return the JSON schema of a scenario file, for editors."""
        schema = _without_null(Document.model_json_schema())
        return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "tbatch scenario"}


def _without_null(schema: Any) -> Any:
    """Return a schema without null, which TOML cannot write, and without the defaults of whole tables."""
    if isinstance(schema, list):
        return [_without_null(item) for item in schema if item != {"type": "null"}]
    if not isinstance(schema, dict):
        return schema
    given = {key: value for key, value in schema.items() if key != "default" or not isinstance(value, dict | None)}
    clean = {key: _without_null(value) for key, value in given.items()}
    if len(ways := clean.get("anyOf", ())) == 1:
        del clean["anyOf"]
        clean |= {key: value for key, value in ways[0].items() if key not in clean}
    return clean


def _place(path: Path) -> Path:
    """Return the path as problems name it: entries of lists by number."""
    return tuple(int(key) if isinstance(key, str) and key.isdecimal() and len(key) < 6 else key for key in path)
