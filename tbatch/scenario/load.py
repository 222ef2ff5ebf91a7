"""From the tables of a scenario to a checked document: every problem found, nothing left open."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ValidationError

from tbatch.physics.catalogue.tracks import SLAB_TRACKS
from tbatch.scenario.contact import complete_contact
from tbatch.scenario.document import Document, names_a_folder
from tbatch.scenario.errors import Findings, Path, Problem, did_you_mean, shown
from tbatch.scenario.fields import kind_of
from tbatch.scenario.irregularity import complete_irregularity
from tbatch.scenario.keep import complete_keep
from tbatch.scenario.later import take_out_later
from tbatch.scenario.limits import check_limits, gather_limits
from tbatch.scenario.matrices import read_matrices
from tbatch.scenario.measured import MeasuredLevel, read_measured
from tbatch.scenario.passage import Passage, Speed, complete_run, complete_speed
from tbatch.scenario.resolution import warn_of_step
from tbatch.scenario.sampling import PLAN, Sampling
from tbatch.scenario.section import accepted_at, inner_section
from tbatch.scenario.surface import Surface, check_surface
from tbatch.scenario.track import TrackSection, complete_track, missing_keys
from tbatch.scenario.vary import complete_vary
from tbatch.scenario.vehicle import VehicleSection, complete_vehicle

if TYPE_CHECKING:
    from tbatch.physics.track import Track


@dataclass(frozen=True, eq=False)
class Loaded:
    """A scenario that can be run."""

    document: Document
    """All tables with every number, in SI."""
    passage: Passage
    surface: Surface
    sampling: Sampling
    imported: "Track | None" = None
    """The track, if it is made from files."""


def load(tables: dict[str, Any], *, stem: str, folder: FilePath, findings: Findings) -> Loaded | None:
    """Check and complete the tables of a scenario.

    Each table is checked on its own, and each relation between tables as soon as the tables it needs are sound, so that
    one mistake does not hide another.

    Args:
        tables: The parsed scenario; what is not yet available is taken out of it.
        stem: Name of the campaign if the scenario does not say one.
        folder: Folder that relative paths start from.
        findings: Takes all problems and warnings.

    Returns:
        The scenario, or None if there are problems.
    """
    later = take_out_later(tables)
    findings.problems += later
    if isinstance(tables.get("limits"), dict):
        tables["limits"] = gather_limits(tables["limits"])
    incomplete = {problem.path[0] for problem in later}
    sections = _sections(tables, incomplete, findings)
    campaign, integration = (sections.get(name) for name in ("campaign", "integration"))
    speed: Speed | None = _completed("speed", complete_speed, sections, findings)

    vehicle: VehicleSection | None = _completed("vehicle", complete_vehicle, sections, findings)
    track: TrackSection | None = _completed("track", complete_track, sections, findings)
    imported: Track | None = None
    files: TrackSection | None = sections.get("track")  # read even if the rest of the table is not sound
    if files and files.matrices and files.rayleigh:
        matrices, imported = read_matrices(
            files.matrices, folder, findings, rails=files.rails, rayleigh=files.rayleigh.numbers()
        )
        sections["track"] = files.model_copy(update={"matrices": matrices})
        track = track and sections["track"]
    if vehicle and track:
        _check_rails(vehicle, track, findings)
    if contact := sections.get("contact"):
        sections["contact"] = complete_contact(contact, vehicle.wheel_radius if vehicle else None, findings)
    if campaign and not campaign.name:
        if not names_a_folder(stem):
            accepted = accepted_at(Document, ("campaign", "name"))
            findings.refuse(
                ("campaign", "name"), f"is missing, and the file's name {shown(stem)} cannot serve", accepted=accepted
            )
        sections["campaign"] = campaign.model_copy(update={"name": stem})
    if campaign and campaign.stop and campaign.stop.max_runs < campaign.runs:
        accepted = f"campaign.runs = {campaign.runs} or more"
        findings.refuse(("campaign", "stop", "max_runs"), "is too few", value=campaign.stop.max_runs, accepted=accepted)

    passage = surface = None
    reach = (imported.begin, imported.end) if imported else None
    if track and not track.matrices:
        reach = 0.0, track.built_length
    if vehicle and track and reach and speed and integration and "run" in sections:
        sections["run"], passage = complete_run(
            sections["run"],
            offsets=vehicle.offsets,
            track_kind=track.kind,
            reach=reach,
            speeds=speed.range,
            step=integration.step,
            findings=findings,
        )
    level: MeasuredLevel | None = None
    if irregularity := sections.get("irregularity"):
        irregularity = complete_irregularity(irregularity, findings)
        if irregularity.measured:
            measured, level = read_measured(irregularity.measured, folder, findings)
            irregularity = irregularity.model_copy(update={"measured": measured})
        sections["irregularity"] = irregularity
    if passage and irregularity and campaign and speed and integration:
        surface = Surface(irregularity, passage, campaign.seed, level, endless=track is not None and track.endless)
        check_surface(surface, max(speed.range), integration.step, findings)
        if campaign.runs > 1 and not irregularity.is_random and not sections.get("vary") and not speed.distribution:
            findings.warn(
                "campaign.runs: nothing is random in this scenario, so all samples of a speed are the same run"
            )
    if sections.get("vary") is not None:
        sections["vary"] = complete_vary(sections["vary"], sections, findings) or None
    sampling = _sampling(sections, findings) if campaign else None
    if "limits" in sections:
        check_limits(sections["limits"], findings)
    if "keep" in sections and track and speed and integration and campaign:
        sections["keep"] = complete_keep(
            sections["keep"], track.kind, integration.step, len(speed.values), campaign.runs, findings
        )
    if findings.problems or passage is None or surface is None or sampling is None:
        return None
    document = Document.model_construct(**sections)
    warn_of_step(document, level, findings)
    return Loaded(document, passage, surface, sampling, imported)


def _sampling(sections: dict[str, Any], findings: Findings) -> Sampling:
    """Return how samples differ in their numbers, and fill in what the campaign leaves open about it."""
    campaign, speed = sections["campaign"], sections.get("speed")
    distributions = dict(sections.get("vary") or {})
    if speed is not None and speed.distribution is not None:
        distributions["speed"] = speed.distribution
    if not distributions:
        for name in ("sampling", "plan"):
            if getattr(campaign, name) is not None:
                accepted = "beside [vary] or speed.distribution"
                findings.refuse(("campaign", name), "has no effect: nothing varies", accepted=accepted)
        return Sampling(campaign.seed)
    method = campaign.sampling or "random"
    latin = method == "latin-hypercube"
    if campaign.plan is not None and not latin:
        findings.refuse(("campaign", "plan"), f"has no effect with {method!r}", accepted='with "latin-hypercube"')
    plan = campaign.plan or PLAN
    whole = campaign.runs % plan == 0 if latin else (campaign.runs & (campaign.runs - 1)) == 0
    if method != "random" and not whole:
        wanted = f"whole plans of {plan}" if latin else "a power of two"
        findings.warn(f"campaign.runs: {campaign.runs} samples are not {wanted}, so not fully balanced")
    sections["campaign"] = sections["campaign"].model_copy(update={"sampling": method, "plan": plan if latin else None})
    return Sampling(campaign.seed, method, plan, distributions)


def _sections(tables: Mapping[str, Any], incomplete: set[Any], findings: Findings) -> dict[str, Any]:
    """Return the tables that are sound on their own."""
    fields = Document.model_fields
    for name in [name for name in tables if name not in fields]:
        value = None if isinstance(tables[name], dict | list) else tables[name]
        accepted = ", ".join(fields)
        findings.refuse((name,), f"is not a known table{did_you_mean(name, fields)}", value=value, accepted=accepted)
    context = {"per": _per(tables.get("track"))}
    sections: dict[str, Any] = {}
    for name, field in fields.items():
        section = inner_section(field.annotation)
        if section is None:  # a table of whatever keys, checked once the others are complete
            if isinstance(given := tables.get(name), dict | None):
                sections[name] = given
            else:
                findings.refuse((name,), f"is {kind_of(given)}, not a table")
            continue
        try:
            sections[name] = section.model_validate(tables.get(name, {}), context=context)
        except ValidationError as error:
            findings.problems += _translated(error, name, section, context, name in incomplete)
        except RecursionError:
            findings.refuse((name,), "is nested too deeply")
    given = tables.get("track", {})
    if isinstance(given, dict) and (missing := missing_keys(given)):
        sections.pop("track", None)
        for name in missing if "track" not in incomplete else ():
            findings.refuse(("track", name), "is missing", accepted=accepted_at(Document, ("track", name)))
    return sections


def _per(track: Any) -> Any:
    """Return whether the track's layers are per fastener or per metre, as far as can be told."""
    if not isinstance(track, dict):
        return None
    entry = SLAB_TRACKS.get(track["model"]) if isinstance(track.get("model"), str) else None
    return track.get("per", entry.per if entry else None)


