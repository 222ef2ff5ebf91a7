"""A track from files: checked with everything else, known by what the files hold, run as any other."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy import io as scipy_io
from scipy import sparse

import tbatch as tb
from tbatch.campaign.identity import changed_keys, identity
from tbatch.scenario import Problem, Scenario, ScenarioError

SLAB = tb.Track.slab("seed-slab", length=45.0)
NODES = SLAB.node_count
TEXT = """\
[campaign]
name = "imported"
[vehicle]
model = "seed-multiwheel"
[track]
matrices = { mass = "M.mtx", damping = "C.mtx", stiffness = "K.mtx", nodes = "rail.csv", rail_EI = RAIL_EI }
[speed]
values = ["300 km/h"]
[run]
distance = 1.0
start = 25
evaluate_from = 0
""".replace("RAIL_EI", repr(SLAB.rail_EI))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The seed's slab track in Matrix Market files."""
    for name, matrix in (("M", SLAB.mass), ("C", SLAB.damping), ("K", SLAB.stiffness)):
        scipy_io.mmwrite(tmp_path / f"{name}.mtx", matrix.to_csc(), symmetry="symmetric", precision=17)
    lines = [f"{0.65 * node!r},{6 * node + 1},{6 * node + 2}" for node in range(NODES)]
    (tmp_path / "rail.csv").write_text("\n".join(["x [m],w_row [from 1],theta_row [from 1]", *lines]) + "\n")
    (tmp_path / "s.toml").write_text(TEXT)
    return tmp_path


def problems(folder: Path, *overrides: str, text: str = TEXT) -> dict[str, Problem]:
    (folder / "s.toml").write_text(text)
    with pytest.raises(ScenarioError) as caught:
        Scenario.load(folder / "s.toml", overrides)
    return {problem.key: problem for problem in caught.value.problems}


def test_the_model_is_that_of_the_same_track_in_numbers(folder: Path) -> None:
    track = Scenario.load(folder / "s.toml").model().track
    assert (track.kind, track.begin, track.rail_EI) == ("matrices", 0.0, SLAB.rail_EI)
    assert track.end == pytest.approx(SLAB.length, rel=1e-15)
    for read, given in ((track.mass, SLAB.mass), (track.damping, SLAB.damping), (track.stiffness, SLAB.stiffness)):
        found, wanted = (np.sort(np.abs(matrix.to_csc().data)) for matrix in (read, given))
        assert found == pytest.approx(wanted, rel=1e-15)


def test_a_resolved_scenario_loads_as_itself_and_builds_the_same_track(folder: Path) -> None:
    scenario = Scenario.load(folder / "s.toml")
    again = Scenario.from_tables(scenario.resolved())
    assert again.resolved() == scenario.resolved()
    assert again.hash == scenario.hash == identity(scenario.resolved())
    track = scenario.resolved()["track"]
    assert (track["model"], track["matrices"]["units"], "length" in track) == ("matrices", "m-kg-s", False)
    assert Path(track["matrices"]["nodes"]) == folder / "rail.csv"


def test_files_are_known_by_their_content_not_by_their_place(folder: Path) -> None:
    before = Scenario.load(folder / "s.toml")
    elsewhere = folder / "else where"
    elsewhere.mkdir()
    for file in ("M.mtx", "C.mtx", "K.mtx", "rail.csv", "s.toml"):
        (elsewhere / file).write_bytes((folder / file).read_bytes())
    after = Scenario.load(elsewhere / "s.toml")
    assert after.hash == before.hash
    assert changed_keys(before.resolved(), after.resolved()) == []
    (elsewhere / "K.mtx").write_text((folder / "K.mtx").read_text() + "\n")
    after = Scenario.load(elsewhere / "s.toml")
    assert after.hash != before.hash
    ((key, old, new),) = changed_keys(before.resolved(), after.resolved())
    assert key == "track.matrices.sha256.stiffness" and old != new
    (folder / "K.mtx").write_text((folder / "K.mtx").read_text() + "\n")
    with pytest.raises(ScenarioError, match="has changed: its checksum is no longer that of"):
        Scenario.from_tables(before.resolved())


