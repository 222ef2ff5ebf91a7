"""The command line. Each command only reads its options and calls what does the work.

Results go to stdout, progress and messages to stderr. No error reaches the user as a traceback; ``exit_codes`` says
which exit code each one gives.
"""

import glob
import json
import os
import sys
from contextlib import ExitStack
from enum import StrEnum
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from tbatch import __version__
from tbatch.cli import exit_codes
from tbatch.cli.methods_command import methods

if TYPE_CHECKING:
    from tbatch.campaign.part import Part
    from tbatch.scenario import Scenario


class Listed(StrEnum):
    """What ``tbatch list`` lists."""

    vehicles = "vehicles"
    tracks = "tracks"
    spectra = "spectra"
    scenarios = "scenarios"


class Commands(TyperGroup):
    """The commands, with every error turned into a message and an exit code."""

    def invoke(self, ctx: Any) -> Any:
        """Runs a command."""
        try:
            value = super().invoke(ctx)
            sys.stdout.flush()
            return value
        except (Exception, KeyboardInterrupt) as error:
            if type(error).__module__.partition(".")[0] in ("typer", "click") or ctx.params.get("debug"):
                raise  # usage errors and exits, which typer turns into messages and codes itself
            code, text = exit_codes.explain(error)
        if code == exit_codes.BROKEN_PIPE:
            # Whoever read our output has gone; Python would complain again when it flushes stdout at its end.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        elif text:
            say(text)
        raise typer.Exit(code)


app = typer.Typer(cls=Commands, no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None)

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="A campaign folder.")]
Threads = Annotated[int | None, typer.Option(min=1, help="Threads; default: the cores this process may use.")]
ExecutorName = Annotated[str, typer.Option("--executor", metavar="local|dask://HOST:PORT", help="Where to simulate.")]
RunId = Annotated[str, typer.Option("--run", metavar="ID", help="A run, such as c03-s000127.")]
AsJson = Annotated[bool, typer.Option("--json", help="As JSON, in SI units.")]


def main() -> None:
    """Runs the command line; leaves through SystemExit."""
    app(prog_name="tbatch")


def say(text: str) -> None:
    """Says something to the user, beside the results."""
    print(f"tbatch: {text}", file=sys.stderr, flush=True)


def _print_version(asked: bool) -> None:
    if asked:
        print(f"tbatch {__version__}")
        raise typer.Exit


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


@app.callback()
def options(
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")] = False,
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and leave.", is_eager=True, callback=_print_version)
    ] = False,
) -> None:
    """How often wheels leave the rail: batched vehicle-track dynamics."""


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
    live: Annotated[bool, typer.Option(hidden=True)] = False,
    serve: Annotated[bool, typer.Option(hidden=True)] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Estimate time, memory and disk; run nothing.")] = False,
) -> None:
    """Run a scenario's campaign, or what is missing of it, and print its separation statistics."""
    for name, asked in {
        "--arch other than cpu": arch != "cpu",
        "--live": live,
        "--serve": serve,
    }.items():
        if asked:
            _not_yet(name)
    from tbatch.scenario import Scenario

    overrides = list(change or [])
    overrides += [f"campaign.runs={runs}"] if runs is not None else []
    overrides += [f"campaign.seed={seed}"] if seed is not None else []
    overrides += [f"keep.timelines={_kept(keep)}"] if keep is not None else []
    loaded = Scenario.load(scenario, overrides=overrides)
    if dry_run:
        from tbatch.campaign.estimate import estimate, estimate_text

        folder = out or Path("results") / loaded.name
        print(estimate_text(estimate(loaded, folder, threads=threads, part=_part(shard)), folder))
        return
    _carry_out(loaded, out, threads, executor, shard)


@app.command()
def resume(folder: Folder, threads: Threads = None, executor: ExecutorName = "local") -> None:
    """Go on with an interrupted campaign."""
    from tbatch.campaign.campaign import Campaign

    _carry_out(Campaign.open(folder).scenario, folder, threads, executor)


@app.command()
def status(folder: Folder) -> None:
    """Say how far a campaign is, what is missing and what is damaged."""
    from tbatch.campaign.campaign import Campaign
    from tbatch.campaign.summary import status_text

    campaign = Campaign.open(folder)
    damage = campaign.store.damage()
    print(status_text(campaign, damage))
    if damage:
        raise typer.Exit(exit_codes.DAMAGED_STORE)


