"""A body prescribed by harmonics is the ground with an error of opposite sign: every tool must say the same of both."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.model import Model

TEXT = """
schema = 1
[[inertia]]
name = "engine"
J = 0.1
[[inertia]]
name = "hub"
J = 0.01
drag = 0.3
[[inertia]]
name = "wheel"
J = 0.004
drag = 0.05
drag_torque = 4.0
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
[[motion]]
on = "engine"
harmonics = [{ order = 1, amplitude = 0.02 }, { order = 2, amplitude = 0.01, phase = 0.4 }]
[simulation]
cycles = 40
discard = 20
samples_per_cycle = 64
initial = "zero"
"""


def moved(**changes: Any) -> Model:
    return gr.loads(TEXT).with_(changes)


@cache
def unchanged() -> Model:
    return moved()


@cache
def grounded() -> Model:
    """The same with the ground in the engine's place."""
    tables: dict[str, Any] = moved().to_tables()
    (motion,) = tables.pop("motion")
    errors = [{**sine, "amplitude": -sine["amplitude"]} for sine in motion["harmonics"]]
    joint = {**tables["coupling"][0], "between": ["ground", "hub"], "kinematic_error": errors}
    return Model.from_tables({**tables, "inertia": tables["inertia"][1:], "coupling": [joint]})


def test_modes_name_the_motion_as_a_source_with_the_share_of_an_error() -> None:
    with_motion, with_error = gr.modes(moved()), gr.modes(grounded())
    assert with_motion.sources == ("motion of engine", "transmission error of gear")
    assert with_error.sources == ("kinematic error of joint", "transmission error of gear")
    assert with_motion.excitation == pytest.approx(with_error.excitation, rel=1e-9)
    assert with_motion.frequencies == pytest.approx(with_error.frequencies, rel=1e-12)
    assert with_motion.inertia_names == ("hub", "wheel")


def test_a_motion_of_several_elements_has_the_energy_of_a_step_of_its_angle() -> None:
    """A step of the hub's angle stretches the joint and the mesh: J phi'' + K phi = K w, energies mode by mode."""
    model = moved(motion=[{"on": "hub", "harmonics": [{"order": 1, "amplitude": 0.02}]}])
    modes = gr.modes(model)
    pull = np.array([800.0, -1e6 * 0.05 * 0.04])  # torque on engine and wheel of a unit step; signs as of w
    inertia = np.array([0.1, 0.004])
    whole = 800.0 + 1e6 * 0.05**2
    shares = [
        (pull @ shape) ** 2 / (omega**2 * (inertia @ shape**2)) / whole
        for omega, shape in zip(modes.frequencies, modes.shapes.T, strict=True)
    ]
    assert modes.excitation[modes.sources.index("motion of hub")] == pytest.approx(shares, rel=1e-9)
    assert sum(shares) == pytest.approx(1.0, rel=1e-9)  # both springs alone hold their bodies: nothing stays behind


def test_a_campbell_diagram_has_its_orders() -> None:
    lines = gr.campbell(moved()).orders
    assert [(line.order, line.sources) for line in lines] == [
        (1.0, ("motion of engine",)),
        (2.0, ("motion of engine",)),
        (3.0, ("transmission error of gear",)),
    ]


@pytest.mark.slow
def test_a_forecast_sees_it_as_an_error() -> None:
    for method in ("mean-slope", "describing"):
        actual, expected = gr.contact_ratio(unchanged(), method), gr.contact_ratio(grounded(), method)
        assert actual.to_dict() == pytest.approx(expected.to_dict(), rel=1e-9)
        assert not any("held fast" in note for note in actual.attrs["notes"])


@pytest.mark.slow
def test_a_forecast_along_a_sweep_takes_its_first_speed() -> None:
    swept = moved(**{"excitation.sweep": {"from": 80.0, "to": 120.0, "over": 0.8}})
    actual = gr.contact_ratio(swept)
    assert actual.to_dict() == gr.contact_ratio(unchanged()).to_dict()
    assert "the sweep counts as its first speed" in actual.attrs["notes"]


def test_what_needs_every_inertia_free_says_so() -> None:
    for call, words in (
        (gr.nondimensionalize, "nondimensionalisation needs every inertia free"),
        (lambda model: gr.reduce(model, "60 Hz"), "lumping needs every inertia free"),
    ):
        with pytest.raises(gr.ModelError, match=words):
            call(moved())


def test_advice_keeps_every_body_and_foretells_the_rest() -> None:
    actual, expected = gr.advise(moved()), gr.advise(grounded())
    assert "prescribed motion" in actual.line("lumping").words
    assert actual.line("clearances") == expected.line("clearances")
    assert actual.line("contact ratios") == expected.line("contact ratios")


def test_its_inputs_repeat_so_there_are_periodic_motions() -> None:
    orbit, on_ground = gr.periodic(moved()), gr.periodic(grounded())
    assert orbit.residual < 1e-12
    assert orbit.multipliers == pytest.approx(on_ground.multipliers, abs=1e-12)
    assert orbit.run.trajectory.angle[:, 1:] == pytest.approx(on_ground.run.trajectory.angle, abs=1e-12)


def test_engine_orders_are_those_of_the_motion() -> None:
    """TR by order: what the hub has of the prescribed angle, at the orders of the motion alone."""
    run = gr.simulate(moved())
    table = gr.metrics(run)
    rows = table[(table["metric"] == "order_transmissibility") & (table["subject"] == "hub")]
    assert rows["quantity"].tolist() == ["transmissibility at order 1", "transmissibility at order 2"]
    assert np.isfinite(rows["value"].to_numpy()).all()


def test_a_comparison_begins_its_neighbours_elsewhere() -> None:
    """The neighbours' start moves a free body: the prescribed one cannot be moved."""
    both = [gr.compare(model, ["rk4"], budget=2.0).attrs["comparison"] for model in (moved(), grounded())]
    (exact, ceiling), (alone, other) = ((comparison.rows[0], comparison.rows[-1]) for comparison in both)
    assert exact.cost.events == alone.cost.events
    assert ceiling.error.deflection == pytest.approx(other.error.deflection, rel=0.01)
    assert min(ceiling.error.deflection) > 1e-13
