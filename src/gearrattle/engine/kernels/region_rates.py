"""Stages of ``region_stages``: the rates of a region over z and over y, and the effect of the inputs split off.

The arrays are those of ``workspace``.
"""

from __future__ import annotations

from gearrattle.engine.kernels._jit import strict
from gearrattle.engine.kernels.dense import TOP, copy_rows, times
from gearrattle.engine.kernels.memory_addresses import auxiliaries_at, common_at, free_at, laws_at, modes_at, region_at
from gearrattle.engine.kernels.strips import differentiate
from gearrattle.engine.kernels.workspace import CHAIN_PACE, PERIOD


@strict
def _add_auxiliary(common, laws, auxiliaries, region, c, width):
    """Add the force of auxiliary c to the force of its element, and write the rate of its memory."""
    at = common.rows.shape[0] + c
    k = auxiliaries.element[c]
    piece = laws.first[at] + region.pieces[at]
    memory = auxiliaries.state[c]
    stiffness = laws.stiffness[piece]
    damping = laws.damping[piece]
    scale = auxiliaries.scale[c]
    for j in range(width):
        region.force[k, j] += stiffness * common.deflection[k, j] + damping * common.rate[k, j]
    region.force[k, region.matrix.shape[0]] += laws.offset[piece]
    if memory >= 0:
        region.force[k, memory] += auxiliaries.by_memory[piece] / scale
        pace = auxiliaries.moves[piece] * common.limits[PERIOD] * scale
        for j in range(width):
            region.matrix[memory, j] = pace * common.rate[k, j]


@strict
def accelerate(workspace):
    """Write forces, accelerations and the rates of the states as rows over z; return False if one is not finite."""
    common = common_at(workspace)
    laws = laws_at(workspace)
    auxiliaries = auxiliaries_at(workspace)
    region = region_at(workspace)
    m = common.rows.shape[0]
    n = common.inertia.size
    states = region.matrix.shape[0]
    width = region.matrix.shape[1]
    r = common.motion.shape[0]
    finite = True
    # forces of the elements in their pieces, with the forces of the auxiliaries
    for k in range(m):
        piece = laws.first[k] + region.pieces[k]
        stiffness = laws.stiffness[piece]
        damping = laws.damping[piece]
        for j in range(width):
            region.force[k, j] = stiffness * common.deflection[k, j] + damping * common.rate[k, j]
        region.force[k, states] += laws.offset[piece]
    for c in range(auxiliaries.element.size):
        _add_auxiliary(common, laws, auxiliaries, region, c, width)
    # balance of torques: accelerations, and the rates of deflections and velocities
    for j in range(width):
        for i in range(r):
            region.matrix[i, j] = common.motion[i, j]
        for i in range(n):
            total = common.balance[i, j]
            for k in range(m):
                total -= common.rows[k, i] * region.force[k, j]
            region.acceleration[i, j] = total / common.inertia[i]
            region.matrix[r + i, j] = common.pace[i] * region.acceleration[i, j]
            finite = finite and abs(region.matrix[r + i, j]) < 1e300
    return finite


@strict
def look(workspace):
    """Write the rates of the carried quantities, and the watched quantities, as rows over z."""
    common = common_at(workspace)
    laws = laws_at(workspace)
    auxiliaries = auxiliaries_at(workspace)
    region = region_at(workspace)
    n = common.inertia.size
    clearances = common.clearances.size
    watched = common.corner_scale.size
    references = common.references.shape[0]
    period = common.limits[PERIOD]
    width = region.matrix.shape[1]
    # carried quantities: angles of the reference inertias, time integrals of the clearances' forces
    copy_rows(common.references, TOP, references, width, region.carried)
    for k in range(clearances):
        element = common.clearances[k]
        unit = period * period / common.corner_scale[k]
        for j in range(width):
            region.carried[references + k, j] = period * region.force[element, j]
            # watched for a clearance: deflection, rate and second derivative over the corner scale
            region.watched[k, j] = common.seen[k, j]
            region.watched[watched + k, j] = common.seen[clearances + k, j]
            second = -common.curvature[k, j]
            for i in range(n):
                second += common.rows[element, i] * region.acceleration[i, j]
            region.watched[2 * watched + k, j] = second * unit
    # watched for the auxiliaries
    for c in range(auxiliaries.element.size):
        _watch(common, laws, auxiliaries, region, c, clearances + c)


@strict
def _watch(common, laws, auxiliaries, region, c, row):
    """Write the watched quantity of auxiliary c; its derivatives follow from the rates of y."""
    at = common.rows.shape[0] + c
    k = auxiliaries.element[c]
    memory = auxiliaries.state[c]
    piece = laws.first[at] + region.pieces[at]
    unit = 1.0 / common.corner_scale[row]
    of_deflection = auxiliaries.by_deflection[piece] * unit
    of_rate = auxiliaries.by_rate[piece] * unit
    for j in range(region.matrix.shape[1]):
        region.watched[row, j] = of_deflection * common.deflection[k, j] + of_rate * common.rate[k, j]
    if memory >= 0:
        region.watched[row, memory] += auxiliaries.by_itself[piece] * unit / auxiliaries.scale[c]


