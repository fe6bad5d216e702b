"""Regions built with NumPy, LAPACK and extended precision, formula by formula: the oracle of the compiled stages.

Takes a ``Flow`` and pieces; gives what ``system.region.build_region`` gives, but for its tables.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack, schur

from gearrattle.engine.kernels.march_arrays import LONGEST
from gearrattle.engine.kernels.workspace import ELIMINATION, FAST_ROUNDING, LARGEST
from gearrattle.engine.system.flow import Flow, Pieces
from gearrattle.engine.system.forced_response import Split, oscillation
from gearrattle.engine.system.majorant import Majorant
from gearrattle.engine.system.region import Region, exponential_increments, finest_level
from gearrattle.engine.system.region_arrays import FAST_MODES, level_of_turns

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
ComplexArray = NDArray[np.complex128]
SLACK = 1.0 + 1e-6
_SOLVED = 1e-9


@dataclass(frozen=True)
class Block:
    """One invariant subspace of M: rows of V^-1, columns of V, and the upper-triangular block between them."""

    triangle: ComplexArray
    left: ComplexArray
    right: ComplexArray


def block_diagonalise(triangle: ComplexArray, vectors: ComplexArray, largest: float) -> list[Block]:
    """Split M = V T V^H (T upper triangular, V unitary) into blocks.

    Parameters
    ----------
    triangle
        (Z, Z) T.
    vectors
        (Z, Z) V.
    largest
        bound on the entries of every elimination; larger means more, but worse conditioned, blocks.

    Returns
    -------
    list[Block]
        Blocks with M = sum right @ triangle @ left, left_i right_j = identity if i = j, else 0.
    """
    size = triangle.shape[0]
    t, v = np.asfortranarray(triangle), np.asfortranarray(vectors)
    bounds = [0]
    while bounds[-1] < size:
        begin, end = bounds[-1], bounds[-1] + 1
        while end < size and np.any(t[begin:end, end:]):
            coupling, scale, _ = lapack.ztrsyl(t[begin:end, begin:end], t[end:, end:], -t[begin:end, end:], isgn=-1)
            if np.abs(coupling).max() <= largest * scale:
                elimination = coupling / scale
                v[:, end:] += v[:, begin:end] @ elimination
                t[begin:end, end:] = 0.0
                break
            centre = np.diagonal(t)[begin:end].mean()
            nearest = end + int(np.argmin(np.abs(np.diagonal(t)[end:] - centre)))
            if (
                nearest > end
            ):  # the columns from `begin` on are decoupled from all earlier ones, so the swap stays inside
                inner, rotation, _ = lapack.ztrexc(
                    np.asfortranarray(t[begin:, begin:]),
                    np.eye(size - begin, dtype=complex, order="F"),
                    nearest - begin + 1,
                    end - begin + 1,
                )
                t[begin:, begin:] = inner
                v[:, begin:] = v[:, begin:] @ rotation
            end += 1
        bounds.append(end)
    inverse: ComplexArray = np.linalg.inv(v).astype(np.complex128)
    return [Block(t[a:b, a:b].copy(), inverse[a:b].copy(), v[:, a:b].copy()) for a, b in pairwise(bounds)]


def integral(rows: Array, frequency: Array) -> Array:
    """(., U) Q with (Q u)' = rows u for all but the constant input, whose column is zero."""
    count = frequency.size
    out = np.zeros_like(rows)
    out[:, 1 : 1 + count] = -rows[:, 1 + count :] / frequency
    out[:, 1 + count :] = rows[:, 1 : 1 + count] / frequency
    return out


def largest(rows: Array, amplitude: Array) -> Array:
    """(., H) largest value over all phases of each harmonic's part of rows u; ``amplitude`` (1 + H,)."""
    count = amplitude.size - 1
    return np.asarray(np.hypot(rows[:, 1 : 1 + count], rows[:, 1 + count :]) * amplitude[1:])


