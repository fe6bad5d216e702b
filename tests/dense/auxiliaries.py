"""Random drivelines with friction, clipped contact damping and alternating stiffness, made from the plain families.

Each family dresses a plain case drawn from a few of ``families``, the same for the same family and seed.
"""

from __future__ import annotations

import random
from dataclasses import fields, replace

import numpy as np

from tests.dense.case import Case, Element
from tests.dense.dressed import Dressed, Pairs, Slider
from tests.dense.families import between, random_case, share, uniform

RUBBING = ("chain", "tree", "loop", "parallel", "undamped", "flight", "stages", "one-sided", "error", "on-corners")
CLIPPED = ("chain", "tree", "loop", "flight", "one-sided", "error", "mirrored", "to-ground")
ALTERNATING = ("chain", "tree", "undamped", "stages", "error", "to-ground", "on-corners", "resonance")
MOST_SLIDERS = 4


def dressed(case: Case) -> Dressed:
    """The same case, with nothing more on board yet."""
    return case if isinstance(case, Dressed) else Dressed(**{f.name: getattr(case, f.name) for f in fields(Case)})


def widths(case: Case) -> np.ndarray:
    """(m,) largest corner of every element; the middle of the others' where it has none."""
    own = np.array([np.abs(law.corners).max(initial=0.0) for law in case.laws])
    typical = float(np.median(own[own > 0])) if np.any(own > 0) else 1.0
    return np.where(own > 0, own, typical)


def with_friction(case: Case, rng: random.Random) -> Dressed:
    """Add one to four sliders, some of them engaged in the outer pieces of a side only."""
    sliders, width = [], widths(case)
    for _ in range(rng.randint(1, MOST_SLIDERS)):
        k = rng.randrange(len(case.laws))
        law = case.laws[k]
        count = law.stiffness.size
        first = rng.randrange(count)
        engaged = rng.choice([range(count), range(count), range(first, count), range(first + 1)])
        spring = float(law.stiffness.max()) * between(rng, 0.1, 30.0)
        limit = spring * float(width[k]) * between(rng, 0.01, 2.0)
        sliders.append(Slider(k, spring, limit, tuple(engaged)))
    return replace(dressed(case), sliders=tuple(sliders))


def with_limits(case: Case, rng: random.Random) -> Dressed:
    """Clip the contact damping of the elements that are free gaps."""
    elements, clipped = list(case.elements), []
    for k, element in enumerate(case.elements):
        sides = [_free_side(side, rng) for side in (element.drive, element.coast)]
        free = not element.preload and None not in sides and any(len(side) == 2 for side in sides)
        if free and share(rng) < 0.8:
            elements[k] = Element(*sides)
            clipped.append(k)
    return replace(dressed(case), elements=tuple(elements), clipped=tuple(clipped))


def _free_side(side, rng: random.Random):
    """The side without damping in its gap and with some in contact; None if it is no free gap."""
    if len(side) > 2 or side[0][0] != 0.0:
        return None
    if len(side) == 1:
        return ((0.0, 0.0, None),)
    k, c, _ = side[1]
    damping = c or k * between(rng, 1e-3, 1e-1) * rng.choice([0.01, 1.0])
    return ((0.0, 0.0, side[0][2]), (k, damping, None))


def with_pairs(case: Case, rng: random.Random) -> Dressed:
    """Let the stiffness of one to three elements alternate, some at dyadic instants, some two at once."""
    values, pairs = dressed(case), []
    able = [k for k in range(len(case.laws)) if k not in values.clipped]
    shared = _instants(case.period, rng)
    for k in rng.sample(able, min(len(able), rng.randint(1, 3))):
        instants = shared if share(rng) < 0.3 else _instants(case.period, rng)
        lacking = rng.choice([1.0, uniform(rng, 0.05, 0.95)])
        pairs.append(Pairs(k, lacking, share(rng) < 0.5, instants))
    return replace(values, pairs=tuple(pairs))


def _instants(period: float, rng: random.Random) -> tuple[float, ...]:
    """One to six instants later than 0, up to the period."""
    parts = {
        rng.choice([1.0, 0.5, rng.randint(1, 64) / 64, uniform(rng, 1e-3, 1.0), uniform(rng, 1e-3, 1.0)])
        for _ in range(rng.randint(1, 6))
    }
    return tuple(sorted(part * period for part in parts))


def friction_case(_family: str, rng: random.Random, name: str = "friction") -> Dressed:
    """Return a case with sliders."""
    return with_friction(random_case(rng.choice(RUBBING), rng, name), rng)


def clipped_case(_family: str, rng: random.Random, name: str = "clipped") -> Dressed:
    """Return a case with clipped contact damping."""
    while True:
        case = with_limits(random_case(rng.choice(CLIPPED), rng, name), rng)
        if case.clipped:
            return case


def alternating_case(_family: str, rng: random.Random, name: str = "alternating") -> Dressed:
    """Return a case whose stiffness alternates."""
    return with_pairs(random_case(rng.choice(ALTERNATING), rng, name), rng)


def beside_case(_family: str, rng: random.Random, name: str = "all beside") -> Dressed:
    """Return a case with all three."""
    return with_pairs(with_friction(clipped_case("", rng, name), rng), rng)


AUXILIARIES = {
    "friction": friction_case,
    "clipped": clipped_case,
    "alternating": alternating_case,
    "all beside": beside_case,
}
"""How a case of each family is made."""
