"""Random drivelines, reproducible from a family name and a seed.

One generator with switches; a family is a setting of them. Numbers are rounded to a few decimals and kept as text.
Sizes are chosen so that corners are met a handful of times and fast modes make some hundred swings, which the oracle
can follow: natural frequencies about 1 to 20 rad/s, clearances 0.03 to 0.5, a run of two to five periods. The stiff
family multiplies one stiffness by up to 1e8 and shortens the run to match.
"""

from __future__ import annotations

import random
from dataclasses import dataclass, replace
from math import pi, sqrt

from tests.oracles.driveline import Body, Coupling, Driveline, Harmonic, Mesh, Stage, Torque


@dataclass(frozen=True)
class Family:
    """Switches of the generator."""

    branched: bool = False
    loops: bool = False
    staged: bool = False
    meshes: bool = False
    grounded: bool | None = None  # None: either
    damped: bool = True
    drag: bool = True
    means: bool = True
    orders: tuple[str, ...] = ("1", "2")
    stiff: bool = False
    trains: int = 1
    static: bool = False
    gaps: float = 0.7  # share of elements with a corner


FAMILIES: dict[str, Family] = {
    "chain": Family(),
    "tree": Family(branched=True),
    "loop": Family(branched=True, loops=True),
    "staged": Family(staged=True, gaps=1.0),
    "mesh": Family(meshes=True, branched=True, orders=("1", "3")),
    "undamped": Family(damped=False, drag=False, means=False),
    "free-flight": Family(grounded=False, drag=False, gaps=1.0),
    "half-order": Family(orders=("0.5", "1", "1.5"), meshes=True),
    "stiff": Family(stiff=True, meshes=True, gaps=1.0),
    "two-trains": Family(trains=2, staged=True),
    "static": Family(static=True, meshes=True, branched=True, gaps=1.0),
    "everything": Family(branched=True, loops=True, staged=True, meshes=True, drag=False, orders=("0.5", "1", "4")),
}


@dataclass(frozen=True)
class Problem:
    """A driveline and how long to follow it."""

    model: Driveline
    cycles: int
    samples_per_cycle: int


def text(x: float, digits: int = 4) -> str:
    """Return a decimal with few digits, in a form TOML takes as a float."""
    s = f"{x:.{digits}g}"
    return s if any(c in s for c in ".en") else s + ".0"


def log_uniform(rng: random.Random, low: float, high: float) -> float:
    """Return a number whose logarithm is uniform."""
    return low * (high / low) ** rng.random()


def random_problem(family: str, seed: int) -> Problem:
    """Return the same problem for the same family and seed, on any machine."""
    rng = random.Random(f"{family}/{seed}")
    switches = FAMILIES[family]
    bodies: list[Body] = []
    couplings: list[Coupling] = []
    meshes: list[Mesh] = []
    for _ in range(switches.trains):
        _add_train(rng, switches, bodies, couplings, meshes)
    fast = 1.0
    if switches.stiff:
        fast = _stiffen(rng, couplings, meshes)
    torques = _torques(rng, switches, bodies)
    speed = log_uniform(rng, 0.7, 3.0) * (fast / 30.0 if switches.stiff else 1.0)
    model = Driveline(
        name=f"{family} {seed}",
        bodies=tuple(bodies),
        couplings=tuple(couplings),
        meshes=tuple(meshes),
        torques=torques,
        speed=text(speed),
    )
    if not switches.static:
        angle, velocity = _start(rng, bodies, couplings, meshes)
        model = model.start(angle, velocity)
    length = 18.0 * (120.0 / fast if switches.stiff else 1.0)
    return Problem(model, max(1, min(6, round(length / float(model.period)))), 24)


def _add_train(rng, switches: Family, bodies, couplings, meshes) -> None:
    first = len(bodies)
    n = rng.randint(2, 5) if switches.trains == 1 else rng.randint(1, 3)
    for i in range(n):
        bodies.append(
            Body(
                f"body{first + i}",
                text(log_uniform(rng, 0.3, 3.0)),
                drag=text(log_uniform(rng, 1e-3, 0.05)) if switches.drag and rng.random() < 0.6 else "0.0",
                drag_torque=text(0.2 * rng.random()) if switches.means and rng.random() < 0.3 else "0.0",
            )
        )
    links = [(rng.randrange(i) if switches.branched else i - 1, i) for i in range(1, n)]
    if switches.loops:
        links += [tuple(sorted(rng.sample(range(n), 2))) for _ in range(rng.randint(1, 2))]
    for a, b in links:
        ends = (f"body{first + a}", f"body{first + b}")
        ends = ends if rng.random() < 0.5 else ends[::-1]
        if switches.meshes and rng.random() < 0.5:
            meshes.append(_mesh(rng, switches, f"mesh{len(meshes)}", ends))
        else:
            couplings.append(_coupling(rng, switches, f"coupling{len(couplings)}", ends))
    grounded = rng.random() < 0.5 if switches.grounded is None else switches.grounded
    if grounded or n == 1:
        ends = (f"body{first + rng.randrange(n)}", "ground")
        ends = ends if rng.random() < 0.5 else ends[::-1]
        couplings.append(_coupling(rng, switches, f"coupling{len(couplings)}", ends))


