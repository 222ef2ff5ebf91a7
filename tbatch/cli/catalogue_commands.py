"""The commands that say what there is: list and schema."""

import json
from enum import StrEnum
from typing import Annotated

import typer

from tbatch.cli.app import app


class Listed(StrEnum):
    """What ``tbatch list`` lists."""

    vehicles = "vehicles"
    tracks = "tracks"
    spectra = "spectra"
    scenarios = "scenarios"


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
