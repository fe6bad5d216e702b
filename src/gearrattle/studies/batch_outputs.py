"""Outputs that need metrics or samples, of cases computed together, evaluated as soon as the loop has finished a case.

The loop (``solvers.variants``) integrates a case and returns it with the samples of its last cycles: of the eight
cycles for the levels of accelerations, of the steady part, or of none if crossings suffice. Crossings before these
cycles are counted in tallies. So earlier cycles need no samples, and a case is evaluated like the last chunk of a long
motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from numpy.typing import NDArray

from gearrattle.assembly import assemble, whole_trajectory
from gearrattle.engine.kernels.variant_arrays import picked
from gearrattle.engine.solvers.variants import END, Batch, Kept
from gearrattle.engine.system.flow import flow_of
from gearrattle.model import Model
from gearrattle.quantities.evaluation import rows_of
from gearrattle.quantities.metric_sources import inputs_of_crossings
from gearrattle.quantities.quantity_table import CRITERIA, METRICS, QUANTITIES
from gearrattle.results import Run
from gearrattle.signals import parts_of, reduced_inertias
from gearrattle.signals.last_levels import LAST_CYCLES
from gearrattle.simulation.integrate import Grid, cost_of, named
from gearrattle.studies.output import SOUND, Output
from gearrattle.studies.outputs import values_in, values_of
from gearrattle.trajectory import Layout

_LAST = {criterion.name for criterion in CRITERIA if criterion.sums == ("last cycles",)}
_OF_LOG = [metric for metric in METRICS if metric.of_crossings]
_OF_LOG_NAMES = {metric.name for metric in _OF_LOG}
_KNOWN = {*(quantity.name for quantity in QUANTITIES), SOUND}


def is_followed(output: Output) -> bool:
    """Whether an output is of the steady part of a motion alone."""
    return output.criterion in _KNOWN and not output.over_all


@dataclass(frozen=True)
class Followed:
    """Evaluation of the cases that the loop has integrated."""

    outputs: Sequence[Output]
    model: Model

    @property
    def kept(self) -> Kept:
        """The samples that are needed."""
        settings = self.model.simulation
        assert settings.cycles is not None and settings.discard is not None  # noqa: PT018 - the plan's model is settled
        assert settings.samples_per_cycle is not None
        criteria = {output.criterion for output in self._sampled}
        steady = settings.cycles - settings.discard
        if not criteria:
            return END
        if SOUND in criteria:  # the path of the sound rings from before the steady part
            return Kept(settings.samples_per_cycle, settings.cycles)
        return Kept(settings.samples_per_cycle, min(LAST_CYCLES, steady) if criteria <= _LAST else steady)

    @cached_property
    def _sampled(self) -> list[Output]:
        """The outputs that need samples."""
        return [output for output in self.outputs if output.criterion not in _OF_LOG_NAMES]

    @cached_property
    def _of_log(self) -> list[Output]:
        """The outputs that need no samples."""
        return [output for output in self.outputs if output.criterion in _OF_LOG_NAMES]

    def values(self, model: Model, variant: int, batch: Batch) -> dict[str, NDArray[Any]] | None:
        """Return every output of the case that the loop has just followed; None where it must be simulated alone."""
        driveline = assemble(model)
        layout = driveline.layout
        values = dict[str, NDArray[Any]]()
        mass = reduced_inertias(layout, parts_of(layout).clearance.tolist())
        crossings = {**picked(batch.out, variant)._asdict(), "mass": mass}
        if self._of_log:
            inputs = inputs_of_crossings(crossings, layout, self._span(layout))
            wanted = {output.quantity for output in self._of_log}
            values |= values_in(rows_of(inputs, _OF_LOG, wanted), self._of_log, parts_of(layout))
        if self._sampled:
            motion = batch.motion(flow_of(driveline.system))
            if motion is None:
                return None
            trajectory = named(motion, layout, self._grid, cost_of(motion, "exact", 0.0))
            values |= values_of(self._sampled, Run(whole_trajectory(model, trajectory), model), crossings)
        return values

    @property
    def _grid(self) -> Grid:
        """Sample grid of the cycles that are kept."""
        per_cycle, cycles = self.kept
        whole = int(self.model.simulation.cycles or 0)
        steady = whole - int(self.model.simulation.discard or 0)
        return Grid(per_cycle, cycles, whole - cycles, max(0, cycles - steady))

    def _span(self, layout: Layout) -> tuple[float, float]:
        """First and last sample of the steady part [s]."""
        settings = self.model.simulation
        per_cycle = int(self.model.simulation.samples_per_cycle or 1)
        spacing = layout.period / per_cycle
        return int(settings.discard or 0) * per_cycle * spacing, int(settings.cycles or 0) * per_cycle * spacing
