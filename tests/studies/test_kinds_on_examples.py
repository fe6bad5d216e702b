"""Every kind of study on every example: no array whose length follows from the model is of another length.

A wide tolerance lets a short motion count as periodic, so that what is kept of periodic motions is computed as well.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.assembly import unsteady_inputs
from gearrattle.studies.case_runs import DONE, FAILED

EXAMPLES = (
    "alternating_mesh",
    "backlash_oscillator",
    "case3",
    "clutch_friction",
    "driveline_lash",
    "dual_mass_flywheel",
    "manual_transmission",
    "planetary_set",
    "propeller_shaft",
    "rattle_oscillator",
)
SHORT: dict[str, Any] = {"cycles": 4, "discard": 2, "workers": 1}


def speeds(model: gr.Model) -> tuple[str, list[float]]:
    """The speed of a model, as it says it, and two values of it."""
    path = "excitation.speed" if model.units == "SI" else "excitation.frequency"
    return path, [0.97 * model.excitation.omega, model.excitation.omega]


def check(data: xr.Dataset) -> None:
    """No case failed by a fault of the program."""
    assert not np.any(data["outcome"] == FAILED), data.attrs["failures"]
    assert np.any(data["outcome"] == DONE), data.attrs["failures"]


@pytest.mark.parametrize("tolerance", [1e-9, 0.09])
@pytest.mark.parametrize("name", EXAMPLES)
def test_a_bifurcation_diagram_keeps_what_its_motions_have(name: str, tolerance: float) -> None:
    model = gr.example(name)
    assert not unsteady_inputs(model)
    data = gr.bifurcation(model, *speeds(model), direction="up", tolerance=tolerance, **SHORT)
    check(data)
    periodic = data["motion"] == 0
    assert np.array_equal(np.isfinite(data["multiplier real"]).all("multiplier"), periodic & (data["outcome"] == DONE))


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_map_of_basins_and_a_grid_of_every_example(name: str) -> None:
    model = gr.example(name)
    clearance = gr.simulate(model, cycles=1, discard=0, audit=False).trajectory.layout.clearance_names[0]
    over = {f"deflection.{clearance}": [0.0, 1e-5]}
    check(gr.basins(model, over, same=0.095, tolerance=0.09, **SHORT))
    path, values = speeds(model)
    check(gr.study(model, {path: values}, fixed={"simulation.cycles": 4, "simulation.discard": 2}, workers=1))


RUBBING = """
schema = 1
inertia = [ { name = "shaft", J = 0.1, drag = 2.0 }, { name = "gear", J = 0.01, drag = 0.1, drag_torque = 0.5 } ]
excitation = { speed = 50.0 }
torque = [ { on = "shaft", harmonics = [ { order = 1, amplitude = 3.0 } ] } ]

[[coupling]]
name = "damper"
between = ["shaft", "ground"]
stiffness = 500.0
hysteresis = 0.4
stick_stiffness = 2000.0

[[coupling]]
name = "gap"
between = ["shaft", "gear"]
stiffness = 4000.0
damping = 2.0
clearance = 0.01
"""


def test_the_number_of_multipliers_may_change_along_a_sweep() -> None:
    path = "coupling.damper.hysteresis"
    how = SHORT | {"cycles": 40, "discard": 30}
    data = gr.bifurcation(gr.loads(RUBBING), path, [0.0, 0.4], direction="up", tolerance=0.09, **how)
    check(data)
    assert np.all(data["motion"] == 0)
    shown = np.isfinite(data["multiplier real"]).sum("multiplier").values.ravel()
    assert shown[1] == shown[0] + 1
