"""Slow and obvious: drivelines with dry friction and clipped contact damping to fifty digits, from the definitions.

A slider in series with a spring s sticks where it is: its torque is s (delta - a) with the anchor a, until that is H;
then the torque is H and the anchor follows, until delta' changes sign and it sticks anew, a = delta -+ H / s. It is
engaged unloaded (a = delta) and let go at the end of its range. Clipped contact damping is the min and max of its
definition, term by term. So an element's force is linear between switches, k delta + c delta' + f, and the Taylor
recursion of :mod:`tests.oracles.exact_mp` serves; a switch is the first root of one of the *guards*, polynomials that
are positive while everything stays as it is.
"""

from __future__ import annotations

import copy
import random
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from mpmath import mp

from tests.oracles.driveline import Coupling, Driveline
from tests.oracles.exact_mp import Event, Solution, _expand, _start, _step, _System, growth_between
from tests.oracles.fixed_point import ONE, TINY, P, evaluate, fixed, over_h, times_h
from tests.oracles.law import Law, law_of
from tests.oracles.roots import first_root

Triple = tuple[int, int, int]


class Friction(NamedTuple):
    """A slider: spring, H, H / s, and the labels of the regions in which it is engaged (low, high)."""

    name: str
    spring: int
    limit: int
    reach: int
    low: float
    high: float


def frictions(element) -> list[Friction]:
    """Return the sliders of an element: what each stage's loop has beyond the loop of the stage before."""
    if not isinstance(element, Coupling):
        return []
    drive, coast = element.sides
    heights = [[Fraction(stage.hysteresis) for stage in side] for side in (drive, coast)]
    split = 0 if 0 in law_of(element).corners else None
    actual, shared = [], min(heights[0][0], heights[1][0])

    def add(name, height, stage, low, high):
        if height > 0:
            spring, limit = stage.stick, height / 2
            actual.append(Friction(name, fixed(spring), fixed(limit), fixed(limit / spring), low, high))

    add("0", shared, drive[0] if heights[0][0] == shared else coast[0], -np.inf, np.inf)
    for i, stage in enumerate(drive):
        add(f"drive.{i}", heights[0][i] - (heights[0][i - 1] if i else shared), stage, i, np.inf)
    for i, stage in enumerate(coast):
        outer = -i - 1 if split == 0 else -i
        add(f"coast.{i}", heights[1][i] - (heights[1][i - 1] if i else shared), stage, -np.inf, outer)
    return [replace_name(f, element.name) for f in actual]


def replace_name(friction: Friction, element: str) -> Friction:
    return friction._replace(name=f"{element}.{friction.name}")


