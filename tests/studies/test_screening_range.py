"""The range of a screening: every bound is the lift ratio of a driveline without friction and stages; and its check."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.report.screening_page import ScreeningPage
from gearrattle.report.screening_tables import checks_table, gears_of
from gearrattle.studies.screening_check import LIFTS, QUIET, UNDECIDED, forecasts_of, near_border

OMEGA = 100.0
SOFT = 60.0
STICK = 900.0
STIFF = 700.0
CLUTCHED = """
schema = 1
name = "a flywheel, a clutch and a loose gear"
inertia = [
  { name = "flywheel", J = 0.15 },
  { name = "shaft", J = 0.005 },
  { name = "wheel", J = 5e-4, drag_torque = 0.8 },
]
torque = [{ on = "flywheel", mean = 1.0, harmonics = [{ order = 2, amplitude = %s }] }]

[excitation]
speed = 100.0

[simulation]
cycles = 24
discard = 12
samples_per_cycle = 32
initial = "static"

[[coupling]]
name = "clutch"
between = ["flywheel", "shaft"]
%s

[[mesh]]
name = "mesh"
between = ["shaft", "wheel"]
radii = [0.05, 0.04]
stiffness = 1e8
damping = 2000.0
backlash = 1e-4
"""
LINEAR = "stiffness = {}\ndamping = 0.5"
RUBBING = f"stiffness = {SOFT}\ndamping = 0.5\nhysteresis = 2.0\nstick_stiffness = {STICK}"
STAGED = f"stages = [{{ stiffness = {SOFT}, damping = 0.5, until = %s }}, {{ stiffness = {STIFF}, damping = 0.5 }}]"

# the gearbox of a field case: idle at 780 rpm, in neutral, all drags four times their first estimate
_GEARS = (
    (1.9e-3, 1.2, 14.7, 53.0, 140),
    (1.05e-3, 0.88, 22.2, 45.5, 120),
    (5.6e-4, 0.6, 28.7, 39.0, 100),
    (3.5e-4, 0.4, 33.35, 34.35, 90),
    (2.2e-4, 0.28, 37.2, 30.5, 70),
    (1.6e-4, 0.2, 40.05, 27.65, 60),
)
_BODIES = "".join(
    f'[[inertia]]\nname = "gear{i}"\nJ = {inertia}\ndrag_torque = {drag}\n'
    for i, (inertia, drag, *_) in enumerate(_GEARS, 1)
)
_MESHES = "".join(
    f'[[mesh]]\nname = "m{i}"\nbetween = ["input_shaft", "gear{i}"]\nradii = ["{driver} mm", "{loose} mm"]\n'
    f'stiffness = 3.2e8\ndamping = 800.0\nbacklash = "{gap} um"\n'
    for i, (_, _, driver, loose, gap) in enumerate(_GEARS, 1)
)
SIX_SPEED = f"""
schema = 1
name = "six-speed gearbox in neutral"
[[inertia]]
name = "flywheel"
J = 0.14
[[inertia]]
name = "hub"
J = 5e-4
[[inertia]]
name = "input_shaft"
J = 0.0025
drag_torque = 1.2
{_BODIES}
[[coupling]]
name = "damper"
between = ["flywheel", "hub"]
stages = [
  {{ stiffness = "1.2 N*m/deg", until = "4 deg",  hysteresis = "1.5 N*m" }},
  {{ stiffness = "8 N*m/deg",   until = "12 deg", hysteresis = "8 N*m" }},
  {{ stiffness = "25 N*m/deg",                    hysteresis = "20 N*m" }},
]
[[coupling]]
name = "spline"
between = ["hub", "input_shaft"]
stiffness = 1e4
damping = 0.1
clearance = "0.2 deg"
{_MESHES}
[excitation]
speed = "780 rpm"
[[torque]]
on = "flywheel"
mean = 3.4232
harmonics = [{{ order = 2, amplitude = 90.0 }}, {{ order = 4, amplitude = 25.0 }}]
"""


def clutched(clutch: str, amplitude: float = 20.0) -> gr.Model:
    return gr.loads(CLUTCHED % (amplitude, clutch))


def lift(stiffness: float, amplitude: float = 20.0) -> float:
    """The lift ratio of the driveline with a linear clutch."""
    return gr.screen(clutched(LINEAR.format(stiffness), amplitude), [OMEGA]).lift_ratio.item()


def test_a_linear_clutch_has_no_range() -> None:
    data = gr.screen(clutched(LINEAR.format(SOFT), 0.1), [OMEGA])
    assert data.lift_low.item() == data.lift_high.item() == data.lift_ratio.item()
    assert "notes" not in data.attrs


def test_friction_is_judged_stuck_and_let_go() -> None:
    """Each bound is a driveline without friction: the clutch's own spring, and with the one that sticks beside it."""
    data = gr.screen(clutched(RUBBING), [OMEGA])
    bounds = sorted([lift(SOFT), lift(SOFT + STICK)])
    assert [data.lift_low.item(), data.lift_high.item()] == pytest.approx(bounds, rel=1e-12)
    assert data.lift_ratio.item() == pytest.approx(lift(SOFT), rel=1e-12)
    assert not data.inside.item()
    assert "dry friction of clutch" in data.attrs["notes"]
    assert "linear forecast" in data.attrs["notes"]


