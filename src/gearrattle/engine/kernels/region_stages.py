"""The stages that build a region, in their order; every stage is compiled by itself.

Compiling all stages as one function takes half a minute; compiling them separately and calling them by their addresses
(``_jit.address_of``) takes a few seconds. A single run and many variants call the same machine code.

The result is one slot of ``march_arrays.Regions``.
"""

from __future__ import annotations

from functools import cache
from inspect import signature
from math import inf
from typing import Any, NamedTuple

import numpy as np

from gearrattle.engine.kernels import block_diagonal, deflection_bounds, particular_solutions, region_rates, strips
from gearrattle.engine.kernels._jit import address_of, compact, strict, strict_entry
from gearrattle.engine.kernels._llvm import call_code, call_count, call_real, call_silent, call_truth
from gearrattle.engine.kernels.march_arrays import BAND
from gearrattle.engine.kernels.memory_addresses import (
    bounds_at,
    common_at,
    free_at,
    lapack_at,
    laws_at,
    modes_at,
    region_at,
)
from gearrattle.engine.kernels.strips import step
from gearrattle.engine.kernels.workspace import (
    BUILT,
    LARGEST,
    LARGEST_STATE,
    NO_SCHUR_FORM,
    NOT_FINITE,
    POWERS,
)


class Stages(NamedTuple):
    """The stages, or once they are compiled, their addresses."""

    enter_stiffest_pieces: Any = particular_solutions.enter_stiffest_pieces
    accelerate: Any = region_rates.accelerate
    typical_size: Any = particular_solutions.typical_size
    look: Any = region_rates.look
    split_inputs: Any = particular_solutions.split_inputs
    generate: Any = region_rates.generate
    split_off: Any = region_rates.split_off
    transpose_states: Any = region_rates.transpose_states
    turn_back: Any = region_rates.turn_back
    triangular_form: Any = deflection_bounds.triangular_form
    block_diagonalise: Any = block_diagonal.block_diagonalise
    weigh: Any = deflection_bounds.weigh
    gather: Any = deflection_bounds.gather
    finish_bounds: Any = deflection_bounds.finish_bounds
    finest_level: Any = strips.finest_level
    fill: Any = strips.fill
    fill_in_turn: Any = strips.fill_in_turn
    fill_bounds: Any = strips.fill_bounds
    fill_tables: Any = strips.fill_tables
    fill_powers: Any = strips.fill_powers
    fill_series: Any = strips.fill_series
    fill_forced: Any = strips.fill_forced


@cache
def stages() -> Stages:
    """Compile all stages and return their addresses; the name of a parameter decides its type."""
    arguments: dict[str, Any] = {"workspace": np.zeros(1, np.int64), "rows": np.zeros((1, 1)), "h": 0.0}
    arguments |= dict.fromkeys(("stack", "tables", "powers", "series"), np.zeros((1, 1, 1, 4)))
    arguments |= dict.fromkeys(("a", "b", "turn", "carried", "slot", "index", "strip", "first", "count", "columns"), 0)
    return Stages(
        *(address_of(compact(stage), *(arguments[name] for name in signature(stage).parameters)) for stage in Stages())
    )


@strict_entry
def limit_states(stages, workspace):
    """Write the largest state of a particular solution that is split off; return the size of an ordinary motion."""
    call_silent(stages.enter_stiffest_pieces, (workspace,))
    call_truth(stages.accelerate, (workspace,))
    size = call_real(stages.typical_size, (workspace,))
    common_at(workspace).limits[LARGEST_STATE] = LARGEST * size
    return size


@strict
def _find_schur_form(stages, zgees, workspace):
    """Write A = basis @ schur @ basis^H, transposed; return False if LAPACK does not converge.

    For one regular matrix in some fifty thousand the iteration does not converge. Then the order of the states is
    rotated by one, up to a full turn, until the iteration converges.
    """
    lapack = lapack_at(workspace)
    region = region_at(workspace)
    p = lapack.arguments
    for turn in range(region.matrix.shape[0]):
        call_silent(stages.transpose_states, (workspace, turn))
        call_code(
            zgees, (p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11], p[12], p[13], p[14])
        )
        if lapack.integers[4] == 0:
            if turn > 0:
                call_silent(stages.turn_back, (workspace, turn))
            return True
    return False


