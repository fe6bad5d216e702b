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
from gearrattle.kernels.variants import Scales
from gearrattle.system.flow import Flow, Pieces
from gearrattle.system.forced import LARGEST
from gearrattle.system.laid_out import coefficients_of, frame_of

Array = NDArray[np.float64]

DEEPEST = 60  # finest step: LONGEST / 2^60
FAST = 4.0  # times the highest input frequency: modes beyond are bounded by their amplitude where they are small
FAST_ROUNDING = 1e-10  # corner scales, added to the bound on fast modes: what the decomposition itself may round
_WIDEST_TURN = 0.5  # of an input over the finest step, radians
ELIMINATION = 100.0
"""Largest entry of an elimination between blocks; any value is rigorous, this one keeps bounds tight."""
_STAGES = (
    "lay_out", "stiffest", "typical", "accelerate", "look", "split_inputs", "generate", "split_off", "transpose_states",
    "triangular_form", "block_diagonalise", "weigh", "gather", "finish_bounds", "finest_level", "fill", "fill_bounds",
    "fill_tables", "fill_powers", "fill_series", "fill_forced",
)  # fmt: skip
_LETTERS = np.frombuffer(b"VN", dtype=np.uint8)  # zgees: Schur vectors, yes; sorting, no
_SCRATCH = 34  # complex numbers a row, for zgees


class Bench:
    """Room to work a driveline's regions out, one at a time; ``typical`` is the size of its ordinary motions."""

    def __init__(self, flow: Flow) -> None:
        system = flow.system
        m, k, z = len(system.laws), len(system.clearances), flow.width
        carried = len(flow.coordinates.references) + k
        rows, columns = max(carried + z, 4 * k, ORDER + 1, m), max(z + 1, m + 1, 3 * k, ORDER + 1)
        self.work, self.waves = np.zeros((bench.PAGES, rows, columns)), np.zeros((bench.WAVES, z, z), complex)
        self.marks = np.zeros((bench.MARKS, columns), np.int64)
        self.sizes = self.marks[bench.SIZES]
        self.carried, self.clearances = carried, k
        self.states, self.inputs = flow.states, z - flow.states
        first = np.cumsum([0, *(law.pieces for law in system.laws)])
        self.laws = np.empty((5, first[-1]))
        counts = (m, system.size, flow.states, k, len(flow.coordinates.references), flow.frequency.size)
        self.sizes[: len(counts) + 2] = (*counts, level_of_turns(flow.frequency), DEEPEST)
        self.marks[bench.FIRST_PIECE, : m + 1] = first
        self.marks[bench.CLEARANCES, :k] = system.clearances
        frame, scaling = frame_of(system, flow.coordinates), flow.scaling
        scales = Scales(scaling.deflection, scaling.velocity, scaling.inputs, np.empty(k))
        stages().lay_out(coefficients_of(system), frame, scales, self.work, self.laws, self.marks)
        self.corners = self.laws[[bench.LOWER, bench.UPPER]], first[:-1][list(system.clearances)]
        self.corner_scale, self.watched = flow.corner_scale, list(system.clearances)
        self._prepare_lapack()
        self.typical = self._settle_limits()

    def _settle_limits(self) -> float:
        """Write what counts as too large, against an ordinary motion of the stiffest pieces; its size."""
        do, vectors = stages(), self.work[bench.VECTORS]
        limits, frequency = vectors[bench.LIMITS], vectors[bench.FREQUENCY, : self.sizes[bench.HARMONICS]]
        limits[bench.FAST], limits[bench.FAST_ROUNDING] = FAST * frequency.max(initial=2 * np.pi), FAST_ROUNDING
        do.stiffest(self.laws, self.marks)
        do.accelerate(self.work, self.laws, self.marks)
        typical = float(do.typical(self.work, self.waves, self.marks))
        limits[bench.MOST], limits[bench.MOST_SEEN] = LARGEST * typical, LARGEST
        return typical

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
        do.look(work, marks)
        do.split_inputs(work, waves, marks)
        do.generate(work, marks)
        do.split_off(work, marks)
        do.transpose_states(work, waves, marks)
        do.schur(*self.arguments)
        if self.integers[4] != 0:
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
        c, k, u, h = self.carried, self.clearances, self.inputs, LONGEST / 2.0**fine
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
        pieces = marks[bench.PIECES, self.watched]
        (lower, upper), law = self.corners[0], self.corners[1] + pieces
        a["lower"][slot], a["upper"][slot] = lower[law] / self.corner_scale, upper[law] / self.corner_scale
        a["piece"][slot], a["neighbour"][slot] = pieces, -1


@cache
def stages() -> SimpleNamespace:
    """The compiled stages, and LAPACK's zgees; each lets go of the interpreter while it works."""
    from gearrattle.kernels import blocks, majorant, pages, region, responses, strips
    from gearrattle.kernels._jit import compact, lapack_routine

    modules, found = (pages, region, responses, blocks, majorant, strips), {}
    for name in _STAGES:
        found[name] = compact(next(getattr(module, name) for module in modules if hasattr(module, name)))
    return SimpleNamespace(**found, schur=lapack_routine("zgees", 15))


def typical_of(flow: Flow) -> float:
    """Size of the scaled states in an ordinary motion: what fills a clearance, and what the inputs make at most."""
    return Bench(flow).typical


def level_of_turns(frequency: Array) -> int:
    """Smallest level at which every input turns by less than ``_WIDEST_TURN``."""
    fastest = float(frequency.max(initial=0.0)) * LONGEST / _WIDEST_TURN
    return min(DEEPEST, max(0, ceil(log2(fastest)))) if fastest > 0.0 else 0
