"""Short run of a model with some values changed by a slider: its verdict and its phase planes.

Only few cycles are computed, so that the answer comes while the slider moves; a run that is kept has its full length. A
model with fewer cycles of its own, such as one whose record ends, has those.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gearrattle.model import Model
from gearrattle.pipeline import Findings, judged
from gearrattle.report.plots.interactive import chart_json
from gearrattle.report.plots.phase_plane import phase_plane
from gearrattle.simulation.settings import settled
from gearrattle.simulation.simulate import simulate
from gearrattle.workbench.views import verdict_numbers

CYCLES = 60
DISCARD = 30
SAMPLES = 512
_DRAWN = 2  # cycles in the phase planes: they take longer to draw than the motion takes to compute


def live_view(model: Model, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the verdict and the phase planes of a model with values changed, by path as they are written:
    ``{"mesh.gear.backlash": "0.1 mm"}``.
    """
    changed = model.with_(dict(values)) if values else model
    own = settled(changed, {}).simulation
    cycles = None
    discard = None
    if own.cycles is None or own.cycles > CYCLES:
        cycles = CYCLES
        discard = DISCARD if own.discard else 0  # an event is judged from its start
    motion = simulate(changed, cycles=cycles, discard=discard, samples_per_cycle=SAMPLES, audit=False)
    findings: Findings = judged(motion)
    return {"verdict": verdict_numbers(findings), "phase_plane": chart_json(phase_plane(findings, _DRAWN))}
