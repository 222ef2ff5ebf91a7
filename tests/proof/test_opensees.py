"""OpenSees' TRBDF2 integrator on the same model: the two-step scheme with the splitting 1/2 by another code.

A wheel column stands at mid-span of a simply supported beam that is straight at t = 0 and gives way under it. The beam
is OpenSees' own elements with consistent mass, the contact a spring that stays closed. Skipped where OpenSeesPy is not
installed or does not load.
"""

from typing import Any

import numpy as np
import pytest

import tbatch as tb

ELEMENTS, LENGTH, EI, LINE_MASS = 8, 20.0, 2e9, 2000.0
STEP, STEPS, CONTACT = 1e-3, 200, 1.2e9


@pytest.fixture(scope="module")
def opensees() -> Any:
    """The module, loaded."""
    try:
        import openseespy.opensees as module
    except Exception as error:  # it raises RuntimeError where a system library is missing
        pytest.skip(f"OpenSeesPy does not load: {error}")
    return module


def by_opensees(ops: Any, column: tb.Vehicle, load: float, beam_acceleration: np.ndarray) -> np.ndarray:
    """Displacements of carbody, bogie, wheel and mid-span from the same start, shape (time, 4)."""
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    for node in range(ELEMENTS + 1):
        ops.node(node, node * LENGTH / ELEMENTS, 0.0)
        ops.fix(node, 1, int(node in (0, ELEMENTS)), 0)
    ops.geomTransf("Linear", 1)
    for element in range(ELEMENTS):
        ops.element("elasticBeamColumn", element, element, element + 1, 1.0, 1.0, EI, 1, "-mass", LINE_MASS, "-cMass")
    middle = ELEMENTS // 2
    bodies = [100, 101, 102]
    for node, mass in zip(bodies, np.diag(column.mass), strict=True):
        ops.node(node, middle * LENGTH / ELEMENTS, 0.0)
        ops.fix(node, 1, 0, 1)
        ops.mass(node, 0.0, float(mass), 0.0)
    springs = [
        (100, 101, -column.stiffness[0, 1], -column.damping[0, 1]),
        (101, 102, -column.stiffness[1, 2], -column.damping[1, 2]),
        (102, middle, CONTACT, 0.0),
    ]
    for tag, (upper, lower, stiffness, damping) in enumerate(springs, start=200):
        ops.uniaxialMaterial("Elastic", tag, float(stiffness), float(damping))
        ops.element("zeroLength", tag, lower, upper, "-mat", tag, "-dir", 2)
    # The vehicle's weight is in balance with the static contact force; the beam feels that force from t = 0 on.
    ops.timeSeries("Constant", 1)
    ops.pattern("Plain", 1, 1)
    ops.load(middle, 0.0, load, 0.0)
    for node, (vertical, rotation) in enumerate(beam_acceleration):
        ops.setNodeAccel(node, 2, float(vertical), "-commit")
        ops.setNodeAccel(node, 3, float(rotation), "-commit")
    ops.constraints("Plain")
    ops.numberer("Plain")
    ops.system("BandGeneral")
    ops.algorithm("Linear")
    ops.integrator("TRBDF2")
    ops.analysis("Transient")
    rows = [np.zeros(4)]
    for _ in range(STEPS):
        # Its steps alternate between the two substeps.
        assert ops.analyze(2, 0.5 * STEP) == 0
        rows.append(np.array([ops.nodeDisp(node, 2) for node in (*bodies, middle)]))
    return np.array(rows)


def test_trbdf2_of_opensees_is_the_two_step_scheme_split_in_half(opensees: Any) -> None:
    column = tb.Vehicle.column("koh-column")
    track = tb.Track.beam(length=LENGTH, elements=ELEMENTS, EI=EI, mass=LINE_MASS)
    contact = tb.Contact.linear(CONTACT)
    half = 0.5 * LENGTH
    given = {"speed": 0.0, "irregularity": None, "start": half, "duration": STEPS * STEP, "step": STEP,
             "initial": "rest", "save": tb.SaveAt(STEP, ("contact_force", "vehicle", "rail"), [half])}  # fmt: skip
    ours = tb.methods.two_step(column, track, contact, **given, splitting=0.5)
    assert ours.contact_force.min() > 0.0
    weight = 9.81 * float(np.trace(column.mass))
    free = track.free.ravel()
    push = np.zeros(len(free))
    push[ELEMENTS // 2 * 2] = weight
    start = np.zeros(len(free))
    start[free] = np.linalg.solve(track.mass.to_csc().toarray()[np.ix_(free, free)], push[free])
    theirs = by_opensees(opensees, column, weight, start.reshape(-1, 2))
    mine = np.hstack([ours.vehicle[0], ours.rail[0]])
    # The same scheme by two codes: round-off of 400 substeps.
    assert np.abs(mine - theirs).max() < 1e-8 * np.abs(theirs).max()
    # Another splitting is another scheme, by far more.
    other = tb.methods.two_step(column, track, contact, **given)
    assert np.abs(other.rail - ours.rail).max() > 1e-5 * np.abs(theirs).max()