def split_inputs(
    free: Array, driven: Array, frequency: Array, *, amplitude: Array, watched: Array, typical: float
) -> Split:
    """Solve for P, input by input, and keep those whose particular solution is too large.

    Parameters
    ----------
    free, driven
        (N, N) A and (N, U) G.
    frequency
        (H,) radians a period.
    amplitude
        (1 + H,) constant amplitudes in u.
    watched
        (K, N) deflections by state, in corner scales.
    typical
        size of the states in an ordinary motion.
    """
    count = frequency.size
    particular, kept = np.zeros(driven.shape), np.zeros(driven.shape[1], dtype=bool)
    for j, solution in enumerate(responses(free, driven, frequency)):
        size = np.abs(solution) * amplitude[j]
        seen = np.abs(watched @ solution) * amplitude[j]
        if not (size.max() <= LARGEST * typical and seen.max(initial=0.0) <= LARGEST):
            kept[[0] if j == 0 else [j, j + count]] = True
        elif j == 0:
            particular[:, 0] = solution.real
        else:
            particular[:, j], particular[:, j + count] = solution.real, -solution.imag
    return Split(particular, np.flatnonzero(kept))


def typical_size(flow: Flow) -> float:
    """What fills a clearance, and what the inputs make of the stiffest pieces, in a period at most."""
    stiffest = tuple(int(np.argmax(law.stiffness)) for law in flow.system.laws)
    matrix, n = flow.generator(stiffest), flow.states
    made = responses(matrix[:n, :n], matrix[:n, n:], flow.frequency)
    pushed = np.abs(matrix[:n, n : n + 1 + flow.frequency.size]).max(axis=0, initial=0.0)
    reached = np.fmin(pushed, [np.abs(x).max(initial=0.0) for x in made])
    sizes = list(reached * flow.scaling.inputs)
    for k, scale in zip(flow.system.clearances, flow.corner_scale, strict=True):
        if np.any(flow.system.laws[k].corners != 0.0):
            sizes.append(float(scale / np.abs(flow.deflection[k]).max()))
    return max(sizes, default=0.0) or 1.0


def responses(free: Array, driven: Array, frequency: Array) -> list[NDArray[np.complex128]]:
    """(N,) complex response to the constant, then to each cosine - i sine; nan where there is none."""
    count = frequency.size
    forces = [driven[:, 0] + 0j] + [driven[:, j] - 1j * driven[:, j + count] for j in range(1, 1 + count)]
    return [
        _solve(free, w, force.astype(np.complex128)) if np.any(force) else np.zeros(len(free), dtype=np.complex128)
        for w, force in zip([0.0, *frequency.tolist()], forces, strict=True)
    ]


