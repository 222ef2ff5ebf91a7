"""Plots of a comparison of methods. Needs matplotlib, which comes with the extra 'report'."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tbatch.engine.result import Result
from tbatch.methods.comparison import MEASURES, Comparison, Score

# Okabe and Ito's set (Color Universal Design, 2008), told apart by colour-blind eyes; each method has a marker too.
STYLES: dict[str, tuple[str, str, str]] = {
    "reference": ("#000000", "", "-"),
    "two-step": ("#0072B2", "o", "-"),
    "two-step linear": ("#56B4E9", "s", "--"),
    "two-step lagged": ("#CC79A7", "v", "-."),
    "NML": ("#D55E00", "^", "-"),
    "NMN": ("#009E73", "D", "--"),
    "APL": ("#E69F00", "P", "-."),
}
"""Colour, marker and line of each method."""
LABELS = {
    "displacement": "rail displacement, mid-track",
    "force": "contact force",
    "wheel_acceleration": "wheel acceleration",
    "track_acceleration": "rail acceleration, mid-track",
}
LAYER_STYLES = {"rail": ("#0072B2", "-"), "slab": ("#D55E00", "--"), "base": ("#009E73", "-.")}


def plot_comparison(comparison: Comparison, folder: Path) -> list[Path]:
    """Write all plots of a comparison.

    Args:
        comparison: What to plot.
        folder: Where to write; it exists.

    Returns:
        The files written.

    Raises:
        ImportError: If matplotlib is not installed.
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    steps = sorted({score.step for score in comparison.scores})
    shown = comparison.case.model.step
    plots: dict[str, Callable[[], Any]] = {
        "work_precision": partial(_work_precision, comparison),
        "convergence": partial(_convergence, comparison),
    }
    for step in dict.fromkeys((shown, steps[-1])):
        plots[f"responses_{_named(step)}"] = partial(_responses, comparison, step)
    if "slab" in comparison.case.model.track.layers:
        plots[f"layers_{_named(shown)}"] = partial(_layers, comparison, shown)
    written = []
    with pyplot.rc_context({"font.size": 9, "axes.grid": True, "grid.alpha": 0.3, "legend.frameon": False}):
        for name, draw in plots.items():
            figure = draw()
            written.append(folder / f"{name}.png")
            figure.savefig(written[-1], dpi=130)
            pyplot.close(figure)
    return written


def _named(step: float) -> str:
    return f"{step * 1e6:g}us"


def window(comparison: Comparison) -> tuple[float, float]:
    """Times between which responses are shown [s]: around the largest force if it stands out, else around mid-track."""
    case = comparison.case
    step, result = _reference(comparison)
    force = result.contact_force[0]
    load = case.model.static_load
    peak = np.unravel_index(np.argmax(force / load), force.shape)
    if force[peak] > 3.0 * load[peak[1]] and case.model.vehicle.wheel_count == 1:
        middle = float(peak[0]) * step
        return max(middle - 0.012, 0.0), min(middle + 0.02, case.duration)
    passing = (case.point - case.start) / case.speed
    last = passing + float(case.model.vehicle.wheel_offsets.max()) / case.speed
    return max(passing - 0.1, 0.0), min(last + 0.1, case.duration)


def _reference(comparison: Comparison) -> tuple[float, Result]:
    """Time between the reference's samples [s], and the reference."""
    return next((step, result) for (name, step), result in comparison.responses.items() if name == "reference")


def _figure(rows: int, columns: int, size: tuple[float, float]) -> tuple[Any, Any]:
    from matplotlib import pyplot

    return pyplot.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False)


def _work_precision(comparison: Comparison) -> Any:
    """Error against processor time, a panel a measure."""
    figure, axes = _precision(comparison, lambda score: score.cpu_time, "processor time of the run, s")
    _legend(figure, axes.flat[0])
    figure.suptitle(f"{comparison.case.name}: work and precision, one run on this machine")
    return figure


def _convergence(comparison: Comparison) -> Any:
    """Error against step, a panel a measure."""
    figure, axes = _precision(comparison, lambda score: score.step * 1e3, "step, ms")
    steps = np.array(sorted({score.step for score in comparison.scores}))
    for axis, measure in zip(axes.flat, _measures(comparison), strict=False):
        errors = [score.error[measure] for score in comparison.scores if _sound(score, measure)]
        if errors:
            middle = np.sqrt(max(errors) * max(min(errors), 1e-12))
            line = 100.0 * middle * (steps / np.sqrt(steps[0] * steps[-1])) ** 2
            axis.plot(steps * 1e3, line, color="0.6", linewidth=1.0, zorder=0, label="second order")
    _legend(figure, axes.flat[0])
    figure.suptitle(f"{comparison.case.name}: error against step")
    return figure


def _measures(comparison: Comparison) -> list[str]:
    return [name for name in MEASURES if name in comparison.reference_error]


def _sound(score: Score, measure: str) -> bool:
    value = score.error.get(measure, np.nan)
    return score.outcome == "ok" and bool(np.isfinite(value)) and value > 0.0


