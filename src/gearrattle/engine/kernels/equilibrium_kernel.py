"""The static equilibrium; ``system.equilibrium`` describes the minimum problem and its solution."""

from __future__ import annotations

from math import inf, sqrt

import numpy as np

from gearrattle.engine.kernels._jit import strict, strict_entry
from gearrattle.engine.kernels.jacobi_eigenvalues import diagonalise
from gearrattle.engine.kernels.state_scaling import largest_modulus

FOUND, RUNAWAY, LOST = range(3)
"""Results of the search: an equilibrium; a direction in which the potential has no lower bound; no convergence."""
NEGLIGIBLE = 1e-12
"""Share of the sum of the means' moduli on one shaft below which a load counts as zero."""

_NO_STIFFNESS = 1e-13  # scaled stiffness that counts as zero; 1 is that of the stiffest pieces
_MOST_SEARCHES = 2000  # line searches
_ROUNDING = 64 * 2.220446049250313e-16  # share of a sum of moduli
_REFINEMENT = 1e-6  # share of the deflections: a shorter Newton step is taken in full, without a line search


@strict
def piece_at(corners, begin, end, deflection):
    """The piece in which a deflection lies; on a corner the upper piece."""
    piece = 0
    for c in range(begin, end):
        if corners[c] <= deflection:
            piece += 1
    return piece


@strict
def _headed_for(laws, label, k, delta, travel):
    """The piece at a deflection; exactly on a corner, the piece in the direction of travel."""
    begin = laws.first[k]
    end = laws.first[k + 1] - 1
    piece = piece_at(laws.upper, begin, end, delta)
    if piece > 0 and delta == laws.lower[begin + piece]:
        lower = abs(piece - 1 + label[k]) <= abs(piece + label[k])  # at rest, the piece that is nearer to the centre
        if travel < 0.0 or (travel == 0.0 and lower):
            return piece - 1
    return piece


@strict_entry
def accelerate_rigidly(system, motion, acceleration):
    """(n,) accelerations of the trains under the mean torques; zero for trains whose mean torques balance."""
    n, trains = motion.shape
    a = np.empty((trains, trains))
    net = np.empty(trains)
    for p in range(trains):
        # the mean torque on every train; a sum that is rounding counts as zero
        total = 0.0
        size = 0.0
        for i in range(n):
            total += motion[i, p] * system.mean[i]
            size += abs(motion[i, p]) * abs(system.mean[i])
        net[p] = 0.0 if abs(total) <= NEGLIGIBLE * size else total
        # masses of the trains
        for q in range(trains):
            a[p, q] = 0.0
            for i in range(n):
                a[p, q] += motion[i, p] * (system.inertia[i] * motion[i, q])
    # elimination and back substitution
    for p in range(trains):  # positive definite: no pivots
        for q in range(p + 1, trains):
            weight = a[q, p] / a[p, p]
            for j in range(p, trains):
                a[q, j] -= weight * a[p, j]
            net[q] -= weight * net[p]
    for p in range(trains - 1, -1, -1):
        for j in range(p + 1, trains):
            net[p] -= a[p, j] * net[j]
        net[p] /= a[p, p]
    # accelerations of the inertias
    for i in range(n):
        acceleration[i] = 0.0
        for p in range(trains):
            acceleration[i] += motion[i, p] * net[p]


@strict
def _direct(stiffness, residual, force_rounding, vectors, direction):
    """Write a flat direction if the residual loads one, else the shortest Newton direction; True if it is flat."""
    size = residual.size
    is_loaded = False
    # first the directions without stiffness; the Newton direction only if the residual loads none of them
    diagonalise(stiffness, vectors, size)
    for want_flat in (True, False):
        for i in range(size):
            direction[i] = 0.0
        for j in range(size):
            # the component of the residual along each eigenvector
            value = stiffness[j, j]
            part = 0.0
            if (value <= _NO_STIFFNESS) != want_flat:
                continue
            for i in range(size):
                part += vectors[i, j] * residual[i]
            if not want_flat:
                part /= value
            for i in range(size):
                direction[i] += vectors[i, j] * part
        # whether a flat direction is loaded beyond rounding
        for i in range(size):
            is_loaded = is_loaded or (want_flat and abs(direction[i]) > force_rounding[i])
        if is_loaded:
            return True
    return False


