"""The right-hand side, its Jacobian and its corners as C functions, for libraries that take callbacks.

A C library passes one pointer of the caller to a callback. Here it is the address of a *block* of integers with the
sizes of the field and the addresses of its arrays. The library's state is z = y / size, in units of an ordinary motion
(``solvers.vector_field``), so that one tolerance fits all states. For restarts at corners the block holds a field in
which every element has one piece; ``bounds`` are then the corners of these pieces.

Vectors and matrices of SUNDIALS are read by its accessors, whose addresses are the first words of the block.
"""

from __future__ import annotations

import numpy as np

from gearrattle.engine.kernels._jit import callback, kernel
from gearrattle.engine.kernels._llvm import array_at, call_pointer
from gearrattle.engine.kernels.equation_of_motion import Field, derivative, element_states
from gearrattle.engine.kernels.laws import Laws

VECTOR, ENTRIES, INERTIAS, ELEMENTS, DEFLECTIONS, REFERENCES, PIECES, HARMONICS, WATCHED, FIELD = range(10)
"""Words of a block: two accessors, seven sizes, then addresses, first those of the field's arrays."""
ARRAYS = len(Field._fields) - 1 + len(Laws._fields)
SIZE, STATE, WAVE, DEFLECTION, RATE, PIECE, FORCE, CLEARANCES, BOUNDS = range(FIELD + ARRAYS, FIELD + ARRAYS + 9)
LENGTH = BOUNDS + 1


@kernel
def _field(b):
    """The field a block describes."""
    # sizes
    n = b[INERTIAS]
    m = b[ELEMENTS]
    r = b[DEFLECTIONS]
    h = b[HARMONICS]
    return Field(
        # inertia, drag, rows and coordinates
        array_at(b[FIELD], (n,), np.float64),
        array_at(b[FIELD + 1], (n,), np.float64),
        array_at(b[FIELD + 2], (m, n), np.float64),
        array_at(b[FIELD + 3], (r, n), np.float64),
        array_at(b[FIELD + 4], (m, r), np.float64),
        array_at(b[FIELD + 5], (b[REFERENCES],), np.int64),
        # torques, transmission errors and cycles of the harmonics
        array_at(b[FIELD + 6], (n,), np.float64),
        array_at(b[FIELD + 7], (n, h), np.float64),
        array_at(b[FIELD + 8], (n, h), np.float64),
        array_at(b[FIELD + 9], (m, h), np.float64),
        array_at(b[FIELD + 10], (m, h), np.float64),
        array_at(b[FIELD + 11], (h,), np.float64),
        # laws of the elements, piece by piece
        Laws(
            array_at(b[FIELD + 12], (m + 1,), np.int64),
            array_at(b[FIELD + 13], (b[PIECES],), np.float64),
            array_at(b[FIELD + 14], (b[PIECES],), np.float64),
            array_at(b[FIELD + 15], (b[PIECES],), np.float64),
            array_at(b[FIELD + 16], (b[PIECES],), np.float64),
            array_at(b[FIELD + 17], (b[PIECES],), np.float64),
        ),
        array_at(b[FIELD + 18], (1,), np.float64)[0],
    )


@kernel
def _states(b):
    """S, the length of y."""
    return b[DEFLECTIONS] + b[INERTIAS] + b[REFERENCES] + b[ELEMENTS]


@kernel
def _scratch(b):
    """Work arrays for the elements' states."""
    m = b[ELEMENTS]
    return (
        array_at(b[WAVE], (2 * b[HARMONICS],), np.float64),
        array_at(b[DEFLECTION], (m,), np.float64),
        array_at(b[RATE], (m,), np.float64),
        array_at(b[PIECE], (m,), np.float64),
        array_at(b[FORCE], (m,), np.float64),
    )


@kernel
def _slopes(b, time, z, out):
    """Write z' to ``out``; return 1, a request for a shorter step, if it is not finite, else 0."""
    count = _states(b)
    size = array_at(b[SIZE], (count,), np.float64)
    y = array_at(b[STATE], (count,), np.float64)
    wave, deflection, rate, piece, force = _scratch(b)
    for i in range(count):
        y[i] = z[i] * size[i]
    derivative(_field(b), time, y, wave, deflection, rate, piece, force, out)
    total = 0.0
    for i in range(count):
        out[i] /= size[i]
        total += abs(out[i])
    return 0 if np.isfinite(total) else 1


