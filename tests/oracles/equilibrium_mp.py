"""Slow and obvious: the static equilibrium, by trying every combination of pieces.

Every free piece (zero slope between two corners) gets a spring of 1e-40 about its middle, which leaves a loaded gap
where it is and centres an unloaded one. Every free train has its last body held at angle zero and its means reduced by
the inertia forces of its uniform acceleration.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import product

from mpmath import matrix, mp, mpf

from tests.oracles.driveline import Driveline

WEAK = Fraction(1, 10**40)


def equilibrium(model: Driveline) -> list[Fraction]:
    """Return the absolute angles, exact to about forty digits."""
    names = {body.name: i for i, body in enumerate(model.bodies)} | {"ground": -1}
    n = len(model.bodies)
    rows = []
    for element in model.elements:
        row = [Fraction(0)] * n
        (a, b), (ra, rb) = element.between, element.radii
        if names[a] >= 0:
            row[names[a]] += Fraction(ra)
        if names[b] >= 0:
            row[names[b]] -= Fraction(rb)
        rows.append(row)
    load = [-Fraction(body.drag_torque) for body in model.bodies]
    for torque in model.torques:
        load[names[torque.on]] += Fraction(torque.mean)
    stiff = [k for k, e in enumerate(model.elements) if any(Fraction(s.stiffness) for side in e.sides for s in side)]
    J = [Fraction(body.J) for body in model.bodies]
    held = []
    for mode in rigid_modes([rows[k] for k in stiff], n):
        held.append(max(i for i in range(n) if mode[i]))
        alpha = sum(r * t for r, t in zip(mode, load, strict=True)) / sum(
            j * r * r for j, r in zip(J, mode, strict=True)
        )
        load = [t - j * r * alpha for t, j, r in zip(load, J, mode, strict=True)]
    tables = [piece_table(model.elements[k]) for k in stiff]
    for choice in product(*(range(len(t)) for t in tables)):
        pieces = [t[i] for t, i in zip(tables, choice, strict=True)]
        angles = _solve(n, [rows[k] for k in stiff], pieces, load, held)
        if angles is not None and _consistent(angles, [rows[k] for k in stiff], pieces):
            return angles
    raise ArithmeticError("no equilibrium")


def rigid_modes(rows: list[list[Fraction]], n: int) -> list[list[Fraction]]:
    """Return a basis of the rigid motions (null space of the rows), one vector a train: disjoint supports."""
    work, pivots = [list(r) for r in rows], []
    for column in range(n):
        pivot = next((i for i in range(len(pivots), len(work)) if work[i][column]), None)
        if pivot is None:
            continue
        top = len(pivots)
        work[top], work[pivot] = work[pivot], work[top]
        work[top] = [x / work[top][column] for x in work[top]]
        for i, row in enumerate(work):
            if i != top and row[column]:
                work[i] = [x - row[column] * y for x, y in zip(row, work[top], strict=True)]
        pivots.append(column)
    modes = []
    for free in (c for c in range(n) if c not in pivots):
        mode = [Fraction(0)] * n
        mode[free] = Fraction(1)
        for i, column in enumerate(pivots):
            mode[column] = -work[i][free]
        modes.append(mode)
    return modes


def piece_table(element) -> list[tuple[Fraction, Fraction, Fraction | None, Fraction | None]]:
    """Return (slope, offset, lower, upper) of every piece, free ones already centred."""
    drive, coast = element.sides
    table = []
    for stages, sign in ((drive, 1), (coast, -1)):
        force, inner = Fraction(element.preload), Fraction(0)
        for stage in stages:
            k = Fraction(stage.stiffness)
            outer = None if stage.until is None else sign * Fraction(stage.until)
            lower, upper = (inner, outer) if sign > 0 else (outer, inner)
            table.append((k, force - k * inner, lower, upper))
            if outer is not None:
                force, inner = force + k * (outer - inner), outer
    return [_centred(piece, drive[0], coast[0]) for piece in table]


def _centred(piece, drive, coast):
    """Give a free piece its weak spring; a gap on both sides of zero is one gap, and its middle is what counts."""
    k, f, lower, upper = piece
    one_gap = Fraction(drive.stiffness) == Fraction(coast.stiffness) == 0 and drive.until and coast.until
    if one_gap and 0 in (lower, upper):
        lower, upper = -Fraction(coast.until), Fraction(drive.until)
    if k == 0 and lower is not None and upper is not None:
        return WEAK, f - WEAK * (lower + upper) / 2, lower, upper
    return k, f, lower, upper


def _solve(n, rows, pieces, load, held) -> list[Fraction] | None:
    K, rhs = matrix(n, n), matrix(n, 1)
    with mp.workdps(160):
        for i in range(n):
            rhs[i] = _mpf(load[i])
        for row, (k, f, _, _) in zip(rows, pieces, strict=True):
            for i in range(n):
                rhs[i] -= _mpf(row[i] * f)
                for j in range(n):
                    K[i, j] += _mpf(k * row[i] * row[j])
        for i in held:
            for j in range(n):
                K[i, j] = mpf(i == j)
            rhs[i] = mpf(0)
        try:
            x = mp.lu_solve(K, rhs)
        except ZeroDivisionError:
            return None
        return [Fraction(int(mp.nint(mp.ldexp(x[i], 300))), 2**300) for i in range(n)]


def _consistent(angles, rows, pieces) -> bool:
    slack = Fraction(1, 10**30)
    for row, (_, _, lower, upper) in zip(rows, pieces, strict=True):
        delta = sum(w * x for w, x in zip(row, angles, strict=True))
        if (lower is not None and delta < lower - slack) or (upper is not None and delta > upper + slack):
            return False
    return True


def _mpf(x: Fraction) -> mpf:
    return mpf(x.numerator) / x.denominator
