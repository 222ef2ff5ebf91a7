"""What a user writes: a TOML file, checked, completed and built."""

from tbatch.scenario.errors import Problem, ScenarioError
from tbatch.scenario.listing import list_catalogue
from tbatch.scenario.run_name import parse_run_name, run_name
from tbatch.scenario.scenario import Scenario
from tbatch.scenario.source import shipped_scenarios

__all__ = [
    "Problem",
    "Scenario",
    "ScenarioError",
    "list_catalogue",
    "parse_run_name",
    "run_name",
    "shipped_scenarios",
]