@kernel
def _jacobian(b, time, z, out):
    """Write dz'/dz to out (S, S), column by column: out[j, i] = d z'_i / d z_j; constant inside a region."""
    field = _field(b)
    count = _states(b)
    size = array_at(b[SIZE], (count,), np.float64)
    y = array_at(b[STATE], (count,), np.float64)
    wave, deflection, rate, piece, force = _scratch(b)
    # the state in SI units, and the pieces of the elements
    for i in range(count):
        y[i] = z[i] * size[i]
    element_states(field, time, y, wave, deflection, rate, piece, force)
    r = b[DEFLECTIONS]
    n = b[INERTIAS]
    references = b[REFERENCES]
    out[:] = 0.0
    # deflections, drag and angles of the reference inertias
    for i in range(n):
        for j in range(r):
            out[r + i, j] = field.basis[j, i]
        out[r + i, r + i] = -field.drag[i] / field.inertia[i]
    for i in range(references):
        out[r + field.references[i], r + n + i] = 1.0
    for k in range(b[ELEMENTS]):
        # forces: stiffness and damping of the present pieces
        p = field.laws.first[k] + int(piece[k])
        for j in range(r + n):
            stiff = field.laws.stiffness[p] * field.combination[k, j] if j < r else 0.0
            change = stiff if j < r else field.laws.damping[p] * field.rows[k, j - r]
            out[j, r + n + references + k] = change
            for i in range(n):
                out[j, r + i] -= field.rows[k, i] * change / field.inertia[i]
    # to scaled states
    for j in range(r + n):
        for i in range(count):
            out[j, i] *= size[j] / size[i]


@kernel
def _opened(b, vector):
    """The numbers (S,) of one of SUNDIALS' vectors."""
    return array_at(call_pointer(b[VECTOR], (vector,)), (_states(b),), np.float64)


@callback("dppp")
def plain_slopes(time, z, out, user):
    """z' for plain arrays (S,)."""
    b = array_at(user, (LENGTH,), np.int64)
    return _slopes(b, time, array_at(z, (_states(b),), np.float64), array_at(out, (_states(b),), np.float64))


@callback("dppp")
def plain_jacobian(time, z, out, user):
    """The Jacobian for plain arrays: z (S,), out (S, S) column by column."""
    b = array_at(user, (LENGTH,), np.int64)
    count = _states(b)
    _jacobian(b, time, array_at(z, (count,), np.float64), array_at(out, (count, count), np.float64))
    return 0


@callback("dppp")
def slopes(time, z, out, user):
    """CVRhsFn."""
    b = array_at(user, (LENGTH,), np.int64)
    return _slopes(b, time, _opened(b, z), _opened(b, out))


@callback("dppppppp")
def jacobian(time, z, _slopes_there, matrix, user, _one, _two, _three):
    """CVLsJacFn for a dense matrix."""
    b = array_at(user, (LENGTH,), np.int64)
    count = _states(b)
    entries = array_at(call_pointer(b[ENTRIES], (matrix,)), (count, count), np.float64)
    _jacobian(b, time, _opened(b, z), entries)
    return 0


@callback("dppp")
def corners(time, z, out, user):
    """CVRootFn: distances of every clearance from the lower and the upper corner of its held piece, positive inside."""
    b = array_at(user, (LENGTH,), np.int64)
    count = _states(b)
    watched = b[WATCHED]
    size = array_at(b[SIZE], (count,), np.float64)
    y = array_at(b[STATE], (count,), np.float64)
    values = _opened(b, z)
    wave, deflection, rate, piece, force = _scratch(b)
    for i in range(count):
        y[i] = values[i] * size[i]
    element_states(_field(b), time, y, wave, deflection, rate, piece, force)
    inside = array_at(out, (2 * watched,), np.float64)
    clearances = array_at(b[CLEARANCES], (watched,), np.int64)
    bounds = array_at(b[BOUNDS], (watched, 2), np.float64)
    for i in range(watched):
        d = deflection[clearances[i]]
        inside[2 * i] = d - bounds[i, 0] if bounds[i, 0] > -np.inf else 1.0
        inside[2 * i + 1] = bounds[i, 1] - d if bounds[i, 1] < np.inf else 1.0
    return 0
