"""Every kind of study on every example: no array whose length follows from the model is of another length.

A wide tolerance lets a short motion count as periodic, so that what is kept of periodic motions is computed as well.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.assembly import unsteady
from gearrattle.studies.cases import DONE, FAILED, OUTCOMES

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
    assert not unsteady(model)
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


def test_the_number_of_multipliers_may_change_along_a_sweep() -> None:
    model = gr.example("clutch_friction")
    path = next(path for path in model.paths("*hysteresis*")) if hasattr(model, "paths") else hysteresis_of(model)
    with pytest.warns(RuntimeWarning, match="goes on without") if False else warnings.catch_warnings():
        data = gr.bifurcation(model, path, [0.0, 1.0], direction="up", tolerance=0.09, **SHORT)
    check(data)
    shown = np.isfinite(data["multiplier real"]).sum("multiplier").values.ravel()
    assert shown[0] < shown[1]


def hysteresis_of(model: gr.Model) -> str:
    """The path of a friction torque."""
    return next(f"coupling.{row['name']}.hysteresis" for row in model.to_tables()["coupling"] if "hysteresis" in row)


def test_failures_are_told() -> None:
    model = gr.example("case3")
    with pytest.warns(RuntimeWarning, match=f"1 {OUTCOMES[2]}"):
        gr.bifurcation(model, "inertia.i2.J", [-1.0, 1e-3], direction="up", **SHORT)