def _precision(comparison: Comparison, abscissa: Any, label: str) -> tuple[Any, Any]:
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    measures = _measures(comparison)
    rows = (len(measures) + 1) // 2
    figure, axes = _figure(rows, 2, (9.0, 3.4 * rows + 0.4))
    for place, (axis, measure) in enumerate(zip(axes.flat, measures, strict=False)):
        for method in dict.fromkeys(score.method for score in comparison.scores):
            scores = [one for one in comparison.scores if one.method == method and _sound(one, measure)]
            colour, marker, line = STYLES[method]
            points = sorted((abscissa(one), 100.0 * one.error[measure]) for one in scores)
            # Beyond 1000 % there is no answer left to compare.
            points = [(x, min(error, 1e3)) for x, error in points]
            law = next((one.law for one in scores), "")
            axis.plot(*zip(*points, strict=True), color=colour, marker=marker, linestyle=line, markersize=5,
                      label=f"{method} ({law})" if law else method) if points else None  # fmt: skip
        floor = 100.0 * comparison.reference_error[measure] / 3.0
        axis.axhline(floor, color="0.4", linestyle=":", linewidth=1.0)
        axis.annotate("the reference's own error", (0.01, floor), xycoords=("axes fraction", "data"), fontsize=7,
                      color="0.3", va="bottom")  # fmt: skip
        axis.set(xscale="log", yscale="log")
        axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.xaxis.set_minor_formatter(NullFormatter())
        axis.set(title=LABELS[measure], ylabel="largest error, %")
        if place >= len(measures) - 2:
            axis.set_xlabel(label)
    for axis in axes.flat[len(measures) :]:
        axis.set_visible(False)
    return figure, axes


def _legend(figure: Any, axis: Any) -> None:
    """A legend below all panels."""
    figure.legend(*axis.get_legend_handles_labels(), fontsize=8, ncols=4, loc="outside lower center")


def _responses(comparison: Comparison, step: float) -> Any:
    """Contact force, rail and wheel acceleration of every method with one step, beside the reference."""
    case, (low, high) = comparison.case, window(comparison)
    wheel = case.model.vehicle.wheel_dofs[0]
    panels: list[tuple[str, Callable[[Any], np.ndarray]]] = [
        ("contact force, wheel 1, kN", lambda one: one.contact_force[0][:, 0] * 1e-3)
    ]
    panels += [("wheel 1 acceleration, m/s²", lambda one: one.vehicle_acceleration[0][:, wheel])]
    if case.model.track.node_dofs:
        panels += [(f"rail acceleration at {case.point:g} m, m/s²", lambda one: one.rail_acceleration[0][:, 0])]
        panels += [(f"rail displacement at {case.point:g} m, mm", lambda one: one.rail[0][:, 0] * 1e3)]
    figure, axes = _figure(len(panels), 1, (9.0, 2.5 * len(panels) + 0.5))
    chosen = [
        (name, result) for (name, of), result in comparison.responses.items() if of == step or name == "reference"
    ]
    for (label, value), axis in zip(panels, axes.flat, strict=True):
        limits = []
        for name, result in chosen:
            inside = (result.time >= low) & (result.time <= high)
            colour, _, line = STYLES[name]
            values = value(result)[inside]
            reference = name == "reference"
            axis.plot(result.time[inside], values, color=colour, linestyle=line, linewidth=2.4 if reference else 1.2,
                      alpha=0.35 if reference else 1.0, label=name)  # fmt: skip
            if reference and values.size:
                limits = [float(np.nanmin(values)), float(np.nanmax(values))]
        if limits:
            # Methods that go wrong leave the picture; the reference stays in it.
            room = 0.6 * max(limits[1] - limits[0], 1e-9)
            seen = [axis.get_ylim()[0], axis.get_ylim()[1]]
            axis.set_ylim(max(seen[0], limits[0] - room), min(seen[1], limits[1] + room))
        axis.set(ylabel=label, xlim=(low, high))
    axes.flat[-1].set_xlabel("time, s")
    figure.legend(*axes.flat[0].get_legend_handles_labels(), fontsize=8, ncols=len(chosen), loc="outside upper center")
    title = f"{case.name}: {case.speed * 3.6:g} km/h, step {step * 1e3:g} ms; reference {_fine(comparison)}"
    axes.flat[0].set_title(title, fontsize=10)
    return figure


def _layers(comparison: Comparison, step: float) -> Any:
    """Rail, slab and base displacement and the contact forces of the two-step scheme."""
    case = comparison.case
    result = comparison.responses.get(("two-step", step)) or _reference(comparison)[1]
    low, high = window(comparison)
    inside = (result.time >= low) & (result.time <= high)
    figure, axes = _figure(2, 1, (9.0, 6.0))
    for layer, (colour, line) in LAYER_STYLES.items():
        axes[0, 0].plot(result.time[inside], 1e3 * result.channels[layer][0][inside, 0], color=colour, linestyle=line,
                        label=layer)  # fmt: skip
    axes[0, 0].invert_yaxis()
    axes[0, 0].set(ylabel=f"displacement at {case.point:g} m, mm (down)", xlim=(low, high))
    colours = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
    for wheel in range(case.model.vehicle.wheel_count):
        force = 1e-3 * result.contact_force[0][inside, wheel]
        axes[1, 0].plot(
            result.time[inside], force, color=colours[wheel % 4], linewidth=1.0, label=f"wheelset {wheel + 1}"
        )
    axes[1, 0].set(ylabel="contact force, kN", xlabel="time, s", xlim=(low, high))
    for axis in axes.flat:
        axis.legend(fontsize=8, ncols=4)
    figure.suptitle(f"{case.name}: {case.speed * 3.6:g} km/h, two-step, step {step * 1e3:g} ms")
    return figure


def _fine(comparison: Comparison) -> str:
    return f"{comparison.reference_step * 1e3:g} ms"