def test_all_that_is_wrong_is_said_at_once(folder: Path) -> None:
    (folder / "rail.csv").write_text("x [m],w_row [from 1]\n0,1\n0,7\n")
    (folder / "C.mtx").write_text("nothing")
    text = TEXT.replace("M.mtx", "nowhere.mtx").replace('"seed-multiwheel"', '"unknown"').replace("25", "25\nx = 3")
    found = problems(folder, "track.length=30", text=text)
    assert set(found) == {
        "vehicle.model",
        "track.length",
        "run.x",
        *(f"track.matrices.{name}" for name in ("mass", "damping", "nodes")),
    }
    mass, nodes = found["track.matrices.mass"], found["track.matrices.nodes"]
    assert (mass.line, mass.value) == (6, '"nowhere.mtx"') and "nowhere.mtx does not exist" in mass.message
    assert "rail.csv, line 3: x = 0 m does not lie beyond" in nodes.message
    assert "the format is not known" in found["track.matrices.damping"].message
    assert "does not belong to a track from matrices" in found["track.length"].message
    assert all("\n" not in str(problem) for problem in found.values())


@pytest.mark.parametrize(
    ("override", "key", "said"),
    [
        ("track.model=rigid", "track.model", 'stands beside track.matrices; accepted: no track.model, or "matrices"'),
        ("track.elements=3", "track.elements", "does not belong to a track from matrices"),
        ("track.matrices.unit=m", "track.matrices.unit", 'is not a known key; did you mean "units"?'),
        ("track.matrices.units=inch", "track.matrices.units", 'is not known; accepted: "m-kg-s", "mm-t-s"'),
        ("track.matrices.offset=3 kg", "track.matrices.offset", "measures mass, not length"),
        ("track.matrices.mass=", "track.matrices.mass", "cannot be used; accepted: a path"),
        ("track.matrices.mass=.", "track.matrices.mass", "is not a file"),
        ("track.matrices.mass=M.mtx#MAA", "track.matrices.mass", "only Nastran files hold several matrices"),
        (
            "track.matrices.mapping=rail.csv",
            "track.matrices.mapping",
            "no equations; accepted: lines of equation",
        ),
        ("track.matrices.mass=K2.mtx", "track.matrices.mass", "K2.mtx: 6 rows, but "),
        ("track.matrices.stiffness=H.npz", "track.matrices.stiffness", "is not symmetric"),
        ("run.start=200", "run.start", "on a track from 0 to 45.5 m"),
        ("track.matrices.offset=-30", "run.start", "on a track from -30 to 15.5 m"),
    ],
)
def test_what_does_not_fit_is_refused_by_key(folder: Path, override: str, key: str, said: str) -> None:
    scipy_io.mmwrite(folder / "K2.mtx", sparse.identity(6))
    sparse.save_npz(folder / "H.npz", sparse.csc_matrix(sparse.tril(SLAB.stiffness.to_csc())))
    ((found, problem),) = problems(folder, override).items()
    assert found == key and said in str(problem)


def test_a_track_of_numbers_still_needs_model_and_length(folder: Path) -> None:
    text = TEXT.replace(TEXT.split("\n")[5], "rails = 2")
    assert {key: problem.message for key, problem in problems(folder, text=text).items()} == {
        "track.model": "is missing",
        "track.length": "is missing",
    }
    text = text.replace("rails = 2", 'rails = 7\nmodel = "matrices"\nlength = 5')
    assert set(problems(folder, text=text)) == {"track.rails"}
    text = text.replace("rails = 7", "rails = 1")
    assert problems(folder, text=text)["track.matrices"].message == "is missing"


def test_an_offset_moves_the_track_under_the_run(folder: Path) -> None:
    scenario = Scenario.load(folder / "s.toml", ["track.matrices.offset=-22.5 m", "run.start=1"])
    assert scenario.model().track.begin == -22.5


def test_the_engine_gives_the_forces_of_the_same_track_in_numbers(folder: Path) -> None:
    """1e-9 as the entries have 17 digits."""
    numbers = TEXT.replace(TEXT.split("\n")[5], 'model = "seed-slab"\nlength = 45')
    found = []
    for scenario in (Scenario.load(folder / "s.toml"), Scenario.from_text(numbers)):
        runs, duration = scenario.runs([(0, 0)])
        save = tb.SaveAt(every=1e-4, channels=("contact_force",))
        found.append(tb.simulate(scenario.model(), runs, duration, save=save).contact_force)
    assert np.abs(found[0] - found[1]).max() <= 1e-9 * found[1].max()
    assert found[1].max() > 1.01 * found[1].min()  # the forces do vary


def test_the_command_says_what_to_install_for_a_nastran_file(folder: Path) -> None:
    (folder / "M.op4").write_bytes(b"anything")
    (folder / "pyyeti.py").write_text("raise ImportError('hidden')")  # before an installed one on the path
    command = [sys.executable, "-m", "tbatch", "run", "s.toml", "--set", "track.matrices.mass=M.op4", "--dry-run"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    (line,) = done.stderr.strip().split("\n")
    assert "Nastran files need pyYeti, which is not installed: pip install 'tbatch[nastran]'" in line