@app.command()
def stats(
    folder: Folder,
    as_json: AsJson = False,
    every: Annotated[bool, typer.Option("--all", help="Every estimate, not the separations alone.")] = False,
) -> None:
    """Print separation statistics with confidence intervals."""
    from tbatch.campaign.campaign import Campaign
    from tbatch.campaign.estimate_tables import estimates_document, estimates_text
    from tbatch.campaign.summary import summary_document, summary_text

    campaign = Campaign.open(folder)
    if as_json:
        document = summary_document(campaign)
        print(json.dumps({**document, "estimates": estimates_document(campaign)} if every else document, indent=1))
    else:
        print(estimates_text(campaign) if every else summary_text(campaign))


@app.command()
def check(
    folder: Folder,
    junit: Annotated[Path | None, typer.Option(metavar="FILE", help="Also write JUnit XML, for CI.")] = None,
    change: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Change a limit, such as limits.diverged.max=3."),
    ] = None,
) -> None:
    """Judge a campaign by its scenario's [limits]: exit 0 if all are kept, 1 if not."""
    from tbatch.campaign.campaign import Campaign
    from tbatch.campaign.limits import judge, stored_limits
    from tbatch.cli.gate import report_verdicts

    campaign = Campaign.open(folder)
    verdicts = judge(campaign, stored_limits(campaign, change or ()))
    report_verdicts(campaign, verdicts, junit)
    if not all(verdict.passed for verdict in verdicts):
        raise typer.Exit(exit_codes.LIMIT_EXCEEDED)


@app.command()
def report(
    folder: Folder,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Where to write; default DIR/report.")] = None,
    histories: Annotated[bool, typer.Option(help="Simulate a worst and a median run again and draw them.")] = True,
    threads: Threads = None,
) -> None:
    """Write one self-contained HTML page with plots, and the CSV behind each plot."""
    from tbatch.campaign.campaign import Campaign

    if find_spec("matplotlib") is None:
        say("a report needs matplotlib: pip install 'tbatch[report]'")
        raise typer.Exit(exit_codes.BAD_USAGE)
    campaign = Campaign.open(folder, threads=threads)
    from tbatch.view.report import write_report

    path = write_report(campaign, out or folder / "report", histories=histories)
    say(f"wrote {path} and the numbers behind its figures beside it")


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


@app.command()
def bench(as_json: AsJson = False) -> None:
    """Measure run-steps per second and core on this machine, beside SciPy."""
    from tbatch.campaign.summary import columns
    from tbatch.engine.bench import measure

    measured = measure(progress=say)
    if as_json:
        print(json.dumps(measured, indent=1))
    else:
        print("\n".join(columns(["", ""], [], [[key, _shown(value)] for key, value in measured.items()])))


app.command()(methods)


@app.command("list")
def list_(what: Annotated[Listed, typer.Argument(help="What to list.")]) -> None:
    """List the vehicles, tracks, spectra or scenarios that come with tbatch."""
    from tbatch.scenario import list_catalogue

    for name, text in list_catalogue(what.value):
        print(f"{name:24} {text}".rstrip())


@app.command()
def schema() -> None:
    """Print the JSON schema of a scenario, for editors."""
    from tbatch.scenario import Scenario

    print(json.dumps(Scenario.json_schema(), indent=1))


def _not_yet(what: str) -> None:
    say(f"{what} is not served yet by this version ({__version__})")
    raise typer.Exit(exit_codes.BAD_USAGE)


def _carry_out(
    scenario: "Scenario", folder: Path | None, threads: int | None, executor: str = "local", shard: str | None = None
) -> None:
    """Runs what is missing, prints what there is, and judges it."""
    from tbatch.campaign.campaign import run as run_campaign
    from tbatch.campaign.cluster import Dask
    from tbatch.campaign.progress import Progress
    from tbatch.campaign.summary import status_text, summary_text
    from tbatch.cli.interruption import Interruption
    from tbatch.view.kept import write_kept
    from tbatch.view.progress import ProgressDisplay

    part = _part(shard)
    cluster = Dask(executor) if executor != "local" else None
    folder = folder or Path("results") / scenario.name
    for warning in scenario.warnings:
        say(f"warning: {warning}")
    with (
        Interruption(f"resume with: tbatch resume {folder}") as interruption,
        ExitStack() as meter,
    ):
        display = meter.enter_context(ProgressDisplay(scenario.name))

        def show(state: Progress) -> None:
            interruption.stepping = state.phase == "running" and state.run_steps_done > 0
            if state.phase == "recording":
                meter.close()
                say(f"recordings of the kept runs: {state.runs_done} of {state.runs_total}")
            else:
                display(state)
            interruption.check()

        campaign = run_campaign(
            scenario,
            out=folder,
            threads=threads,
            progress=show,
            message=display.message,
            recorder=write_kept,
            cluster=cluster,
            part=part,
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


def _shown(value: Any) -> str:
    return f"{value:,.4g}" if isinstance(value, float) else str(value)
