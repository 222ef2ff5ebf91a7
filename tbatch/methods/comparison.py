"""Methods against each other on one run: errors by the seed paper's measures, time, iterations, stability.

Errors are taken against a converged reference, the batch engine's two-step scheme with a step finer than any compared,
and with the same contact law: NML and APL have a linear contact, and what a linear law differs from Hertz is no error
of a time integration. It is reported apart.

    displacement   max |Δu| / max |u_static|    rail at mid-track; u_static under the standing vehicle
    force          max |ΔF| / max |F_static|    all wheels
    acceleration   max |Δa| / max |a_ref|       wheels; and rail at mid-track, apart
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from tbatch.engine.result import Result
from tbatch.methods.case import METHODS, Case, highest_frequency, reference, run_method, spectral_radius
from tbatch.methods.result import MethodResult

LADDER = (1e-3, 5e-4, 2e-4, 1e-4, 5e-5)
"""Steps compared [s]."""
UNSTABLE = 1e3
"""Contact force, in static loads, beyond which a run that ended counts as unstable."""
MEASURES = ("displacement", "force", "wheel_acceleration", "track_acceleration")


@dataclass(frozen=True)
class Score:
    """How one method did with one step."""

    method: str
    law: str
    step: float
    """[s]."""
    steps: int
    wall_time: float
    """[s]."""
    cpu_time: float
    """Processor time [s]."""
    iterations_mean: float
    """Contact solves a step."""
    iterations_max: int
    outcome: str
    """"ok", "unstable", "iteration failed at t = ... s" or "diverged at t = ... s"."""
    pull: float
    """Largest force by which a separated wheel was held [N]."""
    radius: float
    """Spectral radius at the highest frequency of the track [-]."""
    error: dict[str, float] = field(default_factory=dict)
    """By measure, against the reference of the method's own law; NaN for a run that did not end."""
    error_own: dict[str, float] = field(default_factory=dict)
    """The same against the reference with the scenario's law."""

    def row(self) -> dict[str, Any]:
        """One flat row for a table."""
        flat = {key: value for key, value in asdict(self).items() if not isinstance(value, dict)}
        flat |= {f"error_{name}": value for name, value in self.error.items()}
        return flat | {f"error_{name}_vs_own_law": value for name, value in self.error_own.items()}


@dataclass(frozen=True, eq=False)
class Comparison:
    """All scores of a case."""

    case: Case
    reference_step: float
    """[s]."""
    reference_error: dict[str, float]
    """How far the reference moves when its step is doubled, by measure."""
    law_difference: dict[str, float]
    """How far the linear law's reference is from the own law's, by measure."""
    scores: list[Score]
    responses: dict[tuple[str, float], Result]
    """Histories by method and step; the reference's as ("reference", the shortest step compared)."""

    def document(self) -> dict[str, Any]:
        """What goes into a JSON file."""
        case = self.case
        return {
            "case": case.name,
            "speed_m_per_s": case.speed,
            "duration_s": case.duration,
            "point_m": case.point,
            "contact_law": case.model.contact.law,
            "reference_step_s": self.reference_step,
            "reference_error": self.reference_error,
            "law_difference": self.law_difference,
            "scores": [score.row() for score in self.scores],
        }


