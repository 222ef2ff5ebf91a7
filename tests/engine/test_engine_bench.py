"""What `tbatch bench` prints: every figure that is asked for, counted and laid out right. No time is judged."""

import json

import pytest

from tbatch.engine.bench import scaling
from tbatch.engine.bench.baseline import track_operations
from tbatch.engine.bench.cases import seed_model
from tbatch.engine.bench.measure import measure
from tbatch.engine.bench.table import Table
from tbatch.engine.bench.timing import line_cost


def test_a_table_is_aligned_and_says_its_units():
    table = Table("dofs", ("track", "dofs", "us/run-step"))
    table.add("84 bays", 510, 1.36123)
    table.add("167 bays, 2 elements each", 2010, 12345.6)
    assert table.as_text().splitlines() == [
        "dofs",
        "----",
        "track                       dofs  us/run-step",
        "84 bays                      510        1.361",
        "167 bays, 2 elements each  2,010       12,346",
    ]
    assert table.as_json()[0] == {"track": "84 bays", "dofs": 510, "us/run-step": 1.36123}
    with pytest.raises(ValueError, match="2 values given for 3 columns"):
        table.add("84 bays", 510)


def test_the_operations_of_a_step_are_those_of_its_matrices():
    model = seed_model()
    factor = model.factor.factors[0]
    middle = model.track.node_count // 2

    def count(block):
        return int((abs(block) > 0.0).sum())

    # A node of the interior: the blocks of two sweeps, and of M and C with both neighbours, as the matrices have them.
    solve = count(factor.lower[middle]) + count(factor.pivot[middle]) + count(factor.back[middle])
    products = sum(
        count(matrix.diagonal[middle]) + count(matrix.lower[middle]) + count(matrix.lower[middle + 1])
        for matrix in (model.track.mass, model.track.damping)
    )
    assert track_operations(model.factor.pattern, 168) == 2 * 2 * 168 * (solve + products)


@pytest.mark.slow
def test_all_tables_hold_what_they_promise(monkeypatch):
    # Small enough for a test; what is timed here means nothing.
    parts = {name: getattr(scaling, name) for name in ("lanes_threads_sizes", "batch_sizes", "speeds", "lines")}
    monkeypatch.setattr(
        scaling,
        "lanes_threads_sizes",
        lambda runs, threads: parts["lanes_threads_sizes"](runs, threads, lanes=(16,), bays=(84, 167)),
    )
    monkeypatch.setattr(scaling, "batch_sizes", lambda model: parts["batch_sizes"](model, (16, 32)))
    monkeypatch.setattr(scaling, "speeds", lambda model, runs: parts["speeds"](model, runs, (1, 2)))
    monkeypatch.setattr(scaling, "lines", lambda: parts["lines"]((0.02, 0.05)))
    said = []
    tables = {table.title: table for table in measure(runs=32, threads=2, progress=said.append)}
    assert list(tables) == [
        "machine", "seed model 2, 32 runs", "lanes, threads and sizes", "runs", "dofs", "speeds", "tracks and steps",
        "endless line",
    ]  # fmt: skip
    figures = {row[0]: row[1] for row in tables["seed model 2, 32 runs"].rows}
    for word in ("one run [us", "64 right-hand sides", "ratio", "GFLOP/s", "first compilation", "cache", "kB/run"):
        assert any(word in name for name in figures), word
    assert figures["ratio to the baseline, per core"] == pytest.approx(
        figures["SciPy baseline, one run [us/run-step]"] / figures["batch engine, 1 thread [us/run-step]"]
    )
    assert [row[:3] for row in tables["lanes, threads and sizes"].rows] == [
        (16, 1, 84), (16, 2, 84), (16, 1, 167), (16, 2, 167)
    ]  # fmt: skip
    assert json.loads(json.dumps({title: table.as_json() for title, table in tables.items()}))
    assert said


@pytest.mark.slow
def test_a_longer_endless_line_takes_no_more_memory():
    memory = [line_cost(metres, 16)[1] for metres in (400.0, 1600.0)]
    assert memory[1] < 1.05 * memory[0]
