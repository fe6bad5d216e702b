"""The laws of the drag parts: worked examples, slopes against differences, and what is refused."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.model.drag_parts import DRAG_PARTS, DragPart
from gearrattle.model.oil import Oil

RPM = pi / 30.0
EXAMPLES: dict[str, dict[str, Any]] = {
    "needle-bearing": {"mean_diameter": "45 mm"},
    "rolling-bearing": {"bore": "30 mm", "outer_diameter": "62 mm", "load": "500 N", "number": 2},
    "skf-bearing": {"series": "62", "bore": "30 mm", "outer_diameter": "62 mm", "radial_load": "500 N"},
    "churning": {
        "depth": "30 mm",
        "oil_volume": "1500 cm^3",
        "pitch_diameter": "120 mm",
        "face_width": "20 mm",
        "teeth": 40,
        "tooth_height": "6.75 mm",
    },
    "synchroniser": {"mean_radius": "30 mm", "length": "8 mm", "gap": "0.1 mm"},
    "clutch-pack": {"faces": 12, "outer_radius": "60 mm", "inner_radius": "50 mm", "gap": "0.2 mm"},
    "shaft-seal": {"shaft_diameter": "30 mm"},
    "measured": {
        "speed": ["100 rpm", "500 rpm", "900 rpm"],
        "temperature": ["20 degC", "80 degC"],
        "torque": [[0.2, 0.3, 0.35], [0.1, 0.12, 0.2]],
    },
    "constant": {"torque": "0.1 N*m", "slope": 0.002},
}


def oil(temperature: float) -> Oil:
    points = [{"temperature": 40, "kinematic": "30.8 mm^2/s"}, {"temperature": 100, "kinematic": "5.9 mm^2/s"}]
    return Oil.model_validate(
        {"viscosity": points, "density": 845, "density_slope": -5.5e-4, "temperature": float(temperature)}
    )


def part(kind: str, **keys: object) -> DragPart:
    return DRAG_PARTS[kind].model_validate({"kind": kind, **EXAMPLES[kind], **keys})


@pytest.mark.parametrize(
    ("kind", "temperature", "rpm", "torque"),
    [
        ("needle-bearing", -20, 400, 0.7086),
        ("needle-bearing", 20, 400, 0.1058),
        ("needle-bearing", 40, 400, 0.05833),
        ("needle-bearing", 80, 400, 0.02585),
        ("needle-bearing", 100, 400, 0.01938),
        ("churning", -20, 400, 0.1418),
        ("churning", -20, 1500, 0.3093),
        ("churning", 20, 400, 0.0762),
        ("churning", 20, 1500, 0.1663),
        ("churning", 80, 400, 0.0473),
        ("churning", 80, 1500, 0.2056),
        ("synchroniser", -20, 400, 0.6386),
        ("synchroniser", 20, 400, 0.03605),
        ("synchroniser", 40, 400, 0.01459),
        ("synchroniser", 80, 400, 0.00421),
        ("clutch-pack", 20, 400, 1.679),
        ("clutch-pack", 80, 400, 0.1961),
        ("shaft-seal", 20, 400, 0.0661),
    ],
)
def test_the_laws_give_the_worked_examples(kind: str, temperature: float, rpm: float, torque: float) -> None:
    assert part(kind).at(rpm * RPM, oil(temperature)).torque == pytest.approx(torque, rel=1.5e-3)


def test_a_needle_bearing_has_the_worked_slope() -> None:
    drag = part("needle-bearing").at(400 * RPM, oil(20))
    assert drag.slope == pytest.approx(1.684e-3, rel=1e-3)
    assert drag.torque - drag.slope * 400 * RPM == pytest.approx(0.03526, rel=1e-3)
    loaded = part("needle-bearing", load="100 N").at(400 * RPM, oil(20))
    assert loaded.torque - drag.torque == pytest.approx(9.0e-3, rel=1e-12)


@pytest.mark.parametrize("kind", [kind for kind in DRAG_PARTS if kind != "constant"])
def test_the_slope_is_the_derivative_of_the_torque(kind: str) -> None:
    """At speeds away from corners: of the bearings' branches, of the churning's, of a table's points."""
    law = part(kind)
    for temperature in (25, 40, 79):
        for speed in np.geomspace(12.0, 90.0, 23).tolist():
            step = 1e-5 * speed
            below, at, above = (law.at(s, oil(temperature)).torque for s in (speed - step, speed, speed + step))
            slopes = sorted(((at - below) / step, (above - at) / step))
            slope = law.at(speed, oil(temperature)).slope
            assert slopes[0] - 1e-4 * abs(slopes[0]) - 1e-12 <= slope <= slopes[1] + 1e-4 * abs(slopes[1]) + 1e-12


