"""What a campaign says at its end: statistics per speed and wheelset, and what they rest on."""

import math
from collections.abc import Sequence
from typing import Any

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.lock import folder_owner
from tbatch.campaign.statistics import ANY_WHEELSET, CONFIDENCE

KMH = 3.6


def summary_document(campaign: Campaign) -> dict[str, Any]:
    """The statistics as plain data for JSON: SI units, null where there is no number."""
    rows = _plain(campaign.statistics_of([*campaign.wheels, ANY_WHEELSET]).to_pylist())
    return {
        "campaign": {
            "name": campaign.name,
            "folder": str(campaign.folder),
            "runs": campaign.runs_stored,
            "runs_planned": campaign.runs_total,
            "diverged": campaign.diverged,
            "run_steps_per_second": campaign.run_steps_per_second,
            "confidence": CONFIDENCE,
            "paired": True,
            **_model(campaign),
        },
        "wheelsets": [row for row in rows if row["wheel"] != ANY_WHEELSET],
        "any_wheelset": [row for row in rows if row["wheel"] == ANY_WHEELSET],
    }


def summary_text(campaign: Campaign) -> str:
    """The statistics as a table for people, and what they rest on."""
    document = summary_document(campaign)
    rows = []
    for total in document["any_wheelset"]:
        of_case = [row for row in document["wheelsets"] if row["case"] == total["case"]]
        rows += [*map(_row, of_case), _row(total), []]
    lines = columns(
        [
            "km/h",
            "wheelset",
            "runs",
            "separated",
            "probability",
            "95 % interval",
            "per km",
            "95 % interval",
            "longest",
            "max force",
        ],
        ["", "", "", "runs", "", "", "", "", "ms", "kN"],
        rows[:-1],
    )
    return "\n".join([*lines, "", *_notes(campaign, document)])


def status_text(campaign: Campaign, damage: Sequence[str]) -> str:
    """How far a campaign is, who works on it, what is missing and what is damaged."""
    store = campaign.store
    owner = folder_owner(campaign.folder)
    stored = {case: 0 for case in range(len(campaign.speeds))}
    for shard in store.shards:
        stored[shard.case] += len(shard)
    rows = [
        [f"{speed * KMH:.4g}", str(stored[case]), str(max(0, planned - stored[case]))]
        for case, (speed, planned) in enumerate(zip(campaign.speeds, campaign.planned, strict=True))
    ]
    missing = campaign.runs_total - campaign.runs_stored
    lines = [
        f"campaign {campaign.name}: {campaign.runs_stored} of {campaign.runs_total} runs stored"
        + (", complete" if missing <= 0 else f", {missing} missing"),
        *columns(["km/h", "stored", "missing"], [], rows),
        f"diverged: {campaign.diverged}; recordings: {len(store.manifest.recordings)}",
    ]
    if owner is not None:
        lines.append(f"in use by pid {owner.get('pid')} on host {owner.get('host')}")
    elif missing > 0:
        lines.append(f"go on with: tbatch resume {campaign.folder}")
    lines += [f"damaged: {line}" for line in damage] or ["damaged: nothing"]
    return "\n".join(lines)


def replay_text(campaign: Campaign, run_id: str, result: Any, index: int = 0, *, step: float | None = None) -> str:
    """What a replayed run did, wheel by wheel, and whether it is the stored one.

    Args:
        campaign: The campaign.
        run_id: The run.
        result: A result that holds it.
        index: Its place there.
        step: Another step than the stored one's, that it was simulated with [s].
    """
    case, sample = campaign.pair(run_id)
    speed = campaign.scenario.varied(sample).get("speed", campaign.speeds[case])
    rows = [
        [
            str(row["wheel"]),
            str(row["separations"]),
            _number(1e3 * row["longest"], ".2f") if row["longest"] else "-",
            _number(row["force_min"], ".1f", 1e-3),
            _number(row["force_max"], ".1f", 1e-3),
        ]
        for row in result.summary.to_pylist()
        if row["run"] == index
    ]
    if step is not None:
        verdict = f"step {1e3 * step:g} ms: NOT the stored run, which has a step of {1e3 * campaign.step:g} ms"
    elif not campaign.is_stored(run_id):
        verdict = "not stored in the folder yet, so not compared"
    elif differing := campaign.differs_from_stored(run_id, result, index):
        verdict = f"NOT the stored run, other versions or processor? differing: {', '.join(differing)}"
    else:
        verdict = "bit for bit the stored run"
    return "\n".join(
        [
            f"{run_id}: {speed * KMH:.4g} km/h, {int(result.steps[index])} steps, "
            + ("ok" if int(result.status[index]) == 0 else f"diverged at step {int(result.steps[index])}"),
            *columns(
                ["wheelset", "separations", "longest", "min force", "max force"], ["", "", "ms", "kN", "kN"], rows
            ),
            verdict,
        ]
    )


