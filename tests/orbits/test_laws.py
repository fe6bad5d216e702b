"""What holds for every periodic motion: the product of its multipliers, where a period begins, families, squares."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import gearrattle as gr
from gearrattle.errors import ConvergenceError, ModelError
from gearrattle.orbits import Orbit
from tests.orbits.test_family_ends import assert_same_back

INERTIA = (0.3, 0.02, 0.05, 0.01)
SPEED = 60.0


def chain(
    *,
    drag: float = 0.02,
    later: float = 0.0,
    damping_ratio: float = 0.3,
    mean: tuple[float, float] = (4.0, -4.0),
    **coupling: Any,
) -> gr.Model:
    """Four inertias that turn freely, three gaps, one free of stiffness inside; all inputs some time later."""
    names = [f"body{i}" for i in range(len(INERTIA))]
    links = [
        {"stiffness": 900.0, "damping": 0.4, "clearance": 0.02, "stiffness_ratio": 0.05, "damping_ratio": 0.1},
        {"stiffness": 4000.0, "damping": 0.2, "clearance": 0.01, "damping_ratio": damping_ratio, **coupling},
        {"stiffness": 2500.0, "damping": 0.3, "clearance": 0.004, "stiffness_ratio": 0.2, "damping_ratio": 2.0},
    ]
    harmonics = [
        {"order": order, "amplitude": amplitude, "phase": phase + order * SPEED * later}
        for order, amplitude, phase in ((1, 12.0, 0.4), (2, 5.0, 1.0))
    ]
    return gr.Model.from_tables(
        {
            "schema": 1,
            "inertia": [{"name": name, "J": J, "drag": drag} for name, J in zip(names, INERTIA, strict=True)],
            "coupling": [{"name": f"gap{i}", "between": names[i : i + 2], **link} for i, link in enumerate(links)],
            "excitation": {"speed": SPEED},
            "torque": [
                {"on": names[0], "mean": mean[0], "harmonics": harmonics},
                {"on": names[-1], "mean": mean[1]},
            ],
        }
    )


def damping_over_time(orbit: Orbit) -> float:
    """The integral of the trace of (inertia)^-1 (damping) over a motion, coupling by coupling, crossing by crossing."""
    model, span = orbit.model, orbit.period
    J = {body.name: body.J for body in model.inertias}
    total = span * sum(body.drag / body.J for body in model.inertias)
    events = orbit.run.events
    for coupling in model.couplings:
        inside = coupling.damping * coupling.damping_ratio
        weight = sum(1.0 / J[name] for name in coupling.between if name in J)
        mine = events[events["clearance"] == coupling.name]
        regions = [*mine["from_region"], int(orbit.run.data["region"].sel(clearance=coupling.name).values[-1])]
        times = [0.0, *mine["time"], span]
        for region, duration in zip(regions, np.diff(times), strict=True):
            total += weight * duration * (inside if region == 0 else coupling.damping)
    return float(total)


def sorted_complex(values: Any) -> NDArray[np.complex128]:
    return np.sort_complex(np.round(np.asarray(values, dtype=np.complex128), 11))


def test_the_product_of_the_multipliers_is_that_of_the_damping() -> None:
    """The damping of all three couplings changes at their corners, where no force jumps in position."""
    orbit = gr.periodic(chain())
    assert set(orbit.run.events["clearance"]) == {"gap0", "gap1", "gap2"}
    product = np.prod(np.delete(orbit.multipliers, np.argmin(np.abs(orbit.multipliers - 1.0))))
    assert abs(np.log(product.real) + damping_over_time(orbit)) < 1e-6 * damping_over_time(orbit)


@pytest.mark.parametrize("name", ["backlash_oscillator", "rattle_oscillator", "driveline_lash"])
def test_the_product_for_examples(name: str) -> None:
    orbit = gr.periodic(gr.example(name))
    turning = name == "driveline_lash"
    multipliers = (
        np.delete(orbit.multipliers, np.argmin(np.abs(orbit.multipliers - 1.0))) if turning else orbit.multipliers
    )
    assert np.log(np.prod(multipliers).real) == pytest.approx(-damping_over_time(orbit), rel=1e-9)


@pytest.mark.parametrize("sample", [37, 200, 411])
def test_where_a_period_begins_plays_no_part(sample: int) -> None:
    """The same motion, its period begun at a sample: inputs that come so much earlier."""
    want = gr.periodic(chain())
    run = want.run.data
    start = {name: run[name].values[sample].tolist() for name in ("angle", "velocity")}
    orbit = gr.periodic(chain(later=float(run["time"].values[sample])), start=start)
    np.testing.assert_allclose(orbit.state["velocity"], start["velocity"], rtol=0, atol=1e-8)
    np.testing.assert_allclose(sorted_complex(orbit.multipliers), sorted_complex(want.multipliers), rtol=0, atol=1e-8)


@pytest.mark.parametrize("mean", [(4.0, -4.0), (4.0, -3.0)])
def test_with_drag_a_train_turns_at_one_speed(mean: tuple[float, float]) -> None:
    """All mean torques together drive all drag: speed = sum of torques / sum of drag; angles stay free."""
    orbit = gr.periodic(chain(mean=mean))
    assert orbit.free == 0
    assert np.abs(orbit.multipliers - 1.0).min() == 0.0
    speed = sum(mean) / (0.02 * len(INERTIA))
    assert orbit.motion.turned / orbit.period == pytest.approx(speed, abs=1e-9)
    mean_speed = np.ptp(orbit.run.data["angle"].values[[0, -1]], axis=0) / orbit.period
    np.testing.assert_allclose(mean_speed, abs(speed), rtol=0, atol=1e-8)


def test_without_drag_every_speed_is_one() -> None:
    orbit = gr.periodic(chain(drag=0.0))
    assert orbit.free == 1
    assert np.sum(np.abs(orbit.multipliers - 1.0) < 1e-9) == 2
    np.testing.assert_allclose(orbit.motion.turned, 0.0, atol=1e-10)
    faster = {"angle": orbit.state["angle"], "velocity": [v + 0.7 for v in orbit.state["velocity"]]}
    state = gr.simulate(
        orbit.model, initial=faster, cycles=1, discard=0, samples_per_cycle=16, algorithm="exact", audit=False
    ).data
    moved = state["angle"].values[-1] - state["angle"].values[0]
    np.testing.assert_allclose(moved, 0.7 * orbit.period, rtol=0, atol=1e-10)


def test_mean_torques_that_do_not_balance_are_refused() -> None:
    for call in (gr.periodic, lambda model: gr.continuation(model, "excitation.speed", (50.0, 60.0))):
        with pytest.raises(ModelError, match="must balance"):
            call(chain(drag=0.0, mean=(4.0, -3.9)))


def test_what_does_not_repeat_is_refused() -> None:
    for name in ("measured_flywheel", "run_up"):
        with pytest.raises(ModelError, match="repeat"):
            gr.periodic(gr.example(name))
        with pytest.raises(ModelError, match="repeat"):
            gr.continuation(gr.example(name), "inertia.flywheel.J", (0.1, 0.2))


def pair(hysteresis: float) -> gr.Model:
    """Two inertias with drag, one coupling with dry friction."""
    return gr.Model.from_tables(
        {
            "schema": 1,
            "inertia": [{"name": "engine", "J": 0.1, "drag": 0.02}, {"name": "wheel", "J": 0.02, "drag": 0.02}],
            "coupling": [
                {
                    "name": "clutch",
                    "between": ["engine", "wheel"],
                    "stiffness": 2000.0,
                    "damping": 0.3,
                    "clearance": 0.01,
                    "hysteresis": hysteresis,
                }
            ],
            "excitation": {"speed": 100.0},
            "torque": [
                {"on": "engine", "mean": 2.0, "harmonics": [{"order": 1, "amplitude": 20.0}]},
                {"on": "wheel", "mean": -2.0},
            ],
        }
    )


def test_a_slider_that_slips_forgets_and_one_that_never_slips_is_free() -> None:
    slipping, sticking = gr.periodic(pair(3.0)), gr.periodic(pair(300.0))
    assert np.abs(slipping.multipliers).min() < 1e-12
    assert slipping.free == 0
    assert sticking.free == 1
    assert np.sum(np.abs(sticking.multipliers - 1.0) < 1e-9) == 2  # its offset, and the turning of both bodies
    assert any("family" in note for note in sticking.notes)


def test_over_two_periods_multipliers_are_squares_and_over_four_their_squares() -> None:
    once = gr.periodic(chain())
    for cycles in (2, 4):
        orbit = gr.periodic(chain(), cycles, once)
        assert orbit.period == pytest.approx(cycles * once.period, rel=1e-15)
        np.testing.assert_allclose(
            sorted_complex(orbit.multipliers), sorted_complex(once.multipliers**cycles), rtol=0, atol=1e-8
        )
        np.testing.assert_allclose(orbit.state["velocity"], once.state["velocity"], rtol=0, atol=1e-9)


def test_a_chain_of_32_inertias() -> None:
    """In contact it is linear: state and multipliers by a matrix of complex amplitudes."""
    n, k, c, drag, gap, w = 32, 5000.0, 2.0, 0.05, 0.002, 40.0
    model = gr.Model.from_tables(
        {
            "schema": 1,
            "inertia": [{"name": f"b{i}", "J": 0.1, "drag": drag} for i in range(n)],
            "coupling": [
                {"name": f"k{i}", "between": [f"b{i}", f"b{i + 1}"], "stiffness": k, "damping": c, "clearance": gap}
                for i in range(n - 1)
            ],
            "excitation": {"speed": w},
            "torque": [
                {"on": "b0", "mean": 30.0, "harmonics": [{"order": 1, "amplitude": 5.0, "phase": 0.0}]},
                {"on": f"b{n - 1}", "mean": -30.0},
            ],
        }
    )
    orbit = gr.periodic(model)
    laplacian = np.diag([1.0, *[2.0] * (n - 2), 1.0]) - np.eye(n, k=1) - np.eye(n, k=-1)
    push = np.zeros(n)
    push[0] = 5.0
    dynamic = k * laplacian - 0.1 * w**2 * np.eye(n) + 1j * w * (c * laplacian + drag * np.eye(n))
    angle = np.linalg.solve(dynamic, push)  # times sin(w t)
    np.testing.assert_allclose(orbit.state["velocity"], (1j * w * angle).imag, rtol=0, atol=1e-8)
    matrix = np.block(
        [[np.zeros((n, n)), np.eye(n)], [-k * laplacian / 0.1, -(c * laplacian + drag * np.eye(n)) / 0.1]]
    )
    values = np.exp(np.linalg.eigvals(matrix) * orbit.period)
    assert len(orbit.multipliers) == len(values)
    large = np.sort(np.abs(values))[::-1]
    np.testing.assert_allclose(np.sort(np.abs(orbit.multipliers))[::-1], large, rtol=0, atol=1e-8)
    assert len(orbit.motion.crossings.time) == 0


def test_there_and_back_a_branch_of_four_inertias_meets_itself() -> None:
    model, path = chain(), "torque.0.harmonics.0.amplitude"
    there = gr.continuation(model, path, (3.0, 9.0))
    back = gr.continuation(model, path, (9.0, 3.0), start=there.orbit(len(there.curves[0].points) - 1))
    first, last = there.points[0], back.curves[0].points[-1]
    assert last.parameter == 3.0
    np.testing.assert_allclose(last.state, first.state, rtol=0, atol=1e-9)
    one, other = (branch.events[branch.events["branch"] == 0] for branch in (there, back))
    assert one["kind"].tolist() == other["kind"].tolist()[::-1] == ["grazing", "period doubling"]
    np.testing.assert_allclose(one["value"], other["value"][::-1], rtol=1e-9)


def symmetric(frequency: float, amplitude: float = 0.5) -> gr.Model:
    """x'' + 0.1 x' + f(x) = amplitude cos(W t): with x(t) also -x(t + T/2) is a motion."""
    return gr.Model.from_tables(
        {
            "schema": 1,
            "units": "dimensionless",
            "inertia": [{"name": "body", "J": 1.0, "drag": 0.1}],
            "coupling": [{"name": "gap", "between": ["body", "ground"], "stiffness": 1.0, "clearance": 1.0}],
            "excitation": {"frequency": frequency},
            "torque": [
                {"on": "body", "harmonics": [{"order": 1, "amplitude": amplitude, "phase": np.pi / 2}]},
            ],
        }
    )


