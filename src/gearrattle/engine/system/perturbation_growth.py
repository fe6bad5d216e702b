"""Growth of small perturbations along a motion: the flow's gradient, Lyapunov exponents, the predictability horizon.

Between crossings a perturbation of (x, v) moves by exp(A_r h). At a crossing of a displacement corner it is multiplied
by

    S = I - [0; J^-1 w] (c_after - c_before) [w^T, 0],

the saltation matrix with delta' cancelled: valid at a grazing too, and the identity if the damping does not jump. When
a slider is released its torque F vanishes, and F / delta' is added to the jump. When a slider is engaged, the
perturbation of its spring's stretch is that of the deflection; when it begins to slip, that perturbation is zero. So
the gradient follows from the log of crossings alone. It is stored in segments of an eighth of a period, because over
many cycles of a chaotic motion the product overflows.

The norm of a perturbation is taken in the engine's scaled coordinates (roots of energies, ``energy_scaling``). The
*predictability horizon* is the first time at which some perturbation, begun at any earlier time, has grown by
``GROWTH``. Rounding acts like one error of about ``ROUNDING`` half-gaps at the worst instant, in 95 of 100 motions less
than ``ROUNDING_95`` (measured against fifty digits on 73 chaotic motions: ``make horizon``, docs/reference/horizon.md).
So at the horizon deflections are off by about 1e-8 half-gaps, and the motion is predicted pointwise no longer.

A train with many clearances visits thousands of regions, whose exponentials would fill the memory: a few perturbations
are carried instead (``perturbations``).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.derived_values import kept
from gearrattle.engine.kernels import perturbation_series as kernel
from gearrattle.engine.kernels._jit import vectorised
from gearrattle.engine.kernels.flow_gradient import gradient_segments
from gearrattle.engine.kernels.march_arrays import LONGEST, ORDER, step_of
from gearrattle.engine.system.crossings_in_order import Passages
from gearrattle.engine.system.flow import Flow, Pieces
from gearrattle.engine.system.perturbations import Gradient, Perturbed, driveline_of, regions_of
from gearrattle.engine.system.region import exponential_increments, finest_level

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

GROWTH = 1e7
ROUNDING = 1e-15
"""Effective rounding of ``exact`` [half-gaps]: typical error of a deflection over the growth of perturbations."""
ROUNDING_95 = 3e-14
"""Effective rounding that 95 of 100 motions stay below [half-gaps]."""
MOST_TABLES = 1 << 26  # bytes
_MOST_STARTS = 512  # most segments from which growth is followed at once; more segments are joined in pairs
_BLOCK = 8  # segments per block


@dataclass(frozen=True)
class Variation(Gradient):
    """The gradient of one motion's flow."""

    time: Array  # (S + 1,) ends of the segments [s], the first 0
    segments: Array  # (S, N, N) gradient over each, balanced coordinates
    scale: Array  # (N,) balanced = scale * SI

    def carried(self, segment: int, columns: Array) -> Array:
        """Return perturbations at the end of a segment from those at its start (N, P), scaled coordinates."""
        return np.asarray(self.segments[segment] @ columns)

    def horizon(self, growth: float = GROWTH) -> float:
        """First time [s] at which a perturbation begun at any earlier time has grown by ``growth``; inf if none has."""
        return self.growth(growth)[0]

    def growth(self, least: float = GROWTH) -> tuple[float, float]:
        """The horizon for a growth [s], and how far some perturbation has grown there, or at the end without one.

        Growth is the Frobenius norm of the gradient between two times.
        """
        time = self.time
        segments = self.segments
        grown = 1.0
        while len(segments) > 0:
            passed, grown = _first_passage(segments[:_MOST_STARTS], least)
            if passed is not None:
                return float(time[passed + 1]), grown
            if len(segments) <= _MOST_STARTS:
                break
            pairs = len(segments) // 2
            joined = segments[1 : 2 * pairs : 2] @ segments[0 : 2 * pairs : 2]
            tail = segments[2 * pairs :]
            segments = np.concatenate([joined, tail])
            time = np.concatenate([time[0 : 2 * pairs + 1 : 2], time[2 * pairs + 1 :]])
        return float("inf"), grown


def _first_passage(segments: Array, least: float) -> tuple[int | None, float]:
    """The first segment at whose end a product of consecutive ones reaches a Frobenius norm, and the largest there.

    Products begun in earlier blocks go on block by block: while the norm of the farthest of them times that of any part
    of the block stays below, none can reach it inside.
    """
    begun = segments[:0]
    largest = 1.0
    for first in range(0, len(segments), _BLOCK):
        inner = segments[:0]
        heads = []
        passed = None
        for i, segment in enumerate(segments[first : first + _BLOCK]):
            inner = segment @ np.concatenate([inner, np.eye(segments.shape[1])[None]])
            heads.append(inner[0])
            if _size(inner).max() >= least:
                passed = i
                break
        if len(begun) and _size(begun).max() * max(map(_norm_bound, heads)) >= least:
            reached = (i for i, head in enumerate(heads) if _size(head @ begun).max() >= least)
            passed = next(reached, passed)
        if passed is not None:
            return first + passed, least
        begun = np.concatenate([heads[-1] @ begun, inner])
        largest = float(_size(begun).max())
    return None, largest