@strict
def _keep(common, region, free):
    """Write the entries of z that are in y, chains last, and the amplitudes of the kept inputs; return Y."""
    states = region.matrix.shape[0]
    count = common.frequency.size
    width = states
    # the states
    for i in range(states):
        free.column[i] = i
    # kept inputs: those whose particular solution would be larger than the motion
    for j in range(1 + 2 * count):
        if region.kept[j]:
            if j <= count:
                free.amplitude[width - states] = common.amplitude[j]
            free.column[width] = states + j
            width += 1
    # the signals' chains
    free.chained[0] = width
    for j in range(states + 1 + 2 * count, region.matrix.shape[1]):
        free.column[width] = j
        width += 1
    free.width[0] = width
    return width


@strict
def _take(rows, count, free, out, first):
    """Copy the columns of y from rows over z."""
    for i in range(count):
        for j in range(free.width[0]):
            out[first + i, j] = rows[i, free.column[j]]


@strict
def _force(region, rows, count, out):
    """Write the response of rows over z to the inputs split off: (count, U)."""
    states = region.matrix.shape[0]
    for i in range(count):
        for j in range(region.kept.size):
            total = 0.0 if region.kept[j] else rows[i, states + j]
            for q in range(states):
                total += rows[i, q] * region.particular[q, j]
            out[i, j] = total


@strict
def generate(workspace):
    """Write the rates of carried quantities, states and kept inputs, and the watched quantities, as rows over y."""
    common = common_at(workspace)
    region = region_at(workspace)
    free = free_at(workspace)
    states = region.matrix.shape[0]
    count = common.frequency.size
    watched = common.corner_scale.size
    clearances = common.clearances.size
    one = TOP + 1
    carried = region.carried.shape[0]
    width = _keep(common, region, free)
    # rows of the carried quantities and of the states, over y
    _take(region.carried, carried, free, free.rates, TOP)
    _take(region.matrix, states, free, free.rates, carried)
    # rows of chains and kept inputs: chains dq_j/ds = w q_(j+1), oscillators du/ds = S u
    for i in range(states, width):
        mine = free.column[i] - states
        for j in range(width):
            other = free.column[j] - states
            rate = 0.0
            if mine > 2 * count:
                last = (mine - 2 * count) % common.links[0] == 0
                rate = common.limits[CHAIN_PACE] if other == mine + 1 and not last else 0.0
            elif 0 < mine <= count and other == mine + count:
                rate = -common.frequency[mine - 1]
            elif mine > count and other == mine - count:
                rate = common.frequency[other - 1]
            free.rates[carried + i, j] = rate
    # watched quantities; every derivative is the row before times the generator
    copy_rows(free.rates, carried, width, width, free.generator)
    _take(region.watched, 3 * watched, free, free.watched, TOP)
    for i in range(clearances, watched):
        times(1.0, free.watched, i, free.generator, one, width, free.watched, watched + i)
        times(1.0, free.watched, watched + i, free.generator, one, width, free.watched, 2 * watched + i)
    times(1.0, free.watched, 2 * watched, free.generator, watched, width, free.watched, 3 * watched)


@strict
def split_off(workspace):
    """Write the response of the watched and of the carried quantities to the inputs split off."""
    common = common_at(workspace)
    region = region_at(workspace)
    count = common.frequency.size
    watched = common.corner_scale.size
    carried = region.carried.shape[0]
    # responses of the watched quantities, and their derivatives
    _force(region, region.watched, watched, region.forced)
    for i in range(3 * watched):
        differentiate(region.forced, i, common.frequency, 1.0, i + watched)
    # responses of the carried quantities: integrals of sines and cosines
    _force(region, region.carried, carried, region.flowing)
    for i in range(carried):
        region.integral[i, 0] = 0.0
        for h in range(count):
            w = common.frequency[h]
            region.integral[i, 1 + h] = -region.flowing[i, 1 + count + h] / w
            region.integral[i, 1 + count + h] = region.flowing[i, 1 + h] / w


@strict
def transpose_states(workspace, turn):
    """Write A as LAPACK reads it, transposed, with the order of its states rotated by ``turn``."""
    region = region_at(workspace)
    modes = modes_at(workspace)
    n = region.matrix.shape[0]
    for i in range(n):
        for j in range(n):
            modes.schur[(j + turn) % n, (i + turn) % n] = region.matrix[i, j]


@strict
def turn_back(workspace, turn):
    """Undo the rotation in the Schur vectors; V^-1, which is not written yet, serves as scratch."""
    modes = modes_at(workspace)
    n = modes.basis.shape[0]
    for i in range(n):
        for j in range(n):
            modes.left[0, j] = modes.basis[i, (j + turn) % n]
        for j in range(n):
            modes.basis[i, j] = modes.left[0, j]
