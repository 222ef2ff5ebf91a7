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
    run_id: Annotated[
        list[str] | None, typer.Option("--run", metavar="ID", help="A run, recorded or not; may be given again.")
    ] = None,
    compare: Annotated[bool, typer.Option("--compare", help="The runs on the same axes.")] = False,
    sort: Annotated[
        str, typer.Option(metavar="COLUMN", help="Order of the table: separations, longest, force, speed, seed, run.")
    ] = "separations",
    envelopes: Annotated[bool, typer.Option(help="Percentiles of Q/Q0 along the line, for each speed.")] = True,
    write: Annotated[
        bool, typer.Option("--write", help="Write the recordings that are missing, open nothing.")
    ] = False,
    threads: Threads = None,
) -> None:
    """Show a campaign's recorded runs as a table and in the rerun viewer, or one run, or a recording."""
    from tbatch.campaign.store import RESOLVED_NAME
    from tbatch.view.viewer import recordings

    runs = run_id or []
    if compare:
        if len(runs) < 2:
            raise ValueError(f"--compare: {len(runs)} runs are given with --run, at least 2 are needed")
        from tbatch.campaign.campaign import Campaign

        # Not in the campaign folder: a comparison is nobody's result, and is made again within seconds.
        made = Path(tempfile.mkdtemp(prefix="tbatch-compare-")) / f"{'-'.join(runs)}.rrd"
        _compare(Campaign.open(source, threads=threads), runs, made, threads=threads)
        if write:
            print(made)
        else:
            _open([made])
    elif (source / RESOLVED_NAME).exists():
        _view_campaign(source, runs, sort, envelopes, write, threads)
    else:
        _open([file for run in runs for file in recordings(source, run=run)] or recordings(source))


def _open(files: Sequence[Path]) -> None:
    """Opens recordings in the viewer."""
    from tbatch.view.viewer import open_viewer

    open_viewer(list(files))
    say(f"opened {len(files)} recording{'s' if len(files) != 1 else ''} in the rerun viewer")


def _view_campaign(
    folder: Path, run_ids: Sequence[str], sort: str, envelopes: bool, write: bool, threads: int | None
) -> None:
    """Shows what a campaign folder has, and makes what is to be shown and is not there."""
    from tbatch.campaign.campaign import Campaign
    from tbatch.view.kept_runs import kept_runs, kept_runs_text
    from tbatch.view.viewer import open_catalogue, viewer_here
    from tbatch.view.views import Views

    campaign = Campaign.open(folder, threads=threads)
    views = Views(campaign, say)
    if run_ids:
        paths = [views.run(run_id) for run_id in run_ids]
        if write:
            print(*paths, sep="\n")
        else:
            _open(paths)
        return
    files = {path.stem: path for path in views.kept()}
    runs = kept_runs(campaign, list(files), sort)
    if write:
        made = views.envelopes() if envelopes else []
        print(*files.values(), *made, sep="\n")
        return
    print(kept_runs_text(runs) if runs else "no run is recorded: see one with --run ID")
    viewer_here(
        f"write what is to be seen with `tbatch view {folder} --write`, copy the files to a machine with a display "
        "and run `rerun` on them; or run here `rerun --serve-web --bind 127.0.0.1 FILE...`, forward ports 9090 and "
        "9876 (ssh -L) and open the address it prints"
    )
    worst = kept_runs(campaign, list(files))
    shown = [files[run.name] for run in worst]
    open_catalogue(campaign.name, shown, views.envelopes() if envelopes else [])
    say(f"opened {len(shown)} recorded runs in the rerun viewer")