@pytest.mark.parametrize("kind", [kind for kind in DRAG_PARTS if kind not in {"churning", "skf-bearing"}])
def test_torque_is_continuous_and_does_not_fall_with_speed(kind: str) -> None:
    speeds = np.geomspace(11.0, 94.0, 4001)
    torques = np.array([part(kind).at(speed, oil(60)).torque for speed in speeds.tolist()])
    assert np.all(np.diff(torques) >= 0.0)
    assert np.max(np.diff(torques) / torques[1:]) < 5e-3


def test_churning_may_rise_where_the_oil_warms() -> None:
    """In the law of Changenet and Velex the regime changes: more speed and thinner oil may mean more drag."""
    law = part("churning")
    assert law.at(1500 * RPM, oil(80)).torque > law.at(1500 * RPM, oil(20)).torque
    near = [law.at(speed, oil(60)).torque for speed in np.linspace(20.0, 300.0, 4001).tolist()]
    assert np.max(np.abs(np.diff(near)) / np.array(near[1:])) < 0.01


class SameViscosity(Oil):
    """An oil of 30.8 or 50 mm^2/s at any temperature."""

    def kinematic_viscosity(self) -> float:
        """Return it [m^2/s]."""
        return 1e-6 * self.temperature


@pytest.mark.parametrize(
    ("keys", "rpm", "viscosity", "rolling", "sliding"),
    [
        ({}, 800, 30.8, 8.531, 2.579),  # 6206
        (
            {
                "series": "cylindrical-4",
                "outer_diameter": "90 mm",
                "radial_load": "1000 N",
            },
            1000,
            50.0,
            101.398,
            1.832,
        ),  # NJ 406
    ],
)
def test_a_loaded_bearing_has_the_worked_torque(
    keys: dict[str, Any], rpm: float, viscosity: float, rolling: float, sliding: float
) -> None:
    """Rolling and sliding apart: the coefficients of friction multiply the sliding part alone."""
    thick = SameViscosity.model_construct(temperature=viscosity)
    whole, rolls = (
        1e3 * part("skf-bearing", **keys, **friction).at(rpm * RPM, thick).torque
        for friction in ({}, {"friction": 0.0, "boundary_friction": 0.0})
    )
    assert rolls == pytest.approx(rolling, abs=5e-4)
    assert whole - rolls == pytest.approx(sliding, abs=5e-4)


def test_an_axial_load_on_a_deep_groove_bearing_counts() -> None:
    """By hand: a_F = 24.6 (1000/11200)^0.24 = 13.779 deg, G_rr = 0.0209..., rolling alone, no starvation."""
    thick = SameViscosity.model_construct(temperature=30.8)
    keys = {"axial_load": "1000 N", "static_rating": "11200 N", "lubrication": "flooded"}
    law = part("skf-bearing", **keys, friction=0.0, boundary_friction=0.0)
    contact = np.sin(np.radians(24.6 * (1000.0 / 11200.0) ** 0.24))
    load = 3.9e-7 * 46.0**1.96 * (500.0 + 1.7 * 1000.0 / contact) ** 0.54
    heating = 1.0 / (1.0 + 1.84e-9 * (800.0 * 46.0) ** 1.28 * 30.8**0.64)
    assert 1e3 * law.at(800 * RPM, thick).torque == pytest.approx(heating * load * (30.8 * 800.0) ** 0.6, rel=1e-12)
    slides = 1e3 * part("skf-bearing", **keys, friction=1.0, boundary_friction=1.0).at(800 * RPM, thick).torque
    sliding = 3.23e-3 * 46.0**-0.145 * (500.0**5 + 36.5 * 46.0**1.5 * 1000.0**4 / contact) ** (1.0 / 3.0)
    assert slides - 1e3 * law.at(800 * RPM, thick).torque == pytest.approx(sliding, rel=1e-12)


