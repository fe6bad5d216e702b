"""A driveline in plain floats: the physical definition from which both the program and the check are fed.

    J q'' + D q' + W^T F(W q - e, W q' - e') = T(t)

Each element has stages from the centre outward on its drive and coast side. Units are whatever is consistent.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gearrattle.engine.solvers import SOLVERS, Motion, Task
from gearrattle.engine.system.law import Stage, staged
from gearrattle.engine.system.piecewise import Harmonics, PiecewiseSystem
from gearrattle.outcome import Outcome

MOST_SECONDS = 20.0
"""Processor time after which a run counts as stalled; the busiest case, its regions included, needs one or two."""

Stages = tuple[tuple[float, float, float | None], ...]


class Stalled(AssertionError):
    """The solver did not finish."""


@dataclass(frozen=True)
class Element:
    """Stages (stiffness, damping, outer end) of both sides from the centre outward; force at zero deflection."""

    drive: Stages
    coast: Stages
    preload: float = 0.0


@dataclass(frozen=True)
class Law:
    """The same laid side by side: F = k d + c d' + f in piece r, between corners[r - 1] and corners[r]."""

    corners: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    offset: np.ndarray


def law_of(element: Element) -> Law:
    """Lay the sides of an element together; the elastic force is continuous and equals the preload at zero."""
    sides = []
    for stages, sign in ((element.drive, 1.0), (element.coast, -1.0)):
        rows = []
        force = element.preload
        inner = 0.0
        for k, c, until in stages:
            end = sign * until if until is not None else np.nan
            rows.append((end, k, c, force - k * inner))
            force, inner = force + k * (end - inner), end
        sides.append(rows)
    drive, coast = sides
    corners = [row[0] for row in reversed(coast[:-1])] + [0.0] + [row[0] for row in drive[:-1]]
    pieces = [row[1:] for row in reversed(coast)] + [row[1:] for row in drive]
    if drive[0][1:3] == coast[0][1:3]:  # one piece through zero
        del corners[len(coast) - 1], pieces[len(coast) - 1]
    k, c, f = (np.array(column) for column in zip(*pieces, strict=True))
    return Law(np.array(corners), k, c, f)


@dataclass(frozen=True)
class Case:
    """A driveline, its inputs, its start, and how long it is followed.

    Attributes
    ----------
    inertia, drag
        (n,). rows: (m, n) W. elements: m of them.
    period
        T of the inputs; harmonic j makes cycles[j] oscillations in it.
    mean
        (n,) constant torque. torque_sine, torque_cosine: (n, H). error_sine, error_cosine: (m, H).
    angle, velocity
        (n,) at t = 0. length: periods; samples: stored a period.
    """

    name: str
    inertia: np.ndarray
    drag: np.ndarray
    rows: np.ndarray
    elements: tuple[Element, ...]
    period: float
    cycles: np.ndarray
    mean: np.ndarray
    torque_sine: np.ndarray
    torque_cosine: np.ndarray
    error_sine: np.ndarray
    error_cosine: np.ndarray
    angle: np.ndarray
    velocity: np.ndarray
    length: int
    samples: int

    @cached_property
    def laws(self) -> tuple[Law, ...]:
        """The laws of all elements, laid side by side."""
        return tuple(law_of(e) for e in self.elements)

    @property
    def clearances(self) -> tuple[int, ...]:
        """Indices of the elements with a corner."""
        return tuple(k for k, law in enumerate(self.laws) if law.corners.size)

    def system(self) -> PiecewiseSystem:
        """What the program takes."""
        laws = tuple(
            staged([Stage(*s) for s in e.drive], [Stage(*s) for s in e.coast], e.preload) for e in self.elements
        )
        inputs = Harmonics(
            self.period,
            self.cycles,
            self.mean,
            self.torque_sine,
            self.torque_cosine,
            self.error_sine,
            self.error_cosine,
        )
        return PiecewiseSystem(self.inertia, self.drag, self.rows, laws, inputs)

    def task(self) -> Task:
        """The run to make."""
        return Task(self.system(), self.angle, self.velocity, self.length, self.samples, None, None, audit=False)


def run(case: Case) -> Motion:
    """Return the motion as ``exact`` finds it; a run that fails or does not end raises ``Stalled``."""
    march = SOLVERS["exact"](case.task())
    began = None
    while (outcome := march.advance()) is not Outcome.DONE:
        began = began or time.process_time()  # the first slice may have been compiled
        if outcome is not Outcome.SLICE_SPENT:
            raise Stalled(f"{case.name}: {outcome.name} at t = {march.position().time:.9g}")
        if time.process_time() - began > MOST_SECONDS:
            raise Stalled(f"{case.name}: still under way at t = {march.position().time:.9g}")
    return march.motion()
