"""The wheels of one run on the rail: where they are, what lies under them, how far the rail gives."""

import taichi as ti

from tbatch.engine.rows import ELEMENT, MARKS, PER_WHEEL, PROFILE_COUNT, PROFILE_FIRST

Four = ti.types.vector(4, ti.f64)


@ti.func
def profile_value(
    segment_real: ti.template(), segment_whole: ti.template(), coefficients: ti.template(), first, count, x
):
    """Value at x of a piecewise-uniform cubic B-spline (`tbatch.physics.profile.Profile`)."""
    low = first
    high = first + count
    while high - low > 1:
        middle = (low + high) // 2
        if segment_real[middle, 0] <= x:
            low = middle
        else:
            high = middle
    t = (x - segment_real[low, 0]) * segment_real[low, 1]
    i = ti.min(ti.max(int(ti.floor(t)), 0), segment_whole[low, 1] - 1)
    w = ti.min(ti.max(t - i, 0.0), 1.0)
    o = 1.0 - w
    c = segment_whole[low, 0] + i
    b0 = o * o * o / 6.0
    b1 = (3.0 * w * w * w - 6.0 * w * w + 4.0) / 6.0
    b2 = (3.0 * o * o * o - 6.0 * o * o + 4.0) / 6.0
    b3 = w * w * w / 6.0
    return coefficients[c] * b0 + coefficients[c + 1] * b1 + coefficients[c + 2] * b2 + coefficients[c + 3] * b3


@ti.func
def rail_row(pattern: ti.template(), rail_rows: ti.template(), node):
    """First of the two rows of a rail node."""
    row = node * pattern.dofs
    if ti.static(pattern.sparse):
        row = rail_rows[node]
    return row


@ti.func
def place_wheels(
    at: ti.template(), pattern: ti.template(), memory: ti.template(), marks: ti.template(), b, lane, time,
    element_length, elements, period, rail_x: ti.template(),
):  # fmt: skip
    """Element and shape values under each wheel of one run."""
    front = memory[b, at.start][lane] + memory[b, at.speed][lane] * time
    for j in range(at.wheels):
        x = front - memory[b, at.offset + j][lane]
        if ti.static(pattern.sparse):
            element = 0
            beyond = elements
            while beyond - element > 1:
                middle = (element + beyond) // 2
                if rail_x[middle] <= x:
                    element = middle
                else:
                    beyond = middle
            length = rail_x[element + 1] - rail_x[element]
            s = (x - rail_x[element]) / length
            put_shape(at, pattern, memory, marks, b, lane, j, element, s, length)
        else:
            scaled = (x - ti.cast(marks[b, MARKS.passed, lane], ti.f64) * period) / element_length
            element = ti.min(ti.max(int(ti.floor(scaled)), 0), elements - 1)
            put_shape(at, pattern, memory, marks, b, lane, j, element, scaled - element, element_length)


@ti.func
def put_shape(
    at: ti.template(), pattern: ti.template(), memory: ti.template(), marks: ti.template(), b, lane, j, element, s,
    length,
):  # fmt: skip
    """Write where one wheel stands: its element, the local coordinate, the shape values."""
    marks[b, MARKS.wheels + PER_WHEEL * j + ELEMENT, lane] = element
    memory[b, at.local + j][lane] = s
    if ti.static(pattern.linear):
        memory[b, at.shape + 4 * j][lane] = 1.0 - s
        memory[b, at.shape + 4 * j + 1][lane] = 0.0
        memory[b, at.shape + 4 * j + 2][lane] = s
        memory[b, at.shape + 4 * j + 3][lane] = 0.0
    else:
        memory[b, at.shape + 4 * j][lane] = 1.0 - s * s * (3.0 - 2.0 * s)
        memory[b, at.shape + 4 * j + 1][lane] = length * (s * (1.0 - s) * (1.0 - s))
        memory[b, at.shape + 4 * j + 2][lane] = s * s * (3.0 - 2.0 * s)
        memory[b, at.shape + 4 * j + 3][lane] = length * (s * s * (s - 1.0))


@ti.func
def find_levels(
    at: ti.template(), memory: ti.template(), marks: ti.template(), b, lane, time,
    segment_real: ti.template(), segment_whole: ti.template(), coefficients: ti.template(),
):  # fmt: skip
    """Level r_j under each wheel of one run: the rail's irregularity and the wheel's own profile."""
    rolled = memory[b, at.speed][lane] * time
    front = memory[b, at.start][lane] + rolled
    for j in range(at.wheels):
        mark = MARKS.wheels + PER_WHEEL * j
        r = profile_value(
            segment_real, segment_whole, coefficients,
            marks[b, MARKS.profile, lane], marks[b, MARKS.profile + 1, lane], front - memory[b, at.offset + j][lane],
        )  # fmt: skip
        if marks[b, mark + PROFILE_COUNT, lane] > 0:
            turns = ti.floor(rolled / memory[b, at.circumference][lane])
            r = r + profile_value(
                segment_real, segment_whole, coefficients,
                marks[b, mark + PROFILE_FIRST, lane], marks[b, mark + PROFILE_COUNT, lane],
                rolled - turns * memory[b, at.circumference][lane],
            )  # fmt: skip
        memory[b, at.level + j][lane] = r


@ti.func
def rail_value(
    at: ti.template(), pattern: ti.template(), memory: ti.template(), marks: ti.template(), rail_rows: ti.template(),
    vector: ti.template(), b, lane, j, below,
):  # fmt: skip
    """N times the dofs of `vector` under wheel j of one run: the rail's, or those `below` rows after them."""
    element = marks[b, MARKS.wheels + PER_WHEEL * j + ELEMENT, lane]
    row = rail_row(pattern, rail_rows, element) + below
    far = rail_row(pattern, rail_rows, element + 1) + below
    n = at.shape + 4 * j
    return (memory[b, n][lane] * vector[b, row][lane] + memory[b, n + 1][lane] * vector[b, row + 1][lane]) + (
        memory[b, n + 2][lane] * vector[b, far][lane] + memory[b, n + 3][lane] * vector[b, far + 1][lane]
    )


