"""The report's tables, the facts at its head, and which estimates are drawn against the speed."""

import math
from collections.abc import Iterable, Mapping, Sequence
from html import escape

from tbatch import __version__
from tbatch.campaign.campaign import Campaign
from tbatch.campaign.estimates import ANY_WHEELSET, Estimate
from tbatch.campaign.estimates.estimate import shown
from tbatch.campaign.estimates.extremes import ExtremeFit
from tbatch.campaign.limits import stored_limits
from tbatch.campaign.provenance import versions
from tbatch.scenario.limits import limits_of
from tbatch.view.report.against_speed import Table, by_estimate
from tbatch.view.report.against_speed import by_wheelset as wheelset_picture
from tbatch.view.report.drawing import Picture
from tbatch.view.report.page import facts_html, table_html

__all__ = [
    "basis",
    "by_wheelset",
    "escape",
    "every",
    "facts",
    "filtered_picture",
    "fits",
    "headline",
    "limit_lines",
    "speed_pictures",
    "with_interval",
]

KMH = 3.6
_HEADLINE = (
    ("probability", "separation.probability"),
    ("per km", "separation.per_km"),
    ("of the time\n[%]", "separation.share"),
    ("longest", "separation.duration.max"),
    ("largest gap\n[mm]", "separation.gap.max"),
    ("min Q/Q0,\nmedian run", "load_ratio.min.p50"),
    ("max Q/Q0,\n95 % of runs", "load_ratio.max.p95"),
    ("20 Hz Q99.85/Q0,\n95 % of runs", "load_ratio_20hz.section_p99.85.p95"),
)


def basis(campaign: Campaign) -> str:
    """What every figure rests on, in a line."""
    seed = campaign.store.resolved["campaign"]["seed"]
    samples = max((shard.stop for shard in campaign.store.shards), default=0)
    return f"{campaign.runs_stored} runs, seed {seed}, samples 0 to {samples - 1}; tbatch {__version__}."


def facts(campaign: Campaign) -> str:
    """What was run, with what."""
    resolved = campaign.store.resolved
    made_by = campaign.store.manifest.sessions[-1]["versions"] if campaign.store.manifest.sessions else {}
    lengths = campaign.table("runs", ("evaluated_length",))["evaluated_length"].to_numpy()
    roughness = resolved["irregularity"]
    surface = roughness.get("spectrum") or ("measured" if "measured" in roughness else "no spectrum")
    rails = "half model (one rail)" if resolved["vehicle"]["rails"] == 1 else "whole model (two rails)"
    listed = [
        ("runs", f"{campaign.runs_stored} of {campaign.runs_total}, {campaign.diverged} diverged and left out"),
        ("speeds", _speeds(campaign)),
        ("seed and samples", basis(campaign).split(";")[0] + "; all speeds meet the same samples (paired)"),
        ("evaluated", f"{lengths.min():.4g} m of wheelset 1 per run; km are wheelset-kilometres"),
        ("vehicle, track", f"{resolved['vehicle'].get('model', '-')}, {resolved['track'].get('model', '-')}, {rails}"),
        ("contact", str(resolved["contact"]["law"])),
        ("irregularity", str(surface)),
        ("varied", _varied(campaign)),
        ("step", f"{1e3 * campaign.step:g} ms; counts of the shortest separations depend on it"),
        ("made by", ", ".join(f"{name} {version}" for name, version in made_by.items())),
        ("report by", f"tbatch {versions()['tbatch']}"),
        ("campaign", campaign.store.manifest.campaign),
    ]
    return facts_html(listed)


def _speeds(campaign: Campaign) -> str:
    drawn = campaign.store.resolved["speed"].get("distribution")
    if drawn is None:
        return ", ".join(f"{KMH * speed:.4g}" for speed in campaign.speeds) + " km/h"
    ends = f"{KMH * drawn['low']:.4g} to {KMH * drawn['high']:.4g} km/h"
    return f"{drawn['kind']}, {ends}, drawn for each sample; figures name the median"


def _varied(campaign: Campaign) -> str:
    resolved = campaign.store.resolved
    parts = [
        f"{name}: {numbers['kind']}, {numbers['low']:.4g} to {numbers['high']:.4g}"
        for name, numbers in resolved.get("vary", {}).items()
    ]
    return "; ".join([*parts, f"sampling: {resolved['campaign'].get('sampling')}"]) if parts else "nothing"


