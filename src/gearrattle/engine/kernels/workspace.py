"""The work arrays in which the regions of a driveline are built one after the other.

    m                 elements
    n                 inertias
    r                 deflections that are states
    S                 memories of auxiliaries
    N = r + n + S     states
    H                 harmonics
    U = 1 + 2 H       inputs: a constant, then cosines and sines
    D                 degree of the signals
    Q                 entries of all chains: a *chain* is a signal with its derivatives (``system.piecewise_signals``)
    Z = N + U + Q     entries of z = (states, inputs, chains)
    Y <= Z            entries of y = (states, inputs kept as states, chains)
    K                 clearances
    W                 watched quantities: the clearances, then the auxiliaries
    R                 reference angles
    C = R + K         carried quantities: reference angles, then force integrals of the clearances
    P                 pieces of all elements, then of all auxiliaries
    J                 rows that bound the fourth derivatives

Every array has the largest size that a region may need. ``Free.width`` and ``Bounds.used`` give the sizes Y and J that
the present region uses. Arrays are grouped so that a compiled stage receives only the groups that it uses: every array
argument costs compile time.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import islice
from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels.arrays import (
    ByteVector,
    ComplexMatrix,
    ComplexVector,
    Int32Vector,
    IntVector,
    Matrix,
    Vector,
)
from gearrattle.engine.kernels.laws import Laws
from gearrattle.engine.kernels.march_arrays import ORDER


class Common(NamedTuple):
    """Arrays that the regions of a driveline share; rows have one entry for each entry of z."""

    motion: Matrix  # (r, Z) rates of the deflections that are states
    balance: Matrix  # (n, Z) external torques minus drag torques
    rows: Matrix  # (m, n) deflections of the elements per angle of the bodies
    deflection: Matrix  # (m, Z) of every element
    rate: Matrix  # (m, Z)
    references: Matrix  # (R, Z) rates of the reference angles
    seen: Matrix  # (2 K, Z) deflections of the clearances, then their rates, in corner scales
    curvature: Matrix  # (K, Z) e'' of the clearances [SI]
    inertia: Vector  # (n,)
    pace: Vector  # (n,) T times the scale of every velocity
    corner_scale: Vector  # (W,)
    frequency: Vector  # (H,) radians per period
    amplitude: Vector  # (1 + H,)
    input_size: Vector  # (U,) the amplitude of every input
    clearances: IntVector  # (K,) elements
    cornered: IntVector  # (K,) 1: the clearance has a corner other than zero
    limits: Vector  # (LIMITS,) by the indices PERIOD ...
    coarsest: IntVector  # (1,) least level that the finest step may have
    links: IntVector  # (1,) D + 1, entries of one chain


PERIOD, LARGEST_STATE, FAST, CHAIN_PACE, HORIZON, LIMITS = range(6)
"""Indices of ``Common.limits``: T [s]; largest scaled state of a particular solution that is split off; frequency from
which a mode counts as fast [radians per period]; pace of the chains; time for which bounds must hold [periods]."""


class Auxiliaries(NamedTuple):
    """Data of every auxiliary, and of its pieces, which follow those of the elements in ``Laws``."""

    element: IntVector  # (auxiliaries,)
    state: IntVector  # (auxiliaries,) index of its memory among the states; -1: no memory
    scale: Vector  # (auxiliaries,) scale of its memory
    by_memory: Vector  # (P,) force per unit of memory
    moves: Vector  # (P,) 1: the memory changes with time; 0: it does not
    by_deflection: Vector  # (P,) coefficient of the element's deflection in the watched quantity
    by_rate: Vector  # (P,) coefficient of the deflection's rate
    by_itself: Vector  # (P,) coefficient of the memory


class Region(NamedTuple):
    """The region that is being built; rows have one entry for each entry of z."""

    pieces: IntVector  # (m + auxiliaries,)
    force: Matrix  # (m, Z)
    acceleration: Matrix  # (n, Z)
    matrix: Matrix  # (N, Z) A and G: rates of the states
    carried: Matrix  # (C, Z) rates of the carried quantities
    watched: Matrix  # (3 W, Z) the watched quantities, then their first, then their second derivatives
    kept: IntVector  # (U,) 1: the input is kept as a state; 0: it is split off
    particular: Matrix  # (N, U) P
    forced: Matrix  # (4 W, U) response of the watched quantities to the inputs split off, with three derivatives
    flowing: Matrix  # (C, U) response of the rates of the carried quantities to these inputs
    integral: Matrix  # (C, U) time integral of that response


class Free(NamedTuple):
    """The same region without the inputs split off; rows have one entry for each entry of y."""

    width: IntVector  # (1,) Y
    chained: IntVector  # (1,) where the chains begin in y
    column: IntVector  # (Y,) index in z of every entry of y
    amplitude: Vector  # (U,) amplitudes of the inputs that are kept
    rates: Matrix  # (C + Y, Y) of the carried quantities and of y
    generator: Matrix  # (Y, Y) of y alone
    watched: Matrix  # (4 W, Y) the watched quantities with three derivatives
    calm: Matrix  # (4 W, Y) the same without the fast modes
    fast: Matrix  # (W, Y) the part of the watched quantities that the fast modes make
    fine: IntVector  # (1,) level of the finest step


class Modes(NamedTuple):
    """The generator without the chains, factored into right T left with T upper triangular."""

    schur: ComplexMatrix  # (N, N) Schur form of A, transposed
    basis: ComplexMatrix  # (N, N) Schur vectors of A, transposed
    triangle: ComplexMatrix  # (Y, Y) T; columns of chains: their input to the modes
    left: ComplexMatrix  # (Y, Y) V^-1
    right: ComplexMatrix  # (Y, Y) V
    begins: IntVector  # (blocks + 1,) where blocks begin, and where the last ends
    simple: IntVector  # (Y,) 1: the mode is a block of size one; 0: it is not


class Bounds(NamedTuple):
    """Bounds, W of each kind: on fourth derivatives; the same without the fast modes; on the fast modes alone."""

    used: IntVector  # (1,) J
    rows: ComplexMatrix  # (J, Y)
    weights: Matrix  # (3 W, J)
    constant: Vector  # (3 W,)
    pushed: Matrix  # (3 W, Q) bounds on what chains drive
    followed: Matrix  # (W, Q) the part of the deflections that the chains make directly


class Scratch(NamedTuple):
    """Temporary arrays for tables, series and exponentials."""

    one: Matrix
    two: Matrix
    three: Matrix
    four: Matrix
    largest: Vector  # (ORDER + 1,) Taylor coefficient of every order


class Solver(NamedTuple):
    """A linear system with one right side."""

    matrix: ComplexMatrix  # (N, N)
    force: ComplexVector  # (N,)
    solution: ComplexVector  # (N,)
    residual: ComplexVector  # (N,)
    pivots: IntVector  # (N,)


class Lapack(NamedTuple):
    """Arguments of zgees (LAPACK)."""

    letters: ByteVector  # (2,) JOBVS = V: Schur vectors are computed; SORT = N: eigenvalues are not sorted
    integers: Int32Vector  # (5,) sizes; the last is INFO, 0 if the Schur form was found
    room: ComplexVector  # WORK, W and RWORK
    arguments: IntVector  # (15,) addresses of the arguments


class Workspace(NamedTuple):
    """All groups of arrays."""

    common: Common
    laws: Laws  # offsets divided by the constant input's scale; the pieces of auxiliaries follow those of the elements
    auxiliaries: Auxiliaries
    region: Region
    free: Free
    modes: Modes
    bounds: Bounds
    scratch: Scratch
    solver: Solver
    lapack: Lapack


class Sizes(NamedTuple):
    """Sizes of the arrays."""

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
"""Factor on every bound that covers the rounding of the decomposition."""
LARGEST = 2.0
"""A particular solution is split off if its states are at most this many times those of an ordinary motion, and its
deflections at most this many corner scales."""
FAST_ROUNDING = 1e-10
"""Addition to the bound on fast modes that covers the rounding of the decomposition [corner scales]."""
ELIMINATION = 100.0
"""Largest entry of the matrices that eliminate the coupling of blocks. Bounds hold for any value; this one keeps them
close."""
BUILT, NOT_FINITE, NO_SCHUR_FORM = range(3)
"""Result of building a region."""
REASONS = {NOT_FINITE: "its rates are not finite", NO_SCHUR_FORM: "its eigenvalues are not found"}
POWERS = 4
"""Number of powers of the generator kept for the Taylor window."""
_LINE = 8  # doubles in a cache line
_LAPACK = 34  # complex work numbers of zgees per row


def workspace_for(sizes: Sizes) -> tuple[Workspace, NDArray[np.int64]]:
    """Return all arrays, zero except the arguments of zgees; and (words,) the address and the shape of every array."""
    plan, words, addresses, count = _laid_out(sizes)
    block = np.zeros(count)
    groups: tuple[Any, ...] = plan
    arrays = iter([np.ndarray(shape, kind, block, begin) for group in groups for shape, kind, begin in group])
    workspace = Workspace(*(type(group)(*islice(arrays, len(group))) for group in groups))
    _prepare_lapack(workspace)
    return workspace, words + block.ctypes.data * addresses


@cache
def _laid_out(sizes: Sizes) -> tuple[Workspace, NDArray[np.int64], NDArray[np.int64], int]:
    """Return the position of every array in one block of memory.

    Returns shape, type and first byte of every array; the words for a block at address 0; for every word 1 if it is an
        address, else 0; the size of the block in numbers of 8 bytes.
    """
    count = 0
    words: list[int] = []
    addresses: list[int] = []

    def place(shape: tuple[int, ...], kind: Any) -> Any:
        nonlocal count
        begin = 8 * count
        count = count + _LINE * -(-prod(shape) * np.dtype(kind).itemsize // (8 * _LINE))
        words.extend((begin, *shape))
        addresses.extend((1, *(0 for _ in shape)))
        return shape, kind, begin

    plan = _shapes(sizes, place)
    return plan, np.array(words), np.array(addresses), count


def _shapes(sizes: Sizes, allocate: Callable[[tuple[int, ...], Any], Any]) -> Workspace:
    """Call ``allocate`` with the shape and type of every array; return its answers in the groups of a workspace."""
    m, n, r, states, harmonics, chain, references, clearances, auxiliaries, pieces = sizes
    inputs = 1 + 2 * harmonics
    watched = clearances + auxiliaries
    carried = references + clearances
    members = m + auxiliaries
    z = states + inputs + chain
    rows = max(carried + z, ORDER + 1)

    def floats(*shape: int) -> Any:
        return allocate(shape, np.float64)

    def integers(*shape: int) -> Any:
        return allocate(shape, np.int64)

    def complexes(*shape: int) -> Any:
        return allocate(shape, np.complex128)

    # what all regions share
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
    # one region over z, then over y
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
    # its Schur form and its bounds
    modes = Modes(
        schur=complexes(states, states),
        basis=complexes(states, states),
        triangle=complexes(z, z),
        left=complexes(z, z),
        right=complexes(z, z),
        begins=integers(z + 1),
        simple=integers(z),
    )
    bounds = Bounds(
        used=integers(1),
        rows=complexes(z, z),
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
        Solver(complexes(states, states), complexes(states), complexes(states), complexes(states), integers(states)),
        Lapack(allocate((2,), np.uint8), allocate((5,), np.int32), complexes((_LAPACK + 2) * states), integers(15)),
    )


def _prepare_lapack(workspace: Workspace) -> None:
    """Store the addresses of the fifteen arguments of zgees; the sorting function (SELECT) is null."""
    modes = workspace.modes
    lapack = workspace.lapack
    states = len(modes.schur)
    # addresses of its integers, letters and work arrays
    n = lapack.integers.ctypes.data
    job = lapack.letters.ctypes.data
    work = lapack.room.ctypes.data
    leading, sorted_count, work_size, info = (n + 4 * i for i in range(1, 5))
    eigenvalues = work + 16 * _LAPACK * states
    real_work = work + 16 * (_LAPACK + 1) * states
    # zgees(JOBVS, SORT, SELECT, N, A, LDA, SDIM, W, VS, LDVS, WORK, LWORK, RWORK, BWORK, INFO)
    arguments = (
        job,
        job + 1,
        0,
        n,
        modes.schur.ctypes.data,
        leading,
        sorted_count,
        eigenvalues,
        modes.basis.ctypes.data,
        leading,
        work,
        work_size,
        real_work,
        0,
        info,
    )
    # N, leading dimension, SDIM, LWORK, INFO
    integers = states, states, 0, _LAPACK * states, 0
    for array, numbers in ((lapack.letters, b"VN"), (lapack.integers, integers), (lapack.arguments, arguments)):
        for i, number in enumerate(numbers):
            array[i] = number
