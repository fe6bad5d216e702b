"""How a region is built: the stages, each a compiled function on the stacks of ``kernels.bench``.

One compiled function for all of it would take half a minute to compile; called from here, stage by stage, they take a
few seconds, and the calls cost a tenth of the work.

Takes a ``Flow`` and pieces; writes one slot of ``kernels.packed.Regions``.
"""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from math import ceil, log2
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.kernels import bench
from gearrattle.kernels.packed import LONGEST, ORDER
from gearrattle.system import forced
from gearrattle.system.companion import Companion
from gearrattle.system.flow import Flow, Pieces
from gearrattle.system.law import PiecewiseLaw

Array = NDArray[np.float64]

DEEPEST = 60  # finest step: LONGEST / 2^60
FAST = 4.0  # times the highest input frequency: modes beyond are bounded by their amplitude where they are small
FAST_ROUNDING = 1e-10  # corner scales, added to the bound on fast modes: what the decomposition itself may round
_WIDEST_TURN = 0.5  # of an input over the finest step, radians
ELIMINATION = 100.0
"""Largest entry of an elimination between blocks; any value is rigorous, this one keeps bounds tight."""
_STAGES = (
    "accelerate", "look", "split_inputs", "generate", "split_off", "transpose_states", "triangular_form",
    "block_diagonalise", "weigh", "gather", "finish_bounds", "finest_level", "fill", "fill_bounds", "fill_tables",
    "fill_powers", "fill_series", "fill_forced",
)  # fmt: skip
_LETTERS = np.frombuffer(b"VN", dtype=np.uint8)  # zgees: Schur vectors, yes; sorting, no
_SCRATCH = 34  # complex numbers a row, for zgees


