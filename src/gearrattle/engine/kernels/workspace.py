"""The arrays in which the regions of a driveline are built, one at a time: what all share, and what each writes anew.

m elements, n inertias, r deflections that are states, S memories, N = r + n + S states, U = 1 + 2 H inputs, Q entries
of chains, Z = N + U + Q, K clearances, W = K + auxiliaries watched, R reference angles, C = R + K carried quantities, P
pieces of all elements, then of all auxiliaries. z are the states, inputs and chains; y of the length Y <= Z are the
states, the inputs kept as states and the chains. J rows bound the fourth derivatives.

Every array is as large as it may ever need to be; ``Free.width`` and ``Bounds.count`` say how much of those over y and
over J a region uses. They come in groups so that a stage is handed what it needs: every array takes time to compile.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import islice
from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels.laws import Laws
from gearrattle.engine.kernels.packed import ORDER


class Common(NamedTuple):
    """What the regions of a driveline have in common; rows over z."""

    motion: Any  # (r, Z) rates of the deflections that are states
    balance: Any  # (n, Z) torques less drag
    rows: Any  # (m, n) W
    deflection: Any  # (m, Z) of every element
    rate: Any  # (m, Z)
    references: Any  # (R, Z) rates of the reference angles
    seen: Any  # (2 K, Z) deflections and rates of the clearances, in corner scales
    curvature: Any  # (K, Z) e'' of the clearances [SI]
    inertia: Any  # (n,)
    pace: Any  # (n,) T times the scale of every velocity
    corner_scale: Any  # (W,)
    frequency: Any  # (H,) radians a period
    amplitude: Any  # (1 + H,)
    input_size: Any  # (U,) the amplitude of every input
    clearances: Any  # (K,) elements
    cornered: Any  # (K,) 1: one has a corner off zero
    limits: Any  # (LIMITS,) see below
    coarsest: Any  # (1,) the smallest level that a finest step may have
    links: Any  # (1,) D + 1, entries a chain has


PERIOD, LARGEST_STATE, FAST, CHAIN_PACE, HORIZON, LIMITS = range(6)
"""Of ``Common.limits``: T [s]; the largest state up to which a particular solution is used; how many radians a period
make a mode fast; the pace of chains; how long bounds must hold, in periods."""


class Auxiliaries(NamedTuple):
    """Of every auxiliary, and of its pieces, which follow those of the elements in ``Laws``."""

    element: Any  # (auxiliaries,)
    state: Any  # (auxiliaries,) its memory's place among the states, -1 without
    scale: Any  # (auxiliaries,) of its memory
    by_memory: Any  # (P,) the force for a unit of memory
    moves: Any  # (P,) whether the memory moves, 1 or 0
    by_deflection: Any  # (P,) what of the deflection is watched
    by_rate: Any  # (P,) of its rate
    by_itself: Any  # (P,) of the memory


class Region(NamedTuple):
    """The region at hand; rows over z."""

    pieces: Any  # (m + auxiliaries,)
    force: Any  # (m, Z)
    acceleration: Any  # (n, Z)
    matrix: Any  # (N, Z) A and G: rates of the states
    carried: Any  # (C, Z) rates of the carried quantities
    watched: Any  # (3 W, Z) what is watched, its first and second derivatives
    kept: Any  # (U,) whether an input is kept, 1 or 0
    particular: Any  # (N, U) P
    forced: Any  # (4 W, U) what the inputs split off make of what is watched, and three derivatives
    flowing: Any  # (C, U) of the rates of the carried quantities
    integral: Any  # (C, U) of these quantities


class Free(NamedTuple):
    """The same without the inputs split off; rows over y."""

    width: Any  # (1,) Y
    chained: Any  # (1,) where the chains begin in y
    column: Any  # (Y,) which of z stand in y
    amplitude: Any  # (U,) of the kept constant and harmonics
    rates: Any  # (C + Y, Y) of the carried quantities and of y
    generator: Any  # (Y, Y) of y alone
    watched: Any  # (4 W, Y) what is watched, and three derivatives
    calm: Any  # (4 W, Y) the same without the fast modes
    fast: Any  # (W, Y) the fast modes' part of what is watched
    fine: Any  # (1,) level of the finest step


class Modes(NamedTuple):
    """The generator without chains as right T left, T upper triangular."""

    schur: Any  # (N, N) Schur form of A, transposed
    basis: Any  # (N, N) its vectors, transposed
    triangle: Any  # (Y, Y) T; columns of chains: what they push
    left: Any  # (Y, Y) V^-1
    right: Any  # (Y, Y) V
    begins: Any  # (blocks + 1,) where blocks begin, and where the last ends
    simple: Any  # (Y,) whether a mode is a block of its own, 1 or 0


class Bounds(NamedTuple):
    """Bounds on fourth derivatives: W rows, W without the fast modes, W of the fast modes alone."""

    count: Any  # (1,) J
    rows: Any  # (J, Y)
    weights: Any  # (3 W, J)
    constant: Any  # (3 W,)
    pushed: Any  # (3 W, Q) on what chains drive
    followed: Any  # (W, Q) what the deflections follow of chains


class Scratch(NamedTuple):
    """For tables, series and exponentials."""

    one: Any
    two: Any
    three: Any
    four: Any
    largest: Any  # (ORDER + 1,) Taylor coefficient of every order


class Solver(NamedTuple):
    """A linear system with one right side."""

    matrix: Any  # (N, N)
    force: Any  # (N,)
    solution: Any  # (N,)
    residual: Any  # (N,)
    pivots: Any  # (N,)


class Lapack(NamedTuple):
    """What zgees is handed."""

    letters: Any  # (2,) Schur vectors, yes; sorting, no
    integers: Any  # (5,) sizes; the last is its answer, 0 where it found the Schur form
    room: Any  # for its work
    arguments: Any  # (15,) addresses


class Workspace(NamedTuple):
    """All of it."""

    common: Common
    laws: Laws  # offsets over the constant input's scale; the pieces of auxiliaries follow those of the elements
    auxiliaries: Auxiliaries
    region: Region
    free: Free
    modes: Modes
    bounds: Bounds
    scratch: Scratch
    solver: Solver
    lapack: Lapack


class Sizes(NamedTuple):
    """How large they are."""

    elements: int  # m
    inertias: int  # n
    deflections: int  # r
    states: int  # N
    harmonics: int  # H
    chain: int  # Q
    references: int  # R
    clearances: int  # K
    auxiliaries: int
    pieces: int  # P


SLACK = 1.0 + 1e-6
"""Covers the rounding of a region's decomposition."""
LARGEST = 2.0
"""A particular solution is used up to this many times an ordinary motion, and corner scales of what is watched."""
FAST_ROUNDING = 1e-10
"""Corner scales, added to the bound on fast modes: what the decomposition itself may round."""
ELIMINATION = 100.0
"""Largest entry of an elimination between blocks; any value is rigorous, this one keeps bounds tight."""
BUILT, NOT_FINITE, NO_SCHUR_FORM = range(3)
"""What became of a region."""
REASONS = {NOT_FINITE: "its rates are not finite", NO_SCHUR_FORM: "its eigenvalues are not found"}
POWERS = 4
"""Of the generator, for the Taylor window."""
_LINE = 8  # numbers in a cache line
_LAPACK = 34  # complex numbers a row that zgees works with


