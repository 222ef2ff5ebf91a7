"""The commands that look after campaign folders: merge and verify."""

from pathlib import Path
from typing import Annotated

import typer

from tbatch.cli import exit_codes
from tbatch.cli.app import Folder, app, say


@app.command()
def merge(
    folders: Annotated[list[Path], typer.Argument(metavar="DIR...", help="Campaign folders; all join the first.")],
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Join them here instead; they are only read.")] = None,
) -> None:
    """Join what parts or other machines stored: all folders into the first, or into --out."""
    from tbatch.campaign.merging import merge as merge_folders
    from tbatch.campaign.summary import status_text

    target, sources = (out, folders) if out is not None else (folders[0], folders[1:])
    campaign = merge_folders(target, sources, message=say)
    print(status_text(campaign, []))


@app.command()
def verify(folder: Folder) -> None:
    """Read every file of a campaign folder again and hold it against its checksum."""
    from tbatch.campaign.verification import verify as verify_folder

    found = verify_folder(folder)
    for line in found.damage:
        print(f"damaged: {line}")
    for line in found.notes:
        print(f"note: {line}")
    print(f"{found.files} files are what was written, {len(found.damage)} are damaged")
    if found.damage:
        raise typer.Exit(exit_codes.DAMAGED_STORE)
