"""The commands that simulate: run and resume."""

import glob
import json
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tbatch import __version__
from tbatch.cli import exit_codes
from tbatch.cli.app import Folder, Threads, app, say

if TYPE_CHECKING:
    from tbatch.campaign.part import Part
    from tbatch.scenario import Scenario

ExecutorName = Annotated[str, typer.Option("--executor", metavar="local|dask://HOST:PORT", help="Where to simulate.")]


def _scenarios_like(incomplete: str) -> list[str]:
    """Completes scenario files, folders on the way to one, and the shipped names."""
    place, _, begun = incomplete.rpartition("/")
    paths = Path(place or ("/" if incomplete.startswith("/") else ".")).glob(f"{glob.escape(begun)}*")
    names = [f"{place}/{path.name}" if incomplete.startswith("/") or place else path.name for path in paths]
    files = [name + "/" * Path(name).is_dir() for name in names if Path(name).is_dir() or name.endswith(".toml")]
    if place:
        return sorted(files)
    from tbatch.scenario.source import shipped_scenarios

    return sorted({*files, *(name for name in shipped_scenarios() if name.startswith(begun))})


@app.command()
def run(
    scenario: Annotated[
        str,
        typer.Argument(
            help="A scenario file, or a name that 'tbatch list scenarios' lists.", autocompletion=_scenarios_like
        ),
    ],
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Campaign folder; default results/<name>.")] = None,
    runs: Annotated[int | None, typer.Option(min=1, help="Samples per speed; more than stored extends.")] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the campaign.")] = None,
    change: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Change a key, such as run.start=40.")
    ] = None,
    keep: Annotated[str | None, typer.Option(help="Runs to record: worst:3, none, or ids.")] = None,
    threads: Threads = None,
    arch: Annotated[str, typer.Option(help="Processor: cpu.")] = "cpu",
    executor: ExecutorName = "local",
    shard: Annotated[
        str | None, typer.Option(metavar="I/N", help="Only part i of n, i from 0; join the parts with 'tbatch merge'.")
    ] = None,
    live: Annotated[bool, typer.Option("--live", help="Show it in the rerun viewer while it runs.")] = False,
    serve: Annotated[bool, typer.Option("--serve", help="The same for a browser, at this machine alone.")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Estimate time, memory and disk; run nothing.")] = False,
) -> None:
    """Run a scenario's campaign, or what is missing of it, and print its separation statistics."""
    if arch != "cpu":
        _not_yet("--arch other than cpu (docs/speed.md says why)")
    if dry_run and (live or serve):
        say("--dry-run runs nothing that --live or --serve could show")
        raise typer.Exit(exit_codes.BAD_USAGE)
    from tbatch.scenario import Scenario

    overrides = list(change or [])
    overrides += [f"campaign.runs={runs}"] if runs is not None else []
    overrides += [f"campaign.seed={seed}"] if seed is not None else []
    overrides += [f"keep.timelines={_kept(keep)}"] if keep is not None else []
    loaded = Scenario.load(scenario, overrides=overrides)
    if dry_run:
        from tbatch.campaign.forecast import forecast, forecast_text

        folder = out or Path("results") / loaded.name
        print(forecast_text(forecast(loaded, folder, threads=threads, part=_part(shard)), folder))
        return
    _carry_out(loaded, out, threads, executor, shard, live=live, serve=serve)


@app.command()
def resume(folder: Folder, threads: Threads = None, executor: ExecutorName = "local") -> None:
    """Go on with an interrupted campaign."""
    from tbatch.campaign.campaign import Campaign

    _carry_out(Campaign.open(folder).scenario, folder, threads, executor)


def _not_yet(what: str) -> None:
    say(f"{what} is not served yet by this version ({__version__})")
    raise typer.Exit(exit_codes.BAD_USAGE)


def _carry_out(
    scenario: "Scenario",
    folder: Path | None,
    threads: int | None,
    executor: str = "local",
    shard: str | None = None,
    *,
    live: bool = False,
    serve: bool = False,
) -> None:
    """Runs what is missing, prints what there is, and judges it."""
    from tbatch.campaign.cluster import Dask
    from tbatch.campaign.progress import Progress
    from tbatch.campaign.run import run as run_campaign
    from tbatch.campaign.summary import status_text, summary_text
    from tbatch.cli.interruption import Interruption
    from tbatch.view.kept import recorder
    from tbatch.view.live import LiveView
    from tbatch.view.progress import ProgressDisplay

    part = _part(shard)
    cluster = Dask(executor) if executor != "local" else None
    folder = folder or Path("results") / scenario.name
    for warning in scenario.warnings:
        say(f"warning: {warning}")
    with (
        Interruption(f"resume with: tbatch resume {folder}") as interruption,
        ExitStack() as shown,
        ExitStack() as meter,
    ):
        display = meter.enter_context(ProgressDisplay(scenario.name))
        view = None
        if live or serve:
            view = shown.enter_context(LiveView(display.message, web=serve, window=live))

        def show(state: Progress) -> None:
            interruption.stepping = state.phase == "running" and state.run_steps_done > 0
            if state.phase == "recording":
                meter.close()
                say(f"recordings of the kept runs: {state.runs_done} of {state.runs_total}")
            else:
                display(state)
            if view is not None:
                view.progress(state)
            interruption.check()

        campaign = run_campaign(
            scenario,
            out=folder,
            threads=threads,
            progress=show,
            message=display.message,
            recorder=recorder(display.message),
            cluster=cluster,
            part=part,
            observer=view,
        )
    print(summary_text(campaign) if part is None else f"part {part} is stored; {status_text(campaign, [])}")
    if campaign.diverged > scenario.limits_diverged:
        say(f"{campaign.diverged} runs diverged, limits.diverged allows {scenario.limits_diverged}")
        raise typer.Exit(exit_codes.TOO_MANY_DIVERGED)


def _part(text: str | None) -> "Part | None":
    from tbatch.campaign.part import Part

    return None if text is None else Part.parse(text)


def _kept(text: str) -> str:
    """The value of ``keep.timelines`` as TOML: a word, or the ids of a comma-separated list."""
    if text == "none" or ":" in text:
        return json.dumps(text)
    return json.dumps([name.strip() for name in text.split(",")])
