"""The commands and the example of the README are true."""

import re
import subprocess
import sys
from pathlib import Path

README = Path(__file__).parent.parent / "README.md"


def test_the_python_example_runs_as_printed() -> None:
    """The README's Python block runs and prints a summary."""
    [code] = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.DOTALL)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "separations" in done.stdout


def test_the_two_commands_are_on_the_first_screen() -> None:
    """Set-up is two commands, and a reader sees them without scrolling."""
    first_screen = "\n".join(README.read_text(encoding="utf-8").splitlines()[:40])
    assert "pip install . && .venv/bin/tbatch run scenarios/separation_vs_speed.toml" in first_screen
    assert "pip install '.[test]' && .venv/bin/pytest" in first_screen