def _translated(
    error: ValidationError, table: str, section: type[BaseModel], context: Mapping[str, Any], incomplete: bool
) -> list[Problem]:
    """Return pydantic's errors in a table as problems."""
    details = error.errors(include_url=False)
    places = [detail["loc"] for detail in details]
    problems = []
    for detail in details:
        kind, place, value = detail["type"], detail["loc"], detail["input"]
        path: Path = (table, *place)
        accepted = accepted_at(section, place, context)
        told = None if isinstance(value, dict) else shown(value)
        if kind == "tbatch":
            said = detail.get("ctx", {})
            message, accepted = said["message"], said["accepted"]
        elif kind == "missing":
            if incomplete:
                continue
            message, told = "is missing", None
        elif kind == "extra_forbidden":
            keys = _keys(section, place[:-1])
            message, accepted = f"is not a known key{_better(str(place[-1]), table, keys)}", ", ".join(keys)
        elif kind in ("too_short", "too_long"):
            if any(other != place and other[: len(place)] == place for other in places):
                continue  # pydantic counts only the sound values; the others have told their own story
            message = f"has {len(value)} values"
        elif kind == "tuple_type":
            message = f"is {kind_of(value)}, not a list"
        else:
            message, accepted = f"is {kind_of(value)}, not a table", ", ".join(_keys(section, place))
        problems.append(Problem(path, message, told, accepted))
    return problems


