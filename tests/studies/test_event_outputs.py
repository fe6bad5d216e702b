"""Outputs of events: in studies as in the verdict, as targets, and as goals of an optimisation."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.design.target import target_of
from gearrattle.studies.goals import constraints_of
from gearrattle.studies.outputs import outputs_of, short_runs

OVER = "torque.0.ramps.0.over"
TIP_IN = gr.example("tip_in")
OUTPUTS = ["hardest impact", "first impact", "impacts", "peak torque", "time to settle", "ramp time"]


def test_a_study_has_what_the_verdict_says_of_an_event() -> None:
    data = gr.study(TIP_IN, {OVER: [0.05, 0.2]}, OUTPUTS, workers=1)
    for over in (0.05, 0.2):
        case = data.sel({OVER: over})
        event = gr.criteria(gr.simulate(TIP_IN.with_({OVER: over}))).event
        assert float(case["hardest impact"]) == pytest.approx(event.hardest.energy, rel=1e-12)
        assert float(case["first impact"]) == pytest.approx(event.first_impact, rel=1e-12)
        assert float(case["impacts"]) == event.impacts
        assert float(case["time to settle"]) == pytest.approx(event.settled - 0.2, rel=1e-12)
        assert float(case["ramp time"]) == pytest.approx(over)
        peaks = {str(part): float(case["peak torque"].sel(part=part)) for part in case["part"].values}
        assert peaks == pytest.approx({name: abs(peak.value) for name, peak in event.peak_torque.items()})


def test_crossings_alone_give_the_same_without_samples() -> None:
    crossings_only = gr.study(TIP_IN, {OVER: [0.05, 0.2]}, ["hardest impact", "largest impact energy"], workers=1)
    with_samples = gr.study(
        TIP_IN, {OVER: [0.05, 0.2]}, ["hardest impact", "largest impact energy", "impacts"], workers=1
    )
    np.testing.assert_array_equal(crossings_only["hardest impact"], with_samples["hardest impact"])
    np.testing.assert_array_equal(crossings_only["hardest impact"], crossings_only["largest impact energy"].max("part"))


def test_the_hardest_impact_leaves_out_springs_that_change_stage() -> None:
    gaps = [1e-4, 2e-4, 3e-4, 4e-4]  # enough to be marched together
    model = gr.example("case3")
    data = gr.study(model, {"mesh.gear.backlash": gaps}, ["hardest impact", "largest impact energy"], workers=1)
    energies = data["largest impact energy"].sel(part=["spline", "gear"])
    np.testing.assert_array_equal(data["hardest impact"], energies.max("part"))
    run = gr.simulate(model.with_({"mesh.gear.backlash": 2e-4}))
    single = outputs_of(["hardest impact"], run).of(run)
    assert float(single["hardest impact"]) == float(data["hardest impact"][1])


def test_no_impact_and_no_rest_have_their_values() -> None:
    still = TIP_IN.with_({"torque.0.ramps": None, "excitation.duration": 0.2})
    data = gr.study(still, {"mesh.first_stage.backlash": [1e-4, 2e-4]}, OUTPUTS[:-1], workers=1)
    assert (data["hardest impact"] == 0.0).all()
    assert np.isnan(data["first impact"]).all()
    short = TIP_IN.with_({"excitation.duration": 0.24})
    data = gr.study(short, {OVER: [0.05]}, ["time to settle"], workers=1)
    assert float(data["time to settle"][0]) == pytest.approx(0.04)  # not at rest when the run ends
    with pytest.raises(gr.ModelError, match="ramp time"):
        gr.study(gr.example("case3"), {"mesh.gear.backlash": [1e-4]}, ["ramp time"])


@pytest.mark.parametrize(
    ("until", "limit"),
    [
        ("hardest impact < 5 mJ", 5e-3),
        ("half_shafts: peak torque < 0.9 kN*m", 900.0),
        ("peak torque < 900", 900.0),
        ("time to settle < 300 ms", 0.3),
        ("first impact > 0.25 s", 0.25),
    ],
)
def test_events_are_targets(until: str, limit: float) -> None:
    assert target_of(TIP_IN, until).limit == limit


def test_the_peak_torque_of_all_counts_shafts_without_a_gap() -> None:
    target = target_of(TIP_IN, "peak torque < 900 N*m")
    run = gr.simulate(TIP_IN)
    values = outputs_of(["peak torque", "severity"], run).of(run)
    assert target.number(values) == pytest.approx(abs(gr.criteria(run).peak_torque["half_shafts"].value))


def test_limits_of_an_optimisation_may_have_units() -> None:
    outputs = outputs_of(["hardest impact", "peak torque"], short_runs([TIP_IN])[0])
    wanted = {"hardest impact": {"below": "1 mJ"}, "half_shafts: peak torque": {"below": "0.9 kN*m", "above": 3}}
    energy, torque = constraints_of(wanted, outputs, TIP_IN)
    assert (energy.below, torque.below, torque.above) == (1e-3, 900.0, 3.0)
    with pytest.raises(gr.ModelError, match="energy"):
        constraints_of({"hardest impact": {"below": "1 mm"}}, outputs, TIP_IN)


def test_a_torque_shape_of_three_pieces_is_faster_than_a_straight_ramp() -> None:
    pytest.importorskip("pymoo")
    pieces = [{"at": 0.2, "over": 0.08, "to": 2.0}, {"over": 0.02, "to": 12.0}, {"over": 0.05, "to": 80.0}]
    ranges = {f"torque.0.ramps.{i}.over": ("5 ms", "150 ms") for i in range(3)}
    limits = {"hardest impact": {"below": "1 mJ"}}
    model = TIP_IN.with_({"torque.0.ramps": pieces})
    best = gr.optimize(
        model, ranges, {"ramp time": "min"}, constraints=limits, population=8, generations=3, seed=2, workers=1
    )
    chosen = best.isel(design=best.attrs["best"])
    assert float(chosen["hardest impact"]) < 1e-3
    assert float(chosen["ramp time"]) == pytest.approx(sum(float(chosen[path]) for path in ranges))
    straight = gr.study(TIP_IN, {OVER: [float(chosen["ramp time"])]}, ["hardest impact"], workers=1)
    assert float(straight["hardest impact"][0]) > 3.0 * float(chosen["hardest impact"])


def test_what_is_measured_of_an_event_is_an_output() -> None:
    names = ["rms torque", "energy lost in impacts", "peak angular acceleration", "instant of the hardest impact"]
    data = gr.study(TIP_IN, {OVER: [0.05, 0.2]}, names, workers=1)
    run = gr.simulate(TIP_IN.with_({OVER: 0.2}))
    measured = {(row.subject, row.quantity): row.value for row in gr.metrics(run).itertuples()}
    case = data.sel({OVER: 0.2})
    assert float(case["rms torque"].sel(part="half_shafts")) == measured["half_shafts", "rms torque"]
    assert float(case["energy lost in impacts"].sel(part="first_stage")) == measured["first_stage", names[1]]
    assert float(case["peak angular acceleration"].sel(inertia="rotor")) == measured["rotor", names[2]]
    assert float(case["instant of the hardest impact"]) == measured["driveline", names[3]]
