"""Studies of a driveline whose first or middle body moves by harmonics: sections, basins, screenings."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.studies.start_coordinates import starts_of
from tests.analysis.test_harmonic_motions import grounded, moved

MIDDLE = {
    "motion": [{"on": "hub", "harmonics": [{"order": 1, "amplitude": 0.02, "phase": 0.3}]}],
    "inertia.engine.drag": 0.4,
}


def test_a_bifurcation_diagram_is_that_of_the_driveline_on_the_ground() -> None:
    """The sections, the periods and the multipliers, of bodies that are free alone."""
    values = [0.004, 0.0042]
    actual, expected = (
        gr.bifurcation(m, "inertia.wheel.J", values, cycles=30, discard=24, workers=1) for m in (moved(), grounded())
    )
    for name in ("deflection.joint", "rate.joint", "deflection.gear", "rate.gear", "multiplier real"):
        assert actual[name].values == pytest.approx(expected[name].values, rel=1e-6, abs=1e-9, nan_ok=True), name
    assert actual.sizes["multiplier"] == 4
    assert actual["motion"].values.tolist() == expected["motion"].values.tolist()


def test_sections_see_what_a_run_has() -> None:
    """Of a body in the middle: the deflections on both sides of it, and its own angle."""
    names = ["deflection.joint", "deflection.gear", "angle.hub", "velocity.engine"]
    model = moved(**MIDDLE)
    done = gr.bifurcation(
        model, "inertia.wheel.J", [0.004, 0.005], section=names, direction="up", cycles=6, discard=5, workers=1
    )
    run = gr.simulate(model, cycles=6, discard=5)
    first = done.isel(direction=0, **{"inertia.wheel.J": 0})
    for name in names:
        kind, _, subject = name.partition(".")
        expected = run.data[kind].sel({"clearance" if kind == "deflection" else "inertia": subject}).values[-1]
        assert float(first[name].values[-1]) == pytest.approx(float(expected), rel=1e-9, abs=1e-14), name


def test_starts_set_deflections_beside_the_prescribed_body() -> None:
    model = moved(**MIDDLE)
    starts = starts_of(model, ("deflection.joint", "rate.gear"))
    state = starts.state({"deflection.joint": 0.012, "rate.gear": -0.3})
    run = gr.simulate(model, initial=state, cycles=1)
    assert run.trajectory.deflection[0, 0] == pytest.approx(0.012, rel=1e-12)
    t = run.trajectory
    rate = 0.05 * t.velocity[0, 1] - 0.04 * t.velocity[0, 2] - 2e-6 * 3.0 * 80.0
    assert rate == pytest.approx(-0.3, rel=1e-12)
    with pytest.raises(gr.ModelError, match="motion of this inertia is prescribed"):
        starts_of(model, ("angle.hub",))


def test_basins_are_those_of_the_driveline_on_the_ground() -> None:
    over = {"deflection.gear": [-1e-4, 0.0, 1e-4], "rate.joint": [0.0, 1.0]}
    actual, expected = (gr.basins(m, over, cycles=12, discard=8, workers=1) for m in (moved(), grounded()))
    for name in ("deflection.joint", "deflection.gear", "rate.gear"):
        assert actual[name].values == pytest.approx(expected[name].values, rel=1e-6, abs=1e-7), name
    assert actual["basin"].values.tolist() == expected["basin"].values.tolist()


@pytest.mark.parametrize("on", ["engine", "hub"])
def test_a_screening_knows_the_driver(on: str) -> None:
    """While nothing rattles the threshold is the peak of the driver's acceleration, prescribed or not."""
    sines = [{"order": 1, "amplitude": 1e-3, "phase": 0.2}, {"order": 2, "amplitude": 5e-4}]
    changes = {"motion": [{"on": on, "harmonics": sines}], "coupling.joint.clearance": 0.0, "inertia.engine.drag": 0.4}
    model = moved(**changes, **{"mesh.gear.transmission_error": []})
    screening = gr.screen(model, [80.0, 95.0])
    assert screening["inside"].values.all()
    for i, speed in enumerate((80.0, 95.0)):
        run = gr.simulate(model.with_({"excitation.speed": speed}), cycles=120, discard=119, samples_per_cycle=2048)
        peak = float(np.abs(run.data.acceleration.sel(inertia="hub").values[-2048:]).max())
        ratio = 0.004 * (0.05 / 0.04) * peak / 4.0
        assert float(screening["separation_ratio"].values[i, 0, 0]) == pytest.approx(ratio, rel=2e-3)


def test_a_study_over_the_amplitude_is_single_runs() -> None:
    path = "motion.0.harmonics.0.amplitude"
    study = gr.study(moved(), {path: ["0.5 deg", "1 deg", 0.02, 0.03]}, ("crossings per cycle",), workers=1)
    assert study[path].attrs["long_name"] == "motion amplitude of engine, order 1"
    assert study[path].attrs["units"] == "rad"
    for amplitude, crossings in zip(study[path].values, study["crossings per cycle"].values, strict=True):
        run = gr.simulate(moved(**{path: float(amplitude)}))
        inside = (run.events.time > run.trajectory.discard * run.trajectory.layout.period).sum()
        assert crossings == pytest.approx(inside / 20.0)