@ti.func
def push_rail(
    at: ti.template(), pattern: ti.template(), memory: ti.template(), marks: ti.template(), rail_rows: ti.template(),
    load: ti.template(), b, lane,
):  # fmt: skip
    """Add Nᵀ F to the track's load of one run."""
    for j in range(at.wheels):
        element = marks[b, MARKS.wheels + PER_WHEEL * j + ELEMENT, lane]
        row = rail_row(pattern, rail_rows, element)
        far = rail_row(pattern, rail_rows, element + 1)
        n = at.shape + 4 * j
        force = memory[b, at.force + j][lane]
        load[b, row][lane] = load[b, row][lane] + memory[b, n][lane] * force
        load[b, row + 1][lane] = load[b, row + 1][lane] + memory[b, n + 1][lane] * force
        load[b, far][lane] = load[b, far][lane] + memory[b, n + 2][lane] * force
        load[b, far + 1][lane] = load[b, far + 1][lane] + memory[b, n + 3][lane] * force


@ti.func
def gather_rail(
    at: ti.template(), pattern: ti.template(), memory: ti.template(), marks: ti.template(), columns: ti.template(),
    element_class: ti.template(), window_start: ti.template(), near: ti.template(), load: ti.template(), rate, b, lane,
    j,
):  # fmt: skip
    """N K̂⁻¹ load under wheel j of one run: where the rail would be without the new contact forces."""
    element = marks[b, MARKS.wheels + PER_WHEEL * j + ELEMENT, lane]
    kind = element_class[element]
    first = window_start[element]
    y = Four(0.0)
    if ti.static(pattern.sparse):
        odd = Four(0.0)
        for pair in range(columns.shape[2] // 2):
            place = 2 * pair
            y = y + columns[rate, kind, place] * load[b, near[element, place]][lane]
            odd = odd + columns[rate, kind, place + 1] * load[b, near[element, place + 1]][lane]
        y = y + odd
    else:
        sums = [Four(0.0) for _ in ti.static(range(pattern.dofs // 2))]
        for node in range(columns.shape[2] // pattern.dofs):
            for r in ti.static(range(pattern.dofs)):
                sums[r % (pattern.dofs // 2)] = (
                    sums[r % (pattern.dofs // 2)]
                    + columns[rate, kind, node * pattern.dofs + r] * load[b, first + node * pattern.dofs + r][lane]
                )
        y = sums[0]
        for chain in ti.static(range(1, pattern.dofs // 2)):
            y = y + sums[chain]
    n = at.shape + 4 * j
    return (memory[b, n][lane] * y[0] + memory[b, n + 1][lane] * y[1]) + (
        memory[b, n + 2][lane] * y[2] + memory[b, n + 3][lane] * y[3]
    )


@ti.func
def rail_flexibility(
    at: ti.template(), pattern: ti.template(), memory: ti.template(), marks: ti.template(), columns: ti.template(),
    element_class: ti.template(), window_start: ti.template(), rail_places, rate, b, lane, i, j,
):  # fmt: skip
    """N_i K̂⁻¹ N_jᵀ of one run; zero where wheel j stands outside the window of wheel i's element.

    Of the places near an element of an imported track, those of the rail come first, two a node.
    """
    element = marks[b, MARKS.wheels + PER_WHEEL * i + ELEMENT, lane]
    node = marks[b, MARKS.wheels + PER_WHEEL * j + ELEMENT, lane]
    stride = ti.static(2 if pattern.sparse else pattern.dofs)
    places = columns.shape[2]
    if ti.static(pattern.sparse):
        places = rail_places
    other = node * stride - window_start[element]
    kind = element_class[element]
    total = 0.0
    if other >= 0 and other + stride + 1 < places:
        n = at.shape + 4 * i
        for part in range(4):
            g = columns[rate, kind, other + (part // 2) * stride + part % 2]
            total = total + memory[b, at.shape + 4 * j + part][lane] * (
                (memory[b, n][lane] * g[0] + memory[b, n + 1][lane] * g[1])
                + (memory[b, n + 2][lane] * g[2] + memory[b, n + 3][lane] * g[3])
            )
    return total


@ti.func
def local_compliance(
    at: ti.template(), pattern: ti.template(), memory: ti.template(), marks: ti.template(), rail_x: ti.template(),
    b, lane, element_length, compliance, i, j,
):  # fmt: skip
    """Deflection at wheel i by a unit force at wheel j of the fixed-fixed element both stand on, else zero [m/N].

    b²x²(3aℓ - x(3a + b))/(6EIℓ³) for x <= a, b = ℓ - a; `compliance` is 1/(6EIℓ³), for an imported track
    without the ℓ³.
    """
    total = 0.0
    element = marks[b, MARKS.wheels + PER_WHEEL * i + ELEMENT, lane]
    if element == marks[b, MARKS.wheels + PER_WHEEL * j + ELEMENT, lane]:
        length = element_length
        factor = compliance
        if ti.static(pattern.sparse):
            length = rail_x[element + 1] - rail_x[element]
            factor = compliance / (length * length * length)
        si = memory[b, at.local + i][lane]
        sj = memory[b, at.local + j][lane]
        x = length * ti.min(si, sj)
        a = length * ti.max(si, sj)
        c = length - a
        total = factor * (c * c * x * x * (3.0 * a * length - x * (3.0 * a + c)))
    return total
