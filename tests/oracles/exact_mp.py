"""Slow and obvious: the motion of a driveline to fifty digits, event by event.

Inside one region vector the equations are linear with constant coefficients,

    J_i q_i'' = T_i(t) - drag_torque_i - drag_i q_i' - sum_k (+-R_k) F_k,    F_k = k delta_k + c delta_k' + f,
    delta_k = R_a q_a - R_b q_b - e_k(t),

so the Taylor coefficients of the *absolute* angles about any instant follow from one another. A step sums some eighty
of them; a corner is crossed where the polynomial delta_k(s) - corner has its first root. Nothing is shared with the
program under test, neither code nor method. Numbers are fixed-point integers (:mod:`tests.oracles.fixed_point`);
mpmath makes the sines and pi, fractions.Fraction reads the decimals.
"""

from __future__ import annotations

import random
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import lru_cache
from math import ceil, factorial, log2, sqrt

import numpy as np
from mpmath import mp, mpf

from tests.oracles.driveline import Driveline, Torque
from tests.oracles.equilibrium_mp import equilibrium
from tests.oracles.fixed_point import ONE, TINY, P, evaluate, fixed, over_h, real, times_h, to_float
from tests.oracles.law import Law, law_of
from tests.oracles.roots import first_root


@dataclass(frozen=True)
class Event:
    """A crossing. ``rate`` and ``curvature`` are delta' and delta'' (right limit) there."""

    time: int
    element: int
    from_region: int
    to_region: int
    rate: int
    curvature: int


@dataclass
class Solution:
    """Samples (lists over time of lists over bodies or elements, fixed-point) and every crossing."""

    time: list[int] = field(default_factory=list)
    angle: list[list[int]] = field(default_factory=list)
    velocity: list[list[int]] = field(default_factory=list)
    acceleration: list[list[int]] = field(default_factory=list)
    deflection: list[list[int]] = field(default_factory=list)
    rate: list[list[int]] = field(default_factory=list)
    force: list[list[int]] = field(default_factory=list)
    region: list[list[int]] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    steps: int = 0

    def array(self, name: str) -> np.ndarray:
        """Return a sampled quantity as doubles, shape (time,) or (time, columns)."""
        rows = getattr(self, name)
        if name == "region":
            return np.array(rows, dtype=np.int64)
        if name == "time":
            return np.array([to_float(x) for x in rows])
        return np.array([[to_float(x) for x in row] for row in rows])