@strict_entry
def build_region(stages, zgees, workspace):
    """Build the region of ``Region.pieces``, up to its tables; return BUILT, NOT_FINITE or NO_SCHUR_FORM."""
    # equations of motion in this region: A_r and G_r
    if not call_truth(stages.accelerate, (workspace,)):
        return NOT_FINITE
    call_silent(stages.look, (workspace,))
    # split off the inputs whose P_r u is not larger than the motion; keep the others as states
    call_silent(stages.split_inputs, (workspace,))
    call_silent(stages.generate, (workspace,))
    call_silent(stages.split_off, (workspace,))
    # Schur form of the rates, then invariant subspaces split as far as that is well-conditioned
    if not _find_schur_form(stages, zgees, workspace):
        return NO_SCHUR_FORM
    call_silent(stages.triangular_form, (workspace,))
    # the bound (B) on fourth derivatives: a weight for every block, and the fast modes
    begins = modes_at(workspace).begins
    for block in range(call_count(stages.block_diagonalise, (workspace,))):
        call_silent(stages.weigh, (workspace, begins[block], begins[block + 1]))
    call_silent(stages.gather, (workspace,))
    call_silent(stages.finish_bounds, (workspace,))
    # the finest step: its Taylor series of 20 terms represents every motion to rounding
    free_at(workspace).fine[0] = call_count(stages.finest_level, (workspace,))
    return BUILT


@strict
def pack_bounds(workspace, lower, upper, band, piece, neighbour):
    """Write the watched quantities of one slot: corners, rounding bands and pieces; no neighbour is built yet."""
    common = common_at(workspace)
    laws = laws_at(workspace)
    pieces = region_at(workspace).pieces
    clearances = common.clearances.size
    m = common.rows.shape[0]
    for i in range(common.corner_scale.size):
        member = common.clearances[i] if i < clearances else m + i - clearances
        # the corners of the piece, over the corner scale
        p = laws.first[member] + pieces[member]
        unit = common.corner_scale[i]
        lower[i] = laws.lower[p] / unit
        upper[i] = laws.upper[p] / unit
        piece[i] = pieces[member]
        # the band of a corner other than zero; the band of a corner at zero is relative to the motion
        if i < clearances:
            is_off_zero = common.cornered[i] != 0
        else:
            is_off_zero = (lower[i] != 0.0 and lower[i] > -inf) or (upper[i] != 0.0 and upper[i] < inf)
        band[i] = BAND if is_off_zero else 0.0
        # the regions beyond the corners are built when they are first entered
        neighbour[i, 0] = -1
        neighbour[i, 1] = -1


@strict_entry
def pack(stages, workspace, regions, slot, first):
    """Write the region that has been built into a slot, its tables from index ``first`` on."""
    # the sizes, the inputs kept and the constants of the bound
    a = regions
    common = common_at(workspace)
    region = region_at(workspace)
    free = free_at(workspace)
    bounds = bounds_at(workspace)
    states = region.matrix.shape[0]
    width = free.width[0]
    modes = bounds.used[0]
    fine = free.fine[0]
    carried = region.carried.shape[0]
    watched = common.corner_scale.size
    inputs = region.kept.size
    h = step(fine)
    a.width[slot] = width
    a.modes[slot] = modes
    a.fine[slot] = fine
    a.first_table[slot] = first
    for j in range(states, width):
        a.kept[slot, j - states] = free.column[j] - states
    for i in range(carried):
        a.drift[slot, i] = region.flowing[i, 0] * common.amplitude[0]
    for i in range(3 * watched):
        a.constant[slot, i] = bounds.constant[i]
    # tables E_l of the dyadic steps, and the powers that Taylor polynomials of the state are made of
    call_silent(stages.fill_tables, (workspace, a.tables, first, carried))
    call_silent(stages.fill_powers, (workspace, a.powers, POWERS * slot, carried, h))
    # the particular solution P_r, and that of the carried quantities
    strip = call_count(stages.fill, (a.particular, slot, 0, region.integral, 0, carried, inputs))
    call_count(stages.fill, (a.particular, slot, strip, region.particular, 0, states, inputs))
    # rows of deflections and derivatives: of the state, without fast modes, of the inputs split off
    call_silent(stages.fill_in_turn, (a.probe, slot, free.watched, watched, width))
    call_silent(stages.fill_in_turn, (a.calm, slot, free.calm, watched, width))
    call_silent(stages.fill_in_turn, (a.forced, slot, region.forced, watched, inputs))
    # the bound (B): weights, pushes of the chains, rows
    call_count(stages.fill, (a.weights, slot, 0, bounds.weights, 0, 3 * watched, modes))
    call_count(stages.fill, (a.pushes, slot, 0, bounds.pushed, 0, 3 * watched, bounds.pushed.shape[1]))
    call_silent(stages.fill_bounds, (workspace, a.bounds, slot))
    # Taylor series of the deflections over the finest step
    call_silent(stages.fill_series, (workspace, a.series, slot, h))
    a.forced_strips[slot] = call_count(stages.fill_forced, (workspace, a.forced_series, slot, h))
    # corners, pieces and rounding bands
    pack_bounds(workspace, a.lower[slot], a.upper[slot], a.band[slot], a.piece[slot], a.neighbour[slot])