def _keys(section: type[BaseModel], place: tuple[int | str, ...]) -> list[str]:
    """Return the keys of the table at a place below a section."""
    inner: type[BaseModel] | None = section
    for key in place:
        if isinstance(key, str) and inner is not None:
            inner = inner_section(inner.model_fields[key].annotation) if key in inner.model_fields else None
    return [] if inner is None else list(inner.model_fields)


def _better(key: str, table: str, keys: list[str]) -> str:
    """Return a guess at what an unknown key was meant to be."""
    if guess := did_you_mean(key, keys):
        return guess
    for other, field in Document.model_fields.items():
        section = inner_section(field.annotation)
        if section is not None and other != table and key in section.model_fields:
            return f"; it belongs in [{other}]"
    return ""


def _completed(name: str, complete: Any, sections: dict[str, Any], findings: Findings) -> Any:
    """Complete a table in place; None if it cannot be used."""
    if name not in sections:
        return None
    before = len(findings.problems)
    sections[name] = complete(sections[name], findings)
    return sections[name] if len(findings.problems) == before else None


def _check_rails(vehicle: VehicleSection, track: TrackSection, findings: Findings) -> None:
    if None in (vehicle.rails, track.rails) or vehicle.rails == track.rails:
        return
    words = {1: "a half model (one rail)", 2: "a whole model (two rails)"}
    message = f"is {words[track.rails or 0]}, but the vehicle {shown(vehicle.model)} is {words[vehicle.rails or 0]}"
    accepted = f"a track with rails = {vehicle.rails}; both half or both whole"
    findings.refuse(("track", "model"), message, value=track.model, accepted=accepted)