class Bench:
    """Room to work a driveline's regions out, one at a time."""

    def __init__(self, flow: Flow) -> None:
        system = flow.system
        m, k, w, z = len(system.laws), len(system.clearances), system.watched, flow.width
        carried = len(flow.coordinates.references) + k
        rows, columns = max(carried + z, 4 * w, ORDER + 1, m), max(z + 1, m + w, 3 * w, ORDER + 1)
        self.work, self.waves = np.zeros((bench.PAGES, rows, columns)), np.zeros((bench.WAVES, z, z), complex)
        self.marks = np.zeros((bench.MARKS, columns), np.int64)
        self.sizes = self.marks[bench.SIZES]
        self.carried, self.watched = carried, w
        self.states, self.inputs = flow.states, flow.inputs
        _share(flow, self.work)
        self._write_laws(flow)
        counts = (m, system.size, flow.states, w, len(flow.coordinates.references), flow.frequency.size)
        links = 1 if system.signals is None else system.signals.degree + 1
        chains = len(flow.coordinates.elements), flow.chain.size, links
        sizes = (*counts, level_of_turns(flow.frequency), DEEPEST, k, *chains)
        self.sizes[: len(sizes)] = sizes
        self.marks[bench.CLEARANCES, :k] = system.clearances
        self.corner_scale = flow.corner_scale
        self.which = np.array([*system.clearances, *range(m, m + w - k)], dtype=np.int64)  # of all pieces
        self._prepare_lapack()

    def _write_laws(self, flow: Flow) -> None:
        """Write down all pieces of all elements, then of all companions."""
        system, unit = flow.system, 1.0 / flow.scaling.inputs[0]
        members: tuple[PiecewiseLaw | Companion, ...] = (*system.laws, *system.companions)
        first = np.cumsum([0, *(each.pieces for each in members)])
        self.laws = np.zeros((bench.LAWS, first[-1]))
        for each, begin, end in zip(members, first, first[1:], strict=False):
            own = self.laws[:, begin:end]
            own[bench.STIFFNESS], own[bench.DAMPING], own[bench.OFFSET] = (
                each.stiffness,
                each.damping,
                each.offset * unit,
            )
            if isinstance(each, Companion):
                own[bench.LOWER], own[bench.UPPER] = each.lower, each.upper
                own[bench.BY_MEMORY], own[bench.MOVES] = each.memory, each.moves
                own[[bench.BY_DEFLECTION, bench.BY_RATE, bench.BY_ITSELF]] = each.watched.T
            else:
                own[bench.LOWER, 0], own[bench.LOWER, 1:] = -np.inf, each.corners
                own[bench.UPPER, -1], own[bench.UPPER, :-1] = np.inf, each.corners
        self.marks[bench.FIRST_PIECE, : len(members)] = first[:-1]
        for c, companion in enumerate(system.companions):
            self.marks[bench.PARENT, c], self.marks[bench.MEMORY, c] = companion.element, -1
        for i, c in enumerate(system.memories):
            self.marks[bench.MEMORY, c] = flow.states - len(system.memories) + i
            self.work[bench.VECTORS, bench.MEMORY_SCALE, c] = flow.memory[i]

    def _prepare_lapack(self) -> None:
        """Write the addresses of zgees' fifteen arguments down; the function that would sort is none."""
        states = self.states
        self._integers = np.array([states, self.waves.shape[1], 0, _SCRATCH * states, 0], np.int32)
        self._scratch = np.empty((_SCRATCH + 2) * states, complex)
        n, letter, scratch = self._integers.ctypes.data, _LETTERS.ctypes.data, self._scratch.ctypes.data
        schur, basis = (self.waves[page].ctypes.data for page in (bench.SCHUR, bench.BASIS))
        values, reals = scratch + 16 * _SCRATCH * states, scratch + 16 * (_SCRATCH + 1) * states
        self._arguments = (
            letter, letter + 1, None, n, schur, n + 4, n + 8, values, basis, n + 4, scratch, n + 12, reals, None, n + 16
        )  # fmt: skip

    def work_out(self, pieces: Pieces) -> None:
        """Work a region out, up to its tables.

        Raises:
            FloatingPointError: its rates are not finite, or its eigenvalues are not found.
        """
        do, work, waves, marks = stages(), self.work, self.waves, self.marks
        marks[bench.PIECES, : len(pieces)] = pieces
        if not do.accelerate(work, self.laws, marks):
            raise FloatingPointError(f"the region {pieces} cannot be built: its rates are not finite")
        do.look(work, self.laws, marks)
        do.split_inputs(work, waves, marks)
        do.generate(work, marks)
        do.split_off(work, marks)
        do.transpose_states(work, waves, marks)
        do.schur(*self._arguments)
        if self._integers[4] != 0:
            raise FloatingPointError(f"the region {pieces} cannot be built: its eigenvalues are not found")
        do.triangular_form(work, waves, marks)
        blocks = do.block_diagonalise(waves, marks, ELIMINATION)
        bounds = marks[bench.PIVOTS, : blocks + 1].tolist()
        for a, b in pairwise(bounds):
            do.weigh(work, waves, marks, a, b)
        do.gather(work, waves, marks)
        do.finish_bounds(work, marks)
        self.sizes[bench.FINE] = do.finest_level(work, marks)

    def found(self) -> tuple[int, int, int]:
        """Y, J and the finest level of the region worked out."""
        sizes = self.sizes.tolist()
        return sizes[bench.WIDTH], sizes[bench.MODES], sizes[bench.FINE]

    def pack(self, a: dict[str, NDArray[Any]], slot: int, first: int) -> None:
        """Write it into a slot of the arrays of ``packed.Regions``, its tables from ``first`` on."""
        do, work, marks, (width, modes, fine) = stages(), self.work, self.marks, self.found()
        c, k, u, h = self.carried, self.watched, self.inputs, LONGEST / 2.0**fine
        a["width"][slot], a["modes"][slot], a["fine"][slot], a["first_table"][slot] = width, modes, fine, first
        a["kept"][slot, : width - self.states] = marks[bench.COLUMN, self.states : width] - self.states
        do.fill_tables(a["tables"], first, work, c, width, fine)
        do.fill_powers(a["powers"], bench.POWERS * slot, bench.POWERS, work, c, width, h)
        strip = do.fill(a["particular"], slot, 0, work, bench.INTEGRAL, 0, c, u)
        do.fill(a["particular"], slot, strip, work, bench.PARTICULAR, 0, self.states, u)
        do.fill(a["probe"], slot, 0, work, bench.WATCHED, 0, 4 * k, width)
        do.fill(a["calm"], slot, 0, work, bench.CALM, 0, 4 * k, width)
        do.fill(a["forced"], slot, 0, work, bench.FORCED, 0, 4 * k, u)
        do.fill(a["weights"], slot, 0, work, bench.WEIGHTS, 0, 3 * k, modes)
        do.fill_bounds(a["bounds"], slot, self.waves, modes, width)
        do.fill_series(a["series"], slot, work, marks, h)
        a["forced_strips"][slot] = do.fill_forced(a["forced_series"], slot, work, marks, h)
        a["drift"][slot, :c] = work[bench.FLOWING, :c, 0] * work[bench.VECTORS, bench.AMPLITUDE, 0]
        a["constant"][slot, : 3 * k] = work[bench.FOUND, bench.OFFSETS, : 3 * k]
        pieces = marks[bench.PIECES, self.which]
        law = marks[bench.FIRST_PIECE, self.which] + pieces
        a["lower"][slot] = self.laws[bench.LOWER, law] / self.corner_scale
        a["upper"][slot] = self.laws[bench.UPPER, law] / self.corner_scale
        a["piece"][slot], a["neighbour"][slot] = pieces, -1