@pytest.mark.parametrize(("until", "reaches"), [(0.018, True), (10.0, False)])
def test_a_stage_counts_where_the_swing_reaches_it(until: float, reaches: bool) -> None:
    """A clutch that swings into its second stage may work with either stiffness; one that does not, with its first."""
    data = gr.screen(clutched(STAGED % until), [OMEGA])
    bounds = sorted([lift(SOFT), lift(STIFF if reaches else SOFT)])
    assert [data.lift_low.item(), data.lift_high.item()] == pytest.approx(bounds, rel=1e-12)


def test_gears_that_may_lift_off_load_their_driver_no_more() -> None:
    """The second gear is light and lifts first: the first is judged without it as well, as if it were not there."""
    body = '{ name = "light", J = 2e-3, drag_torque = 0.01 },\n]\ntorque'
    second = """
[[mesh]]
name = "lighter"
between = ["shaft", "light"]
radii = [0.05, 0.04]
stiffness = 1e8
damping = 2000.0
backlash = 1e-4
"""
    text = CLUTCHED % (3.0, LINEAR.format(STIFF)) + second
    both = gr.loads(text.replace("]\ntorque", body, 1).replace("mean = 1.0,", "mean = 1.0125,"))
    data = gr.screen(both, [OMEGA]).sel(gear="mesh")
    without = lift(STIFF, 3.0)
    bounds = sorted([data.lift_ratio.item(), without])
    assert abs(bounds[1] / bounds[0] - 1.0) > 0.1
    assert [data.lift_low.item(), data.lift_high.item()] == pytest.approx(bounds, rel=1e-9)


def test_the_six_speed_gearbox_is_not_said_to_be_quiet() -> None:
    """All six gears run double-sided there; let go in its first stage, friction left out, each margin is below 0 dB."""
    data = gr.screen(gr.loads(SIX_SPEED), ["780 rpm"])
    assert (data.lift_ratio.values < 1.0).all()
    assert (data.forecast.values == UNDECIDED).all()
    assert (data.lift_high.values > 1.0).all()


def test_forecasts() -> None:
    low = np.array([0.1, 0.5, 1.1, np.inf])
    high = np.array([0.9, 1.5, 1.2, np.inf])
    assert forecasts_of(low, high).tolist() == [QUIET, UNDECIDED, LIFTS, LIFTS]


