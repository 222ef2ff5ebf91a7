"""Where the verdicts of ``tbatch check`` go: the terminal, a JUnit file, and GitHub where it runs there."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tbatch import __version__
from tbatch.view.verdicts import github_annotations, junit_xml, step_summary, verdicts_text

if TYPE_CHECKING:
    from tbatch.campaign.campaign import Campaign
    from tbatch.campaign.limits import Verdict


def report_verdicts(campaign: "Campaign", verdicts: Sequence["Verdict"], junit: Path | None) -> None:
    """Prints verdicts, writes them to files, and tells GitHub if this is one of its jobs.

    Args:
        campaign: The campaign.
        verdicts: Its verdicts.
        junit: File for JUnit XML; None for none.
    """
    print(verdicts_text(verdicts))
    facts = {
        "tbatch": __version__,
        "runs": str(campaign.runs_stored),
        "seed": str(campaign.store.resolved["campaign"]["seed"]),
        "identity": campaign.store.manifest.campaign,
    }
    if junit is not None:
        junit.parent.mkdir(parents=True, exist_ok=True)
        junit.write_bytes(junit_xml(verdicts, campaign.name, facts))
    if os.environ.get("GITHUB_ACTIONS") == "true":
        print("\n".join(github_annotations(verdicts, campaign.name)))
    if summary := os.environ.get("GITHUB_STEP_SUMMARY"):
        told = f"tbatch {__version__}, {facts['runs']} runs, seed {facts['seed']}, folder `{campaign.folder}`"
        with open(summary, "a", encoding="utf-8") as file:
            file.write(step_summary(verdicts, campaign.name, told) + "\n")
