"""The recipes of docs/ are run as they are printed, with stand-ins for what only a cluster or GitHub has."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from typer.main import get_command

from tbatch.cli import main  # noqa: F401  (puts all commands into the app)
from tbatch.cli.app import app

DOCS = Path(__file__).parent.parent / "docs"
RECIPES = ("clusters.md", "ci.md")

SCENARIO = """
[campaign]
name = "line"
runs = {runs}
seed = 1
[vehicle]
model = "koh-column"
[track]
model = "koh-winkler"
length = "40 m"
[contact]
wheel_radius = 0.42
[irregularity]
defect = [{{ kind = "flat", at = "20 m", depth = "2.15 mm", length = "150 mm" }}]
[speed]
values = ["117 km/h", "100 km/h"]
[run]
start = "15 m"
distance = "8 m"
taper = "0 m"
evaluate_from = "1 m"
[keep]
timelines = "worst:1"
[limits]
diverged = {{ max = 0 }}
"separation.probability" = {{ max = 1.0 }}
"""

# What sbatch does with the recipe's options: the script once for each element of its array, then the wrapped command.
SBATCH = """#!/bin/bash
set -e
for word in "$@"; do case "$word" in
    --parsable|--export=ALL) ;;
    --dependency=afterok:*) test "${word##*:}" = 4711 ;;
    --wrap) shift_to_wrap=1 ;;
    *) if [ -n "$shift_to_wrap" ]; then exec bash -c "$word"; fi; script=$word ;;
esac; done
array=$(sed -n 's/^#SBATCH.*--array=\\([0-9]*-[0-9]*\\).*/\\1/p' "$script")
export SLURM_CPUS_PER_TASK=$(sed -n 's/^#SBATCH.*--cpus-per-task=\\([0-9]*\\).*/\\1/p' "$script")
for SLURM_ARRAY_TASK_ID in $(seq "${array%-*}" "${array#*-}"); do
    export SLURM_ARRAY_TASK_ID
    bash "$script" >&2
