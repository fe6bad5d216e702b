"""``contact_ratio``: names, quantities and intervals."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr

PAPER = Path(__file__).parents[2] / "examples" / "paper"


@pytest.fixture(scope="module")
def rattling() -> gr.Run:
    return gr.simulate(gr.load(PAPER / "case2.toml"), cycles=24, discard=8, samples_per_cycle=256)


def test_mean_slope_by_clearance(rattling: gr.Run) -> None:
    actual = gr.contact_ratio(rattling)
    assert list(actual.index) == ["clutch", "spline", "gear"]
    assert actual.attrs["quantity"] == "mean slope"
    share = {entry.subject: entry.value for entry in gr.criteria(rattling).of("contact") if "share" in entry.quantity}
    contact = gr.criteria(rattling).parts
    by_name = {part.name: part.contact_share for part in contact}
    assert share
    assert actual["gear"] == pytest.approx(by_name["gear"], rel=1e-12)
    assert actual["clutch"] == pytest.approx(0.01 + 0.99 * by_name["clutch"], rel=1e-12)


def test_spectra_and_describing_functions_tell_one_gain(rattling: gr.Run) -> None:
    spectral, describing = (gr.contact_ratio(rattling, method) for method in ("spectral", "describing"))
    assert spectral.attrs["quantity"] == describing.attrs["quantity"] == "equivalent gain"
    for name in spectral.index:
        assert spectral.attrs["low"][name] <= describing[name] <= spectral.attrs["high"][name]
    assert np.isfinite(spectral).all()


def test_a_method_there_is_not(rattling: gr.Run) -> None:
    with pytest.raises(gr.ModelError, match="must be one of mean-slope, spectral, describing"):
        gr.contact_ratio(rattling, "guess")


def test_a_model_is_forecast() -> None:
    model = gr.load(PAPER / "case1_loaded.toml")
    gain, slope = gr.contact_ratio(model, "describing"), gr.contact_ratio(model)
    points = gain.attrs["fixed_points"]
    assert [point["motion"] for point in points] == ["stable", "stable", "unstable"]
    assert gain.to_dict() == points[0]["motion_gain"]
    assert slope.to_dict() == points[0]["motion_mean_slope"]
    assert points[0]["starts"] > points[1]["starts"]
    assert "only a run tells" in gain.attrs["notes"][1]
    assert "stable periodic motion" in gain.attrs["notes"][2]
    with pytest.raises(gr.ModelError, match="needs a motion"):
        gr.contact_ratio(model, "spectral")


def test_a_model_without_input_is_forecast_by_one_answer() -> None:
    model = gr.loads(
        'schema = 1\nname = "still"\n'
        'inertia = [ { name = "a", J = 0.2, drag = 0.05 }, { name = "b", J = 0.02 }, { name = "c", J = 0.01 } ]\n'
        '[[coupling]]\nname = "ab"\nbetween = ["a", "b"]\nstiffness = 800.0\ndamping = 0.2\nclearance = 0.01\n'
        '[[coupling]]\nname = "bc"\nbetween = ["b", "c"]\nstiffness = 800.0\ndamping = 0.2\nclearance = 0.01\n'
        "[excitation]\nspeed = 80.0\n"
    )
    begun = time.process_time()
    ratios = gr.contact_ratio(model)
    assert time.process_time() - begun < 1.0
    assert ratios.to_dict() == {"ab": 0.0, "bc": 0.0}
    (point,) = ratios.attrs["fixed_points"]
    assert (point["starts"], point["motion"]) == (1, "not sought")
