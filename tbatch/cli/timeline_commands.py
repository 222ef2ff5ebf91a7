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
    run_id: Annotated[str | None, typer.Option("--run", metavar="ID", help="A run of the campaign.")] = None,
) -> None:
    """Show recordings in the rerun viewer."""
    from tbatch.view.viewer import open_viewer, recordings

    files = recordings(source, run=run_id)
    open_viewer(files)
    say(f"opened {len(files)} recording{'s' if len(files) != 1 else ''} in the rerun viewer")
