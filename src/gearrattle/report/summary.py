"""The findings of a run for machines.

The keys of ``Verdict.to_dict()`` (verdict, sentence, rule, parts, entries) stand at the top, beside the model's name,
the linear results, the settings and cost of the run, and every rattle metric. JSON types only; numbers that are not
finite are null.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.advice.advice_record import scores_dict
from gearrattle.json_types import json_value
from gearrattle.pipeline import Findings
from gearrattle.report.cause_page import cause_content
from gearrattle.report.energy_table import energy_dict
from gearrattle.trajectory import Trajectory

if TYPE_CHECKING:
    from gearrattle.analysis.statics import Modes


def findings_content(findings: Findings) -> dict[str, Any]:
    """Return the findings in JSON types."""
    # verdict and cause
    trajectory = findings.motion.trajectory
    rest = findings.equilibrium
    return {
        "model": {"name": findings.model.name, "units": findings.model.units},
        **findings.verdict.to_dict(),
        "cause": None if findings.cause is None else cause_content(findings.cause),
        # settings and cost of the run
        "simulation": {
            "period": trajectory.layout.period,
            "cycles": trajectory.cycles,
            "discard": trajectory.discard,
            "samples_per_cycle": trajectory.samples_per_cycle,
            "crossings": len(trajectory.events),
            "switches": switches(trajectory),
            "predictability_horizon": json_value(findings.motion.predictability_horizon),
            "largest_lyapunov_exponent": json_value(findings.motion.largest_lyapunov_exponent),
        },
        "energy": json_value(energy_dict(findings)),
        "cost": json_value(trajectory.cost),
        # results of the linear driveline
        "equilibrium": json_value(
            {
                "angle": dict(zip(trajectory.layout.inertia_names, rest.angle.tolist(), strict=True)),
                "acceleration": dict(zip(trajectory.layout.inertia_names, rest.acceleration.tolist(), strict=True)),
                "deflection": rest.deflection,
                "region": rest.region,
            }
        ),
        "modes": modes_dict(findings.modes),
        "modes_contact": modes_dict(findings.modes_contact),
        # forecasts and metrics
        "advice": None if findings.advice is None else findings.advice.to_dict(),
        "scores": scores_dict(findings.scores),
        "metrics": json_value(findings.metrics),
    }


def switches(trajectory: Trajectory) -> dict[str, int]:
    """Return how often each slider began or ceased to slip, and each limit of contact damping to act."""
    if trajectory.auxiliaries is None:
        return {}
    layout = trajectory.layout
    watch = trajectory.auxiliaries.passages.watch
    first = len(layout.clearance)
    names = layout.auxiliary_names
    counts = np.bincount(watch[watch >= first] - first, minlength=len(names))
    return dict(zip(names, counts.tolist(), strict=True))


def modes_dict(modes: Modes) -> dict[str, Any]:
    """Return modes in JSON types: frequencies [rad/s], damping ratios; shapes and shares one mapping a mode."""
    count = range(len(modes.frequencies))
    by_inertia = {name: getattr(modes, name) for name in ("shapes", "kinetic_energy", "participation")}
    converted: dict[str, Any] = json_value(
        {
            "frequencies": modes.frequencies,
            "damping_ratios": modes.damping_ratios,
            "modal_inertia": modes.modal_inertia,
            **{name: _columns(modes.inertia_names, table) for name, table in by_inertia.items()},
            "strain_energy": _columns(modes.element_names, modes.strain_energy),
            "excitation": _columns(modes.sources, modes.excitation),
            "works_in": [list(modes.works_in(mode)) for mode in count],
            "excited_by": [list(modes.excited_by(mode)) for mode in count],
            "repeated": modes.repeated(),
            "notes": modes.notes,
        }
    )
    return converted


def _columns(names: tuple[str, ...], table: Any) -> list[dict[str, float]]:
    return [dict(zip(names, column, strict=True)) for column in table.T.tolist()]