done
echo 4711
"""


def text_of(name):
    return (DOCS / name).read_text(encoding="utf-8")


def section(name, heading):
    return re.search(rf"^## {heading}\n(.*?)(?=^## |\Z)", text_of(name), flags=re.DOTALL | re.MULTILINE)[1]


def blocks(text, language=""):
    """Fenced blocks of a language, or indented ones."""
    if language:
        return re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)
    return ["\n".join(line[4:] for line in block.splitlines()) for block in re.findall(r"(?:^ {4}.*\n)+", text, re.M)]


def commands_of(line):
    """The words of each tbatch command in a line of shell."""
    found, words = [], []
    for word in [*shlex.split(line, comments=True), "&&"]:
        if "tbatch " in word:  # a command in quotes
            found += commands_of(word)
        elif word in ("&&", ">", "|"):
            found += [words[words.index("tbatch") + 1 :]] if "tbatch" in words else []
            words = []
        else:
            words.append(word)
    return found


def typed_commands():
    """Every tbatch command in a code block, as its words."""
    stand_ins = {"${{ matrix.part }}": "0", "$SLURM_ARRAY_TASK_ID": "0", "$SLURM_CPUS_PER_TASK": "2", "[DIR...]": ""}
    for name in RECIPES:
        text = text_of(name)
        for block in [*blocks(text, r"\w+"), *blocks(re.sub(r"```.*?```", "", text, flags=re.DOTALL))]:
            for line in block.splitlines():
                for what, instead in stand_ins.items():
                    line = line.replace(what, instead)
                yield from ((name, words) for words in (commands_of(line) if "tbatch " in line else ()))


@pytest.mark.parametrize(
    ("name", "words"), [*typed_commands()], ids=lambda value: value if isinstance(value, str) else " ".join(value)
)
def test_each_command_in_the_docs_is_one_that_the_command_line_knows(name, words):
    if words[0].startswith("--"):
        assert words[0] == "--install-completion"
        return
    command = get_command(app).commands[words[0]]
    command.make_context(words[0], words[1:])  # exits on an unknown option or a missing argument


@pytest.fixture
def place(tmp_path):
    """A folder with the scenario, and tbatch, pip and sbatch on the path."""
    programs = tmp_path / "bin"
    programs.mkdir()
    for program, text in {
        "tbatch": f'#!/bin/bash\nexec {sys.executable} -m tbatch "$@"\n',
        "pip": '#!/bin/bash\n[ "$1" = install ]\n',  # it is installed
        "sbatch": SBATCH,
    }.items():
        (programs / program).write_text(text)
        (programs / program).chmod(0o755)
    work = tmp_path / "work"
    work.mkdir()
    root = str(Path(__file__).parent.parent)
    settings = {**os.environ, "PATH": f"{programs}:{os.environ['PATH']}", "PYTHONPATH": root}

    def shell(text, **more):
        done = subprocess.run(
            ["bash", "-e", "-o", "pipefail", "-c", text],
            cwd=work,
            env={**settings, **more},
            capture_output=True,
            text=True,
            timeout=600,
            check=False,
        )
        assert "Traceback" not in done.stdout + done.stderr
        return done

    return work, shell


def test_the_slurm_array_runs_every_part_and_the_joined_campaign_is_complete(place):
    work, shell = place
    recipe = section("clusters.md", "Slurm")
    [script] = blocks(recipe, "bash")
    [last, count] = re.search(r"--array=0-(\d+) .*?/(\d+)\"", script, flags=re.DOTALL).groups()
    assert int(count) == int(last) + 1  # the array's elements are the parts
    script = script.replace(f"--array=0-{last}", "--array=0-1").replace(f"/{count}", "/2")
    (work / "shards.sh").write_text(script)
    (work / "scenario.toml").write_text(SCENARIO.format(runs=70))
    [submit] = blocks(re.sub(r"```.*?```", "", recipe, flags=re.DOTALL))
    done = shell(submit.replace("/shared/campaign", str(work / "campaign")))
    assert done.returncode == 0, done.stderr
    assert "140 of 140 runs stored, complete" in done.stdout
    assert len(list((work / "campaign" / "rrd").glob("*.rrd"))) == 2  # by resume: parts record nothing
    assert not (work / "campaign" / "parts").exists()


def steps(job):
    """The run: lines of a job, in order."""
    return re.findall(r"^\s*(?:- )?run: (.+)$", job, flags=re.MULTILINE)


@pytest.mark.slow
def test_the_github_matrix_runs_every_part_and_the_joined_campaign_is_complete(place):
    work, shell = place
    [workflow] = blocks(section("clusters.md", "GitHub Actions"), "yaml")
    part, whole = workflow.split("  all:\n")
    (work / "scenario.toml").write_text(SCENARIO.format(runs=70))
    matrix = [int(number) for number in re.search(r"part: \[([^\]]*)\]", part)[1].split(",")]
    for index in matrix:
        for line in steps(part):
            done = shell(line.replace("${{ matrix.part }}", str(index)))
            assert done.returncode == 0, done.stderr
        # upload-artifact and download-artifact leave each part in a folder of the artifact's name.
        assert (work / f"part-{index}" / "parts").is_dir()
    for line in steps(whole):
        done = shell(line)
        assert done.returncode == 0, done.stderr
    assert "Runs: 140 of 140" in done.stdout


@pytest.mark.slow
def test_the_ci_workflow_runs_judges_and_reports(place):
    work, shell = place
    [workflow] = blocks(section("ci.md", "GitHub Actions"), "yaml")
    (work / "scenarios").mkdir()
    (work / "scenarios" / "line.toml").write_text(SCENARIO.format(runs=24))
    summary = work / "summary.md"
    for line in steps(workflow):
        done = shell(line, GITHUB_ACTIONS="true", GITHUB_STEP_SUMMARY=str(summary))
        assert done.returncode == 0, done.stderr
    uploaded = [line.strip() for line in workflow.split("path: |\n")[1].splitlines()]
    assert all((work / path).exists() for path in uploaded), uploaded
    assert "separation.probability" in summary.read_text(encoding="utf-8")
    failing = shell("tbatch check results/line --set 'limits.\"separation.probability\".max=0'", GITHUB_ACTIONS="true")
    assert failing.returncode == 1
    assert "::error title=" in failing.stdout
