"""The commands that look at single runs: replay and view."""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tbatch.cli.app import Folder, Threads, app, say

if TYPE_CHECKING:
    from tbatch.campaign.campaign import Campaign

RunIds = Annotated[list[str], typer.Option("--run", metavar="ID", help="A run, such as c03-s000127; several compare.")]
Steps = Annotated[
    list[str] | None,
    typer.Option("--step", metavar="TIME", help="Compare with another step, such as '0.05 ms'; not the stored run."),
]


@app.command()
def replay(
    folder: Folder,
    run_id: RunIds,
    step: Steps = None,
    rrd: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the histories as a recording.")] = None,
    threads: Threads = None,
) -> None:
    """Simulate runs again from their seeds, bit for bit, with full histories; several on the same axes."""
    from tbatch.campaign.campaign import Campaign
    from tbatch.campaign.summary import replay_text

    campaign = Campaign.open(folder, threads=threads)
    if len(run_id) > 1 or step:
        return _compare(campaign, run_id, rrd, steps=step or (), threads=threads)
    from tbatch.view.kept import record_of, replay_with_histories
    from tbatch.view.timeline import write_recording

    result = replay_with_histories(campaign, run_id)
    print(replay_text(campaign, run_id[0], result))
    if rrd is not None:
        write_recording(record_of(campaign, run_id[0], result), rrd)
        say(f"wrote {rrd}; see it with: tbatch view {rrd}")


def _compare(
    campaign: "Campaign", names: Sequence[str], rrd: Path | None, *, steps: Sequence[str] = (), threads: int | None
) -> None:
    """Simulate runs again, with the stored step and with others, and put them on the same axes."""
    from tbatch.campaign.summary import replay_text
    from tbatch.view.overlaid_runs import overlaid_runs, replay_with_steps
    from tbatch.view.timeline import write_overlay

    parts = replay_with_steps(campaign, names, steps, threads=threads)
    for part in parts:
        other = None if part is parts[0] else part.step
        for index, name in enumerate(part.names):
            print(replay_text(campaign, name, part.result, index, step=other))
    if rrd is not None:
        write_overlay(overlaid_runs(parts, stored_step=campaign.step), rrd)
        say(f"wrote {rrd}; see it with: tbatch view {rrd}")


@app.command()
def view(
    source: Annotated[Path, typer.Argument(metavar="DIR|FILE.rrd", help="A campaign folder or a recording.")],
    run_id: Annotated[list[str] | None, typer.Option("--run", metavar="ID", help="A run of the campaign.")] = None,
    compare: Annotated[bool, typer.Option("--compare", help="The runs on the same axes.")] = False,
    threads: Threads = None,
) -> None:
    """Show recordings in the rerun viewer."""
    from tbatch.view.viewer import open_viewer, recordings

    runs = run_id or []
    if compare:
        from tbatch.campaign.campaign import Campaign

        if len(runs) < 2:
            raise ValueError(f"--compare: {len(runs)} runs are given with --run, at least 2 are needed")
        # Not in the campaign folder: a comparison is nobody's result, and is made again within seconds.
        made = Path(tempfile.mkdtemp(prefix="tbatch-compare-")) / f"{'-'.join(runs)}.rrd"
        _compare(Campaign.open(source, threads=threads), runs, made, threads=threads)
        files = [made]
    else:
        files = [file for run in runs for file in recordings(source, run=run)] or recordings(source)
    open_viewer(files)
    say(f"opened {len(files)} recording{'s' if len(files) != 1 else ''} in the rerun viewer")
