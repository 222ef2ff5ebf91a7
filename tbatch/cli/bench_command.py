"""``tbatch bench``: what this machine steps."""

import json
from typing import Annotated

import typer

from tbatch.cli.app import AsJson, app, say


@app.command()
def bench(
    as_json: AsJson = False,
    quick: Annotated[bool, typer.Option("--quick", help="SciPy, the engine and the ratio alone.")] = False,
) -> None:
    """Measure run-steps per second and core on this machine, beside SciPy; some minutes, a quick look one."""
    from tbatch.engine.bench.measure import measure

    measured = measure(progress=say, tables=not quick)
    if as_json:
        print(json.dumps({table.title: table.as_json() for table in measured}, indent=1))
    else:
        print("\n\n".join(table.as_text() for table in measured))
