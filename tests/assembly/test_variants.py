"""Variants assembled together have the coefficients of each assembled by itself, to the last bit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.assembly.variant_assembly import bound_of, coefficients
from gearrattle.engine.kernels.variant_arrays import picked
from gearrattle.engine.system.plain_arrays import coefficients_of

STAGED = """
schema = 1
inertia = [ { name = "engine", J = 0.2, drag = 0.05 }, { name = "hub", J = 0.004 }, { name = "wheel", J = 0.02 } ]
[[coupling]]
name = "damper"
between = ["engine", "hub"]
stages = [ { stiffness = 30.0, until = 0.05, damping = 0.02 }, { stiffness = 600.0, until = 0.2, damping = 0.1 },
           { stiffness = 5000.0, damping = 0.1 } ]
coast_stages = [ { stiffness = 40.0, until = 0.04, damping = 0.02 }, { stiffness = 5000.0, damping = 0.1 } ]
preload = 0.3
[[mesh]]
name = "gear"
between = ["hub", "wheel"]
radii = [0.05, 0.08]
stiffness = 2.0e6
damping = 50.0
backlash = 1.0e-4
transmission_error = [ { order = 3, amplitude = 5.0e-6, phase = 0.3 }, { order = 3, amplitude = 1.0e-6 } ]
[excitation]
frequency = 20.0
[[torque]]
on = "engine"
mean = { speed = [50.0, 150.0, 300.0], value = [5.0, 8.0, 6.0] }
harmonics = [ { order = 1, amplitude = { speed = [50.0, 300.0], value = [20.0, 30.0] } },
              { order = 2, amplitude = 4.0, phase = 0.7 } ]
[[torque]]
on = "engine"
mean = 0.5
[[torque]]
on = "wheel"
mean = -7.0
[simulation]
cycles = 6
discard = 2
samples_per_cycle = 32
"""

PATHS: Mapping[str, Sequence[float]] = {
    "inertia.engine.J": (0.19, 0.23),
    "inertia.hub.drag": (0.0, 0.3),
    "inertia.wheel.drag_torque": (0.1, 1.7),
    "coupling.damper.stages.0.stiffness": (21.0, 39.0),
    "coupling.damper.stages.1.until": (0.11, 0.37),
    "coupling.damper.stages.1.damping": (0.0, 0.3),
    "coupling.damper.stages.2.stiffness": (3100.0, 5300.0),
    "coupling.damper.coast_stages.0.until": (0.013, 0.057),
    "coupling.damper.coast_stages.1.damping": (0.01, 0.7),
    "coupling.damper.preload": (-0.3, 0.7),
    "mesh.gear.stiffness": (1.1e6, 3.3e6),
    "mesh.gear.damping": (0.0, 91.0),
    "mesh.gear.backlash": (3.1e-5, 2.3e-4),
    "mesh.gear.transmission_error.0.amplitude": (-3e-6, 7e-6),
    "mesh.gear.transmission_error.1.phase": (-1.1, 3.7),
    "torque.0.mean": (-3.1, 9.7),
    "torque.0.harmonics.0.amplitude": (-7.0, 33.0),
    "torque.0.harmonics.1.phase": (-2.3, 0.9),
    "torque.2.mean": (-9.1, -3.3),
    "excitation.frequency": (9.3, 43.1),
    "excitation.speed": (51.7, 293.3),
}


def model() -> gr.Model:
    return gr.loads(STAGED, "staged.toml")


def check(base: gr.Model, values: Mapping[str, np.ndarray]) -> None:
    count = len(next(iter(values.values())))
    many, good = coefficients(base, values, count)
    assert good.all()
    for i in range(count):
        alone = coefficients_of(
            assemble(base.with_({path: float(column[i]) for path, column in values.items()})).system
        )
        chosen = picked(many, i)
        for numbers, other in ((chosen, alone), (chosen.laws, alone.laws)):
            for name, array in other._asdict().items():
                assert name == "laws" or np.array_equal(getattr(numbers, name), array), (name, i)


@pytest.mark.parametrize("path", PATHS)
def test_one_path_gives_the_same_bits(path: str) -> None:
    low, high = PATHS[path]
    check(model(), {path: np.random.default_rng(1).uniform(low, high, 7)})


def test_all_paths_together_give_the_same_bits() -> None:
    rng = np.random.default_rng(2)
    chosen = {path: rng.uniform(*ends, 25) for path, ends in PATHS.items() if path != "excitation.frequency"}
    check(model(), chosen)


def test_couplings_in_their_clearance_form_give_the_same_bits() -> None:
    base = gr.load(Path(__file__).parents[2] / "examples/paper/case3.toml")
    rng = np.random.default_rng(3)
    paths = {
        f"coupling.clutch.{key}": rng.uniform(low, high, 9)
        for key, low, high in (
            ("stiffness", 900.0, 2100.0),
            ("damping", 0.0, 0.4),
            ("clearance", 0.01, 0.3),
            ("stiffness_ratio", 0.03, 1.7),
            ("damping_ratio", 0.0, 1.3),
        )
    }
    check(base, paths)


def test_tables_over_speed_are_read_at_their_points_and_between() -> None:
    check(model(), {"excitation.speed": np.array([50.0, 99.9, 150.0, np.nextafter(150.0, 200.0), 300.0])})


@pytest.mark.parametrize(
    ("path", "values", "good"),
    [
        ("mesh.gear.backlash", [1e-4, 0.0, -1e-4, np.nan], [True, False, False, False]),
        ("mesh.gear.stiffness", [1e6, 0.0, np.inf], [True, False, False]),
        ("coupling.damper.preload", [0.1, 0.0], [True, True]),
        ("coupling.damper.stages.1.until", [0.1, 0.05, 0.04], [True, False, False]),
        ("excitation.speed", [50.0, 49.9, 300.1, 300.0], [True, False, False, True]),
        ("inertia.hub.J", [1e-3, 0.0, 5e-324], [True, False, True]),
        ("mesh.gear.radii.0", [0.05], [False]),
        ("torque.0.harmonics.0.order", [2.0], [False]),
        ("coupling.damper.stages.2.until", [0.5], [False]),
        ("coupling.damper.stiffness", [500.0], [False]),
        ("simulation.cycles", [9.0], [False]),
        ("no.such.path", [1.0], [False]),
    ],
)
def test_what_has_another_structure_or_might_be_refused_is_marked(
    path: str, values: list[float], good: list[bool]
) -> None:
    assert coefficients(model(), {path: np.array(values)}, len(values))[1].tolist() == good


def test_stages_that_become_equal_on_both_sides_are_another_structure() -> None:
    together = {"coupling.damper.stages.0.stiffness": np.array([30.0, 40.0])}
    assert coefficients(model(), together, 2)[1].tolist() == [True, False]


def test_speed_and_frequency_together_go_the_general_way() -> None:
    both = {"excitation.speed": np.array([80.0]), "excitation.frequency": np.array([20.0])}
    assert not coefficients(model(), both, 1)[1].any()


def test_every_path_that_may_vary_is_a_path_of_a_model() -> None:
    known: Any = {path: bound_of(model(), path) for path in model().paths()}
    reported = {path for path, bound in known.items() if bound}
    assert reported >= {path for path in PATHS if path in model().paths()}
    assert not any(known[path] for path in model().paths() if path.startswith(("simulation", "schema")))
