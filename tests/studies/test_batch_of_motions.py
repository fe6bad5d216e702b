"""Studies over harmonics of a prescribed motion: computed together to the same bits as one at a time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly.variant_assembly import bound_of, static_velocities
from gearrattle.simulation.simulate import prepare
from tests.assembly.test_variants import check
from tests.studies.test_batch import HARDNESS, OUTPUTS, planned
from tests.studies.test_batch import check as check_study

TEXT = """
schema = 1
[[inertia]]
name = "engine"
J = 0.1
[[inertia]]
name = "hub"
J = 0.01
drag = 0.05
[[inertia]]
name = "wheel"
J = 0.004
drag = 0.01
drag_torque = 0.4
[[coupling]]
name = "joint"
between = ["engine", "hub"]
stiffness = 800.0
damping = 0.5
clearance = 0.01
[[mesh]]
name = "gear"
between = ["hub", "wheel"]
radii = [0.05, 0.04]
stiffness = 1.0e6
damping = 40.0
backlash = 2.0e-4
transmission_error = [{ order = 3, amplitude = 2.0e-6 }]
[excitation]
speed = 80.0
[[torque]]
on = "wheel"
mean = 0.1
[[motion]]
on = "engine"
harmonics = [{ order = 1, amplitude = 0.05 }, { order = 2, amplitude = 0.03 }]
[simulation]
cycles = 8
discard = 3
samples_per_cycle = 32
"""
PATHS: Mapping[str, tuple[float, float]] = {
    "motion.0.harmonics.0.amplitude": (-0.03, 0.07),
    "motion.0.harmonics.1.phase": (-2.0, 3.0),
    "inertia.hub.J": (0.008, 0.013),
    "inertia.engine.J": (0.08, 0.13),
    "inertia.wheel.drag_torque": (0.3, 0.6),
    "torque.0.mean": (0.0, 0.2),
    "mesh.gear.transmission_error.0.amplitude": (1e-6, 5e-6),
    "excitation.speed": (60.0, 110.0),
}
MIDDLE = {
    "motion": [{"on": "hub", "harmonics": [{"order": 1, "amplitude": 0.05}, {"order": 2, "amplitude": 0.03}]}],
    "torque": [{"on": "engine", "mean": 2.0}],
    "inertia.engine.drag": 0.2,
}


def model(changes: Mapping[str, Any] | None = None) -> gr.Model:
    return gr.loads(TEXT).with_(dict(changes or {}))


@pytest.mark.parametrize("base", [model(), model(MIDDLE)], ids=["first", "middle"])
def test_coefficients_have_the_same_bits(base: gr.Model) -> None:
    rng = np.random.default_rng(3)
    for path, ends in PATHS.items():
        check(base, {path: rng.uniform(*ends, 5)})
    check(base, {path: rng.uniform(*ends, 9) for path, ends in PATHS.items()})


def test_only_amplitudes_and_phases_vary_together() -> None:
    assert bound_of(model(), "motion.0.harmonics.0.amplitude") == bound_of(model(), "motion.0.harmonics.1.phase")
    assert bound_of(model(), "motion.0.harmonics.0.amplitude") is not None
    for path in ("motion.0.harmonics.0.order", "motion.0.harmonics.2.amplitude", "motion.1.harmonics.0.amplitude"):
        assert bound_of(model(), path) is None


def test_static_velocities_are_those_of_a_single_run() -> None:
    base, rng = model(MIDDLE), np.random.default_rng(5)
    varied = {path: rng.uniform(*PATHS[path], 6) for path in ("motion.0.harmonics.0.amplitude", "excitation.speed")}
    velocity, level = static_velocities(base, varied, 6)
    assert level.all()
    for v in range(6):
        case = base.with_({path: float(column[v]) for path, column in varied.items()})
        assert np.array_equal(prepare(case, {"initial": "static"}, audit=False).task.velocity, velocity[v])
    turned = static_velocities(base, {"motion.0.harmonics.0.phase": np.array([0.0, 0.3])}, 2)[1]
    assert turned.tolist() == [True, False]


@pytest.mark.parametrize(
    "initial", ["steady", "static", "zero", {"angle": [9.0, 0.012, 0.0], "velocity": [9.0, 0.3, -0.2]}]
)
@pytest.mark.parametrize("base", [model(), model(MIDDLE)], ids=["first", "middle"])
def test_amplitudes_and_speeds_give_the_same_bits(base: gr.Model, initial: Any) -> None:
    axes = {"motion.0.harmonics.0.amplitude": [0.02, 0.04, 0.05, "3 deg"], "excitation.speed": [70.0, 90.0]}
    plan, outputs = planned(base.with_({"simulation.initial": initial}), axes, (*OUTPUTS, *HARDNESS))
    assert check_study(plan, outputs).all()


def test_phases_go_together_unless_a_static_start_turns_with_the_body() -> None:
    """The loop's static start is the equilibrium itself; a body that begins elsewhere takes the others with it."""
    axes = {"motion.0.harmonics.1.phase": [-0.5, 0.0, 0.4, 1.0, 1.5]}
    plan, outputs = planned(model({"simulation.initial": "zero"}), axes, OUTPUTS)
    assert check_study(plan, outputs).all()
    plan, outputs = planned(model(), axes, OUTPUTS)
    assert check_study(plan, outputs).tolist() == [False, True, False, False, False]


def test_orders_go_the_general_way() -> None:
    plan, outputs = planned(
        model(), {"motion.0.harmonics.1.order": [2.0, 3.0, 4.0, 5.0, 6.0]}, ("crossings per cycle",)
    )
    assert not check_study(plan, outputs).any()


def test_inertia_of_the_prescribed_body_changes_nothing() -> None:
    study = gr.study(model(), {"inertia.engine.J": [0.05, 0.1, 0.2, 0.4]}, ("crossings per cycle",), workers=1)
    assert len(set(study["crossings per cycle"].values.tolist())) == 1