def test_a_loaded_bearing_may_drag_less_where_its_film_builds_up() -> None:
    """Between boundary and full friction the torque falls with the speed, at high load and thin oil."""
    law = part("skf-bearing", radial_load="5 kN", series="60")
    speeds = np.geomspace(2.0, 600.0, 400)
    slopes = np.array([law.at(speed, oil(90)).slope for speed in speeds.tolist()])
    assert slopes.min() < 0.0 < slopes.max()


def test_a_factor_scales_torque_and_slope() -> None:
    once, twice = (part("churning", factor=f).at(60.0, oil(40)) for f in (1.0, 2.0))
    assert twice == pytest.approx([2.0 * value for value in once], rel=1e-15)


def test_lubrication_multiplies_f0() -> None:
    bath, jet, mist = (
        part("rolling-bearing", lubrication=way, load=0).at(60.0, oil(40)).torque
        for way in ("oil-bath", "injection", "oil-air")
    )
    assert (jet, mist) == pytest.approx((2.0 * bath, 0.5 * bath), rel=1e-15)
    own = part("rolling-bearing", f0=2.0, load=0).at(60.0, oil(40)).torque
    assert own == pytest.approx(bath, rel=1e-15)


def test_a_measured_table_is_met_at_its_points_and_not_extrapolated() -> None:
    law = part("measured")
    assert law.at(500 * RPM, oil(20)).torque == pytest.approx(0.3, rel=1e-12)
    assert law.at(700 * RPM, oil(80)).torque == pytest.approx(0.16, rel=1e-12)
    assert law.at(500 * RPM, oil(50)).torque == pytest.approx(0.21, rel=1e-12)
    for speed, temperature in ((50, 40), (950, 40), (500, 10), (500, 90)):
        with pytest.raises(gr.ModelError, match="covers"):
            law.at(speed * RPM, oil(temperature))


MODEL = """schema = 1
{oil}
[[inertia]]
name = "shaft"
J = 0.01
[[inertia]]
name = "gear"
J = 0.002
drag_parts = [{part}]
[[mesh]]
name = "mesh"
between = ["shaft", "gear"]
radii = ["40 mm", "50 mm"]
stiffness = 1e8
damping = 100
backlash = "0.1 mm"
[excitation]
speed = "800 rpm"
[[torque]]
on = "shaft"
mean = "balance"
harmonics = [{{ order = 2, amplitude = "5 N*m" }}]
"""
OIL = '[oil]\ntype = "70w-75w-gl4"\ntemperature = 40'