def _size(matrices: Array) -> Array:
    return np.asarray(np.linalg.norm(matrices, axis=(1, 2)))


def _norm_bound(matrix: Array) -> float:
    """An upper bound on the spectral norm."""
    return float(np.sqrt(np.linalg.norm(matrix, 1) * np.linalg.norm(matrix, np.inf)))


def variation(
    flow: Flow, initial: Pieces, path: Passages, *, end: float, most_tables: int = MOST_TABLES
) -> Variation | Perturbed:
    """The gradient along a motion, from its log of crossings.

    Factors are tables of exponentials, one for each region met, as long as these take no more memory than
    ``most_tables`` bytes; beyond, perturbations are carried without them.

    initial: piece of every element and auxiliary at the start.
    end: length of the motion [s]: a whole number of eighths of the period.
    """
    # intervals end at crossings and at every eighth of a period
    system = flow.system
    period = flow.system.inputs.period
    n = flow.states
    s = flow.memory.size
    grid = np.arange(1, max(1, round(end / period / LONGEST)) + 1) * LONGEST
    at = np.concatenate([path.time / period, grid])
    order = np.argsort(at, kind="stable")
    durations = np.diff(np.concatenate([[0.0], at[order]]))
    # room: region, clearance and end of an eighth for each interval, with the kick behind it
    index: dict[Pieces, int] = {}
    steps = np.full((len(at), 3), -1, dtype=np.int64)
    kicks = np.zeros((len(at), n))
    reset = np.zeros((len(at), s), dtype=np.bool_)
    push = _kicks(flow)
    pieces = initial
    crossings = list(zip(path.watch.tolist(), path.upward.tolist(), strict=True))
    changes: dict[tuple[Pieces, int, int], _Change] = {}
    # region by region along the log
    for i, which in enumerate(order.tolist()):
        steps[i] = index.setdefault(pieces, len(index)), -1, which >= len(crossings)
        if which < len(crossings):
            watch, upward = crossings[which]
            if (pieces, watch, upward) not in changes:
                changes[pieces, watch, upward] = _change(flow, pieces, watch, upward)
            # the crossing: kick of the velocities, new memories, the region behind it
            change = changes[pieces, watch, upward]
            reset[i] = change.reset
            if change.element >= 0:
                let_go = torque_let_go(flow, change.element, pieces, change.after, path.memory[which]) if s else 0.0
                jump = change.damping - let_go / path.velocity[which] if let_go != 0.0 else change.damping
                steps[i, 1] = watch
                kicks[i] = -push[watch] * jump
                kicks[i, n - s :] = change.engaged
            pieces = change.after
    # to SI units
    scale = np.concatenate([flow.scaling.deflection, flow.scaling.velocity, flow.memory])
    time = np.concatenate([[0.0], grid * period])
    # too many regions for tables: perturbations are carried without them
    most = most_tables // _table_size(flow, initial)
    if len(index) > most:
        return _perturbed(flow, list(index), (steps, durations, kicks, reset), time, scale)
    # gradients over every eighth of a period
    rows = np.ascontiguousarray(flow.deflection[list(system.clearances), :n])
    segments = np.zeros((len(grid), n, n))
    free = _free_motions(flow, index, most)
    _run(free, (steps, durations, kicks, reset, rows), segments)
    return Variation(time, segments, scale)


class _Change(NamedTuple):
    """Effect of a crossing on perturbations, the same at every such crossing in this region."""

    after: Pieces  # the region behind it
    reset: NDArray[np.bool_]  # (S,) memories that are known before or behind it
    element: int  # whose corner it is; -1 for another line
    damping: float  # jump of its damping
    engaged: Array  # (S,) 1, scaled, for every slider that engages


def _change(flow: Flow, pieces: Pieces, watch: int, upward: int) -> _Change:
    system = flow.system
    after = system.beyond(pieces, watch, upward)
    reset = ~np.isnan(flow.known(after)) | ~np.isnan(flow.known(pieces))
    if watch >= len(system.clearances):
        return _Change(after, reset, -1, 0.0, np.zeros(flow.memory.size))
    k = system.clearances[watch]
    damping = _damping(flow, k, after) - _damping(flow, k, pieces)
    return _Change(after, reset, k, damping, _engaged(flow, k, pieces, after))