def test_the_cases_nearest_to_the_border_are_checked() -> None:
    """Those that hold 1 first, then the nearest in decibels; of equally near ones, some over the whole map."""
    low = np.array([[[0.1]], [[0.9]], [[0.5]], [[4.0]], [[1.2]]])
    high = np.array([[[0.2]], [[1.1]], [[0.8]], [[5.0]], [[1.3]]])
    assert near_border(low, high, 2)[:, 0].tolist() == [1, 4]
    assert near_border(low, high, 3)[:, 0].tolist() == [1, 2, 4]
    assert near_border(low, high, 9)[:, 0].tolist() == [0, 1, 2, 3, 4]
    alike = near_border(np.full((9, 1, 1), 0.5), np.full((9, 1, 1), 2.0), 3)[:, 0]
    assert len(set(alike.tolist())) == 3
    assert alike[0] < 3 <= alike[1] < 6 <= alike[2]


def test_a_check_simulates_some_cases_and_counts() -> None:
    """Two of three cases, the third stays unjudged; the table has a row a simulated case."""
    data = gr.screen(clutched(LINEAR.format(SOFT)), [80.0, 100.0, 300.0], check=2, workers=1)
    judged = data.regime.values[:, 0, 0] >= 0
    assert judged.sum() == 2
    (gear,) = gears_of(data)
    assert gear.checked is not None
    assert (gear.judged, gear.checked.said_quiet + gear.checked.said_lifts + gear.checked.undecided) == (2, 2)
    assert len(checks_table(data).rows) == 2
    page = ScreeningPage(data)
    assert "Simulated were 2 pairs of a gear and a case" in page.sentence
    assert page.content()["gears"][0]["checked"]["said_quiet"] == gear.checked.said_quiet
    assert page.content()["forecasts"] == ["quiet", "undecided", "lifts off"]


def test_wrong_forecasts_are_called_wrong() -> None:
    """A gear that rattles against the forecast stands first in the table; one that touches is said to be quiet."""
    data = gr.screen(clutched(LINEAR.format(SOFT), 0.1), [80.0, 100.0], simulate=True, workers=1)
    data["regime"][1, 0, 0] = 2
    data["severity"][1, 0, 0] = 1
    assert [row[-2:] for row in checks_table(data).rows] == [("quiet", "right"), ("touches, double-sided", "right")]
    assert gears_of(data)[0].rattles == 0
    data["severity"][1, 0, 0] = 2
    assert [row[-2:] for row in checks_table(data).rows] == [("rattles, double-sided", "wrong"), ("quiet", "right")]
    assert "of 2 said quiet 1 ran quiet" in ScreeningPage(data).sentence
    earlier = data.drop_vars("severity")  # of a version without it
    assert [row[-2:] for row in checks_table(earlier).rows] == [("double-sided", "wrong"), ("quiet", "right")]


def test_lift_off_of_a_gear_that_touches_is_neither_right_nor_wrong() -> None:
    data = gr.screen(clutched(LINEAR.format(SOFT), 0.1), [80.0], simulate=True, workers=1)
    data["forecast"][:] = LIFTS
    data["regime"][:] = 1
    for severity, said in ((1, ""), (2, "right")):
        data["severity"][:] = severity
        assert [row[-1] for row in checks_table(data).rows] == [said]
    data["regime"][:] = 0
    data["severity"][:] = 0
    assert [row[-1] for row in checks_table(data).rows] == ["wrong"]


def test_a_screening_of_an_earlier_version_has_its_lift_ratio_for_a_range() -> None:
    data = gr.screen(clutched(RUBBING), [80.0, OMEGA])
    old = data.drop_vars(["lift_low", "lift_high", "forecast"])
    page = ScreeningPage(old)
    (gear,) = gears_of(old)
    assert gear.undecided == 0
    assert gear.margin == gear.least == pytest.approx(20.0 * np.log10(float(data.lift_ratio.max())))
    assert page.charts()


def test_a_check_is_refused_beside_simulate_and_below_one() -> None:
    with pytest.raises(gr.ModelError, match="every case"):
        gr.screen(clutched(RUBBING), [OMEGA], simulate=True, check=True)
    for wrong in (0, 2.5, "no"):
        with pytest.raises(gr.ModelError, match=r"check.*whole number"):
            gr.screen(clutched(RUBBING), [OMEGA], check=wrong)  # type: ignore[arg-type]
