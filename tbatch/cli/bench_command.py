"""``tbatch bench``: what this machine steps."""

import json
from typing import Any

from tbatch.cli.app import AsJson, app, say


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


def _shown(value: Any) -> str:
    return f"{value:,.4g}" if isinstance(value, float) else str(value)
