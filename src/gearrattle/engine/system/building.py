"""How a region is built: the stages, each a compiled function on the stacks of ``kernels.bench``.

One compiled function for all of it would take half a minute to compile; called from here, stage by stage, they take a
few seconds, and the calls cost a tenth of the work.

Takes a ``Flow`` and pieces; writes one slot of ``kernels.packed.Regions``.
"""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels import bench
from gearrattle.engine.kernels.packed import DEEPEST, LONGEST, ORDER, level_within, step_of
from gearrattle.engine.kernels.variants import Scales
from gearrattle.engine.system.companion import Companion
from gearrattle.engine.system.flow import Flow, Pieces
from gearrattle.engine.system.forced import LARGEST
from gearrattle.engine.system.laid_out import coefficients_of, frame_of
from gearrattle.engine.system.law import PiecewiseLaw

Array = NDArray[np.float64]

FAST = 4.0  # times the highest input frequency: modes beyond are bounded by their amplitude where they are small
FAST_ROUNDING = 1e-10  # corner scales, added to the bound on fast modes: what the decomposition itself may round
_WIDEST_TURN = 0.5  # of an input over the finest step, radians
ELIMINATION = 100.0
"""Largest entry of an elimination between blocks; any value is rigorous, this one keeps bounds tight."""
_STAGES = (
    "lay_out", "stiffest", "typical", "accelerate", "look", "split_inputs", "generate", "split_off", "transpose_states",
    "triangular_form", "block_diagonalise", "weigh", "gather", "finish_bounds", "finest_level", "fill", "fill_in_turn",
    "fill_bounds", "fill_tables", "fill_powers", "fill_series", "fill_forced",
)  # fmt: skip
_LETTERS = np.frombuffer(b"VN", dtype=np.uint8)  # zgees: Schur vectors, yes; sorting, no
_SCRATCH = 34  # complex numbers a row, for zgees


