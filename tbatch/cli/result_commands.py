"""The commands that read what is stored: status, stats, check and report."""

import json
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from tbatch.cli import exit_codes
from tbatch.cli.app import AsJson, Folder, Threads, app, say


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
    from tbatch.campaign.estimate_tables import estimates_document, estimates_text, sensitivities_document
    from tbatch.campaign.summary import summary_document, summary_text

    campaign = Campaign.open(folder)
    if as_json:
        document = summary_document(campaign)
        if every:
            document["estimates"] = estimates_document(campaign)
            document["sensitivities"] = sensitivities_document(campaign)
        print(json.dumps(document, indent=1))
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
    histories: Annotated[bool, typer.Option(help="Simulate some runs again and draw them along the line.")] = True,
    threads: Threads = None,
) -> None:
    """Write one self-contained HTML page with plots, and the CSV behind each plot."""
    from tbatch.campaign.campaign import Campaign

    if find_spec("matplotlib") is None:
        say("a report needs matplotlib: pip install 'tbatch[report]'")
        raise typer.Exit(exit_codes.BAD_USAGE)
    campaign = Campaign.open(folder, threads=threads)
    from tbatch.view.report import write_report

    path = write_report(campaign, out or folder / "report", histories=histories, message=say)
    say(f"wrote {path} and the numbers behind its figures beside it")
