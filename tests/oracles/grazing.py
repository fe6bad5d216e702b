"""Pairs of drivelines that just touch and just miss a corner, made to measure.

Take a model in which an element stays inside its first stage, find the global maximum of |delta| over the run to
thirty digits, and set the clearance to (1 - eps) and (1 + eps) times it: the first is crossed and left again about
that instant, the second is not, and until then both motions are the same.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from mpmath import mp, mpf

from tests.oracles.driveline import Coupling, Driveline, Mesh
from tests.oracles.exact_mp import solve, solve_at
from tests.oracles.fixed_point import fixed, real


def with_gap(model: Driveline, element: int, half: str) -> Driveline:
    """Return the model with the half gap of an element set (of a mesh: half its backlash)."""
    part = model.elements[element]
    if isinstance(part, Mesh):
        with mp.workdps(40):
            meshes = list(model.meshes)
            meshes[element - len(model.couplings)] = replace(part, backlash=mp.nstr(2 * mpf(half), 30))
        return replace(model, meshes=tuple(meshes))
    assert isinstance(part, Coupling)
    couplings = list(model.couplings)
    couplings[element] = replace(part, clearance=half)
    return replace(model, couplings=tuple(couplings))


def largest_deflection(model: Driveline, element: int, cycles: int) -> tuple[mpf, mpf]:
    """Return the global maximum of |delta| over the run and its time, the element's gap being out of reach."""
    wide = with_gap(model, element, "1000.0")
    coarse = solve(wide, cycles, 400)
    delta = np.abs(coarse.array("deflection")[:, element])
    peak = int(np.argmax(delta))
    if peak in (0, len(delta) - 1):
        raise ValueError("the largest deflection is at an end of the run")
    a, b = coarse.time[peak - 1], coarse.time[peak + 1]
    rate_a, rate_b = coarse.rate[peak - 1][element], coarse.rate[peak + 1][element]
    while abs(b - a) > fixed("1e-24") and rate_b != rate_a:  # secant on delta' = 0
        a, b = b, b - rate_b * (b - a) // (rate_b - rate_a)
        rate_a, rate_b = rate_b, solve_at(wide, [b]).rate[0][element]
    return abs(real(solve_at(wide, [b]).deflection[0][element])), real(b)


def pair(model: Driveline, element: int, cycles: int, eps: str) -> tuple[Driveline, Driveline]:
    """Return the model that just touches and the one that just misses, by the part ``eps`` of the clearance."""
    with mp.workdps(50):
        peak, _ = largest_deflection(model, element, cycles)
        touch, miss = (mp.nstr(peak * (1 + sign * mpf(eps)), 30) for sign in (-1, 1))
    return with_gap(model, element, touch), with_gap(model, element, miss)
