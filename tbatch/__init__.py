"""Batched vehicle-track dynamics with wheels that may leave the rail.

The public names are loaded on first use, so that ``import tbatch`` stays light.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tbatch import methods
    from tbatch.campaign.campaign import Campaign
    from tbatch.campaign.run import run
    from tbatch.engine.model import Model
    from tbatch.engine.result import Result
    from tbatch.engine.runs import Runs, SaveAt, State
    from tbatch.engine.simulate import simulate
    from tbatch.physics.contact import Contact
    from tbatch.physics.irregularity import Irregularity
    from tbatch.physics.track import Track
    from tbatch.physics.vehicle import Vehicle
    from tbatch.scenario import Scenario

__version__ = "0.1.0"

__all__ = [
    "Campaign",
    "Contact",
    "Irregularity",
    "Model",
    "Result",
    "Runs",
    "SaveAt",
    "Scenario",
    "State",
    "Track",
    "Vehicle",
    "methods",
    "run",
    "simulate",
]

_HOME = {
    "Campaign": "tbatch.campaign.campaign",
    "run": "tbatch.campaign.run",
    "Model": "tbatch.engine.model",
    "Result": "tbatch.engine.result",
    "Runs": "tbatch.engine.runs",
    "SaveAt": "tbatch.engine.runs",
    "State": "tbatch.engine.runs",
    "simulate": "tbatch.engine.simulate",
    "Contact": "tbatch.physics.contact",
    "Irregularity": "tbatch.physics.irregularity",
    "Track": "tbatch.physics.track",
    "Vehicle": "tbatch.physics.vehicle",
    "Scenario": "tbatch.scenario",
}


def __getattr__(name: str) -> Any:
    if name == "methods":
        return import_module("tbatch.methods")
    if name not in _HOME:
        raise AttributeError(f"module 'tbatch' has no attribute {name!r}")
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME, "methods"})
