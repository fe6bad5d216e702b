"""A driveline with more on board: sliders, clipped contact damping, alternating stiffness, piecewise polynomials.

The physical definition from which both the program and the check are fed; the check shares no formula with the program.

* A slider is a spring in series with a Coulomb slider on one element, engaged in some pieces of its law.
* Where an element is clipped, the damper's part of its force in contact is min(max(c delta', -E), E), E the size of the
  spring's force there.
* An alternating element lacks a part of its elastic force half of the time; it changes at given instants.
* Polynomials add to the torques and transmission errors.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gearrattle.engine.system.auxiliary import Auxiliary, alternation, limiters, slider
from gearrattle.engine.system.clock import Clock
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.piecewise_signals import Signals
from tests.dense.case import Case


@dataclass(frozen=True)
class Slider:
    """A spring that slips at a limit; ``engaged`` are the indices of the pieces of its element's law it works in."""

    element: int
    spring: float
    limit: float
    engaged: tuple[int, ...]

    @property
    def reach(self) -> float:
        """The stretch at which it slips."""
        return self.limit / self.spring


@dataclass(frozen=True)
class Pairs:
    """An element that lacks a part of its elastic force, or does not, in turn; ``instants`` are those of changes."""

    element: int
    lacking: float
    begins_lacking: bool
    instants: tuple[float, ...]


@dataclass(frozen=True)
class Dressed(Case):
    """A case with auxiliaries and signals.

    Attributes
    ----------
    sliders
        in the order of their auxiliaries, behind those of the clipped elements.
    clipped
        elements with clipped contact damping.
    pairs
        alternating elements; their instants come again every period if ``repeats``.
    signals
        knots, coefficients, and what they act on; None without.
    """

    sliders: tuple[Slider, ...] = ()
    clipped: tuple[int, ...] = ()
    pairs: tuple[Pairs, ...] = ()
    repeats: bool = True
    signals: Signals | None = None

    def system(self) -> PiecewiseSystem:
        """What the program takes."""
        plain = super().system()
        others: list[Auxiliary] = []
        for k in self.clipped:
            others += limiters(k, plain.laws[k])
        for entry in self.sliders:
            law = plain.laws[entry.element]
            labels = [piece + law.first_label for piece in entry.engaged]
            others.append(slider(entry.element, law, (entry.spring, entry.limit), labels, self.period))
        first = len(others)
        for pair in self.pairs:
            law = plain.laws[pair.element]
            others.append(alternation(pair.element, law, pair.lacking, begins_lacking=pair.begins_lacking))
        ticks = sorted((time, first + i) for i, pair in enumerate(self.pairs) for time in pair.instants)
        clock = Clock(np.array([time for time, _ in ticks]), np.array([c for _, c in ticks], np.int64), self.repeats)
        return replace(plain, auxiliaries=tuple(others), signals=self.signals, clock=clock if ticks else None)

    def ticks(self, pair: int) -> np.ndarray:
        """All instants of an alternating element within the run, one at its very end left out."""
        once, end = np.array(self.pairs[pair].instants), self.length * self.period
        turns = np.arange(self.length) if self.repeats else np.zeros(1)
        all_of_them = np.add.outer(turns * self.period, once).ravel()
        return all_of_them[all_of_them < end * (1 - 1e-14)]
