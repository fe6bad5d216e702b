"""Outputs of a case over all its stable motions: the largest value that any of them has.

A simulation gives the response of the motion that it settles in. Under the same load there may be others; a design that
is judged by one of them may turn out louder. So every output has a twin "... over all stable motions": the largest
value over the motions in which the case itself and ``orbits.attractors.STARTS`` other starts settle, each judged over
its own n periods. A word counts by its code: the worst verdict. Where the case itself does not settle, its own value
counts as well. Motions whose basin no start met are not among them.

Two outputs are known of these motions alone: ``COUNT``, how many there are, and ``SWING``, exact between samples.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import assemble
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.orbits.attractors import Settled, settled_motions
from gearrattle.orbits.start_states import state_of
from gearrattle.results import Run
from gearrattle.studies.output import OVER_ALL, Output

Values = dict[str, NDArray[Any]]

COUNT = "stable motions"
SWING = f"peak-to-peak deflection{OVER_ALL}"


def values_over_all(
    outputs: Sequence[Output], run: Run, values_of: Callable[[tuple[Output, ...], Run], Values]
) -> Values:
    """Return the largest value of every output over all stable motions of a case."""
    model = run.model
    settled = settled_motions(model, state_of(model, PeriodMap(assemble(model).system), run))
    bases = {output.name: replace(output, name=output.base, over_all=False) for output in outputs}
    judged = tuple(bases[name] for name in bases if name not in (COUNT, SWING))
    runs = [orbit.run for orbit in settled.orbits] + ([run] if settled.own < 0 else [])
    of_motions = [values_of(judged, one) for one in runs] if judged else []
    values: Values = {}
    for output in outputs:
        if output.name == COUNT:
            values[COUNT] = np.array(float(len(settled.orbits)))
        elif output.name == SWING:
            values[SWING] = _swings(output, settled, run)
        else:
            base = output.base
            values[output.name] = np.fmax.reduce([one[base] for one in of_motions]).astype(output.dtype)
    return values


def _swings(output: Output, settled: Settled, run: Run) -> NDArray[Any]:
    """Peak-to-peak deflection of every clearance, (subjects,)."""
    t = run.trajectory
    swings = [levels[1] - levels[0] for orbit in settled.orbits for levels in [orbit.period_map.levels(orbit.motion)]]
    if settled.own < 0:
        swings.append(np.ptp(t.deflection[t.discard * t.samples_per_cycle :], axis=0))
    largest = dict(zip(t.layout.clearance_names, np.max(swings, axis=0), strict=True))
    return np.array([largest.get(str(name), output.nothing) for name in output.subjects])