@pytest.mark.parametrize(
    ("written", "path", "rule"),
    [
        (
            '{ kind = "skf-bearing", series = "32", bore = 0.03, outer_diameter = 0.06, radial_load = 100 }',
            "drag_parts.0.series",
            "must be one of",
        ),
        (
            '{ kind = "skf-bearing", series = "62", bore = 0.03, outer_diameter = 0.06 }',
            "drag_parts.0",
            "no torque without load",
        ),
        (
            '{ kind = "skf-bearing", series = "62", bore = 0.03, outer_diameter = 0.06, axial_load = 100 }',
            "drag_parts.0.axial_load",
            "needs static_rating",
        ),
        (
            '{ kind = "skf-bearing", series = "62", bore = 0.06, outer_diameter = 0.06, radial_load = 100 }',
            "drag_parts.0.bore",
            "smaller than",
        ),
        ('{ kind = "needle" }', "drag_parts.0", "whose kind is"),
        ("{ }", "drag_parts.0", "whose kind is"),
        ("3", "drag_parts.0", "whose kind is"),
        ('{ kind = "needle-bearing" }', "drag_parts.0", "either bore and outer_diameter"),
        ('{ kind = "needle-bearing", bore = 0.03, outer_diameter = 0.02 }', "drag_parts.0.bore", "smaller than"),
        ('{ kind = "needle-bearing", mean_diametre = 0.03 }', "drag_parts.0.mean_diametre", "unknown key"),
        (
            '{ kind = "needle-bearing", mean_diameter = 0.03, on = "shft" }',
            "drag_parts.0.on",
            "no inertia has this name",
        ),
        ('{ kind = "needle-bearing", mean_diameter = 0.03, on = "gear" }', "drag_parts.0.on", "two different bodies"),
        ('{ kind = "shaft-seal", shaft_diameter = "3 rad" }', "drag_parts.0.shaft_diameter", "length"),
        (
            '{ kind = "clutch-pack", faces = 2, outer_radius = 0.02, inner_radius = 0.03, gap = 1e-4 }',
            "inner_radius",
            "smaller",
        ),
        ('{ kind = "synchroniser", mean_radius = 0.03, length = 0.008, gap = 1e-4, wetted = 2.0 }', "wetted", "share"),
        ('{ kind = "measured", speed = [2, 1], torque = [[1, 2]] }', "drag_parts.0.speed", "ascend"),
        ('{ kind = "measured", speed = [1, 2], torque = [[1, 2, 3]] }', "drag_parts.0.torque.0", "a torque per speed"),
        (
            '{ kind = "measured", speed = [1, 2], torque = [[1, 2], [3, 4]] }',
            "drag_parts.0.torque",
            "a row per temperature",
        ),
        ('{ kind = "measured", speed = [1, 2], torque = [[0.1, 0.2]] }', "drag_parts.0.speed", "covers 1 to 2"),
    ],
)
def test_what_is_no_part_is_refused(written: str, path: str, rule: str) -> None:
    with pytest.raises(gr.ModelError) as refused:
        gr.simulate(gr.loads(MODEL.format(oil=OIL, part=written)))
    problems = refused.value.problems
    assert any(path in problem.place and rule in problem.rule for problem in problems), refused.value


def test_a_law_without_oil_is_refused() -> None:
    with pytest.raises(gr.ModelError, match="its law needs the oil"):
        gr.loads(MODEL.format(oil="", part='{ kind = "needle-bearing", mean_diameter = 0.03 }'))


def test_churning_acts_on_the_housing_alone() -> None:
    keys = (
        "depth = 0.03, oil_volume = 1.5e-3, pitch_diameter = 0.12, face_width = 0.02, teeth = 40, tooth_height = 0.006"
    )
    with pytest.raises(gr.ModelError, match="not on another body"):
        gr.loads(MODEL.format(oil=OIL, part=f'{{ kind = "churning", on = "shaft", {keys} }}'))


def test_paths_lead_into_parts_and_have_words() -> None:
    from gearrattle.model.path_labels import path_label

    model = gr.loads(MODEL.format(oil=OIL, part='{ kind = "needle-bearing", mean_diameter = "30 mm" }'))
    assert model["inertia.gear.drag_parts.0.mean_diameter"] == 0.03
    assert gr.loads(model.to_toml()) == model
    wide = model.with_({"inertia.gear.drag_parts.0.mean_diameter": "40 mm", "oil.temperature": 80})
    assert wide["inertia.gear.drag_parts.0.mean_diameter"] == 0.04
    label = path_label("inertia.gear.drag_parts.0.mean_diameter", model)
    assert (label.words, label.unit) == ("mean diameter of needle bearing of gear", "m")
    assert path_label("oil.temperature", model) == ("oil temperature", "degC")
