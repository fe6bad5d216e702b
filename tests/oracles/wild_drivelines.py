"""Random drivelines without manners: inertias over six decades, gaps over five, damping up to ten times critical.

Wider than :mod:`tests.oracles.random_drivelines`, less tidy: loops and parallel elements of any ratio (which may lock a
train), stages of zero slope or damping, preloads, starts anywhere. Reproducible from the seed.
"""

from __future__ import annotations

import random
from math import sqrt

from tests.oracles.driveline import Body, Coupling, Driveline, Harmonic, Mesh, Stage, Torque
from tests.oracles.exact_mp import fastest_rate
from tests.oracles.random_drivelines import Problem, log_uniform, text

MOST_WORK = 3000.0
"""Radians of the fastest mode the oracle is asked to follow."""


def wild_problem(seed: int) -> Problem:
    """Return the first tractable problem of this seed."""
    attempt = 0
    while True:
        problem = _attempt(random.Random(f"wild/{seed}/{attempt}"), f"wild {seed}")
        if fastest_rate(problem.model) * problem.cycles * float(problem.model.period) < MOST_WORK:
            return problem
        attempt += 1


def _attempt(rng: random.Random, name: str) -> Problem:
    bodies = _bodies(rng)
    couplings, meshes = _elements(rng, [float(b.J) for b in bodies])
    torques = _torques(rng, bodies)
    model = Driveline(name, bodies, couplings, meshes, torques, speed=text(log_uniform(rng, 0.5, 10.0)))
    speed = log_uniform(rng, 1e-3, 1.0)
    model = model.start(
        tuple(text(rng.uniform(-1, 1) * rng.choice([0.0, 0.01, 0.2]), 10) for _ in bodies),
        tuple(text(rng.uniform(-1, 1) * speed) for _ in bodies),
    )
    return Problem(model, max(1, min(4, int(25 / float(model.period)))), 12)


def _bodies(rng: random.Random) -> tuple[Body, ...]:
    return tuple(
        Body(
            f"b{i}",
            text(log_uniform(rng, 1e-3, 1e3)),
            drag=text(log_uniform(rng, 1e-6, 1.0)) if rng.random() < 1 / 3 else "0.0",
            drag_torque=text(rng.random()) if rng.random() < 1 / 3 else "0.0",
        )
        for i in range(rng.randint(1, 5))
    )


def _elements(rng: random.Random, J: list[float]) -> tuple[tuple[Coupling, ...], tuple[Mesh, ...]]:
    n = len(J)
    links: list[tuple[int, int | None]] = [(rng.randrange(i), i) for i in range(1, n)]
    for _ in range(rng.choice([0, 0, 1, 2]) if n > 1 else 0):
        a, b = rng.sample(range(n), 2)
        links.append((a, b))
    if n == 1 or rng.random() < 0.5:
        links.append((rng.randrange(n), None))
    couplings: list[Coupling] = []
    meshes: list[Mesh] = []
    for a, b in links:
        moved = J[a] if b is None else J[a] * J[b] / (J[a] + J[b])
        ends = (f"b{a}", "ground" if b is None else f"b{b}")
        ends = ends if rng.random() < 0.5 else ends[::-1]
        if b is not None and rng.random() < 0.35:
            meshes.append(_mesh(rng, f"m{len(meshes)}", ends, moved))
        else:
            couplings.append(_coupling(rng, f"c{len(couplings)}", ends, moved))
    return tuple(couplings), tuple(meshes)


def _damping(rng: random.Random, stiffness: float, moved: float) -> float:
    return 0.0 if rng.random() < 0.5 else 2 * log_uniform(rng, 1e-4, 10.0) * sqrt(stiffness * moved)


def _mesh(rng: random.Random, name: str, ends: tuple[str, str], moved: float) -> Mesh:
    k, gap = moved * log_uniform(rng, 0.5, 30.0) ** 2, log_uniform(rng, 1e-5, 0.5)
    ra, rb = log_uniform(rng, 0.02, 2.0), log_uniform(rng, 0.02, 2.0)
    error = tuple(
        Harmonic(order, text(gap * ra * log_uniform(rng, 0.01, 0.5)), text(rng.uniform(-3, 3)))
        for order in rng.sample(["1", "3", "7.5", "20"], rng.randint(0, 2))
    )
    damping = _damping(rng, k, moved) / ra**2
    backlash = text(gap * ra) if rng.random() < 0.85 else None
    return Mesh(name, ends, (text(ra), text(rb)), text(k / ra**2), text(damping), backlash, error)


def _coupling(rng: random.Random, name: str, ends: tuple[str, str], moved: float) -> Coupling:
    k, gap = moved * log_uniform(rng, 0.5, 30.0) ** 2, log_uniform(rng, 1e-5, 0.5)
    form = rng.random()
    if form < 0.2:
        return Coupling(name, ends, text(k), text(_damping(rng, k, moved)))
    if form < 0.6:
        ratio = text(rng.choice([0.0, log_uniform(rng, 1e-4, 5.0)]))
        damping_ratio = text(rng.choice([0.0, log_uniform(rng, 1e-3, 5.0)]))
        return Coupling(name, ends, text(k), text(_damping(rng, k, moved)), text(gap), ratio, damping_ratio)
    return Coupling(
        name,
        ends,
        stages=_stages(rng, k, gap, moved),
        coast_stages=_stages(rng, k, gap, moved) if rng.random() < 0.7 else None,
        preload=text(rng.uniform(-1, 1) * k * gap) if rng.random() < 1 / 3 else "0",
    )


def _stages(rng: random.Random, k: float, gap: float, moved: float) -> tuple[Stage, ...]:
    count, until, stages = rng.randint(1, 4), 0.0, []
    for i in range(count):
        last = i == count - 1
        until += gap * log_uniform(rng, 0.3, 3.0)
        slope = k if last else rng.choice([0.0, k * log_uniform(rng, 1e-3, 3.0)])
        stages.append(Stage(text(slope), text(_damping(rng, k, moved)), None if last else text(until)))
    return tuple(stages)


def _torques(rng: random.Random, bodies: tuple[Body, ...]) -> tuple[Torque, ...]:
    torques = []
    for body in rng.sample(bodies, min(len(bodies), rng.randint(0, 2))):
        J = float(body.J)
        orders = rng.sample(["0.5", "1", "1.5", "2", "3", "6"], rng.randint(0, 3))
        harmonics = (Harmonic(o, text(J * log_uniform(rng, 0.01, 30.0)), text(rng.uniform(-3, 3))) for o in orders)
        mean = text(0.3 * J * rng.uniform(-1, 1)) if rng.random() < 0.5 else "0.0"
        torques.append(Torque(body.name, mean, tuple(harmonics)))
    return tuple(torques)
