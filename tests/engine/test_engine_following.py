"""Histories of some runs of a batch: the same bits as those of all, handed over piece by piece, at nobody's cost."""

import numpy as np
import pytest
from engine_cases import corrugation, model

from tbatch.engine.footprint import Footprint
from tbatch.engine.rows import LANES
from tbatch.engine.runs import Runs, SaveAt
from tbatch.engine.seating import blocks_first, seats
from tbatch.engine.simulate import simulate

COUNT = 2 * LANES + 3  # two whole blocks and one that is not full
CHANNELS = ("contact_force", "vehicle_acceleration")


@pytest.fixture(scope="module")
def of():
    return model("column", "winkler")


@pytest.fixture(scope="module")
def table(of):
    irregularity = [corrugation(0.5e-3, run) for run in range(COUNT)]
    return Runs(speed=np.linspace(45.0, 55.0, COUNT), irregularity=irregularity, start=4.0)


DURATION = 0.004 + 1e-4 * np.arange(COUNT)


@pytest.fixture(scope="module")
def everything(of, table):
    return simulate(of, table, DURATION, save=SaveAt(of.step, CHANNELS), threads=1)


@pytest.mark.parametrize("chosen", [(COUNT - 2, 2), (0,), (LANES + 1, LANES, 5), tuple(range(COUNT))])
@pytest.mark.parametrize("chunk", [7, None])
def test_the_histories_of_some_runs_are_those_of_a_simulation_that_saves_all(of, table, everything, chosen, chunk):
    pieces = []
    save = SaveAt(of.step, CHANNELS, runs=chosen)
    result = simulate(of, table, DURATION, save=save, follow=pieces.append, threads=1, chunk=chunk)
    assert result.summary.equals(everything.summary)
    assert result.separations.equals(everything.separations)
    for name in CHANNELS:
        expected = everything.channels[name][list(chosen), : result.channels[name].shape[1]]
        np.testing.assert_array_equal(result.channels[name], expected)
        for run, history in zip(chosen, result.channels[name], strict=True):
            mine = [piece.channels[name][piece.runs.index(run)] for piece in pieces]
            told = np.concatenate(mine)[: len(history)]
            np.testing.assert_array_equal(told, history[: len(told)])
            assert np.isnan(history[len(told) :]).all()
    firsts = [piece.first for piece in pieces]
    assert firsts[0] == 0
    assert firsts == sorted(set(firsts))


def test_pieces_of_a_batch_that_memory_cuts_in_two_are_of_the_runs_that_are_stepped(of, table, everything):
    pieces = []
    save = SaveAt(of.step, ("contact_force",), runs=(0, 18))
    simulate(of, table, DURATION, save=save, follow=pieces.append, threads=1, memory=1.0)
    assert {piece.runs for piece in pieces} == {(0,), (18,)}
    for run in (0, 18):
        told = np.concatenate([piece.channels["contact_force"][0] for piece in pieces if piece.runs == (run,)])
        np.testing.assert_array_equal(told, everything.contact_force[run, : len(told)])


def test_the_blocks_of_chosen_runs_come_first_and_no_block_is_taken_apart():
    seat = seats(["slow"] * (2 * LANES) + ["fast"] * (LANES + 3))
    moved = blocks_first(seat, [LANES + 1, 2 * LANES + 5])
    assert moved[LANES + 1] // LANES == 0
    assert moved[2 * LANES + 5] // LANES == 1
    together = seat[:, None] // LANES == seat // LANES
    np.testing.assert_array_equal(moved[:, None] // LANES == moved // LANES, together)
    np.testing.assert_array_equal(moved % LANES, seat % LANES)
    np.testing.assert_array_equal(blocks_first(seat, []), seat)


def test_histories_of_few_runs_need_room_for_few(of, table, monkeypatch):
    few, every = (SaveAt(of.step, runs=runs) for runs in ((3,), None))
    needs = Footprint.of(of, save=every, steps=80)
    room = COUNT * (needs.kept - needs.histories) + 2 * needs.histories
    monkeypatch.setattr("tbatch.engine.simulate.available_memory", lambda: room)
    with pytest.raises(MemoryError, match="histories"):
        simulate(of, table, DURATION, save=every, threads=1, memory=1e9)
    assert len(simulate(of, table, DURATION, save=few, threads=1, memory=1e9).contact_force) == 1


def test_runs_that_cannot_be_saved_are_refused(of, table):
    with pytest.raises(ValueError, match=rf"save\.runs: {COUNT} is not one of the {COUNT} runs"):
        simulate(of, table, DURATION, save=SaveAt(of.step, runs=(0, COUNT)), threads=1)
    with pytest.raises(ValueError, match="each run at most once"):
        SaveAt(of.step, runs=(3, 3))