def headline(campaign: Campaign, found: Table, whole: Mapping[str, Estimate]) -> str:
    """A row for each speed, any wheelset, and one for the campaign."""
    titles = ["speed\n[km/h]", "separated\nof runs", *(title for title, _ in _HEADLINE)]
    rows = [[f"{KMH * speed:.4g}", *_cells(found[case, ANY_WHEELSET])] for case, speed in enumerate(campaign.speeds)]
    for row, diverged in zip(rows, diverged_of(campaign), strict=True):
        row[1] += f"\n{diverged} diverged" if diverged else ""
    if len(campaign.speeds) > 1:
        rows.append(["all", *_cells(whole)])
    note = (
        '<p class="note">Diverged runs are left out. Below each: its 95 % interval; "open" where the runs are too few'
        " for an end. The row of all speeds counts samples, each with its runs at all speeds. A separation is a contact"
        " force of zero; 20 Hz values are EN 14363's and know no separations.</p>"
    )
    return table_html(titles, rows) + note


def diverged_of(campaign: Campaign) -> list[int]:
    """Diverged runs of each speed."""
    counts = [0] * len(campaign.speeds)
    for shard, entry in campaign.store.manifest.shards.items():
        counts[shard.case] += entry["diverged"]
    return counts


def by_wheelset(campaign: Campaign, found: Table) -> str:
    """A row for each speed and wheelset."""
    titles = ["speed\n[km/h]", "wheelset", "separated\nof runs", *(title for title, _ in _HEADLINE)]
    rows = [
        [f"{KMH * speed:.4g}", str(wheel), *_cells(found[case, wheel])]
        for case, speed in enumerate(campaign.speeds)
        for wheel in campaign.records.wheels
    ]
    return table_html(titles, rows)


def every(campaign: Campaign, found: Table, whole: Mapping[str, Estimate]) -> str:
    """All estimates, folded away by speed."""
    titles = ["estimate", "method", "remark", "value", "low", "high", "unit", "runs"]
    parts = []
    groups: list[tuple[str, Iterable[Estimate]]] = [("all speeds, any wheelset", whole.values())]
    groups += [
        (f"{KMH * speed:.4g} km/h, any wheelset", found[case, ANY_WHEELSET].values())
        for case, speed in enumerate(campaign.speeds)
    ]
    for heading, numbers in groups:
        rows = [
            [
                one.name,
                one.method,
                one.flag,
                *map(_plain, (one.value, one.low, one.high)),
                one.unit or "-",
                str(one.runs),
            ]
            for one in numbers
        ]
        parts.append(f"<details><summary>{escape(heading)}</summary>{table_html(titles, rows, text=3)}</details>")
    note = '<p class="note">By wheelset: <code>tbatch stats DIR --all --json</code>. SI units.</p>'
    return note + "\n".join(parts)


def fits(found: Sequence[ExtremeFit]) -> str:
    """Parameters, goodness and return values of extreme value fits."""
    titles = ["fit", "remark", "blocks", "shape", "location", "scale", "K-S distance", "p"]
    titles += [f"one in {runs:g}" for runs, *_ in found[0].return_values]
    rows = [
        [
            fit.family,
            fit.warning or "fits",
            str(fit.blocks),
            *(f"{number:.3g}" for number in (fit.shape, fit.location, fit.scale, fit.distance, fit.p_value)),
            *(f"{value:.3g}\n{low:.3g} to {high:.3g}" for _, value, low, high in fit.return_values),
        ]
        for fit in found
    ]
    return table_html(titles, rows, text=2)