@cache
def stages() -> SimpleNamespace:
    """The compiled stages, and LAPACK's zgees; each lets go of the interpreter while it works."""
    from gearrattle.kernels import blocks, majorant, region, responses, strips
    from gearrattle.kernels._jit import compact, lapack_routine

    modules, found = (region, responses, blocks, majorant, strips), {}
    for name in _STAGES:
        found[name] = compact(next(getattr(module, name) for module in modules if hasattr(module, name)))
    return SimpleNamespace(**found, schur=lapack_routine("zgees", 15))


def _share(flow: Flow, work: Array) -> None:
    """Write the pages that all regions share."""
    system, scaling, period = flow.system, flow.scaling, flow.system.inputs.period
    clearances = list(system.clearances)
    unit = 1.0 / flow.corner_scale[: len(clearances), None]
    fastest = float(flow.frequency.max(initial=2 * np.pi))
    pace = float(flow.pace_of_chains.max(initial=0.0))
    horizon = min(2.0 * LONGEST, float(np.diff(flow.knots).max()))
    limits = np.array([
        period, forced.LARGEST * flow.typical, forced.LARGEST, FAST * fastest, FAST_ROUNDING, pace, horizon
    ])  # fmt: skip
    pages = {
        bench.MOTION: period * scaling.deflection[:, None] * (flow.coordinates.basis @ flow.velocity),
        bench.BALANCE: flow.torque - system.drag[:, None] * flow.velocity,
        bench.ELEMENTS: system.rows,
        bench.DEFLECTION: flow.deflection,
        bench.RATE: flow.rate,
        bench.REFERENCES: period * flow.velocity[list(flow.coordinates.references)],
        bench.SEEN: np.vstack([flow.deflection[clearances] * unit, flow.rate[clearances] * unit * period]),
        bench.CURVATURE: flow.curvature_of_error[clearances],
    }
    for page, rows in pages.items():
        work[page, : rows.shape[0], : rows.shape[1]] = rows
    vectors = {
        bench.INERTIA: system.inertia, bench.PACE: period * scaling.velocity, bench.CORNER_SCALE: flow.corner_scale,
        bench.FREQUENCY: flow.frequency, bench.AMPLITUDE: scaling.inputs, bench.INPUT_SIZE: flow.input_size,
        bench.LIMITS: limits,
    }  # fmt: skip
    for row, vector in vectors.items():
        work[bench.VECTORS, row, : vector.size] = vector


def level_of_turns(frequency: Array) -> int:
    """Smallest level at which every input turns by less than ``_WIDEST_TURN``."""
    fastest = float(frequency.max(initial=0.0)) * LONGEST / _WIDEST_TURN
    return min(DEEPEST, max(0, ceil(log2(fastest)))) if fastest > 0.0 else 0
