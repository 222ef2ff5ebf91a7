"""Row numbers of the lane memory: where each quantity of a run stands.

A block holds `LANES` runs side by side. All that belongs to a run stands in two arrays: real numbers in
`memory[block, row, lane]`, whole numbers in `marks[block, row, lane]`. This module alone says which row is what.
"""

import os
from dataclasses import dataclass, fields

LANES_VARIABLE = "TBATCH_LANES"
"""Environment variable that `tbatch bench` sets to time other numbers of lanes; results do not depend on it."""
LANES = int(os.environ.get(LANES_VARIABLE, "16"))
"""Runs a block: two 512-bit vectors of f64, so that one coefficient loaded serves two products."""

if LANES not in (8, 16, 32):
    raise ValueError(f"{LANES_VARIABLE} = {LANES}: accepted are 8, 16 and 32")


@dataclass(frozen=True)
class MemoryRows:
    """First row of each group in `memory`; `n` vehicle dofs, `w` wheels. Hashable: it selects a compiled kernel."""

    dofs: int
    """Vehicle dofs n; not a row."""
    wheels: int
    """Wheels w; not a row."""

    # constant during a run: the vehicle
    stiffness: int
    """-2 K [N/m], n x n rows, row by row."""
    mass: int
    """M [kg], n x n rows."""
    damping: int
    """-C [N s/m], n x n rows."""
    inverse: int
    """K̂⁻¹ [m/N], n x n rows for each rate."""
    # constant during a run: its course
    speed: int
    """Speed [m/s]."""
    start: int
    """Position of wheel 1 at t = 0 [m]."""
    end: int
    """Number of steps of the run, as a real number."""
    evaluate_from: int
    """Position beyond which a wheel's statistics count [m]."""
    circumference: int
    """Rolling circumference of the wheels [m]; 1 where unused."""
    # constant during a run: contact, a row a wheel
    hertz: int
    """1 for the 3/2 power, 0 for a linear law; one row."""
    offset: int
    """Distance behind wheel 1 [m]."""
    contact_stiffness: int
    """k [N/m or N/m^1.5]."""
    separation: int
    """δ_sep [m]: F = k max(δ - δ_sep, 0)^(1 or 3/2)."""
    approach: int
    """δ₀ [m] at rest on a rigid rail."""
    load: int
    """P₀ [N] at rest on a rigid rail."""
    # state
    active: int
    """1 while the run is stepped, 0 once it has ended or diverged."""
    displacement: int
    """Vehicle q [m, rad] from rest; between the substeps c₁q₀ + c₂q₁."""
    velocity: int
    """Vehicle q̇ [m/s, rad/s]."""
    vehicle_load: int
    """Right-hand side of the vehicle's next solve [N], without contact forces yet unknown."""
    force: int
    """Contact force F [N] of the last substep, a row a wheel."""
    shape: int
    """Hermite values N of the rail element under each wheel, 4 rows a wheel."""
    position: int
    """Where the separation in hand began [m], a row a wheel."""
    gap: int
    """Its largest gap so far [m]."""
    landing: int
    """Its largest landing force so far [N]."""
    # scratch
    local: int
    """Local coordinate of each wheel on its element [-]."""
    level: int
    """r_j [m]: irregularity and wheel profile under each wheel."""
    rail: int
    """N u [m] under each wheel without the contact forces of the substep."""
    overlap: int
    """δ [m] of each wheel."""
    acceleration: int
    """c₁v₀ + c₂v₁ + c₃(c₁q₀ + c₂q₁), negative; n rows."""
    flexibility: int
    """H [m/N], w x w rows."""
    newton: int
    """Work space of the contact solve: `newton_rows(w)` rows."""
    outputs: int
    """First row of what follows: accumulators, then probes; their number is not known at compile time."""

    @classmethod
    def of(cls, dofs: int, wheels: int, rates: int) -> "MemoryRows":
        """Lay out the rows for a vehicle with `dofs` dofs and `wheels` wheels, K̂ having `rates` distinct rates."""
        square = dofs * dofs
        size = dict.fromkeys((field.name for field in fields(cls)), wheels)
        size |= dict.fromkeys(("stiffness", "mass", "damping"), square)
        size |= {"inverse": rates * square}
        size |= dict.fromkeys(("speed", "start", "end", "evaluate_from", "circumference", "hertz", "active"), 1)
        size |= dict.fromkeys(("displacement", "velocity", "vehicle_load", "acceleration"), dofs)
        size |= {"shape": 4 * wheels, "flexibility": wheels * wheels, "newton": newton_rows(wheels)}
        first, row = {}, 0
        for name in list(size)[2:]:
            first[name] = row
            row += size[name]
        return cls(dofs=dofs, wheels=wheels, **first)


def newton_rows(wheels: int) -> int:
    """Rows of work space that the contact solve needs for `wheels` wheels."""
    return 12 * wheels + wheels * wheels


@dataclass(frozen=True)
class MarkRows:
    """First row of each group in `marks` (int32)."""

    status: int = 0
    """0 ok, 1 diverged."""
    steps: int = 1
    """Steps completed."""
    profile: int = 2
    """First segment of the run's irregularity, then its number of segments."""
    passed: int = 4
    """Periods of an endless track that the line has moved."""
    wheels: int = 5
    """First of `PER_WHEEL` rows for each wheel, in the order of the constants below."""

    @classmethod
    def total(cls, wheels: int, counters: int) -> int:
        """Rows needed for `wheels` wheels with `counters` rows of whole-number statistics each."""
        return cls.wheels + wheels * (PER_WHEEL + counters)


MARKS = MarkRows()

# Rows of one wheel in `marks`, from MARKS.wheels + PER_WHEEL * wheel.
ELEMENT = 0
"""Rail element under the wheel."""
PROFILE_FIRST = 1
"""First segment of the wheel's own profile."""
PROFILE_COUNT = 2
"""Number of its segments; 0 for a round wheel."""
OPENED = 3
"""Step at which the separation in hand began; -1 if there is none."""
CLOSED = 4
"""Step at which it ended, while its landing is being watched; -1 before."""
CENSORED = 5
"""1 if it was open when the wheel's evaluation began."""
EVALUATED = 6
"""1 once the wheel's evaluation has begun."""
SEPARATED = 7
"""1 if the wheel was separated at the end of the last step."""
EVENTS = 8
"""Separations written since the host last emptied the log."""
PER_WHEEL = 9

# Columns of one separation in the event log.
EVENT_START, EVENT_END, EVENT_POSITION, EVENT_GAP, EVENT_LANDING, EVENT_CENSORED = range(6)
EVENT_COLUMNS = 6

# Channels of a sample, in the order of `sample_rows`.
FORCE, VEHICLE, VEHICLE_ACCELERATION, LEVEL, PROBE, PROBE_ACCELERATION, UNDER_WHEEL = range(7)
LAYERS = ("rail", "slab", "base")
"""Layers of a track from above, in the order of a node's rows: (w, θ) of each. UNDER_WHEEL is the first of theirs."""
CHANNELS = UNDER_WHEEL + len(LAYERS)
