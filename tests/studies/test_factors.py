"""Studies over patterns and factors are those over plain values made by hand; coordinates hold what was asked."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.errors import ModelError
from gearrattle.studies.screening_study import screening_of
from gearrattle.studies.study import prepare
from gearrattle.studies.study_axes import axes_of
from gearrattle.studies.study_file import read_study
from tests.studies.drivelines import TOML, loudness, model
from tests.studies.test_optimization import SMALL

JOINT = "coupling.joint.clearance"
JOINTS = "coupling.*.clearance"
OUTPUTS = ["regime", "largest impact energy"]
TIMES = [0.5, 1.0, 3.0]
OWN = 0.01


def values(data: Any) -> list[np.ndarray]:
    return [data[name].values for name in OUTPUTS]


@pytest.mark.parametrize(
    "entry",
    [
        {"factor": TIMES},
        [gr.factor(times) for times in TIMES],
        [{"factor": times} for times in TIMES],
        {"factor": np.array(TIMES)},
    ],
)
def test_an_axis_of_factors_is_one_of_their_values(entry: Any) -> None:
    by_hand = gr.study(model(), {JOINT: [times * OWN for times in TIMES]}, OUTPUTS, workers=1)
    actual = gr.study(model(), {JOINTS: entry}, OUTPUTS, workers=1)
    assert [a.tolist() for a in values(actual)] == [b.tolist() for b in values(by_hand)]
    assert actual[JOINTS].values.tolist() == TIMES
    assert actual[JOINTS].attrs == {"long_name": "clearance of coupling joint, times", "units": ""}


def test_a_range_of_factors() -> None:
    (axis,) = axes_of({JOINT: {"factor": {"from": 1, "to": 4, "count": 3, "spacing": "log"}}}, model())
    assert axis.coordinate == pytest.approx((1.0, 2.0, 4.0), rel=1e-15)
    assert axis.values[JOINT] == tuple(times * OWN for times in axis.coordinate)
    ends = {"from": gr.factor(1), "to": {"factor": 4}, "count": 3, "spacing": "log"}
    assert axes_of({JOINT: ends}, model()) == (axis,)


def test_several_paths_on_one_axis_keep_their_factors() -> None:
    """The coordinate holds the factors where all have the same ones, else numbers; fixed values come first."""
    drags, mean = "inertia.*.drag_torque", "torque.*.mean"
    fixed = {"inertia.wheel.drag_torque": 0.2, "torque.0.mean": {"factor": 0.5}}
    data = gr.study(model(), {"oil": {drags: {"factor": [1, 3]}, mean: {"factor": [1, 3]}}}, OUTPUTS, fixed=fixed)
    by_hand = {"oil": {"inertia.wheel.drag_torque": [0.2, 3 * 0.2], "torque.0.mean": [0.2, 3 * 0.2]}}
    assert [a.tolist() for a in values(data)] == [b.tolist() for b in values(gr.study(model(), by_hand, OUTPUTS))]
    assert data["oil"].values.tolist() == data[drags].values.tolist() == data[mean].values.tolist() == [1.0, 3.0]
    (mixed,) = axes_of({"oil": {drags: {"factor": [1, 3]}, mean: [0.4, 1.2]}}, model())
    assert mixed.coordinate == (0, 1)
    assert mixed.requested() == {drags: [gr.factor(1), gr.factor(3)], mean: [0.4, 1.2]}


def test_a_plain_value_at_a_pattern_is_given_to_all_that_match() -> None:
    (axis,) = axes_of({"inertia.*.J": ["10 kg*cm^2", 0.2]}, model())
    assert axis.coordinate == pytest.approx((1e-3, 0.2), rel=1e-15)
    assert axis.values == {"inertia.engine.J": axis.coordinate, "inertia.wheel.J": axis.coordinate}


@pytest.mark.parametrize("method", ["latin-hypercube", "one-at-a-time"])
def test_scattering_factors_are_scattering_values(method: str) -> None:
    """The same points of the unit cube, scaled by the model's own; a sample has one factor for all that match."""
    size: dict[str, Any] = {"method": method, "samples": 0 if method == "one-at-a-time" else 6, "seed": 2}
    uniform = {"distribution": "uniform", "from": 0.5, "to": 2.0}
    factors = prepare(model(), vary={"inertia.*.J": {"factor": uniform}}, outputs=OUTPUTS, **size).plan.samples
    engine = {"distribution": "uniform", "from": 0.5 * 0.2, "to": 2.0 * 0.2}
    plain = prepare(model(), vary={"inertia.engine.J": engine}, outputs=OUTPUTS, **size).plan.samples
    assert factors is not None
    assert plain is not None
    assert factors.values["inertia.engine.J"] == pytest.approx(plain.values["inertia.engine.J"], rel=1e-14)
    assert (factors.values["inertia.wheel.J"] == 0.02 * factors.points[:, 0]).all()
    assert factors.paths == ("inertia.*.J",)


def test_a_deviation_of_a_factor_is_plain() -> None:
    normal = {"distribution": "normal", "mean": 1.0, "deviation": 0.1}
    samples = prepare(model(), vary={JOINT: {"factor": normal}}, outputs=OUTPUTS, samples=64).plan.samples
    assert samples is not None
    assert np.std(samples.points) == pytest.approx(0.1, rel=0.1)
    assert samples.values[JOINT] == pytest.approx(OWN * samples.points[:, 0], rel=1e-15)


