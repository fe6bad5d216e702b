"""Pilot run: a short exact run that gives regimes, the cost of a cycle and the growth of perturbations.

An exact run of some thirty cycles costs less than most of the linear algebra of an advice, so it gives the first
evidence on everything nonlinear. It does not show motions that settle slowly, nor motions from other starts.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from gearrattle.advice.forecasts import QUANTITIES, Forecast
from gearrattle.analysis.stiffness import Visited, regions_visited
from gearrattle.engine.system.perturbation_growth import GROWTH
from gearrattle.model import Model
from gearrattle.results import Run
from gearrattle.simulation.simulate import simulate
from gearrattle.wording import counted

CYCLES = 32


@dataclass(frozen=True)
class Pilot:
    """A short exact run, of which the first half is discarded."""

    run: Run
    planned: int

    @property
    def name(self) -> str:
        """Name of the pilot, as its forecasts and lines give it."""
        return f"pilot of {counted(self.run.trajectory.cycles, 'cycle')}"

    def of(self, quantity: str) -> dict[str, float | str]:
        """Return the values in the pilot run of a quantity that can be forecast, by subject."""
        return dict(QUANTITIES[quantity][0](self.run))

    @cached_property
    def _treated(self) -> list[Visited]:
        return []

    def treat_regions(self, progress: Callable[[float], None] | None = None) -> None:
        """Compute the eigenvalues of the regions that the pilot visits; ``progress`` receives the finished share."""
        if not self._treated:
            self._treated.append(regions_visited(self.run, progress))

    @property
    def visited(self) -> Visited:
        """Regions that the pilot visits, with their eigenvalues."""
        self.treat_regions()
        return self._treated[0]

    @property
    def stretched(self) -> float:
        """Length of the planned run over the length of the pilot."""
        return self.planned / self.run.trajectory.cycles

    @property
    def exponent(self) -> float:
        """Largest Lyapunov exponent over the second half [1/s]."""
        return self.run.largest_lyapunov_exponent

    @cached_property
    def _growth(self) -> tuple[float, float]:
        return self.run.variation.growth(GROWTH)

    @property
    def predictable_cycles(self) -> float:
        """Cycles until a perturbation has grown by ``GROWTH``; infinite if that is beyond the planned end.

        If the pilot is too short, the growth is extrapolated at the rate of the largest Lyapunov exponent.
        """
        t = self.run.trajectory
        reached, grown = self._growth
        if math.isinf(reached):
            rate = self.exponent
            reached = t.end + math.log(GROWTH / grown) / rate if rate > 0.0 else math.inf
        cycles = reached / t.layout.period
        return cycles if cycles < self.planned else math.inf

    def forecasts(self) -> list[Forecast]:
        """All forecasts of the pilot for the planned run."""
        forecasts = [
            Forecast(quantity, subject, self.name, value, "1" if quantity == "mean slope" else "")
            for quantity in ("regime", "mean slope")
            for subject, value in self.of(quantity).items()
        ]
        for quantity, unit in (("function calls", "1"), ("computing time", "s")):
            value = self.of(quantity)[""]
            assert isinstance(value, float)
            forecasts.append(Forecast(quantity, "", self.name, value * self.stretched, unit))
        forecasts.append(Forecast("crossings a cycle", "", self.name, self.of("crossings a cycle")[""], "1"))
        forecasts.append(Forecast("predictable cycles", "", self.name, self.predictable_cycles, "1"))
        return forecasts


def run_pilot(
    model: Model, planned: int, progress: Callable[[float], None] | None = None, cycles: int = CYCLES
) -> Pilot:
    """Simulate a model exactly for some cycles, never more than planned, after one cycle that compiles the code.

    Raises
    ------
    ModelError
        no static equilibrium to start from.
    ConvergenceError
        the exact solution failed.
    """
    cycles = min(cycles, planned)
    simulate(model, "exact", cycles=1, discard=0)
    return Pilot(simulate(model, "exact", cycles=cycles, discard=cycles // 2, progress=progress), planned)