@strict
def _slide(laws, elastic, delta, travel, power):
    """The step s > 0 to the minimum of U on a line; U' is piecewise linear and never falls; -1: no minimum."""
    begin = 0.0
    while True:
        # the next corner on the line
        end = inf
        for e in range(elastic.size):
            k = elastic[e]
            if travel[e] != 0.0:
                for p in range(laws.first[k], laws.first[k + 1] - 1):
                    s = (laws.upper[p] - delta[e]) / travel[e]
                    if begin < s < end:
                        end = s
        # slope of U' up to that corner
        inside = begin + 0.5 * (end - begin) if end < inf else begin + 1.0 + abs(begin)
        slope = 0.0
        force = 0.0
        for e in range(elastic.size):
            k = elastic[e]
            d = delta[e]
            v = travel[e]
            at = d + inside * v
            p = laws.first[k] + piece_at(laws.upper, laws.first[k], laws.first[k + 1] - 1, at)
            slope += laws.stiffness[p] * v * v
            force += (laws.stiffness[p] * d + laws.offset[p]) * v
        # U' reaches zero before that corner: the minimum
        if slope > 0.0:
            zero = (power - force) / slope
            if zero <= end:
                return max(begin, zero)
        # flat, and U' is zero: the step ends here
        elif power - force <= 1e-14 * abs(power):
            return begin if begin > 0.0 else min(end, 1.0)
        if end == inf:
            return -1.0
        begin = end


@strict
def _load(system, statics, acceleration, load, load_rounding):
    """Write the load g on every unknown deflection, and the part of it that counts as rounding."""
    for j in range(load.size):
        load[j] = 0.0
        load_rounding[j] = 0.0
        for i in range(acceleration.size):
            weight = statics.angle_from_basis[i, j]
            load[j] += weight * (system.mean[i] - system.inertia[i] * acceleration[i])
            load_rounding[j] += NEGLIGIBLE * (abs(weight) * abs(system.mean[i]))


@strict
def _weigh(laws, label, statics, x, travel, scale, delta, pieces, residual, force_rounding, total_rounding, stiffness):
    """Write deflections and pieces at x, subtract the forces from the residual, and write the scaled stiffness.

    ``force_rounding`` is the error of the residual by rounding of the forces; ``total_rounding`` has the rounding of
    the deflections x: the backward error |K| |x| + |f| times some roundings. Along a direction without stiffness only
    ``force_rounding`` counts, because the force of a stiff element has no component along it.
    """
    size = x.size
    elastic = statics.elastic
    combination = statics.combination
    # sums over the elements begin at zero
    for i in range(size):
        for j in range(size):
            stiffness[i, j] = 0.0
        force_rounding[i] = 0.0
        total_rounding[i] = 0.0
    for e in range(elastic.size):
        # each element: its deflection and its piece
        delta[e] = 0.0
        terms = 0.0
        for j in range(size):
            delta[e] += combination[e, j] * x[j]
            terms += abs(combination[e, j] * x[j])
        pieces[e] = _headed_for(laws, label, elastic[e], delta[e], travel[e])
        p = laws.first[elastic[e]] + pieces[e]
        slope = laws.stiffness[p]
        offset = laws.offset[p]
        # its force, and the moduli of the terms, on which its rounding depends
        force = slope * delta[e] + offset
        force_terms = abs(slope * delta[e]) + abs(offset)
        all_terms = slope * terms + abs(offset)
        # balance and stiffness for the unknown deflections
        for i in range(size):
            residual[i] -= combination[e, i] * force
            force_rounding[i] += _ROUNDING * (abs(combination[e, i]) * force_terms)
            total_rounding[i] += _ROUNDING * (abs(combination[e, i]) * all_terms)
            for j in range(size):
                stiffness[i, j] += (combination[e, i] * scale[i]) * (slope * (combination[e, j] * scale[j]))