def columns(titles: Sequence[str], units: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a table in right-aligned columns; an empty row is an empty line."""
    table = [titles, *([units] if any(units) else []), *rows]
    widths = [max(len(row[column]) for row in table if row) for column in range(len(titles))]
    return ["  ".join(text.rjust(width) for text, width in zip(row, widths, strict=False)).rstrip() for row in table]


def _row(row: dict[str, Any]) -> list[str]:
    places = max(3, math.ceil(math.log10(max(row["runs"], 1))) + 1)
    low, high = row["probability_low"], row["probability_high"]
    return [
        _number(row["speed"] * KMH, ".4g"),
        "any" if row["wheel"] == ANY_WHEELSET else str(row["wheel"]),
        str(row["runs"]),
        str(row["separated_runs"]),
        _number(row["probability"], f".{places}f"),
        f"{low:.{places}f} to {high:.{places}f}",
        _number(row["separations_per_km"], ".3g"),
        f"{row['separations_per_km_low']:.3g} to {_bound(row['separations_per_km_high'])}",
        _number(1e3 * row["longest"], ".2f") if row["longest"] else "-",
        _number(row["force_max"], ".1f", 1e-3),
    ]


def _notes(campaign: Campaign, document: dict[str, Any]) -> list[str]:
    """What the reader of the table must know."""
    facts = document["campaign"]
    lengths = sorted(
        {row["evaluated_length"] for row in document["any_wheelset"] if row["evaluated_length"] is not None}
    )
    length = " to ".join(f"{value:.4g}" for value in {lengths[0]: 0, lengths[-1]: 0}) if lengths else "-"
    rate = facts["run_steps_per_second"]
    notes = [
        f"Probability: of at least one separation in a run, {length} m evaluated; exact (Clopper-Pearson) interval.",
        "per km: separations per wheelset-kilometre evaluated; bootstrap over runs. longest: none cut off by the ends.",
        _pairing(campaign),
        f"Runs: {facts['runs']} of {facts['runs_planned']}; diverged: {facts['diverged']}"
        + (" (left out of the statistics)." if facts["diverged"] else "."),
        f"Step {1e3 * facts['step']:g} ms; contact {facts['contact']}; {facts['model']}."
        + (f" {rate:,.0f} run-steps/s in the kernels." if rate else ""),
    ]
    if "stop" in campaign.store.resolved["campaign"]:
        notes.append("Runs by campaign.stop, speed by speed; intervals are those of a number of runs fixed beforehand.")
    if facts["runs"] < facts["runs_planned"]:
        notes.append(f"Not complete: tbatch resume {campaign.folder}")
    return notes


def _pairing(campaign: Campaign) -> str:
    """What the samples of different speeds, or of one, have in common."""
    resolved = campaign.store.resolved
    varied = ", ".join(resolved.get("vary", {}))
    drawn = "distribution" in resolved["speed"]
    text = (
        "Each sample has a speed of its own; the table names their median."
        if drawn
        else (
            "All speeds met the same samples of irregularity and varied numbers (paired)."
            if varied
            else "All speeds met the same irregularity samples (paired)."
        )
    )
    return text + (f" Varied ({resolved['campaign'].get('sampling')}): {varied}." if varied else "")


def _model(campaign: Campaign) -> dict[str, Any]:
    """What the numbers rest on."""
    resolved = campaign.store.resolved
    rails = resolved["vehicle"]["rails"]
    return {
        "step": campaign.step,
        "contact": resolved["contact"]["law"],
        "rails": rails,
        "model": "half model (one rail)" if rails == 1 else "whole model (two rails)",
    }


def _number(value: float | None, form: str, factor: float = 1.0) -> str:
    return "-" if value is None or math.isnan(value) else format(value * factor, form)


def _bound(value: float | None) -> str:
    return format(value, ".3g") if value is not None and math.isfinite(value) else "open"


def _plain(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [
        {name: None if isinstance(value, float) and not math.isfinite(value) else value for name, value in row.items()}
        for row in rows
    ]