@dataclass
class _Part:
    """One element: its law, its sliders, and how everything stands.

    ``held``: of every slider None (let go), ("stick", anchor) or ("slip", sign). ``mode``: of clipped contact damping
    "spring" (as it is), "double" (as large as the spring), "nothing" (no pull), or None.
    """

    law: Law
    frictions: list[Friction]
    clipped: bool
    piece: int = 0
    held: list = field(default_factory=list)
    mode: str | None = None

    @property
    def label(self) -> int:
        return self.law.first + self.piece

    def triple(self) -> Triple:
        """k, c, f of the force as everything stands."""
        k, c, f = (getattr(self.law, name)[self.piece] for name in ("stiffness", "damping", "offset"))
        if self.mode == "double":
            k, c, f = 2 * k, 0, 2 * f
        elif self.mode == "nothing":
            k, c, f = 0, 0, 0
        for friction, held in zip(self.frictions, self.held, strict=True):
            if held is not None and held[0] == "stick":
                k, f = k + friction.spring, f - (friction.spring * held[1] >> P)
            elif held is not None:
                f += held[1] * friction.limit
        return k, c, f

    def guards(self, delta: list[int], shift: int):
        """Yield (what, polynomial that is positive while it lasts, what to do beyond)."""
        corners = self.law.corners
        if self.piece > 0:
            yield "corner", _minus(delta, corners[self.piece - 1]), -1
        if self.piece < len(corners):
            yield "corner", [-x for x in _minus(delta, corners[self.piece])], 1
        rate = [over_h(j * x, shift) for j, x in enumerate(delta)][1:]
        for i, (friction, held) in enumerate(zip(self.frictions, self.held, strict=True)):
            if held is None:
                continue
            if held[0] == "stick":
                stretch = _minus(delta, held[1])
                yield i, _minus(stretch, -friction.reach), ("slip", -1)
                yield i, [-x for x in _minus(stretch, friction.reach)], ("slip", 1)
            else:
                yield i, [held[1] * x for x in rate], ("stick", -held[1] * friction.reach)
        if self.mode is not None:
            yield from self._contact(delta, rate)

    def _contact(self, delta, rate):
        side = 1 if self.label > 0 else -1
        k, c, f = (getattr(self.law, name)[self.piece] for name in ("stiffness", "damping", "offset"))
        spring = [side * k * x >> P for x in delta[:-1]]
        spring[0] += side * f
        damper = [side * c * x >> P for x in rate]
        over = [e - d for e, d in zip(spring, damper, strict=True)]
        under = [e + d for e, d in zip(spring, damper, strict=True)]
        if self.mode == "spring":
            yield "contact", over, "double"
            yield "contact", under, "nothing"
        else:
            yield "contact", [-x for x in (over if self.mode == "double" else under)], "spring"

    def enter(self, piece: int, delta: int, rate: int) -> None:
        """Enter a piece of the law."""
        self.piece = piece
        for i, friction in enumerate(self.frictions):
            engaged = friction.low <= self.label <= friction.high
            self.held[i] = None if not engaged else self.held[i] or ("stick", delta)
        if self.clipped:
            side = (self.label > 0) - (self.label < 0)
            pushes = side * rate > 0 and self.law.damping[piece] > 0
            self.mode = None if side == 0 else "double" if pushes else "spring"


def _minus(polynomial: list[int], constant: int) -> list[int]:
    return [polynomial[0] - constant, *polynomial[1:]]


class Switch(NamedTuple):
    """What a slider or the clipping of an element's contact damping did."""

    time: int
    name: str
    to: str


@dataclass
class Motion(Solution):
    """A solution with the switches of sliders and of contact damping."""

    switches: list[Switch] = field(default_factory=list)


