"""Random drivelines by family, the same for the same family and seed on any machine.

Every case has a length scale (1e-5 to 1) for its gaps and a rate scale (0.1 to 1000) for its frequencies. Frequencies
lie within a decade unless the family is stiff, starts and loads move the deflections by about a gap, and a run lasts a
given number of radians of its fastest undamped mode, so that corners are met often and never by the thousand.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from tests.dense.case import Case, Element, Stages, law_of


@dataclass(frozen=True)
class Family:
    """Switches of the generator; shares are probabilities, pairs are ranges."""

    shape: str = "chain"
    bodies: tuple[int, int] = (1, 8)
    grounded: float = 0.5
    forms: str = "gap"
    alpha: tuple[float, ...] = (0.0, 1e-3, 0.5)
    damped: float = 0.7
    drag: float = 0.5
    means: float = 0.6
    errors: float = 0.0
    stiff: bool = False
    start: str = "random"
    radians: tuple[float, float] = (20.0, 120.0)
    resonant: bool = False
    critical: bool = False
    symmetric: bool = False


FAMILIES: dict[str, Family] = {
    "chain": Family(),
    "tree": Family(shape="tree", bodies=(3, 8)),
    "loop": Family(shape="loop", bodies=(2, 6)),
    "parallel": Family(shape="parallel", bodies=(1, 5), forms="any"),
    "to-ground": Family(shape="ground", bodies=(1, 6), grounded=1.0, forms="any"),
    "undamped": Family(damped=0.0, drag=0.0),
    "flight": Family(grounded=0.0, bodies=(2, 6), alpha=(0.0,), drag=0.0, means=1.0),
    "stiff": Family(stiff=True, forms="any", bodies=(1, 6), radians=(50.0, 600.0)),
    "stiff-damped": Family(stiff=True, damped=1.0, forms="any", bodies=(1, 5), radians=(200.0, 1500.0)),
    "critical": Family(critical=True, bodies=(1, 4), drag=0.0),
    "resonance": Family(resonant=True, damped=0.0, drag=0.0, bodies=(1, 6)),
    "stages": Family(forms="staged", bodies=(1, 5)),
    "one-sided": Family(forms="one-sided", bodies=(1, 6)),
    "bilinear": Family(forms="bilinear", bodies=(1, 6)),
    "mirrored": Family(shape="star", symmetric=True, bodies=(2, 6), grounded=0.7),
    "error": Family(shape="tree", bodies=(2, 6), errors=1.0),
    "on-corners": Family(start="corner", forms="any", bodies=(1, 6)),
    "everything": Family(shape="loop", forms="any", bodies=(2, 8), errors=0.5, drag=0.3),
}
"""All but the grazing ones, which are made from these (``grazing``)."""

MOST_CLEARANCES = 6


def share(rng: random.Random) -> float:
    """Return a number from 0 to 1 in millionths: exact ends are possible, numbers next to nothing are not."""
    return rng.randint(0, 1_000_000) / 1e6


def uniform(rng: random.Random, low: float, high: float) -> float:
    """Return a number from low to high."""
    return low + (high - low) * share(rng)


def between(rng: random.Random, low: float, high: float) -> float:
    """Return a number whose logarithm is uniform."""
    return low * (high / low) ** share(rng)


def links_of(rng: random.Random, family: Family, n: int) -> list[tuple[int, int]]:
    """Pairs of bodies joined, -1 for the ground."""
    if family.shape == "star":
        links = [(0, i) for i in range(1, n)]
    elif family.shape in ("tree", "loop"):
        links = [(rng.randrange(i), i) for i in range(1, n)]
    else:
        links = [(i - 1, i) for i in range(1, n)]
    if n == 1 or share(rng) < family.grounded:
        links.append((0 if family.symmetric else rng.randrange(n), -1))
    if family.shape == "ground":
        links += [(rng.randrange(n), -1) for _ in range(rng.randint(1, 3))]
    if family.shape == "loop":
        links += [tuple(rng.sample(range(n), 2)) for _ in range(rng.randint(1, 2))]
    if family.shape == "parallel":
        links += [rng.choice(links) for _ in range(rng.randint(1, 3))]
    return links


def element_of(rng: random.Random, family: Family, k: float, c: float, gap: float) -> Element:
    """An element with a corner at about the gap given."""
    form = rng.choice(["gap", "staged", "one-sided", "bilinear"]) if family.forms == "any" else family.forms
    alpha, beta = rng.choice(family.alpha), rng.choice([0.0, 0.0, 0.3, 1.0])
    preload = k * gap * uniform(rng, -1, 1) if form == "staged" and share(rng) < 0.3 else 0.0
    if form == "bilinear":
        ratio = rng.choice([1.0, between(rng, 0.05, 20.0)])
        return Element(((k, c, None),), ((k * ratio, c * rng.choice([0.0, 0.5, 1.0]) + 0.01 * k * (ratio == 1), None),))
    if form == "staged":
        drive = _stages(rng, k, c, gap)
        return Element(drive, drive if share(rng) < 0.4 else _stages(rng, k, c, gap), preload)
    inner = (alpha * k, beta * c)
    drive = ((*inner, gap), (k, c, None))
    if form == "one-sided":
        wall, open_side = drive, ((*inner, None),)
        return Element(wall, open_side) if share(rng) < 0.5 else Element(open_side, wall)
    return Element(drive, drive)


def _stages(rng: random.Random, k: float, c: float, gap: float) -> Stages:
    count = rng.randint(1, 4)
    until = 0.0
    stages = []
    for i in range(count):
        until += gap * between(rng, 0.2, 2.0)
        slope = k if i == count - 1 else k * rng.choice([0.0, between(rng, 0.01, 3.0)])
        stages.append((slope, c * rng.choice([0.0, 0.3, 1.0]), None if i == count - 1 else until))
    return tuple(stages)


def random_case(family: str, rng: random.Random, name: str = "") -> Case:
    """Return a case of a family."""
    switches = FAMILIES[family]
    n = rng.randint(*switches.bodies)
    gap, rate = between(rng, 1e-5, 1.0), between(rng, 0.1, 1e3)
    spread = rng.choice([3.0, 3.0, 100.0])
    J = np.array([between(rng, 1.0, spread) for _ in range(n)]) * between(rng, 1e-3, 10.0)
    if switches.symmetric:
        J[1:] = J[1]
    links = links_of(rng, switches, n)
    rows, elements = _elements(rng, switches, J, links, gap=gap, rate=rate)
    fastest, slowest = rates(J, rows, elements)
    radians = between(rng, *switches.radians)
    length = rng.randint(1, 3)
    period = radians / fastest / length
    if switches.resonant:
        actual = modes(J, rows, elements, _pieces(rng, elements)) or [rate]
        slow = [w for w in actual if 6 * np.pi * fastest / w < 2 * switches.radians[1]] or [max(actual)]
        period = 2 * np.pi * rng.randint(1, 3) / rng.choice(slow)
        length = max(1, min(6, round(radians / fastest / period)))
    most = max(1, min(12, round(3 * slowest * period / 2 / np.pi)))
    cycles = np.unique(
        [
            float(rng.choice([1, 1, rng.randint(1, most), rng.choice([0.5, 1.7, 2**0.5])]))
            for _ in range(0 if share(rng) < 0.1 else rng.randint(1, 3))
        ]
    )
    if switches.resonant:
        cycles = np.unique([1.0, *cycles])
    zero = np.zeros((n, cycles.size))
    load = gap * J.min() * slowest**2 * between(rng, 0.1, 10.0)
    on = rng.sample(range(n), rng.randint(1, min(n, 2)))
    sine, cosine = zero.copy(), zero.copy()
    for i in on:
        sine[i] = [load * uniform(rng, -1, 1) for _ in cycles]
        cosine[i] = [load * uniform(rng, -1, 1) * rng.choice([0, 1]) for _ in cycles]
    mean = np.array([load * uniform(rng, -1, 1) if share(rng) < switches.means else 0.0 for _ in range(n)])
    drag = np.array([J[i] * slowest * between(rng, 1e-3, 0.3) if share(rng) < switches.drag else 0.0 for i in range(n)])
    error = np.zeros((2, len(rows), cycles.size))
    for e, element in enumerate(elements):
        if share(rng) < switches.errors and cycles.size:
            size = max([abs(c) for c in law_of(element).corners] + [0.0]) or gap
            error[:, e, rng.randrange(cycles.size)] = [size * uniform(rng, -0.4, 0.4), size * uniform(rng, -0.4, 0.4)]
    if switches.symmetric:
        for a in (sine, cosine, mean, drag):
            a[1:] = a[1] if n > 1 else 0.0
    angle, velocity = _start(rng, switches, rows, elements, gap=gap, rate=slowest, error=error[1].sum(axis=1))
    return Case(
        name or family,
        J,
        drag,
        rows,
        elements,
        float(period),
        cycles,
        mean,
        sine,
        cosine,
        error[0],
        error[1],
        angle,
        velocity,
        length,
        max(2, 10 // length),
    )


def seeded(family: str, seed: int, make: Callable[..., Case] = random_case) -> Case:
    """Return the same case for the same family and seed."""
    return make(family, random.Random(f"dense/{family}/{seed}"), f"{family} {seed}")


def rates(J: np.ndarray, rows: np.ndarray, elements) -> tuple[float, float]:
    """Largest rate and smallest undamped frequency, zero ones left out, every element in its stiffest piece."""
    actual = modes(J, rows, elements, [int(np.argmax(law_of(e).stiffness)) for e in elements])
    c = np.array([law_of(e).damping.max() for e in elements])
    decay = eigh((rows.T * c) @ rows, np.diag(J), eigvals_only=True).max()
    return max([*actual, float(decay)]), min(actual)


def modes(J: np.ndarray, rows: np.ndarray, elements, pieces) -> list[float]:
    """Undamped frequencies of one region, zero ones left out."""
    k = np.array([law_of(e).stiffness[p] for e, p in zip(elements, pieces, strict=True)])
    squares = eigh((rows.T * k) @ rows, np.diag(J), eigvals_only=True)
    return [float(w) ** 0.5 for w in squares if w > 1e-12 * max(squares.max(), 1e-300)]


def _pieces(rng: random.Random, elements) -> list[int]:
    return [rng.randrange(law_of(e).stiffness.size) for e in elements]


def _elements(rng, switches: Family, J, links, *, gap: float, rate: float):
    """Rows and elements of the links, at most six with corners."""
    rows, elements = np.zeros((len(links), len(J))), []
    chosen = set(rng.sample(range(len(links)), min(len(links), rng.randint(1, MOST_CLEARANCES))))
    if switches.symmetric:
        chosen = set(range(len(J) - 1))
    stiff_one = rng.choice(sorted(chosen)) if switches.stiff else -1
    critical = 2.0 / (rate * between(rng, 1.0, 10.0)) * (1 + rng.choice([0.0, 1e-15, -1e-12, 1e-9, 1e-6, -1e-3]))
    for e, (a, b) in enumerate(links):
        size = (1.0, 1.0)
        if share(rng) < switches.errors and b >= 0:
            size = (between(rng, 0.02, 2.0), between(rng, 0.02, 2.0))
        rows[e, a] = size[0]
        if b >= 0:
            rows[e, b] = -size[1]
        moved = 1.0 / float((rows[e] ** 2 / J).sum())
        k = moved * (rate * between(rng, 1.0, 10.0)) ** 2
        ratio = between(rng, 0.3, 1.5) if share(rng) < 0.1 else between(rng, 1e-3, 0.3)
        c = 2 * ratio * (k * moved) ** 0.5 if share(rng) < switches.damped else 0.0
        if switches.critical:
            k = moved * (2.0 / critical) ** 2 if len(J) == 1 else k
            c = critical * k
        width = gap * size[0] * between(rng, 0.1, 1.0)
        if e == stiff_one:
            factor = between(rng, 1e4, 1e8)
            k = k * factor
            c = c * factor**0.5
            width = width * between(rng, 10.0, 300.0) / factor**0.5
        linear = Element(((k, c, None),), ((k, c, None),))
        elements.append(element_of(rng, switches, k, c, width) if e in chosen else linear)
    if switches.symmetric:
        for e in range(1, len(J) - 1):
            elements[e] = elements[0]
            if share(rng) < 0.3:
                rows[e] = -rows[e]
                elements[e] = Element(elements[0].coast, elements[0].drive, -elements[0].preload)
    return rows, tuple(elements)


def _start(rng, switches: Family, rows, elements, *, gap: float, rate: float, error) -> tuple[np.ndarray, np.ndarray]:
    """Angles that put the deflections near their corners (or on them), velocities of a gap a radian."""
    n = rows.shape[1]
    target = error.copy()
    for e, element in enumerate(elements):
        corners = law_of(element).corners
        size = max(np.abs(corners).max(initial=0.0), 0.1 * gap)
        exact = switches.start == "corner" and corners.size and share(rng) < 0.7
        target[e] += rng.choice(list(corners)) if exact else size * uniform(rng, -1.3, 1.3)
    angle = np.linalg.lstsq(rows, target, rcond=None)[0]
    moving = 0.0 if switches.start == "corner" and share(rng) < 0.3 else gap * rate
    velocity = np.array([moving * uniform(rng, -1.5, 1.5) for _ in range(n)])
    if switches.symmetric:
        return np.r_[0.0, np.full(n - 1, uniform(rng, -1, 1) * gap)], np.r_[velocity[0], np.full(n - 1, velocity[-1])]
    return angle, velocity
