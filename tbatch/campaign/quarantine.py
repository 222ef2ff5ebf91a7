"""What is known of runs that diverged: enough to run one again to the same step, and to see how it came there.

``quarantine/<run>.json`` holds the scenario, the seed, the run, the step and the last states before it. Diverged runs
stay in the tables with their status and are left out of the statistics.
"""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tbatch.campaign.durable import make_folder, write_bytes
from tbatch.campaign.progress import Progress, Report
from tbatch.campaign.provenance import processor, versions
from tbatch.campaign.recordings import RECORDED_TOGETHER
from tbatch.campaign.store import QUARANTINE, Message

if TYPE_CHECKING:
    from tbatch.campaign.campaign import Campaign
    from tbatch.engine.result import Result

LAST_STATES = 100
MOST_RECORDS = 100  # of a campaign: where everything diverges, the first hundred tell as much


def write_quarantine(campaign: "Campaign", report: Report, message: Message) -> None:
    """Writes a record of each diverged run that has none yet.

    Args:
        campaign: The campaign, whose folder this process holds.
        report: Called between batches; may raise to stop.
        message: Where to say what was found.
    """
    if not campaign.diverged:
        return
    runs = campaign.table("runs", ("name", "status"))
    names = [
        name for name, status in zip(*(runs[key].to_pylist() for key in ("name", "status")), strict=True) if status
    ]
    noted = campaign.store.manifest.quarantine
    folder = campaign.folder / QUARANTINE
    todo = [name for name in names[:MOST_RECORDS] if not _is_there(folder, name, noted)]
    if not todo:
        return
    make_folder(folder)
    for first in range(0, len(todo), RECORDED_TOGETHER):
        batch = todo[first : first + RECORDED_TOGETHER]
        report(Progress("recording", first, len(todo), 0, 0, 0))
        result = campaign.replay_together(batch, progress=lambda _: report(Progress("recording", 0, 0, 0, 0, 0)))
        files = {}
        for index, name in enumerate(batch):
            text = json.dumps(record(campaign, name, result, index), indent=1)
            files[f"{name}.json"] = write_bytes(folder / f"{name}.json", text.encode())
        campaign.store.note_quarantine(files)
    beyond = f", of the first {MOST_RECORDS}" if len(names) > MOST_RECORDS else ""
    message(f"{len(names)} runs diverged; their last states{beyond} are in {folder}")


def record(campaign: "Campaign", name: str, result: "Result", index: int = 0) -> dict[str, Any]:
    """What is known of one diverged run.

    Args:
        campaign: The campaign.
        name: The run's printed id.
        result: A result with histories at every step that holds it.
        index: Its place there.
    """
    case, sample = campaign.pair(name)
    stopped = int(result.steps[index])
    last = slice(max(0, stopped + 1 - LAST_STATES), stopped + 1)
    return {
        "run": name,
        "case": case,
        "sample": sample,
        "seed": campaign.scenario.seed,
        "speed": campaign.speeds[case],
        "step": stopped,
        "time": stopped * campaign.step,
        "campaign": campaign.store.manifest.campaign,
        "versions": versions(),
        "processor": processor(),
        "replay": f"tbatch replay {campaign.folder} --run {name}",
        "last_states": {
            "time": _plain(result.time[last]),
            **{channel: _plain(values[index, last]) for channel, values in sorted(result.channels.items())},
        },
        "scenario": campaign.store.resolved,
    }


def _is_there(folder: Path, name: str, noted: dict[str, str]) -> bool:
    return f"{name}.json" in noted and (folder / f"{name}.json").exists()


def _plain(values: np.ndarray) -> Any:
    """Numbers for JSON, which has no NaN and no infinity: null."""
    plain = values.astype(object)
    plain[~np.isfinite(values)] = None
    return plain.tolist()