@strict_entry
def rest(system, label, statics, acceleration, x, travel):
    """Write the deflections x (r,) of an equilibrium under the mean loads.

    system: ``variant_arrays.Coefficients`` of one driveline.
    label: (m,) label of every element's lowest piece.
    acceleration: (n,) from ``accelerate_rigidly``.
    x: (r,) written.
    travel: (E,) last direction, written; after RUNAWAY: nonzero for the elements whose deflections have no bound.
    Returns FOUND, RUNAWAY or LOST.
    """
    # scratch
    laws = system.laws
    size = x.size
    elastic = statics.elastic
    combination = statics.combination
    load = np.empty(size)
    load_rounding = np.empty(size)
    residual = np.empty(size)
    force_rounding = np.empty(size)
    scale = np.empty(size)
    direction = np.empty(size)
    total_rounding = np.empty(size)
    delta = np.empty(elastic.size)
    stiffness = np.empty((size, size))
    vectors = np.empty((size, size))
    pieces = np.empty(elastic.size, np.int64)
    # loads, and a scale of every deflection from the largest stiffness that acts on it
    _load(system, statics, acceleration, load, load_rounding)
    for j in range(size):
        x[j] = 0.0
        scale[j] = 0.0
    for e in range(elastic.size):
        k = elastic[e]
        stiffest = largest_modulus(laws.stiffness, laws.first[k], laws.first[k + 1])
        for j in range(size):
            scale[j] += combination[e, j] * combination[e, j] * stiffest
    for j in range(size):
        scale[j] = 1.0 / sqrt(max(scale[j], 1e-300))
    for e in range(elastic.size):
        travel[e] = 0.0
    for _ in range(_MOST_SEARCHES if size else 0):
        # residual of the balance and stiffness of the present pieces
        for j in range(size):
            residual[j] = load[j]
        _weigh(
            laws, label, statics, x, travel, scale, delta, pieces, residual, force_rounding, total_rounding, stiffness
        )
        # whether the residual is zero to rounding
        is_balanced = True
        for j in range(size):
            force_rounding[j] = max(force_rounding[j], load_rounding[j])
            is_balanced = is_balanced and abs(residual[j]) <= max(total_rounding[j], force_rounding[j])
            residual[j] *= scale[j]
            force_rounding[j] *= scale[j]
        # a flat direction that is loaded, or Newton's direction
        is_flat = _direct(stiffness, residual, force_rounding, vectors, direction)
        power = 0.0
        stays = True
        shift = 0.0
        distance = 0.0
        for j in range(size):
            shift = max(shift, abs(direction[j]))
            distance = max(distance, abs(x[j]) / scale[j])
            direction[j] *= scale[j]
            power += load[j] * direction[j]
        for e in range(elastic.size):
            # whether the full step stays in the present pieces
            k = elastic[e]
            polished = 0.0
            travel[e] = 0.0
            terms = 0.0
            for j in range(size):
                travel[e] += combination[e, j] * direction[j]
                terms += abs(combination[e, j] * direction[j])
                polished += combination[e, j] * (x[j] + direction[j])
            if is_flat and abs(travel[e]) <= _ROUNDING * terms:
                travel[e] = 0.0
            begin = laws.first[k]
            end = laws.first[k + 1] - 1
            stays = stays and piece_at(laws.upper, begin, end, polished) == pieces[e]
        # an equilibrium: the last Newton step is added if it stays in the pieces
        if is_balanced and not is_flat:
            for j in range(size):
                x[j] += direction[j] if stays else 0.0
            return FOUND
        # a very short step is taken in full, any other up to the minimum of the energy on its line
        is_refined = stays and not is_flat and shift <= _REFINEMENT * distance
        step = 1.0 if is_refined else _slide(laws, elastic, delta, travel, power)
        if step < 0.0:
            return RUNAWAY
        for j in range(size):
            x[j] += step * direction[j]
    return LOST if size else FOUND


@strict_entry
def is_loose(laws, statics, x):
    """Whether an element lies within a gap without stiffness: its deflection in equilibrium is then not unique."""
    for e in range(statics.elastic.size):
        k = statics.elastic[e]
        delta = 0.0
        for j in range(x.size):
            delta += statics.combination[e, j] * x[j]
        begin = laws.first[k]
        last = laws.first[k + 1] - 1
        p = begin + piece_at(laws.upper, begin, last, delta)
        if begin < p < last and laws.stiffness[p] == 0.0:
            return True
    return False


@strict_entry
def angles_from_deflections(statics, x, angle):
    """(n,) angles of deflections; the last inertia of every free train at zero."""
    for i in range(angle.size):
        angle[i] = 0.0
        for j in range(x.size):
            angle[i] += statics.angle_from_basis[i, j] * x[j]