def _damping(rng, switches: Family, stiffness: float) -> float:
    return 2 * log_uniform(rng, 0.003, 0.3) * sqrt(stiffness) if switches.damped and rng.random() < 0.8 else 0.0


def _coupling(rng, switches: Family, name: str, ends) -> Coupling:
    k = log_uniform(rng, 1.0, 40.0)
    c = _damping(rng, switches, k)
    if switches.staged and rng.random() < 0.7:
        return Coupling(
            name,
            ends,
            stages=_stages(rng, switches, k),
            coast_stages=_stages(rng, switches, k) if rng.random() < 0.6 else None,
            preload=text(rng.uniform(-0.3, 0.3)) if rng.random() < 0.3 else "0",
        )
    if rng.random() > switches.gaps:
        return Coupling(name, ends, text(k), text(c))
    alpha = 0.0 if rng.random() < 0.5 else log_uniform(rng, 0.01, 3.0)
    beta = 0.0 if rng.random() < 0.5 else log_uniform(rng, 0.01, 3.0)
    b = log_uniform(rng, 0.03, 0.4)
    return Coupling(name, ends, text(k), text(c), text(b), text(alpha), text(beta))


def _stages(rng, switches: Family, k: float) -> tuple[Stage, ...]:
    count, until, stages = rng.randint(1, 3), 0.0, []
    for i in range(count):
        until += log_uniform(rng, 0.03, 0.3)
        slope = k * (log_uniform(rng, 0.01, 3.0) if i < count - 1 else 1.0)
        if i == 0 and count > 1 and rng.random() < 0.3:
            slope = 0.0
        c = _damping(rng, switches, max(slope, 0.1))
        stages.append(Stage(text(slope), text(c), text(until) if i < count - 1 else None))
    return tuple(stages)


def _mesh(rng, switches: Family, name: str, ends) -> Mesh:
    size = log_uniform(rng, 0.03, 2.0)
    radii = (size, size * log_uniform(rng, 0.5, 2.0))
    k = log_uniform(rng, 4.0, 100.0) / size**2
    c = _damping(rng, switches, k) / size
    gap = log_uniform(rng, 0.05, 0.5) * size
    error = ()
    if rng.random() < 0.7:
        amplitude = gap * log_uniform(rng, 0.02, 0.4)
        error = (Harmonic(switches.orders[-1], text(amplitude), text(rng.uniform(-pi, pi))),)
    backlash = text(gap) if rng.random() < switches.gaps else None
    return Mesh(name, ends, (text(radii[0]), text(radii[1])), text(k), text(c), backlash, error)


def _stiffen(rng, couplings, meshes) -> float:
    """Multiply one stiffness, shrink its gap and keep its damping ratio; return the fastest rate then."""
    factor = log_uniform(rng, 1e4, 1e8)
    parts = meshes or couplings
    i = rng.randrange(len(parts))
    part = parts[i]
    k, c = float(part.stiffness) * factor, float(part.damping) * sqrt(factor)
    shrink = 30.0 / sqrt(factor)
    if isinstance(part, Mesh):
        error = tuple(replace(h, amplitude=text(float(h.amplitude) * shrink)) for h in part.error)
        backlash = None if part.backlash is None else text(float(part.backlash) * shrink)
        parts[i] = replace(part, stiffness=text(k), damping=text(c), backlash=backlash, error=error)
        k *= float(part.radii[0]) ** 2 + float(part.radii[1]) ** 2
    else:
        clearance = None if part.clearance is None else text(float(part.clearance) * shrink)
        parts[i] = replace(part, stiffness=text(k), damping=text(c), clearance=clearance)
    return sqrt(k)


def _torques(rng, switches: Family, bodies) -> tuple[Torque, ...]:
    torques = []
    for body in rng.sample(bodies, min(len(bodies), rng.randint(1, 2))):
        harmonics = tuple(
            Harmonic(order, text(log_uniform(rng, 0.1, 2.0)), text(rng.uniform(-pi, pi)))
            for order in switches.orders
            if rng.random() < 0.8
        )
        mean = text(rng.uniform(-0.5, 0.5)) if switches.means and rng.random() < 0.6 else "0.0"
        torques.append(Torque(body.name, mean, harmonics))
    return tuple(torques)


def _start(rng, bodies, couplings, meshes) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Start with deflections about the size of the gaps: walk the elements, placing each next body."""
    angle: dict[str, float] = {"ground": 0.0}
    waiting = [*couplings, *meshes]
    while len(angle) <= len(bodies):
        ready = next((e for e in waiting if (e.between[0] in angle) != (e.between[1] in angle)), None)
        if ready is None:
            free = next(b.name for b in bodies if b.name not in angle)
            angle[free] = rng.uniform(-0.5, 0.5)
            continue
        (a, b), (ra, rb) = ready.between, (float(r) for r in ready.radii)
        gap = ready.backlash if isinstance(ready, Mesh) else ready.clearance
        delta = rng.uniform(-1.2, 1.2) * (float(gap) if gap else 0.1)
        if a in angle:
            angle[b] = (ra * angle[a] - delta) / rb
        else:
            angle[a] = (rb * angle[b] + delta) / ra
    return (
        tuple(text(angle[b.name], 12) for b in bodies),
        tuple(text(rng.uniform(-0.8, 0.8)) for _ in bodies),
    )