class _System:
    """The driveline's numbers in fixed point, the same for all regions."""

    def __init__(self, model: Driveline) -> None:
        names = {body.name: i for i, body in enumerate(model.bodies)} | {"ground": -1}
        self.n = len(model.bodies)
        self.J = [fixed(b.J) for b in model.bodies]
        self.inverse_J = [fixed(1 / Fraction(b.J)) for b in model.bodies]
        self.drag = [fixed(b.drag) for b in model.bodies]
        self.ends = [(names[e.between[0]], names[e.between[1]]) for e in model.elements]
        self.radii = [(fixed(e.radii[0]), fixed(e.radii[1])) for e in model.elements]
        self.laws = [law_of(e) for e in model.elements]
        self.constant = [-fixed(b.drag_torque) for b in model.bodies]
        self.slope = [0] * self.n
        self.changes: list[tuple[int, int, int, int]] = []  # time, body, new constant part, new slope: of ramps
        waves: dict[tuple[Fraction, str], int] = {}
        self.torques: list[tuple[int, int, int]] = []  # body, wave, amplitude
        self.errors: list[list[tuple[int, int]]] = [[] for _ in model.elements]  # wave, amplitude
        for torque in model.torques:
            self.constant[names[torque.on]] += fixed(torque.mean)
            self.changes += _ramp_changes(torque, names[torque.on])
            for h in torque.harmonics:
                wave = waves.setdefault((Fraction(h.order), h.phase), len(waves))
                self.torques.append((names[torque.on], wave, fixed(h.amplitude)))
        for k, element in enumerate(model.elements):
            for h in element.error:
                wave = waves.setdefault((Fraction(h.order), h.phase), len(waves))
                self.errors[k].append((wave, fixed(h.amplitude)))
        speed = Fraction(model.speed)
        self.waves = [(speed * order, Fraction(phase)) for order, phase in waves]
        self.changes.sort(reverse=True)

    def change_torques(self, time: int) -> None:
        """Begin or end the ramps whose instant is now."""
        while self.changes and self.changes[-1][0] <= time:
            _, body, constant, slope = self.changes.pop()
            self.constant[body] += constant
            self.slope[body] += slope

    def rate_bound(self, pieces: list[int]) -> float:
        """Return a bound on |lambda| of the region and on the forcing frequencies (it sets the step, no more)."""
        n = self.n
        K, D = np.zeros((n, n)), np.diag([to_float(d) for d in self.drag])
        for (a, b), radii, law, r in zip(self.ends, self.radii, self.laws, pieces, strict=True):
            w = np.zeros(n + 1)
            w[a], w[b] = to_float(radii[0]), -to_float(radii[1])
            w = w[:n]
            K += to_float(law.stiffness[r]) * np.outer(w, w)
            D += to_float(law.damping[r]) * np.outer(w, w)
        root = np.sqrt([to_float(j) for j in self.J])
        K, D = K / np.outer(root, root), D / np.outer(root, root)
        natural = sqrt(np.abs(K).sum(axis=1).max()) + np.abs(D).sum(axis=1).max()
        return max([natural, *(abs(float(w)) for w, _ in self.waves)])


def _ramp_changes(torque: Torque, body: int) -> list[tuple[int, int, int, int]]:
    """Return (time, body, change of the constant part, change of the slope) where ramps begin and end."""
    changes, before = [], Fraction(torque.mean)
    for ramp in torque.ramps:
        begin, to = Fraction(ramp.at), Fraction(ramp.to)
        end = begin + Fraction(ramp.over)
        slope = (to - before) / (end - begin)
        changes.append((fixed(begin), body, fixed(-slope * begin), fixed(slope)))
        changes.append((fixed(end), body, fixed(slope * end), fixed(-slope)))
        before = to
    return changes


def fastest_rate(model: Driveline) -> float:
    """Return a bound on |lambda| over the innermost and outermost pieces of all elements [1/s]."""
    system = _System(model)
    outer = [len(law.stiffness) - 1 for law in system.laws]
    return max(system.rate_bound(outer), system.rate_bound([0] * len(outer)))


@lru_cache(maxsize=4096)
def _wave_scale(frequency: Fraction, shift: int, terms: int) -> tuple[int, ...]:
    """Return (w h)^j / j! for h = 2^-shift."""
    x = frequency / 2**shift if shift >= 0 else frequency * 2**-shift
    return tuple(round(x**j / factorial(j) * ONE) for j in range(terms))


def _wave(frequency: Fraction, phase: Fraction, step: _Step) -> list[int]:
    """Return the Taylor coefficients, in units of the step, of sin(w t + phase) about the step's start."""
    with mp.workprec(2 * P):
        theta = (
            mpf(frequency.numerator) / frequency.denominator * real(step.time)
            + mpf(phase.numerator) / phase.denominator
        )
        cosine, sine = (fixed(x) for x in mp.cos_sin(theta))
    cycle = (sine, cosine, -sine, -cosine)
    return [g * cycle[j % 4] >> P for j, g in enumerate(_wave_scale(frequency, step.shift, step.terms))]


@dataclass(frozen=True)
class _Step:
    """Where a step starts, its length h = 2^-shift, how many Taylor terms it takes, and the piece of every element."""

    pieces: list[int]
    time: int
    shift: int
    terms: int


@dataclass
class _Piece:
    """Taylor polynomials over one step s in [0, 1], t = time + s h: angles, deflections and forces."""

    q: list[list[int]]
    delta: list[list[int]]
    force: list[list[int]]