def compare(
    case: Case,
    *,
    steps: Sequence[float] = LADDER,
    methods: Sequence[str] = tuple(METHODS),
    direct: bool = False,
    reference_step: float | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> Comparison:
    """Run every method with every step and score it.

    Args:
        case: The run.
        steps: Δt [s], a ladder.
        methods: Names from `METHODS`.
        direct: Let the lagged methods factorise the coupled matrix at every step, as the literature writes it.
        reference_step: Of the reference [s]; by default a tenth of the shortest step.
        progress: Told what is being run.

    Raises:
        ValueError: If a method is unknown, a step is no whole multiple of the shortest, or that one none of twice the
            reference's.
    """
    unknown = [name for name in methods if name not in METHODS]
    if unknown:
        raise ValueError(f"methods: {unknown[0]!r} is unknown; accepted are {', '.join(METHODS)}")
    ladder = sorted({*steps, case.model.step}, reverse=True)
    fine = 0.1 * ladder[-1] if reference_step is None else reference_step
    sampled = ladder[-1]
    for step in ladder:
        if abs(step / sampled - round(step / sampled)) > 1e-6:
            raise ValueError(f"steps: {step:g} s is no whole multiple of the shortest, {sampled:g} s")
    if abs(sampled / (2.0 * fine) - round(sampled / (2.0 * fine))) > 1e-6 or fine > 0.5 * sampled:
        raise ValueError(
            f"reference_step = {fine:g} s: the shortest step, {sampled:g} s, must be a whole multiple of twice it, "
            "so that the reference can be checked with half as many steps"
        )
    references: dict[str, Result] = {}
    for law in ("own", "linear"):
        if law == "linear" and case.contact(law) == case.contact("own"):
            references[law] = references["own"]
        else:
            progress(f"reference, {case.law(law)} contact, step {fine * 1e3:g} ms")
            references[law] = reference(case, law, fine, sampled)
    own = references["own"]
    scale = _Scale.of(case, own)
    coarser = reference(case, "own", 2.0 * fine, sampled)
    responses: dict[tuple[str, float], Result] = {("reference", sampled): own}
    scores = []
    top = highest_frequency(case)
    for step in ladder:
        for name in methods:
            if (METHODS[name] == "linear") and name == "two-step linear" and references["linear"] is own:
                continue
            progress(f"{name}, step {step * 1e3:g} ms")
            result = run_method(case, name, step, direct=direct)
            responses[name, step] = result
            law = METHODS[name]
            outcome = _outcome(result, step, float(case.model.static_load.max()))
            scores.append(
                Score(
                    method=name,
                    law=case.law(law),
                    step=step,
                    steps=int(result.steps[0]),
                    wall_time=result.wall_time,
                    cpu_time=result.cpu_time,
                    iterations_mean=float(result.iterations.mean()),
                    iterations_max=int(result.iterations.max()),
                    outcome=outcome,
                    pull=max(0.0, -float(np.nanmin(result.contact_force))),
                    radius=spectral_radius(case, name, step, top),
                    error=scale.errors(result, references[law], round(step / sampled)),
                    error_own=scale.errors(result, own, round(step / sampled)),
                )
            )
    return Comparison(
        case=case,
        reference_step=fine,
        reference_error=scale.errors(coarser, own, 1),
        law_difference=scale.errors(references["linear"], own, 1),
        scores=scores,
        responses=responses,
    )


def _outcome(result: MethodResult, step: float, load: float) -> str:
    if not result.status[0]:
        return "unstable" if float(np.abs(result.contact_force).max()) > UNSTABLE * load else "ok"
    when = f"at t = {(int(result.steps[0]) + 1) * step:.6g} s"
    return f"diverged {when}" if result.converged else f"iteration failed {when}"


@dataclass(frozen=True)
class _Scale:
    """What errors are relative to."""

    wheels: tuple[int, ...]
    """Wheel dofs."""
    static: dict[str, float]

    @classmethod
    def of(cls, case: Case, own: Result) -> "_Scale":
        model = case.model
        static = {"force": float(model.static_load.max())}
        wheels = tuple(model.vehicle.wheel_dofs)
        static["wheel_acceleration"] = float(np.abs(own.vehicle_acceleration[0][:, wheels]).max())
        if model.track.node_dofs:
            positions = case.start - model.vehicle.wheel_offsets
            deflection = model.ground.flexibility(positions) - model.ground.compliance(positions)
            static["displacement"] = float((deflection @ model.static_load).max())
            static["track_acceleration"] = float(np.abs(own.rail_acceleration).max())
        return cls(wheels, static)

    def errors(self, result: Result, exact: Result, ratio: int) -> dict[str, float]:
        """Errors by measure; `ratio` reference samples to a sample."""
        pairs = {"displacement": "rail", "force": "contact_force", "track_acceleration": "rail_acceleration"}
        found = {}
        for measure in MEASURES:
            if measure not in self.static:
                continue
            if measure == "wheel_acceleration":
                a, b = (one.vehicle_acceleration[0][:, self.wheels] for one in (result, exact))
            else:
                a, b = (one.channels[pairs[measure]][0] for one in (result, exact))
            b = b[::ratio]
            count = min(len(a), len(b))
            largest = float(np.abs(a[:count] - b[:count]).max())
            size = self.static[measure]
            found[measure] = largest / size if size > 0.0 else float("nan")
        return found
