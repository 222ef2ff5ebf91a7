"""The commands that look at single runs: replay and view."""

from pathlib import Path
from typing import Annotated

import typer

from tbatch.cli.app import Folder, Threads, app, say

RunId = Annotated[str, typer.Option("--run", metavar="ID", help="A run, such as c03-s000127.")]


@app.command()
def replay(
    folder: Folder,
    run_id: RunId,
    rrd: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the histories as a recording.")] = None,
    threads: Threads = None,
) -> None:
    """Simulate one run again from its seed, bit for bit, with full histories."""
    from tbatch.campaign.campaign import Campaign
    from tbatch.campaign.summary import replay_text
    from tbatch.view.kept import record_of, replay_with_histories
    from tbatch.view.timeline import write_recording

    campaign = Campaign.open(folder, threads=threads)
    result = replay_with_histories(campaign, [run_id])
    print(replay_text(campaign, run_id, result))
    if rrd is not None:
        write_recording(record_of(campaign, run_id, result), rrd)
        say(f"wrote {rrd}; see it with: tbatch view {rrd}")


@app.command()
def view(
    source: Annotated[Path, typer.Argument(metavar="DIR|FILE.rrd", help="A campaign folder or a recording.")],
    run_id: Annotated[str | None, typer.Option("--run", metavar="ID", help="One run, recorded or not.")] = None,
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
    from tbatch.view.viewer import open_viewer, recordings

    if (source / RESOLVED_NAME).exists():
        _view_campaign(source, run_id, sort, envelopes, write, threads)
        return
    files = recordings(source, run=run_id)
    open_viewer(files)
    say(f"opened {len(files)} recording{'s' if len(files) != 1 else ''} in the rerun viewer")


def _view_campaign(
    folder: Path, run_id: str | None, sort: str, envelopes: bool, write: bool, threads: int | None
) -> None:
    """Shows what a campaign folder has, and makes what is to be shown and is not there."""
    from tbatch.campaign.campaign import Campaign
    from tbatch.view.kept_runs import kept_runs, kept_runs_text
    from tbatch.view.viewer import open_catalogue, open_viewer, viewer_here
    from tbatch.view.views import Views

    campaign = Campaign.open(folder, threads=threads)
    views = Views(campaign, say)
    if run_id is not None:
        path = views.run(run_id)
        if write:
            print(path)
        else:
            open_viewer([path])
            say(f"opened {path} in the rerun viewer")
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