def speed_pictures(found: Table, speeds: Sequence[float], wheels: Sequence[int]) -> list[Picture]:
    """Separation and unloading against the speed."""
    unloading = {f"unloading.share_below_{ratio}": f"Q/Q0 < {ratio}" for ratio in ("0.1", "0.2", "0.4", "0.6", "0.8")}
    minimum = {
        "separation.per_km": "all",
        **{
            f"separation.per_km_{least}": f"≥ {least.removesuffix('ms')} ms"
            for least in ("0.5ms", "1ms", "5ms", "15ms")
        },
    }
    return [
        wheelset_picture(
            found,
            speeds,
            wheels,
            "separation.probability",
            title="Probability of separation",
            axis="probability per run [-]",
            caption="Probability that a wheelset separates at least once in the evaluated length of a run. Bars: exact"
            " (Clopper-Pearson) 95 %; arrows: none seen, upper limit. All speeds meet the same samples.",
        ),
        wheelset_picture(
            found,
            speeds,
            wheels,
            "separation.per_km",
            title="Separations per kilometre",
            axis="separations per km [1/km]",
            caption="Separations per evaluated wheelset-kilometre. Bars: 95 %, bootstrap over runs; arrows: none seen.",
        ),
        by_estimate(
            found,
            speeds,
            minimum,
            picture="separation_durations",
            title="Separations per kilometre by least duration",
            axis="separations per km [1/km]",
            caption="Of all wheelsets, counting only separations that last at least so long. Bars: 95 %, bootstrap over"
            " runs.",
            log=True,
        ),
        by_estimate(
            found,
            speeds,
            unloading,
            picture="unloading",
            title="Unloading: for how much of the time Q/Q0 is low",
            axis="share of the time [-]",
            caption="Share of the evaluated time that the raw contact force spends below a ratio of the static load,"
            " all wheelsets. Bars: 95 %, bootstrap over runs.",
            log=True,
        ),
        by_estimate(
            found,
            speeds,
            {
                "load_ratio.max.p50": "median run",
                "load_ratio.max.p95": "95 % of runs",
                "load_ratio.p99.85": "99.85 % of time",
            },
            picture="load_ratio",
            title="Largest wheel load",
            axis="Q/Q0 [-]",
            caption="Quantiles over runs of the largest raw Q/Q0 of any wheelset (bars: 95 %, order statistics;"
            " triangle: open end), and of all steps (bars: bootstrap over runs).",
        ),
    ]


def filtered_picture(found: Table, speeds: Sequence[float]) -> Picture:
    """The 20 Hz family against the speed."""
    return by_estimate(
        found,
        speeds,
        {
            "load_ratio_20hz.section_p99.85.p50": "Q99.85, median run",
            "load_ratio_20hz.section_p99.85.p95": "Q99.85, 95 % of runs",
            "load_ratio_20hz.min.p50": "smallest, median run",
        },
        picture="load_ratio_20hz",
        title="EN 14363 family: 20 Hz wheel load",
        axis="20 Hz Q/Q0 [-]",
        caption="Force after a fourth-order 20 Hz low-pass; a run is a track section, Q99.85 its 99.85 % percentile (to"
        " a bin of 0.05) over all wheelsets. Bars: 95 %, order statistics over runs. Separations do not show here.",
    )


def limit_lines(campaign: Campaign) -> dict[str, list[float]]:
    """Limits on load ratios, to be drawn: those on a quantile of the largest or smallest of a run."""
    lines: dict[str, list[float]] = {}
    for name, limit in limits_of(stored_limits(campaign)).items():
        group, _, _ = name.rpartition(".p")
        value = limit.max if limit.max is not None else limit.min
        if name.startswith("load_ratio") and ".p" in name and value is not None:
            lines.setdefault(group.removesuffix(".p99"), []).append(float(value))
    return lines


def _cells(numbers: Mapping[str, Estimate]) -> list[str]:
    first = numbers["separation.probability"]
    cells = [f"{first.count} of {first.runs}"]
    for _, name in _HEADLINE:
        one = numbers.get(name)
        if one is None or math.isnan(one.value):
            cells.append("-")
        elif name.endswith(".max"):
            cells.append(f"{1e3 * one.value:.3g}" if one.unit == "m" else _longest(one, numbers))
        elif name == "separation.share":
            cells.append(with_interval(one, 1e2))
        else:
            cells.append(with_interval(one))
    return cells


def _longest(one: Estimate, numbers: Mapping[str, Estimate]) -> str:
    """The longest separation in time, and below it the longest in length."""
    length = numbers.get("separation.length.max")
    return shown(one.value, one.unit) + (f"\n{length.value:.3g} m" if length is not None else "")


def with_interval(one: Estimate, factor: float = 1.0) -> str:
    """A number to three digits, and its interval in a line below."""
    return f"{_plain(factor * one.value, 3)}\n{_plain(factor * one.low, 3)} to {_plain(factor * one.high, 3)}"


def _plain(value: float, digits: int = 4) -> str:
    return f"{value:.{digits}g}" if math.isfinite(value) else "open"