def _solve(matrix: Array, frequency: float, force: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """(i w - A)^-1 g, refined once with a residual in the longest floats there are; nan where it does not exist."""
    system = 1j * frequency * np.eye(len(matrix)) - matrix
    nothing = np.full(force.shape, np.nan + 0j)
    try:
        solution = np.linalg.solve(system, force)
        residual = force.astype(np.clongdouble) - system.astype(np.clongdouble) @ solution.astype(np.clongdouble)
        solution = solution + np.linalg.solve(system, residual.astype(np.complex128))
    except np.linalg.LinAlgError:
        return nothing
    left = np.abs(force - system @ solution).max()  # a singular matrix may pass for a regular one
    return np.asarray(solution if left <= _SOLVED * np.abs(force).max() else nothing)


def triangular_form(generator: Array, states: int, frequency: Array) -> tuple[ComplexArray, ComplexArray]:
    """Complex Schur form of M = [A G; 0 S]: Schur of A, and the known eigenvectors of the oscillators S."""
    width = generator.shape[0]
    inner, basis = schur(generator[:states, :states], output="complex")
    vectors = np.zeros((width, width), dtype=complex)
    vectors[:states, :states] = basis
    vectors[states, states] = 1.0
    triangle = np.zeros((width, width), dtype=complex)
    triangle[:states, :states] = np.triu(inner)
    cosine = np.arange(states + 1, states + 1 + frequency.size)
    sine = cosine + frequency.size
    vectors[cosine, cosine] = vectors[cosine, sine] = 1.0 / np.sqrt(2.0)
    vectors[sine, cosine], vectors[sine, sine] = -1j / np.sqrt(2.0), 1j / np.sqrt(2.0)
    triangle[cosine, cosine], triangle[sine, sine] = 1j * frequency, -1j * frequency
    triangle[:states, states:] = basis.conj().T @ generator[:states, states:] @ vectors[states:, states:]
    return triangle, vectors


def majorant(
    generator: Array, states: int, *, frequency: Array, amplitude: Array, deflection: Array, horizon: float, fast: float
) -> Majorant:
    """Build the bounds of one region.

    Parameters
    ----------
    generator
        (Z, Z) M.
    states
        N, how many leading entries of z are states; the rest are inputs.
    frequency
        (H,) radians a period of the oscillators.
    amplitude
        (1 + H,) constant amplitude of the inputs in z.
    deflection
        (K, Z) rows.
    horizon
        longest s the bounds must hold for.
    fast
        modes beyond this many radians a period count as fast.
    """
    triangle, vectors = triangular_form(generator, states, frequency)
    blocks = block_diagonalise(triangle, vectors, ELIMINATION)
    fourth = []
    weights = []
    swift = []
    part = np.zeros(deflection.shape)
    for block in blocks:
        shape, size = deflection @ block.right, block.left.shape[0]
        if size == 1:
            value = block.triangle[0, 0]
            fourth.append(value**4 * block.left)
            weights.append(np.abs(shape) * np.exp(max(value.real, 0.0) * horizon))
            if abs(value) > fast and np.any(block.left[:, :states]):
                swift.append(1.0 / abs(value) ** 4)
                part += (shape @ block.left).real
                continue
        else:
            metzler = np.abs(np.triu(block.triangle, 1)) + np.diag(np.maximum(block.triangle.diagonal().real, 0.0))
            fourth.append(np.linalg.matrix_power(block.triangle, 4) @ block.left)
            weights.append(np.abs(shape) @ _exponential(metzler * horizon))
        swift += [0.0] * size
    rows, is_fast = np.vstack(fourth), np.array(swift)
    weight = SLACK * np.hstack(weights) * _multiplicity(blocks)
    inputs_only = ~np.any(rows[:, :states], axis=1)
    constant = weight[:, inputs_only] @ _largest_of_inputs(rows[inputs_only, states:], amplitude)
    kept = ~inputs_only & np.any(weight > 0.0, axis=0)
    return Majorant(
        rows[kept],
        np.stack([weight, weight * (is_fast == 0.0), weight * is_fast])[:, :, kept],
        np.zeros((3, len(deflection), 0)),
        np.stack([constant, constant, np.zeros_like(constant)]),
        part,
    )


def _multiplicity(blocks: list[Block]) -> Array:
    """2 for a simple mode above the real axis whose conjugate is there too, 0 for that conjugate, else 1; row by row.

    A mode within rounding of the real axis is real: it is its own conjugate and counts once.
    """
    value = np.concatenate([np.diagonal(block.triangle) for block in blocks])
    simple = np.concatenate([np.full(len(block.triangle), len(block.triangle) == 1) for block in blocks])
    near = 1e-9 * np.abs(value)
    oscillates = np.abs(value.imag) > near
    apart = (np.abs(value[:, None] - value.conj()[None, :]) <= near[:, None]) & simple[None, :]
    paired = np.any(apart, axis=1) & oscillates & simple
    return np.where(paired, np.where(value.imag > 0.0, 2.0, 0.0), 1.0)


def _exponential(matrix: Array) -> Array:
    """exp of a matrix without negative entries: a Taylor series at norm one half, squared up; nothing cancels."""
    squarings = max(0, int(np.ceil(np.log2(max(float(matrix.sum(axis=0).max()), 1e-300)))) + 1)
    small = matrix / 2.0**squarings
    term = total = np.eye(len(matrix))
    for j in range(1, 16):
        term = term @ small / j
        total = total + term
    for _ in range(squarings):
        total = total @ total
    return np.asarray(total)


def _largest_of_inputs(rows: ComplexArray, amplitude: Array) -> Array:
    """Largest |row . u| over all phases, summed over harmonics; rows (J, 1 + 2 H) act on the inputs alone.

    max over phi of |p cos phi + q sin phi|^2 = (|p|^2 + |q|^2 + |p^2 + q^2|) / 2.
    """
    count = amplitude.size - 1
    p, q = rows[:, 1 : 1 + count], rows[:, 1 + count :]
    largest = np.sqrt(0.5 * (np.abs(p) ** 2 + np.abs(q) ** 2 + np.abs(p * p + q * q)))
    return np.asarray(np.abs(rows[:, 0]) * amplitude[0] + largest @ amplitude[1:])


def built_with_numpy(flow: Flow, pieces: Pieces) -> Region:
    """Tables, rows and bounds of the region in which every element is in the piece given."""
    n = flow.states
    matrix = flow.generator(pieces)
    oscillators = oscillation(flow.frequency)
    deflection, rate, curvature = flow.probe_rows(pieces)
    amplitude = flow.scaling.inputs
    split = split_inputs(
        matrix[:n, :n],
        matrix[:n, n:],
        flow.frequency,
        amplitude=amplitude,
        watched=deflection[:, :n],
        typical=typical_size(flow),
    )
    columns = np.r_[0:n, n + split.kept]
    generator, carried = matrix[np.ix_(columns, columns)], flow.carried_rows(pieces)
    forced = _forced_rows(deflection, split, n)
    flowing = _forced_rows(carried, split, n)
    fourth = largest(forced @ np.linalg.matrix_power(oscillators, 4), amplitude).sum(axis=1)
    fourth = np.stack([fourth, fourth, np.full(len(fourth), FAST_ROUNDING)])
    bound = _bound(flow, matrix, split, deflection=deflection, columns=columns)
    calm = [deflection[:, columns] - bound.fast]
    calm += [calm[0] @ np.linalg.matrix_power(generator, j) for j in (1, 2, 3)]
    watched = [deflection[:, columns], rate[:, columns], curvature[:, columns], curvature[:, columns] @ generator]
    fine = max(finest_level(generator), level_of_turns(flow.frequency))
    increments = exponential_increments(generator, carried[:, columns], fine)
    corners = [flow.system.laws[k].bounds(pieces[k]) for k in flow.system.clearances]
    limits = np.array(corners).reshape(-1, 2) / flow.corner_scale[:, None]
    return Region(
        pieces,
        split,
        generator,
        carried[:, columns],
        integral(flowing, flow.frequency),
        flowing[:, 0] * amplitude[0],
        increments,
        np.stack(watched),
        np.stack(calm),
        forced,
        replace(bound, constant=bound.constant + SLACK * fourth),
        limits[:, 0],
        limits[:, 1],
    )


def _forced_rows(rows: Array, split: Split, states: int) -> Array:
    """(., U) what rows over z make of the inputs split off."""
    direct = rows[:, states:].copy()
    direct[:, split.kept] = 0.0
    return direct + rows[:, :states] @ split.particular


def _bound(flow: Flow, matrix: Array, split: Split, *, deflection: Array, columns: IntArray) -> Majorant:
    """The majorant of the free motion and the kept inputs, its rows over y."""
    n, count = flow.states, flow.frequency.size
    harmonics = split.kept[(split.kept > 0) & (split.kept <= count)] - 1
    reduced = np.concatenate([np.arange(n + 1), n + 1 + harmonics, n + 1 + count + harmonics])
    inner = matrix[np.ix_(reduced, reduced)]
    if 0 not in split.kept:
        inner[:, n] = 0.0
    bound = majorant(
        inner,
        n,
        frequency=flow.frequency[harmonics],
        amplitude=flow.scaling.inputs[np.r_[0, 1 + harmonics]],
        deflection=deflection[:, reduced],
        horizon=2 * LONGEST,
        fast=FAST_MODES * float(flow.frequency.max(initial=2 * np.pi)),
    )
    present = np.isin(reduced, columns)
    return replace(bound, rows=bound.rows[:, present], fast=bound.fast[:, present])