def _table_size(flow: Flow, pieces: Pieces) -> int:
    """Bytes of a region's tables."""
    n = flow.states
    return 8 * n * n * (finest_level(flow.generator(pieces)[:n, :n]) + 1)


def _perturbed(
    flow: Flow, regions: list[Pieces], path: tuple[IntArray, Array, Array, NDArray[np.bool_]], time: Array, scale: Array
) -> Perturbed:
    """The growth of perturbations without tables."""
    steps, durations, kicks, reset = path
    crossed = np.array([*flow.system.clearances, -1], dtype=np.int64)[steps[:, 1]]
    ends = np.concatenate([[0], np.flatnonzero(steps[:, 2]) + 1])
    moving, engaged = np.split(kicks[:, len(flow.coordinates.elements) :], [flow.system.size], axis=1)
    columns = (steps[:, 0], durations, crossed, moving, engaged, reset)
    intervals = kernel.Intervals._make(np.ascontiguousarray(column) for column in columns)
    return Perturbed(time, scale, driveline_of(flow), regions_of(flow, regions), intervals, ends)


def _damping(flow: Flow, element: int, pieces: Pieces) -> float:
    """Damping of an element in its piece, its auxiliaries' included."""
    own = float(flow.system.laws[element].damping[pieces[element]])
    return own + sum(float(c.damping[p]) for c, p, _ in flow.beside(pieces) if c.element == element)


def torque_let_go(flow: Flow, element: int, before: Pieces, after: Pieces, memory: Array) -> float:
    """Return the torque of an element's sliders that vanishes where its piece changes [SI]."""
    total = 0.0
    auxiliaries = flow.system.auxiliaries
    held = dict(zip(flow.system.memories, memory, strict=True))
    for c, (auxiliary, old, _) in enumerate(flow.beside(before)):
        new = after[len(flow.system.laws) + c]
        if (
            auxiliary.element == element
            and c in held
            and auxiliary.known[old] != 0.0
            and auxiliaries[c].known[new] == 0.0
        ):
            total += float(auxiliary.memory[old] * held[c] + auxiliary.offset[old])
    return total


def _engaged(flow: Flow, element: int, before: Pieces, after: Pieces) -> Array:
    """(S,) 1, scaled, for every slider of an element that is engaged where its piece changes."""
    old = flow.remembering(before)
    new = flow.remembering(after)
    moved = [
        leaving.element == element and leaving.moves[p] == 0.0 and entered.moves[q] != 0.0
        for (leaving, p), (entered, q) in zip(old, new, strict=True)
    ]
    return np.array(moved, dtype=float) * flow.memory


def _kicks(flow: Flow) -> Array:
    """(K, N) J^-1 w of every clearance, balanced: change of velocities for a unit of deflection and damping jump."""
    system = flow.system
    n = flow.states
    out = np.zeros((len(system.clearances), n))
    rows = system.rows[list(system.clearances)]
    first = n - flow.memory.size - system.size
    out[:, first : first + system.size] = rows / system.inertia * flow.scaling.velocity
    return out


@kept
def _tables(_flow: Flow) -> dict[Pieces, tuple[Array, Array]]:
    """Free motions by region: another motion of a driveline meets mostly the same regions."""
    return {}


def _free_motions(flow: Flow, regions: Collection[Pieces], most: int) -> list[tuple[Array, Array]]:
    """The free motions of regions; so many are kept at most."""
    tables = _tables(flow)
    if len(tables) + sum(region not in tables for region in regions) > most:
        tables.clear()
    free = []
    for region in regions:
        free.append(tables.get(region) or _free_motion(flow, region))
        tables[region] = free[-1]
    return free


def _free_motion(flow: Flow, pieces: Pieces) -> tuple[Array, Array]:
    """(N, N) A of one region, and (fine + 1, N, N) exp(A h) - 1 over the step of every level."""
    n = flow.states
    generator = flow.generator(pieces)[:n, :n]
    fine = finest_level(generator)
    return generator, exponential_increments(generator, np.zeros((0, n)), fine)


def _run(
    free: Sequence[tuple[Array, Array]],
    path: tuple[IntArray, Array, Array, NDArray[np.bool_], Array],
    segments: Array,
) -> None:
    """Pack the regions' free motions and let the kernel multiply."""

    n = segments.shape[1]
    levels = max(len(table) for _, table in free)
    tables = np.zeros((len(free), levels, n, n))
    for i, (_, table) in enumerate(free):
        tables[i, : len(table)] = table
    generators = np.array([generator for generator, _ in free])
    steps = np.array([step_of(level) for level in range(levels)])
    fine = np.array([len(table) - 1 for _, table in free], dtype=np.int64)
    vectorised(gradient_segments)(tables, generators, steps, fine, ORDER, *path, segments)
