"""The pages on the paper's claims name what exists, and their script runs."""

import re
import shlex
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest

import tbatch as tb
from tbatch.methods.case import METHODS
from tbatch.scenario import Scenario

DOCS = Path(__file__).parent.parent / "docs"
PAGES = sorted((DOCS / "claims").glob("*.md"))


def commands(page: Path) -> list[list[str]]:
    """The tbatch commands of a page, continued lines joined."""
    text = page.read_text(encoding="utf-8").replace("\\\n", " ")
    written = re.findall(r"^    (tbatch .*)$", text, flags=re.MULTILINE)
    written += re.findall(r"`(tbatch (?:methods|run) [^`]*)`", text)
    return [shlex.split(one, comments=True) for one in written]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_scenarios_methods_and_changes_on_a_page_exist(page: Path) -> None:
    for _, command, *arguments in commands(page):
        assert command in ("methods", "run", "stats")
        if command == "stats":
            continue
        changes = [value for name, value in pairwise(arguments) if name == "--set"]
        assert Scenario.load(arguments[0], overrides=changes).speeds
        if "--only" in arguments:
            named = arguments[arguments.index("--only") + 1].split(",")
            assert {name.strip() for name in named} <= set(METHODS)


@pytest.mark.parametrize("page", [*PAGES, DOCS / "accuracy.md", DOCS / "step_size.md"], ids=lambda page: page.stem)
def test_links_and_pictures_of_a_page_are_there(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), target


def test_the_script_of_rates_prints_a_line_a_speed(tmp_path: Path) -> None:
    changes = ["run.distance=12 m", "run.evaluate_from=1 m", "keep.timelines=none"]
    tb.run(Scenario.load("quick", overrides=changes), out=tmp_path / "quick")
    script = DOCS / "claims" / "rates.py"
    done = subprocess.run([sys.executable, script, tmp_path / "quick"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert [line.partition(":")[0] for line in done.stdout.splitlines()] == ["case 0", "case 1"]