def is_symmetric(orbit: Orbit) -> bool:
    x = orbit.run.data["deflection"].values[:, 0]
    half = (len(x) - 1) // 2
    return bool(np.abs(x[half:] + x[: len(x) - half]).max() < 1e-8)


def test_where_symmetry_breaks_two_branches_leave() -> None:
    """At both ends of the loop of motions without symmetry a multiplier of the symmetric ones is 1."""
    branch = gr.continuation(symmetric(0.6), "excitation.frequency", (0.6, 0.3))
    main = branch.events[branch.events["branch"] == 0]
    main = main[main["kind"] != "mean at corner"]
    assert main["kind"].tolist() == ["symmetry breaking"]
    here = next(event for event in branch.curves[0].events if event.kind == "symmetry breaking")
    assert np.abs(here.point.multipliers - 1.0).min() < 1e-6
    first = len(branch.curves[0].points)
    assert all(is_symmetric(branch.orbit(i)) for i in range(0, first, 4))
    assert [curve.origin for curve in branch.curves[:3]] == ["", "symmetry breaking", "symmetry breaking"]
    assert {curve.origin for curve in branch.curves[3:]} == {"period doubling"}
    halfway = [first + len(branch.curves[1].points) // 2, first + len(branch.curves[1].points) + 20]
    assert not any(is_symmetric(branch.orbit(i)) for i in halfway)


def test_from_a_start_that_leads_nowhere_the_remedy_is_named() -> None:
    with pytest.raises(ConvergenceError, match="another start"):
        gr.periodic(gr.example("clutch_friction"))


@pytest.mark.long
def test_a_branch_goes_on_beyond_a_symmetry_breaking() -> None:
    branch = gr.continuation(symmetric(0.6, 1.0), "excitation.frequency", (0.6, 0.2))
    assert branch.curves[0].points[-1].parameter == 0.2
    (note,) = branch.notes
    assert note.endswith(
        "of branches of doubled period (0.419344806, 0.410549344, 0.36055958 and 5 more) is not followed."
    )


@pytest.mark.long
def test_both_halves_of_a_loop_are_branches_from_one_breaking_to_the_other() -> None:
    """They are mirror images of one another, and are listed once."""
    branch = gr.continuation(symmetric(0.6), "excitation.frequency", (0.6, 0.2082))
    halves = [curve for curve in branch.curves if curve.origin == "symmetry breaking"]
    breakings = [event.point.parameter for event in branch.curves[0].events if event.kind == "symmetry breaking"]
    assert len(halves) == len(breakings) == 2
    for half in halves:
        assert [half.points[end].parameter for end in (0, -1)] == pytest.approx(breakings, abs=1e-9)


@pytest.mark.long
def test_a_branch_of_doubled_period_holds_no_motions_of_the_single_one() -> None:
    branch = gr.continuation(chain(), "torque.0.harmonics.0.amplitude", (12.0, 8.8))
    for curve in branch.curves[1:]:
        assert curve.cycles == 2
        middle = branch.orbit_at(curve.points[len(curve.points) // 2], 2)
        half = middle.run.data["deflection"].values
        n = (len(half) - 1) // 2
        assert np.abs(half[n:] - half[: n + 1]).max() > 1e-6


def test_a_body_that_floats_touches_where_its_family_ends() -> None:
    """It swings by 0.5 / (W sqrt(W^2 + 0.01)), which is the half gap at W; beyond, it touches both sides."""
    branch = gr.continuation(symmetric(0.8), "excitation.frequency", (0.8, 0.7))
    assert branch.notes == ()
    first = branch.curves[0]
    assert [event.kind for event in first.events if event.kind != "fold"] == ["end of a family"]
    end = np.sqrt((np.sqrt(1.0001) - 0.01) / 2.0)
    assert first.events[0].point.parameter == pytest.approx(end, abs=1e-10)
    is_free = [point.free == 1 for point in first.points]
    count = is_free.index(False)
    assert all(is_free[:count])
    assert not any(is_free[count:])
    assert all({up for _, up in point.pattern} == {0, 1} for point in first.points[count:])
    assert_same_back(branch)
    levels = branch.data.isel(point=slice(count, len(first.points)))
    np.testing.assert_allclose(levels["lowest"], -levels["highest"], rtol=0, atol=1e-8)


def test_a_body_between_soft_stops_goes_on_beyond_its_family() -> None:
    """A free body of mass 1 swings by amplitude / W^2, its half gap at the amplitude 1; the motion beyond is stable."""
    tables = {
        "schema": 1,
        "units": "dimensionless",
        "inertia": [{"name": "body", "J": 1.0}],
        "coupling": [
            {"name": "gap", "between": ["body", "ground"], "stiffness": 0.5, "damping": 0.05, "clearance": 1.0}
        ],
        "excitation": {"speed": 1.0},
        "torque": [{"on": "body", "harmonics": [{"order": 1, "amplitude": 0.3}]}],
    }
    model, path = gr.Model.from_tables(tables), "torque.0.harmonics.0.amplitude"
    start = gr.periodic(model, start={"angle": [0.0], "velocity": [-0.3]})
    branch = gr.continuation(model, path, (0.3, 1.5), start=start)
    assert branch.notes == ()
    assert branch.events["kind"].tolist() == ["end of a family"]
    assert branch.events["value"][0] == pytest.approx(1.0, abs=1e-10)
    assert branch.data["value"].values[-1] == 1.5
    assert branch.data["stable"].values.all()
    assert_same_back(branch)


@pytest.mark.long
def test_a_slider_slips_where_its_family_ends() -> None:
    """While it sticks the body swings by amplitude / |3 - W^2 + 0.15 i W|; at 0.125 its spring carries what it can."""
    slider = {"stiffness": 1.0, "damping": 0.05, "hysteresis": 0.5, "stick_stiffness": 2.0}
    tables = {
        "schema": 1,
        "units": "dimensionless",
        "inertia": [{"name": "body", "J": 1.0, "drag": 0.1}],
        "coupling": [{"name": "joint", "between": ["body", "ground"], "stages": [slider]}],
        "excitation": {"speed": 0.5},
        "torque": [{"on": "body", "harmonics": [{"order": 1, "amplitude": 0.1}]}],
    }
    branch = gr.continuation(gr.Model.from_tables(tables), "torque.0.harmonics.0.amplitude", (0.1, 0.4))
    assert branch.notes == ()
    assert branch.events["kind"].tolist() == ["end of a family"]
    assert branch.events["value"][0] == pytest.approx(0.125 * abs(3.0 - 0.5**2 + 0.075j), abs=1e-10)
    assert_same_back(branch)


@pytest.mark.long
def test_a_loose_gear_folds_just_beyond_its_family() -> None:
    """Motions that touch both sides twice a period exist up to 2.5e-6 beyond its end, and lead back.

    In the family two multipliers are 1: nothing holds the gear. The first light touches damp it, so the motion is
    stable, but a pair leaves the unit circle 4e-8 beyond the end. Behind the fold both are real, one of them inside the
    circle. With 30 digits their product is 1.018764548 at the fold: no pair crosses the circle there.
    """
    tables = {
        "schema": 1,
        "units": "dimensionless",
        "inertia": [{"name": "a", "J": 1.0, "drag": 0.1}, {"name": "b", "J": 0.2}],
        "coupling": [
            {"name": "s", "between": ["a", "ground"], "stiffness": 1.0, "damping": 0.1},
            {"name": "gap", "between": ["a", "b"], "stiffness": 10.0, "damping": 0.5, "clearance": 1.0},
        ],
        "excitation": {"speed": 0.6},
        "torque": [{"on": "a", "harmonics": [{"order": 1, "amplitude": 1.0}]}],
    }
    branch = gr.continuation(gr.Model.from_tables(tables), "torque.0.harmonics.0.amplitude", (0.2, 3.0))
    assert branch.notes == ()
    assert branch.events["kind"].tolist() == ["end of a family", "Neimark-Sacker", "fold"]
    end = abs(1.0 - 0.6**2 + 0.12j)  # there the swing of the body before the gap is its half
    assert branch.events["value"][[0, 2]].tolist() == pytest.approx([end, 0.651155324602881], abs=1e-10)
    pair = np.sort(branch.curves[0].events[2].point.multipliers.real)[-2:]
    assert np.prod(pair) == pytest.approx(1.018764548, abs=1e-7)
    value = branch.data["value"].values
    assert value[-1] == 0.2
    assert not branch.data["stable"].values[np.argmax(value) + 1 :].any()
    assert_same_back(branch)


@pytest.mark.long
def test_a_family_is_one_motion_of_every() -> None:
    orbits = gr.periodic(symmetric(1.2), every=True)
    assert sum(orbit.free > 0 for orbit in orbits) == 1


def test_what_a_start_of_its_own_leads_to_is_stable_or_says_so() -> None:
    orbit = gr.periodic(chain())
    assert orbit.stable or any("unstable" in note for note in orbit.notes)


@pytest.mark.long
def test_every_motion_of_a_symmetric_driveline_has_its_mirror_image() -> None:
    """At W = 0.4 the symmetric motion is unstable, two stable ones are mirror images: the signs sum to one."""
    orbits = gr.periodic(symmetric(0.4), every=True)
    assert sum(orbit.symmetric for orbit in orbits) == 1
    assert all(orbit.notes == () for orbit in orbits)
    means = sorted(float(np.mean(orbit.run.data["deflection"].values[:-1])) for orbit in orbits)
    np.testing.assert_allclose(means, -np.array(means[::-1]), rtol=0, atol=1e-9)


@pytest.mark.long
def test_where_every_free_vibration_repeats_the_branch_is_left() -> None:
    """Without damping at half the natural frequency every motion does, however large."""
    spring = {"name": "spring", "between": ["body", "ground"], "stiffness": 1.0}
    tables = {
        "schema": 1,
        "units": "dimensionless",
        "inertia": [{"name": "body", "J": 1.0}],
        "coupling": [spring],
        "excitation": {"speed": 0.5},
        "torque": [{"on": "body", "mean": 0.1, "harmonics": [{"order": 1, "amplitude": 0.2}]}],
    }
    branch = gr.continuation(gr.Model.from_tables(tables), "excitation.speed", (0.5, 2.0))
    assert len(branch.points) < 300
    assert branch.events.empty
    assert branch.notes == ("A branch was left at 0.5: its motions are one of a family that has no end in sight.",)
