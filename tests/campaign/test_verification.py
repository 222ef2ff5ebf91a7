"""Whatever happens to a file of a campaign folder, it is found, and no number is taken from it."""

import random
import shutil

import pytest
from toy import ToyExecutor, ToyScenario, contents

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.faults import StoreDamaged
from tbatch.campaign.part import Part
from tbatch.campaign.run import run
from tbatch.campaign.verification import verify

SCENARIO = ToyScenario(samples=100)
DIVERGING = frozenset({(1, 3), (0, 70)})
FLIPS, SLOW_FLIPS = 60, 1000
CUTS, SLOW_CUTS = 2, 100


def whole(folder):
    return run(SCENARIO, out=folder, executor=ToyExecutor(SCENARIO, diverging=DIVERGING))


@pytest.fixture
def folder(tmp_path):
    """A finished campaign with two diverged runs, half of it stored by parts."""
    folder = tmp_path / "folder"
    whole(folder)
    return folder


@pytest.fixture
def parts(tmp_path):
    """A folder in which two parts worked."""
    folder = tmp_path / "parts"
    for index in range(2):
        executor = ToyExecutor(SCENARIO, diverging=DIVERGING)
        run(SCENARIO, out=folder, executor=executor, part=Part(index, 2))
    return folder


def files(folder):
    return [path for path in sorted(folder.rglob("*")) if path.is_file()]


def gives_no_other_number(folder, sound):
    """Whether reading gives what was stored, or refuses."""
    try:
        campaign = Campaign.open(folder)
        return contents(campaign) == sound and campaign.diverged == len(DIVERGING)
    except StoreDamaged:
        return True


def find_flips(folder, count):
    sound = contents(Campaign.open(folder))
    draw = random.Random(5)
    for _ in range(count):
        path = draw.choice(files(folder))
        data = path.read_bytes()
        flipped = bytearray(data)
        flipped[draw.randrange(len(data))] ^= 1 << draw.randrange(8)
        path.write_bytes(flipped)
        assert verify(folder).damage, path
        assert gives_no_other_number(folder, sound)
        path.write_bytes(data)
    assert verify(folder).damage == []


def find_cuts(folder, count):
    sound = contents(Campaign.open(folder))
    draw = random.Random(6)
    for path in files(folder):
        data = path.read_bytes()
        for length in {0, 1, len(data) - 1, *(draw.randrange(len(data)) for _ in range(count))}:
            path.write_bytes(data[:length])
            assert verify(folder).damage, (path, length)
            assert gives_no_other_number(folder, sound)
        path.write_bytes(data)
    assert verify(folder).damage == []


def test_flipped_bits_are_found(folder, parts):
    assert verify(folder).files == len(files(folder)) == 3 + 4 * 3 + 2
    find_flips(folder, FLIPS)
    find_flips(parts, FLIPS // 5)


def test_cut_files_are_found(folder):
    find_cuts(folder, CUTS)


@pytest.mark.slow
def test_a_thousand_flipped_bits_and_a_hundred_cuts_of_each_file_are_found(folder, parts):
    find_flips(folder, SLOW_FLIPS)
    find_flips(parts, SLOW_FLIPS)
    find_cuts(folder, SLOW_CUTS)


def test_a_deleted_file_is_found(folder):
    sound = contents(Campaign.open(folder))
    for path in files(folder):
        data = path.read_bytes()
        path.unlink()
        assert any(path.name in line for line in verify(folder).damage), path
        if path.name != "manifest.json":  # without one nothing counts: no numbers at all
            assert gives_no_other_number(folder, sound)
        path.write_bytes(data)


def test_renamed_copied_and_foreign_shards_are_found(folder, tmp_path):
    name, other = "c00-s000000-000064.parquet", "c01-s000064-000100.parquet"
    for kind in ("runs", "wheels", "events"):
        sound = (folder / kind / other).read_bytes()
        (folder / kind / name).rename(folder / kind / "c00-s000128-000192.parquet")
        assert len(verify(folder).damage) == 2  # missing, and not what its name says
        (folder / kind / "c00-s000128-000192.parquet").rename(folder / kind / name)
        shutil.copy(folder / kind / name, folder / kind / "c00-s000128-000192.parquet")
        assert any("c00-s000128-000192" in line for line in verify(folder).damage)
        (folder / kind / "c00-s000128-000192.parquet").unlink()
        shutil.copy(folder / kind / name, folder / kind / other)
        assert any(other in line for line in verify(folder).damage)
        (folder / kind / other).write_bytes(sound)
    foreign = ToyScenario(samples=200, seed=8)
    run(foreign, out=tmp_path / "foreign", executor=ToyExecutor(foreign))
    for kind in ("runs", "wheels", "events"):
        shutil.copy(tmp_path / "foreign" / kind / "c00-s000128-000192.parquet", folder / kind)
    assert any("another campaign" in line for line in verify(folder).damage)


def test_what_a_killed_process_leaves_is_no_damage_but_noted(folder):
    name = "c00-s000000-000064.parquet"
    (folder / "runs" / f".{name}.host-1.tmp").write_bytes(b"half")
    found = verify(folder)
    assert found.damage == []
    assert any(".tmp" in note for note in found.notes)


def test_deleting_what_is_damaged_and_running_again_gives_the_same(folder):
    sound = contents(Campaign.open(folder))
    damaged = folder / "wheels" / "c01-s000000-000064.parquet"
    damaged.write_bytes(damaged.read_bytes()[:-5])
    with pytest.raises(StoreDamaged, match=r"Delete what is damaged and run"):
        whole(folder)
    damaged.unlink()
    assert contents(whole(folder)) == sound
    assert verify(folder).damage == []