def workspace_for(sizes: Sizes) -> tuple[Workspace, NDArray[np.int64]]:
    """All arrays, zero but for what zgees is handed; and address and shape of each in turn, (words,)."""
    plan, words, addresses, count = _laid_out(sizes)
    block = np.zeros(count)
    arrays = iter([np.ndarray(shape, kind, block, begin) for group in plan for shape, kind, begin in group])
    groups: tuple[Any, ...] = plan
    workspace = Workspace(*(type(group)(*islice(arrays, len(group))) for group in groups))
    _prepare_lapack(workspace)
    return workspace, words + block.ctypes.data * addresses


@cache
def _laid_out(sizes: Sizes) -> tuple[Workspace, NDArray[np.int64], NDArray[np.int64], int]:
    """Where every array stands in one block of numbers.

    Returns
    -------
    tuple[Workspace, NDArray[np.int64], NDArray[np.int64], int]
        Shape, kind and first byte of every array; the words of a block at address 0; which of these are addresses, 1
        or 0; how many numbers the block holds.
    """
    count = 0
    words: list[int] = []
    addresses: list[int] = []

    def place(shape: tuple[int, ...], kind: Any) -> Any:
        nonlocal count
        begin, count = 8 * count, count + _LINE * -(-prod(shape) * np.dtype(kind).itemsize // (8 * _LINE))
        words.extend((begin, *shape))
        addresses.extend((1, *(0 for _ in shape)))
        return shape, kind, begin

    plan = _shapes(sizes, place)
    return plan, np.array(words), np.array(addresses), count


def _shapes(sizes: Sizes, allocate: Callable[[tuple[int, ...], Any], Any]) -> Workspace:
    """What ``place`` makes of the shape and kind of every array."""
    m, n, r, states, harmonics, chain, references, clearances, auxiliaries, pieces = sizes
    inputs, watched, carried = 1 + 2 * harmonics, clearances + auxiliaries, references + clearances
    members, z = m + auxiliaries, states + inputs + chain
    rows = max(carried + z, ORDER + 1)

    def floats(*shape: int) -> Any:
        return allocate(shape, np.float64)

    def integers(*shape: int) -> Any:
        return allocate(shape, np.int64)

    def waves(*shape: int) -> Any:
        return allocate(shape, np.complex128)

    common = Common(
        motion=floats(r, z),
        balance=floats(n, z),
        rows=floats(m, n),
        deflection=floats(m, z),
        rate=floats(m, z),
        references=floats(references, z),
        seen=floats(2 * clearances, z),
        curvature=floats(clearances, z),
        inertia=floats(n),
        pace=floats(n),
        corner_scale=floats(watched),
        frequency=floats(harmonics),
        amplitude=floats(1 + harmonics),
        input_size=floats(inputs),
        clearances=integers(clearances),
        cornered=integers(clearances),
        limits=floats(LIMITS),
        coarsest=integers(1),
        links=integers(1),
    )
    laws = Laws(integers(members + 1), *(floats(pieces) for _ in Laws._fields[1:]))
    auxiliary = Auxiliaries(
        element=integers(auxiliaries),
        state=integers(auxiliaries),
        scale=floats(auxiliaries),
        by_memory=floats(pieces),
        moves=floats(pieces),
        by_deflection=floats(pieces),
        by_rate=floats(pieces),
        by_itself=floats(pieces),
    )
    region = Region(
        pieces=integers(members),
        force=floats(m, z),
        acceleration=floats(n, z),
        matrix=floats(states, z),
        carried=floats(carried, z),
        watched=floats(3 * watched, z),
        kept=integers(inputs),
        particular=floats(states, inputs),
        forced=floats(4 * watched, inputs),
        flowing=floats(carried, inputs),
        integral=floats(carried, inputs),
    )
    free = Free(
        width=integers(1),
        chained=integers(1),
        column=integers(z),
        amplitude=floats(inputs),
        rates=floats(carried + z, z),
        generator=floats(z, z),
        watched=floats(4 * watched, z),
        calm=floats(4 * watched, z),
        fast=floats(watched, z),
        fine=integers(1),
    )
    modes = Modes(
        schur=waves(states, states),
        basis=waves(states, states),
        triangle=waves(z, z),
        left=waves(z, z),
        right=waves(z, z),
        begins=integers(z + 1),
        simple=integers(z),
    )
    bounds = Bounds(
        count=integers(1),
        rows=waves(z, z),
        weights=floats(3 * watched, z),
        constant=floats(3 * watched),
        pushed=floats(3 * watched, chain),
        followed=floats(watched, chain),
    )
    return Workspace(
        common,
        laws,
        auxiliary,
        region,
        free,
        modes,
        bounds,
        Scratch(floats(rows, z), floats(rows, z), floats(rows, z), floats(rows, z), floats(ORDER + 1)),
        Solver(waves(states, states), waves(states), waves(states), waves(states), integers(states)),
        Lapack(allocate((2,), np.uint8), allocate((5,), np.int32), waves((_LAPACK + 2) * states), integers(15)),
    )


def _prepare_lapack(workspace: Workspace) -> None:
    """Write the addresses of zgees' fifteen arguments down; the function that would sort is none."""
    modes, lapack = workspace.modes, workspace.lapack
    states = len(modes.schur)
    n, letter, begin = lapack.integers.ctypes.data, lapack.letters.ctypes.data, lapack.room.ctypes.data
    size, count, length, answer = (n + 4 * i for i in range(1, 5))
    values, reals = begin + 16 * _LAPACK * states, begin + 16 * (_LAPACK + 1) * states
    arguments = (
        letter,
        letter + 1,
        0,
        n,
        modes.schur.ctypes.data,
        size,
        count,
        values,
        modes.basis.ctypes.data,
        size,
        begin,
        length,
        reals,
        0,
        answer,
    )
    integers = states, states, 0, _LAPACK * states, 0
    for array, numbers in ((lapack.letters, b"VN"), (lapack.integers, integers), (lapack.arguments, arguments)):
        for i, number in enumerate(numbers):
            array[i] = number