class _March:
    """The driveline under way."""

    def __init__(self, model: Driveline, end: int) -> None:
        self.model, self.system, self.end = model, _System(model), end
        self.parts = [_Part(law_of(e), frictions(e), e.contact_damping == "clipped") for e in model.elements]
        self.out = Motion()

    def linear(self) -> _System:
        """The system with every element's force as it stands."""
        system = copy.copy(self.system)
        system.laws = [Law((), *((x,) for x in part.triple()), first=0) for part in self.parts]
        return system

    def begin(self, q: list[int], v: list[int]) -> None:
        """Everything as it is at t = 0+: sliders unloaded."""
        for part in self.parts:
            part.held = [None] * len(part.frictions)
        poly = _expand(self.linear(), replace(self.step(0), terms=4, shift=0), q, v)
        for part, delta in zip(self.parts, poly.delta, strict=True):
            law, here = part.law, delta[0]
            piece = sum(1 for corner in law.corners if here > corner + TINY)
            for i, corner in enumerate(law.corners):
                if abs(here - corner) <= TINY:
                    piece = i if abs(law.first + i) < abs(law.first + i + 1) else i + 1
            part.enter(piece, here, delta[1])
        self.resolve(0, q, v, log=False)

    def step(self, time: int):
        """A step of about 2 / |lambda|."""
        return _step(self.linear(), [0] * len(self.parts), time, self.end)

    def resolve(self, time: int, q: list[int], v: list[int], log: bool = True) -> None:
        """Switch whatever does not last, until everything does."""
        for _ in range(200):
            step = self.step(time)
            poly = _expand(self.linear(), step, q, v)
            violated = self.violated(poly.delta, step.shift)
            if violated is None:
                return
            k, what, then = violated
            part, here = self.parts[k], poly.delta[k][0]
            rate = over_h(poly.delta[k][1], step.shift)
            if what == "corner":
                before = part.label
                part.enter(part.piece + then, here, rate)
                if log:
                    self.out.events.append(Event(time, k, before, part.label, rate, self._curvature(k, q, v, time)))
            elif what == "contact":
                part.mode = then
                if log:
                    self.out.switches.append(Switch(time, f"{self.model.elements[k].name}.contact", then))
            else:
                part.held[what] = ("stick", here + then[1]) if then[0] == "stick" else then
                if log:
                    self.out.switches.append(Switch(time, part.frictions[what].name, f"{then[0]}{then[1]}"[:6]))
        raise ArithmeticError("no consistent state")

    def _curvature(self, k: int, q, v, time: int) -> int:
        step = self.step(time)
        delta = _expand(self.linear(), replace(step, terms=6), q, v).delta[k]
        return over_h(over_h(2 * delta[2], step.shift), step.shift)

    def violated(self, deltas, shift: int):
        """The first thing that does not last: negative now, or zero and about to be."""
        for k, part in enumerate(self.parts):
            for what, guard, then in part.guards(deltas[k], shift):
                lead = next((c for c in guard[:12] if abs(c) > TINY), 0)
                if lead < 0:
                    return k, what, then
        return None

    def run(self, q: list[int], v: list[int], grid: list[int]) -> Motion:
        """Go from switch to switch, sampling on the way."""
        self.begin(q, v)
        time, waiting = 0, list(reversed(grid))
        while True:
            self.out.steps += 1
            step, system = self.step(time), self.linear()
            poly = _expand(system, step, q, v)
            s = self.lasts(poly.delta, step.shift)
            reached = time + times_h(s if s is not None else ONE, step.shift)
            while waiting and waiting[-1] < reached:
                self.sample(step, poly, waiting.pop())
            if not waiting:
                return self.out
            at = ONE if s is None else s
            q = [evaluate(c, at) for c in poly.q]
            v = [over_h(evaluate(c, at, 1), step.shift) for c in poly.q]
            time = reached
            if s is not None:
                self.resolve(time, q, v)

    def lasts(self, deltas, shift: int) -> int | None:
        """How far into the step everything lasts; None: all of it."""
        actual = []
        for k, part in enumerate(self.parts):
            for _, guard, _ in part.guards(deltas[k], shift):
                c = list(guard)
                if abs(c[0]) <= TINY:  # it sits there: divide the known root out
                    c = c[1:]
                    while c and abs(c[0]) <= TINY >> 40:
                        c = c[1:]
                actual.append(first_root(c))
        return min((s for s in actual if s is not None), default=None)

    def sample(self, step, poly, time: int) -> None:
        """Store everything at one instant."""
        out, shift = self.out, step.shift
        s = over_h(time - step.time, shift)
        out.time.append(time)
        out.angle.append([evaluate(c, s) for c in poly.q])
        out.velocity.append([over_h(evaluate(c, s, 1), shift) for c in poly.q])
        out.acceleration.append([over_h(over_h(evaluate(c, s, 2), shift), shift) for c in poly.q])
        out.deflection.append([evaluate(c, s) for c in poly.delta])
        out.rate.append([over_h(evaluate(c, s, 1), shift) for c in poly.delta])
        out.force.append([evaluate(c, s) for c in poly.force])
        out.region.append([part.label for part in self.parts])


def solve(model: Driveline, cycles: int, samples_per_cycle: int, perturbation: int = 0, seed: int = 0) -> Motion:
    """Return the motion over some periods; arguments as for ``exact_mp.solve``."""
    with mp.workprec(2 * P):
        grid = [fixed(model.period * k / samples_per_cycle) for k in range(cycles * samples_per_cycle + 1)]
    q, v = _start(model)
    if perturbation:
        rng = random.Random(seed)
        q = [x + perturbation * rng.randint(-1000, 1000) // 1000 for x in q]
        v = [x + perturbation * rng.randint(-1000, 1000) // 1000 for x in v]
    return _March(model, grid[-1]).run(q, v, grid)


def growth(model: Driveline, cycles: int, samples_per_cycle: int, base: Motion, scale: np.ndarray) -> np.ndarray:
    """Return how a tiny perturbation of the start has grown, sample by sample; see ``exact_mp.growth``."""
    moved = solve(model, cycles, samples_per_cycle, perturbation=fixed(Fraction(1, 10**30)), seed=1)
    return growth_between(base, moved, scale)