class Bench:
    """Room to work a driveline's regions out, one at a time; ``typical`` is the size of its ordinary motions."""

    def __init__(self, flow: Flow) -> None:
        system = flow.system
        m, k, w, z = len(system.laws), len(system.clearances), system.watched, flow.width
        carried = len(flow.coordinates.references) + k
        rows, columns = max(carried + z, 4 * w, ORDER + 1, m), max(z + 1, m + w + 1, 3 * w, ORDER + 1)
        self.work, self.waves = np.zeros((bench.PAGES, rows, columns)), np.zeros((bench.WAVES, z, z), complex)
        self.marks = np.zeros((bench.MARKS, columns), np.int64)
        self.sizes = self.marks[bench.SIZES]
        self.carried, self.watched = carried, w
        self.states, self.inputs = flow.states, flow.inputs
        members: tuple[PiecewiseLaw | Companion, ...] = (*system.laws, *system.companions)
        first = np.cumsum([0, *(each.pieces for each in members)])
        self.laws = np.zeros((bench.LAWS, first[-1]))
        counts = (m, system.size, flow.states, w, len(flow.coordinates.references), flow.frequency.size)
        links = 1 if system.signals is None else system.signals.degree + 1
        chains = len(flow.coordinates.elements), flow.chain.size, links
        sizes = (*counts, level_of_turns(flow.frequency), DEEPEST, k, *chains)
        self.sizes[: len(sizes)] = sizes
        self.marks[bench.FIRST_PIECE, : len(first)] = first
        self.marks[bench.CLEARANCES, :k] = system.clearances
        if system.is_plain:
            frame, scaling = frame_of(system, flow.coordinates), flow.scaling
            scales = Scales(scaling.deflection, scaling.velocity, scaling.inputs, np.empty(k))
            stages().lay_out(coefficients_of(system), frame, scales, self.work, self.laws, self.marks)
        else:
            self._lay_out(flow)
        self.corner_scale = flow.corner_scale
        self.which = np.array([*system.clearances, *range(m, m + w - k)], dtype=np.int64)  # of all pieces
        self._prepare_lapack()
        self.typical = self._settle_limits(flow)

    def _settle_limits(self, flow: Flow) -> float:
        """Write what counts as too large, against an ordinary motion of the stiffest pieces; its size."""
        do, vectors = stages(), self.work[bench.VECTORS]
        limits, frequency = vectors[bench.LIMITS], vectors[bench.FREQUENCY, : self.sizes[bench.HARMONICS]]
        limits[bench.FAST], limits[bench.FAST_ROUNDING] = FAST * frequency.max(initial=2 * np.pi), FAST_ROUNDING
        limits[bench.CHAIN_PACE] = flow.pace_of_chains.max(initial=0.0)
        limits[bench.HORIZON] = min(2.0 * LONGEST, float(np.diff(flow.knots).max()))
        do.stiffest(self.laws, self.marks)
        do.accelerate(self.work, self.laws, self.marks)
        typical = float(do.typical(self.work, self.waves, self.marks))
        if flow.chain.size:
            chains = self.work[bench.MATRIX, : self.states, self.states + self.inputs :][:, : flow.chain.size]
            pushed = np.abs(chains).max(axis=0, initial=0.0) @ np.abs(flow.chains).max(axis=0)
            typical = max(typical, float(pushed))
        limits[bench.MOST], limits[bench.MOST_SEEN] = LARGEST * typical, LARGEST
        return typical

    def _lay_out(self, flow: Flow) -> None:
        """Write the pages that all regions share, of a driveline that is more than laws and harmonics."""
        system, scaling, period = flow.system, flow.scaling, flow.system.inputs.period
        clearances, vectors = list(system.clearances), self.work[bench.VECTORS]
        unit = 1.0 / flow.corner_scale[: len(clearances), None]
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
            self.work[page, : rows.shape[0], : rows.shape[1]] = rows
        rows_of_vectors = {
            bench.INERTIA: system.inertia, bench.PACE: period * scaling.velocity, bench.CORNER_SCALE: flow.corner_scale,
            bench.FREQUENCY: flow.frequency, bench.AMPLITUDE: scaling.inputs, bench.INPUT_SIZE: flow.input_size,
        }  # fmt: skip
        for row, vector in rows_of_vectors.items():
            vectors[row, : vector.size] = vector
        vectors[bench.LIMITS, bench.PERIOD] = period
        cornered = [np.any(system.laws[k].corners != 0.0) for k in clearances]
        self.marks[bench.CORNERED, : len(clearances)] = cornered
        self._write_laws(flow)

    def _write_laws(self, flow: Flow) -> None:
        """Write down all pieces of all elements, then of all companions."""
        system, unit, first = flow.system, 1.0 / flow.scaling.inputs[0], self.marks[bench.FIRST_PIECE]
        members: tuple[PiecewiseLaw | Companion, ...] = (*system.laws, *system.companions)
        for i, each in enumerate(members):
            own = self.laws[:, first[i] : first[i + 1]]
            own[bench.STIFFNESS], own[bench.DAMPING] = each.stiffness, each.damping
            own[bench.OFFSET] = each.offset * unit
            if isinstance(each, Companion):
                own[bench.LOWER], own[bench.UPPER] = each.lower, each.upper
                own[bench.BY_MEMORY], own[bench.MOVES] = each.memory, each.moves
                own[[bench.BY_DEFLECTION, bench.BY_RATE, bench.BY_ITSELF]] = each.watched.T
            elif isinstance(each, PiecewiseLaw):
                own[bench.LOWER, 0], own[bench.LOWER, 1:] = -np.inf, each.corners
                own[bench.UPPER, -1], own[bench.UPPER, :-1] = np.inf, each.corners
        for c, companion in enumerate(system.companions):
            self.marks[bench.PARENT, c], self.marks[bench.MEMORY, c] = companion.element, -1
        for i, c in enumerate(system.memories):
            self.marks[bench.MEMORY, c] = flow.states - len(system.memories) + i
            self.work[bench.VECTORS, bench.MEMORY_SCALE, c] = flow.memory[i]

    def _prepare_lapack(self) -> None:
        """Write the addresses of zgees' fifteen arguments down; the function that would sort is none."""
        states = self.states
        self.integers = np.array([states, self.waves.shape[1], 0, _SCRATCH * states, 0], np.int32)
        self._scratch = np.empty((_SCRATCH + 2) * states, complex)
        n, letter, scratch = self.integers.ctypes.data, _LETTERS.ctypes.data, self._scratch.ctypes.data
        schur, basis = (self.waves[page].ctypes.data for page in (bench.SCHUR, bench.BASIS))
        values, reals = scratch + 16 * _SCRATCH * states, scratch + 16 * (_SCRATCH + 1) * states
        self.arguments = (
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
        if not self._find_schur_form():
            raise FloatingPointError(f"the region {pieces} cannot be built: its eigenvalues are not found")
        do.triangular_form(work, waves, marks)
        blocks = do.block_diagonalise(waves, marks, ELIMINATION)
        bounds = marks[bench.PIVOTS, : blocks + 1].tolist()
        for a, b in pairwise(bounds):
            do.weigh(work, waves, marks, a, b)
        do.gather(work, waves, marks)
        do.finish_bounds(work, marks)
        self.sizes[bench.FINE] = do.finest_level(work, marks)

    def _find_schur_form(self) -> bool:
        """Write A = basis @ schur @ basis^H, transposed; tell whether LAPACK found it.

        Of one matrix in some fifty thousand its iteration does not end, though nothing is wrong with the matrix. Then
        the states are tried in other orders, each turned by one, until one ends.
        """
        do, n = stages(), self.states
        schur, basis = self.waves[bench.SCHUR, :n, :n], self.waves[bench.BASIS, :n, :n]
        for turn in range(n):
            do.transpose_states(self.work, self.waves, self.marks)
            if turn:
                schur[:] = np.roll(schur, (turn, turn), (0, 1))
            do.schur(*self.arguments)
            if self.integers[4] == 0:
                if turn:
                    basis[:] = np.roll(basis, -turn, 1)
                return True
        return False

    def found(self) -> tuple[int, int, int]:
        """Y, J and the finest level of the region worked out."""
        sizes = self.sizes.tolist()
        return sizes[bench.WIDTH], sizes[bench.MODES], sizes[bench.FINE]

    def pack(self, a: dict[str, NDArray[Any]], slot: int, first: int) -> None:
        """Write it into a slot of the arrays of ``packed.Regions``, its tables from ``first`` on."""
        do, work, marks, (width, modes, fine) = stages(), self.work, self.marks, self.found()
        c, k, u, h = self.carried, self.watched, self.inputs, step_of(fine)
        a["width"][slot], a["modes"][slot], a["fine"][slot], a["first_table"][slot] = width, modes, fine, first
        a["kept"][slot, : width - self.states] = marks[bench.COLUMN, self.states : width] - self.states
        do.fill_tables(a["tables"], first, work, c, width, fine)
        do.fill_powers(a["powers"], bench.POWERS * slot, bench.POWERS, work, c, width, h)
        strip = do.fill(a["particular"], slot, 0, work, bench.INTEGRAL, 0, c, u)
        do.fill(a["particular"], slot, strip, work, bench.PARTICULAR, 0, self.states, u)
        do.fill_in_turn(a["probe"], slot, work, bench.WATCHED, k, width)
        do.fill_in_turn(a["calm"], slot, work, bench.CALM, k, width)
        do.fill_in_turn(a["forced"], slot, work, bench.FORCED, k, u)
        do.fill(a["weights"], slot, 0, work, bench.WEIGHTS, 0, 3 * k, modes)
        do.fill(a["pushes"], slot, 0, work, bench.PUSHED, 0, 3 * k, self.sizes[bench.CHAIN])
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
    from gearrattle.engine.kernels import blocks, majorant, pages, region, responses, strips
    from gearrattle.engine.kernels._jit import compact, lapack_routine

    modules, found = (pages, region, responses, blocks, majorant, strips), {}
    for name in _STAGES:
        found[name] = compact(next(getattr(module, name) for module in modules if hasattr(module, name)))
    return SimpleNamespace(**found, schur=lapack_routine("zgees", 15))


def typical_of(flow: Flow) -> float:
    """Size of the scaled states in an ordinary motion: what fills a clearance, and what the inputs make at most."""
    return Bench(flow).typical


def level_of_turns(frequency: Array) -> int:
    """Smallest level at which every input turns by less than ``_WIDEST_TURN``."""
    fastest = float(frequency.max(initial=0.0))
    return min(DEEPEST, level_within(_WIDEST_TURN / fastest)) if fastest > 0.0 else 0
