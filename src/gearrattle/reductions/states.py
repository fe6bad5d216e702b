"""Contact states in which a reduced system is held against the full one.

A driveline with clearances has one linear system for every region vector, and on the average slopes between them (the
contact ratio Gamma of Padmanabhan et al. 1995, sec. 6). A reduction must hold in all of them. Taken are every
combination of pieces of different slope while there are few, and a ladder of contact ratios for all clearances together
and for each alone, and those at which a mode of that clearance passes the end of the band: one that is low while a gap
hardly touches leaves the band as it closes. With a hundred inertias and many clearances these are too many for some
seconds of computing; then an evenly spread selection is taken.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]

LADDER = (0.5, 0.2, 0.1, 0.05, 0.02, 0.01)
"""Contact ratios between open and closed; a frequency changes by at most 1.6 from rung to rung."""
_MOST_COMBINATIONS = 64
# sum of the cubes of numbers of inertias
_WORK = 5e8
_FEWEST_STATES = 64
_AROUND = (0.03, 0.1, 0.25, 0.5, 1.0)  # the bodies behind are heavier than the two alone, so rather below than above
_WIDE = (0.002, 0.005, 0.01, 0.02, 0.04, 0.07, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
_NEAR = (0.85, 0.92, 0.96, 0.98, 0.99, 1.01, 1.02, 1.04, 1.08, 1.15)


class State(NamedTuple):
    """One linear system of many.

    Attributes
    ----------
    stiffness, damping
        (m,) of every element.
    words
        factor on the last slope of every varied element that is not in its last stage; empty: all in contact.
    """

    stiffness: Array
    damping: Array
    words: tuple[tuple[int, float], ...]


def contact_states(system: PiecewiseSystem, varied: tuple[int, ...], up_to: float = 0.0) -> list[State]:
    """Return the contact states of the varied clearances, all closed first; the others stay in their last drive stage.

    ``up_to`` is the end of the band [rad/s]; 0 leaves out the contact ratios at which a mode of a clearance passes it.
    """
    # combinations of pieces of different slope, while there are few
    factors = [_factors(system, k) for k in varied]
    chosen: dict[tuple[float, ...], None] = {(1.0,) * len(varied): None}
    if np.prod([len(f) for f in factors], dtype=float) <= _MOST_COMBINATIONS:
        chosen.update(dict.fromkeys(product(*factors)))
    else:
        chosen[tuple(f[0] for f in factors)] = None
        for i, choices in enumerate(factors):
            chosen.update({(1.0,) * i + (x,) + (1.0,) * (len(varied) - i - 1): None for x in choices})
            chosen.update({(*(f[0] for f in factors[:i]), 1.0, *(f[0] for f in factors[i + 1 :])): None})
    # ladder of contact ratios: all clearances together, then each alone
    for rung in LADDER:
        chosen[(rung,) * len(varied)] = None
        for i in range(len(varied)):
            chosen[(1.0,) * i + (rung,) + (1.0,) * (len(varied) - i - 1)] = None
    # contact ratios at which a mode passes the end of the band
    centre = tuple(f[0] for f in factors)
    for i, k in enumerate(varied):
        for rung in _passing(system, k, up_to):
            chosen[(1.0,) * i + (rung,) + (1.0,) * (len(varied) - i - 1)] = None
            chosen[(*centre[:i], rung, *centre[i + 1 :])] = None
    # evenly spread choice of very many states
    factors_of = list(chosen)
    if (most := most_states(system)) < len(factors_of):
        alike = [choices for choices in factors_of if len(set(choices)) == 1]
        factors_of = list(dict.fromkeys([*alike, *factors_of[:: -(-len(factors_of) // most)]]))
    return [state_of(system, dict(zip(varied, factor, strict=True))) for factor in factors_of]


def most_states(system: PiecewiseSystem) -> int:
    """Return how many contact states have their frequencies found in some seconds; at least ``_FEWEST_STATES``."""
    return max(_FEWEST_STATES, int(_WORK / system.size**3))


def state_of(system: PiecewiseSystem, factors: Mapping[int, float]) -> State:
    """Return the state in which some elements have a multiple of their last slope; all others have it once."""
    slope = np.array([law.stiffness[-1] for law in system.laws], dtype=float)
    damping = np.array([law.damping[-1] for law in system.laws], dtype=float)
    slope[list(factors)] *= list(factors.values())
    return State(slope, damping, tuple((k, x) for k, x in factors.items() if x != 1.0))


def neighbours(system: PiecewiseSystem, varied: tuple[int, ...], state: State, fine: bool) -> list[State]:
    """Return the states that differ in one clearance: over all contact ratios, or (fine) close by."""
    present = {**dict.fromkeys(varied, 1.0), **dict(state.words)}
    states = []
    for k in varied:
        near = [present[k] * x for x in _NEAR] if fine and present[k] > 0.0 else [0.0, *_WIDE, 1.0]
        states += [state_of(system, {**present, k: min(x, 1.0) if fine else x}) for x in near]
    return states


def _passing(system: PiecewiseSystem, element: int, up_to: float) -> list[float]:
    """Contact ratios around the one at which two bodies on this spring alone would swing at the end of the band."""
    slope = float(system.laws[element].stiffness[-1])
    alone = slope * float(system.rows[element] ** 2 @ (1.0 / system.inertia))
    ratio = up_to**2 / alone if alone > 0.0 else 0.0
    return [ratio * rung for rung in _AROUND if 0.0 < ratio * rung < 1.0]


def _factors(system: PiecewiseSystem, element: int) -> list[float]:
    """Slopes of an element's pieces over its last one's, the centre's first."""
    law = system.laws[element]
    last = float(law.stiffness[-1])
    if last == 0.0:
        return [1.0]
    centre = float(law.stiffness[-law.first_label]) / last
    return list(dict.fromkeys([centre, *(float(k) / last for k in law.stiffness)]))