def _expand(system: _System, step: _Step, q0: list[int], v0: list[int]) -> _Piece:
    """Return the Taylor polynomials of the motion that starts from q0, v0."""
    n, m, shift, terms, pieces = system.n, len(system.laws), step.shift, step.terms, step.pieces
    waves = [_wave(w, phase, step) for w, phase in system.waves]
    errors = [
        [sum(a * waves[i][j] for i, a in parts) >> P for j in range(terms)] if parts else None
        for parts in system.errors
    ]
    q = [[q0[i], times_h(v0[i], shift)] for i in range(n)]
    delta: list[list[int]] = [[] for _ in range(m)]
    force: list[list[int]] = [[] for _ in range(m)]

    def deflect(k: int, j: int) -> int:
        (a, b), (ra, rb), e = system.ends[k], system.radii[k], errors[k]
        value = (ra * q[a][j] if a >= 0 else 0) - (rb * q[b][j] if b >= 0 else 0)
        return (value >> P) - (e[j] if e else 0)

    for k in range(m):
        delta[k].append(deflect(k, 0))
    for j in range(terms - 2):
        torque = [_mean_torque(system, i, j, step) for i in range(n)]
        for body, i, amplitude in system.torques:
            torque[body] += amplitude * waves[i][j] >> P
        for k in range(m):
            law, r = system.laws[k], pieces[k]
            delta[k].append(deflect(k, j + 1))
            f = law.stiffness[r] * delta[k][j] + over_h(law.damping[r] * delta[k][j + 1] * (j + 1), shift) >> P
            if j == 0:
                f += law.offset[r]
            force[k].append(f)
            (a, b), (ra, rb) = system.ends[k], system.radii[k]
            if a >= 0:
                torque[a] -= ra * f >> P
            if b >= 0:
                torque[b] += rb * f >> P
        for i in range(n):
            net = torque[i] - (over_h(system.drag[i] * q[i][j + 1] * (j + 1), shift) >> P)
            acceleration = system.inverse_J[i] * net >> P
            q[i].append(times_h(times_h(acceleration, shift), shift) // ((j + 1) * (j + 2)))
    for k in range(m):
        delta[k].append(deflect(k, terms - 1))
    return _Piece(q, delta, force)


def _mean_torque(system: _System, body: int, j: int, step: _Step) -> int:
    """Return the Taylor coefficient j of a body's mean torque and ramps, in units of the step."""
    if j == 0:
        return system.constant[body] + (system.slope[body] * step.time >> P)
    return times_h(system.slope[body], step.shift) if j == 1 else 0


def _terms(boundtimes_h: float) -> int:
    """Return how many Taylor terms reach 2^-(P + 16)."""
    j, term = 1, 1.0
    while j < 12 or log2(term) > -(P + 16):
        term *= max(boundtimes_h, 0.1) / j
        j += 1
        if term < 1e-280:
            break
    return j + 4


def solve(
    model: Driveline,
    cycles: float,
    samples_per_cycle: int,
    perturbation: int = 0,
    seed: int = 0,
) -> Solution:
    """Return the motion over ``cycles`` common periods, sampled like the program's output.

    ``perturbation`` (fixed-point) moves every angle and velocity of the start by up to that much, at random (``seed``),
    for measuring how small differences grow.
    """
    with mp.workprec(2 * P):
        grid = [fixed(model.period * k / samples_per_cycle) for k in range(round(cycles * samples_per_cycle) + 1)]
    return solve_at(model, grid, perturbation, seed)


def solve_at(model: Driveline, grid: list[int], perturbation: int = 0, seed: int = 0) -> Solution:
    """Return the motion sampled at the given ascending times (fixed-point), the last being the end."""
    system = _System(model)
    q, v = _start(model)
    if perturbation:
        rng = random.Random(seed)
        q = [x + perturbation * rng.randint(-1000, 1000) // 1000 for x in q]
        v = [x + perturbation * rng.randint(-1000, 1000) // 1000 for x in v]
    return _march(system, q, v, grid)


def _start(model: Driveline) -> tuple[list[int], list[int]]:
    if model.angle is None or model.velocity is None:
        return [fixed(x) for x in equilibrium(model)], [0] * len(model.bodies)
    return [fixed(x) for x in model.angle], [fixed(x) for x in model.velocity]


def _step(system: _System, pieces: list[int], time: int, end: int) -> _Step:
    """Return a step of about 2/|lambda| (and at most about the whole run)."""
    bound = system.rate_bound(pieces)
    longest = max(to_float(end), 1e-9)
    shift = max(ceil(log2(bound / 2)) if bound > 0 else -60, ceil(-log2(longest)) - 1)
    return _Step(list(pieces), time, shift, _terms(bound / 2.0**shift))


def _march(system: _System, q: list[int], v: list[int], grid: list[int]) -> Solution:
    """Step from one crossing to the next, sampling on the way (right limits: a sample on a crossing comes after it)."""
    out, waiting, end = Solution(), list(reversed(grid)), grid[-1]
    pieces, corner_at = _initial_pieces(system, q, v, end)
    step = _step(system, pieces, 0, end)
    while True:
        out.steps += 1
        poly = _expand(system, step, q, v)
        _check_tail(poly)
        crossed, s = _first_crossings(system, step, poly, corner_at)
        if system.changes and over_h(system.changes[-1][0] - step.time, step.shift) < s:
            crossed, s = [], over_h(system.changes[-1][0] - step.time, step.shift)
        reached = step.time + times_h(s, step.shift)
        while waiting and waiting[-1] < reached:
            _sample(system, step, poly, waiting.pop(), out)
        if not waiting:
            return out
        q = [evaluate(c, s) for c in poly.q]
        v = [over_h(evaluate(c, s, 1), step.shift) for c in poly.q]
        before, corner_at = step.pieces, {}
        system.change_torques(reached + TINY)
        if not crossed:
            step = replace(step, time=reached)
            continue
        pieces, corner_at = _pieces_on_corners(system, before, q, v, time=reached, end=end)
        rates = [over_h(evaluate(c, s, 1), step.shift) for c in poly.delta]
        step = _step(system, pieces, reached, end)
        fresh = _expand(system, replace(step, terms=6), q, v)
        for k in (k for k in range(len(pieces)) if pieces[k] != before[k]):
            first, curvature = system.laws[k].first, over_h(over_h(2 * fresh.delta[k][2], step.shift), step.shift)
            out.events.append(Event(reached, k, first + before[k], first + pieces[k], rates[k], curvature))


def _check_tail(poly: _Piece) -> None:
    tail = max(abs(x) for c in poly.q for x in c[-2:])
    if tail > 1 << 40:  # 2^-216 = 1e-65
        raise ArithmeticError("the Taylor series has not converged: take a smaller step")


def _sample(system: _System, step: _Step, poly: _Piece, time: int, out: Solution) -> None:
    shift = step.shift
    s = over_h(time - step.time, shift)
    out.time.append(time)
    out.angle.append([evaluate(c, s) for c in poly.q])
    out.velocity.append([over_h(evaluate(c, s, 1), shift) for c in poly.q])
    out.acceleration.append([over_h(over_h(evaluate(c, s, 2), shift), shift) for c in poly.q])
    out.deflection.append([evaluate(c, s) for c in poly.delta])
    out.rate.append([over_h(evaluate(c, s, 1), shift) for c in poly.delta])
    out.force.append([evaluate(c, s) for c in poly.force])
    out.region.append([law.first + r for law, r in zip(system.laws, step.pieces, strict=True)])


def _initial_pieces(system: _System, q, v, end: int) -> tuple[list[int], dict[int, int]]:
    """Return the piece of every element at t = 0+ and, for those exactly on a corner, which corner."""
    pieces = [0] * len(system.laws)
    deflection = [d[0] for d in _expand(system, _Step(pieces, 0, 0, 4), q, v).delta]
    for k, law in enumerate(system.laws):
        pieces[k] = sum(1 for corner in law.corners if deflection[k] > corner)
    return _pieces_on_corners(system, pieces, q, v, time=0, end=end)


def _pieces_on_corners(system: _System, pieces, q, v, *, time: int, end: int) -> tuple[list[int], dict[int, int]]:
    """Return the pieces with those exactly on a corner decided, and which corner they sit on.

    The first derivative of delta that is not zero decides; the inner region if there is none. The pieces of other
    elements enter the higher derivatives, so the rule is repeated until nothing changes: an element at rest on its
    corner may be moved off it by the crossing of another.
    """
    pieces = list(pieces)
    deflection = [d[0] for d in _expand(system, _Step(pieces, time, 0, 4), q, v).delta]
    on = {
        k: i
        for k, law in enumerate(system.laws)
        for i, corner in enumerate(law.corners)
        if abs(deflection[k] - corner) <= TINY
    }
    for k, i in on.items():
        pieces[k] = _inner(system.laws[k], i)
    for _ in range(2 * len(on) + 8):
        poly, previous = _expand(system, _step(system, pieces, time, end), q, v), list(pieces)
        for k, i in on.items():
            lead = next((c for c in poly.delta[k][1:12] if abs(c) > TINY), 0)
            pieces[k] = i + 1 if lead > 0 else i if lead < 0 else _inner(system.laws[k], i)
        if pieces == previous:
            return pieces, on
    raise ArithmeticError("no consistent region")


def _inner(law: Law, corner: int) -> int:
    """Return the piece on the inner side of a corner (label nearer the centre; 0 rather than -1)."""
    below, above = law.first + corner, law.first + corner + 1
    return corner if abs(below) < abs(above) else corner + 1


def _first_crossings(system: _System, step: _Step, poly: _Piece, corner_at: dict[int, int]):
    """Return the crossings (element, corner) that come first in the step and their place s, or none and s = 1."""
    actual: list[tuple[int, int, int]] = []
    for k, law in enumerate(system.laws):
        r = step.pieces[k]
        for corner in (r - 1, r):
            if not 0 <= corner < len(law.corners):
                continue
            c = list(poly.delta[k])
            c[0] -= law.corners[corner]
            if corner_at.get(k) == corner:  # divide the known root at s = 0 out
                c = c[1:]
                while c and abs(c[0]) <= TINY >> 40:
                    c = c[1:]
            s = first_root(c)
            if s is not None:
                actual.append((s, k, corner))
    if not actual:
        return [], ONE
    first = min(actual)[0]
    together = sorted((k, corner) for s, k, corner in actual if s - first <= TINY)
    return together, first


def growth(model: Driveline, cycles: float, samples_per_cycle: int, base: Solution, scale: np.ndarray) -> np.ndarray:
    """Return, sample by sample, the factor by which a tiny perturbation of the start has grown so far.

    ``scale`` (2, elements): the scale of each deflection and of each deflection rate. All angles and velocities of the
    start move by some 1e-30; the factor is the largest change of a deflection or rate, relative to its scale, over
    the largest such change at the start, and never falls.
    """
    moved = solve(model, cycles, samples_per_cycle, perturbation=fixed(Fraction(1, 10**30)), seed=1)
    return growth_between(base, moved, scale) if model.elements else np.ones(len(base.time))


def growth_between(base: Solution, moved: Solution, scale: np.ndarray) -> np.ndarray:
    """Return the factor by which the distance of two motions has grown so far, sample by sample."""
    change = np.zeros(len(base.time))
    for quantity, row in (("deflection", scale[0]), ("rate", scale[1])):
        before, after = getattr(base, quantity), getattr(moved, quantity)
        for i, (a, b) in enumerate(zip(before, after, strict=True)):
            change[i] = max([change[i], *(abs(to_float(x - y)) / s for x, y, s in zip(a, b, row, strict=True))])
    return np.maximum.accumulate(change) / change[0]