def test_a_sweep_of_factors_is_one_of_values() -> None:
    how: dict[str, Any] = {"direction": "up", "cycles": 8, "discard": 6, "outputs": ["regime"], "workers": 1}
    by_factor = gr.bifurcation(model(), "torque.*.amplitude", {"factor": [0.5, 1.0]}, **how)
    by_value = gr.bifurcation(model(), "torque.0.harmonics.0.amplitude", [3.0, 6.0], **how)
    assert by_factor["torque.*.amplitude"].values.tolist() == [0.5, 1.0]
    for name in ("deflection.joint", "regime", "motion"):
        assert by_factor[name].values.tolist() == by_value[name].values.tolist()


def test_an_optimisation_over_factors_writes_plain_models(tmp_path: Path) -> None:
    pytest.importorskip("pymoo")
    variables = {"inertia.*.J": {"factor": (0.5, 1.5)}}
    how = SMALL | {"population": 4, "generations": 2, "output": tmp_path / "out", "workers": 1}
    data = gr.optimize(model(), variables, {"largest speed": "min"}, function=loudness, **how)
    assert data["inertia.*.J"].values[0] == 1.0  # the model itself
    assert data.attrs["own"] == 1
    times = float(data["inertia.*.J"][data.attrs["best"]])
    best = gr.load(tmp_path / "out" / "best.toml")
    assert [body.J for body in best.inertias] == pytest.approx([0.2 * times, 0.02 * times], rel=1e-15)
    again = gr.optimize(model(), variables, {"largest speed": "min"}, function=loudness, **(how | {"resume": True}))
    assert again["value"].values.tolist() == data["value"].values.tolist()
    plain = {"inertia.*.J": (0.5, 1.5)}
    with pytest.raises(ModelError, match="another"):  # the same numbers, of values
        gr.optimize(model(), plain, {"largest speed": "min"}, function=loudness, **(how | {"resume": True}))


def test_a_stored_study_goes_on_with_the_same_factors_alone(tmp_path: Path) -> None:
    """Factors of 0.01 and the values they make are two studies: their coordinates differ."""
    folder = tmp_path / "out"
    asked = {JOINT: {"factor": TIMES}}
    data = gr.study(model(), asked, OUTPUTS, output=folder, workers=1)
    assert gr.open_study(folder).identical(data)
    assert gr.study(model(), asked, OUTPUTS, output=folder, resume=True, workers=1).identical(data)
    for other in ({JOINT: [times * OWN for times in TIMES]}, {JOINTS: {"factor": TIMES}}, {JOINT: {"factor": [1.0]}}):
        with pytest.raises(ModelError, match="another study"):
            gr.study(model(), other, OUTPUTS, output=folder, resume=True, workers=1)


@pytest.mark.parametrize(
    ("study", "message"),
    [
        ({"axes": {JOINT: [gr.factor(1), 0.02]}}, "factors and other values"),
        ({"axes": {JOINT: {"factor": [1], "count": 3}}}, "keys beside factor"),
        ({"axes": {JOINT: {"factor": ["1 mm"]}}}, "must be a finite number"),
        ({"axes": {JOINT: {"factor": [-1.0]}}}, "must not be negative"),
        ({"axes": {"coupling.*.backlash": {"factor": [1.0]}}}, "matches no value"),
        ({"axes": {"inertia.engine.drag_torque": {"factor": [1.0]}}}, "says nothing here"),
        ({"axes": {JOINT: [0.1], JOINTS: {"factor": [1.0]}}}, f"{JOINT}: is varied twice"),
        ({"axes": {"gap": {JOINT: [0.1], JOINTS: {"factor": [1.0]}}}}, f"axis gap: {JOINT}: is varied twice"),
        (
            {
                "axes": {JOINTS: [0.1]},
                "samples": 3,
                "vary": {JOINT: {"distribution": "uniform", "from": 0.1, "to": 0.2}},
            },
            f"{JOINT}: is varied twice",
        ),
        (
            {"vary": {JOINT: {"factor": {"distribution": "normal", "mean": 1, "deviation": 0}}}, "samples": 3},
            "deviation",
        ),
    ],
)
def test_what_has_no_meaning_is_refused(study: dict[str, Any], message: str) -> None:
    with pytest.raises(ModelError, match=message):
        gr.study(model(), outputs=OUTPUTS, **study)


def test_a_file_says_the_same(tmp_path: Path) -> None:
    """And a screening of it: its loads are factors there, and in the map."""
    (tmp_path / "two.toml").write_text(TOML, encoding="utf-8")
    text = (
        'model = "two.toml"\noutputs = ["regime"]\n[fixed]\n"coupling.*.clearance" = { factor = 2 }\n[axis]\n'
        '"excitation.speed" = [80.0]\n"coupling.*.clearance" = { factor = [1, 3] }\n'
    )
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    read = read_study(tmp_path / "study.toml")
    plan = read.prepare().plan  # type: ignore[attr-defined]
    assert plan.axes[1].values == {JOINT: (2 * OWN, 3 * 2 * OWN)}
    assert screening_of(read, "study.toml")[2] == {JOINTS: [gr.factor(1), gr.factor(3)]}
    changed = read.changed({JOINT: 0.05}).prepare().plan  # type: ignore[attr-defined]
    assert changed.axes[1].values == {JOINT: (0.05, 3 * 0.05)}


def test_loads_of_a_screening_are_factors_of_a_pattern() -> None:
    """Twice all amplitudes, by a load factor and by path: the same map."""
    gearbox = gr.example("manual_transmission").with_({"mesh.*.transmission_error": None})
    by_load = gr.screen(gearbox, ["800 rpm"], [1.0, 2.0])
    by_path = gr.screen(gearbox, ["800 rpm"], {"torque.*.amplitude": {"factor": [1.0, 2.0]}})
    assert by_load["lift_ratio"].values.tolist() == by_path["lift_ratio"].values.tolist()
    assert by_path["torque.*.amplitude"].attrs["long_name"] == "torque amplitude of all harmonics, times"
