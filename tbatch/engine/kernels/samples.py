"""Samples of the histories, written to a buffer that the host empties after each chunk.

`sample_rows` holds the first row of each channel in a sample, or -1: contact force, vehicle, vehicle acceleration,
level under each wheel, probes, probe accelerations, the layers of the track under each wheel. A probe is a point of a
layer of the track: two rows of the track's state (its two nodes) and four Hermite values.
"""

import taichi as ti

from tbatch.engine.kernels.lockstep import rail_value_lockstep
from tbatch.engine.kernels.wheels import rail_value
from tbatch.engine.rows import (
    CHANNELS,
    FORCE,
    LANES,
    LEVEL,
    PROBE,
    PROBE_ACCELERATION,
    UNDER_WHEEL,
    VEHICLE,
    VEHICLE_ACCELERATION,
)


@ti.func
def probe_value(vector: ti.template(), probe_rows: ti.template(), probe_shape: ti.template(), b, probe):
    """A probe's value from a track vector, all lanes."""
    near, far = probe_rows[probe, 0], probe_rows[probe, 1]
    return (probe_shape[probe, 0] * vector[b, near] + probe_shape[probe, 1] * vector[b, near + 1]) + (
        probe_shape[probe, 2] * vector[b, far] + probe_shape[probe, 3] * vector[b, far + 1]
    )


@ti.func
def begin_probes(
    memory: ti.template(), probe_rows: ti.template(), probe_shape: ti.template(), displacement: ti.template(),
    velocity: ti.template(), b, first,
):  # fmt: skip
    """Before the step: u₀ and v₀ of each probe, for its acceleration."""
    for probe in range(probe_rows.shape[0]):
        memory[b, first + 2 * probe] = probe_value(displacement, probe_rows, probe_shape, b, probe)
        memory[b, first + 2 * probe + 1] = probe_value(velocity, probe_rows, probe_shape, b, probe)


@ti.func
def middle_probes(
    memory: ti.template(), probe_rows: ti.template(), probe_shape: ti.template(), displacement: ti.template(), b,
    first, scheme: ti.template(),
):  # fmt: skip
    """Between the substeps, `displacement` holding w = c₁u₀ + c₂u₁: c₁v₀ + c₂v₁ of each probe, in place of v₀."""
    for probe in range(probe_rows.shape[0]):
        w = probe_value(displacement, probe_rows, probe_shape, b, probe)
        d = (w + scheme[2] * memory[b, first + 2 * probe]) / scheme[1]
        v0 = memory[b, first + 2 * probe + 1]
        memory[b, first + 2 * probe + 1] = scheme[0] * v0 + scheme[1] * (scheme[3] * d - v0)


@ti.func
def write_sample(
    at: ti.template(), memory: ti.template(), sample_rows: ti.template(), samples: ti.template(),
    probe_rows: ti.template(), probe_shape: ti.template(), displacement: ti.template(), velocity: ti.template(),
    b, slot, first, scheme: ti.template(),
):  # fmt: skip
    """After the step: every channel that is asked for, all lanes."""
    for j in range(at.wheels):
        if sample_rows[FORCE] >= 0:
            samples[b, slot, sample_rows[FORCE] + j] = memory[b, at.force + j]
        if sample_rows[LEVEL] >= 0:
            samples[b, slot, sample_rows[LEVEL] + j] = memory[b, at.level + j]
    for r in range(at.dofs):
        if sample_rows[VEHICLE] >= 0:
            samples[b, slot, sample_rows[VEHICLE] + r] = memory[b, at.displacement + r]
        if sample_rows[VEHICLE_ACCELERATION] >= 0:
            samples[b, slot, sample_rows[VEHICLE_ACCELERATION] + r] = memory[b, at.acceleration + r]
    for probe in range(probe_rows.shape[0]):
        if sample_rows[PROBE] >= 0:
            u = probe_value(displacement, probe_rows, probe_shape, b, probe)
            samples[b, slot, sample_rows[PROBE] + probe] = u
        if sample_rows[PROBE_ACCELERATION] >= 0:
            v = probe_value(velocity, probe_rows, probe_shape, b, probe)
            samples[b, slot, sample_rows[PROBE_ACCELERATION] + probe] = memory[b, first + 2 * probe + 1] + scheme[2] * v


@ti.func
def write_under_wheels(
    at: ti.template(), pattern: ti.template(), memory: ti.template(), marks: ti.template(), lockstep: ti.template(),
    rail_rows: ti.template(), sample_rows: ti.template(), samples: ti.template(), displacement: ti.template(), b, slot,
):  # fmt: skip
    """After the step: N u under every wheel, for each layer that is asked for."""
    for channel in range(UNDER_WHEEL, CHANNELS):
        if sample_rows[channel] >= 0:
            below = 2 * (channel - UNDER_WHEEL)
            for j in range(at.wheels):
                row = sample_rows[channel] + j
                if lockstep[b] == 1:
                    samples[b, slot, row] = rail_value_lockstep(
                        at, pattern, memory, marks, rail_rows, displacement, b, j, below
                    )
                else:
                    for lane in range(LANES):
                        samples[b, slot, row][lane] = rail_value(
                            at, pattern, memory, marks, rail_rows, displacement, b, lane, j, below
                        )
