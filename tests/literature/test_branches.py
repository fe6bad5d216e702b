"""Branches of periodic motions of published systems, at the accuracy the source supports.

Four of five are conditions in closed form that follow from the published equations and are derived here; of the
harmonic balance only its own error is held. Numbers printed in figures are not read off.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import brentq, fsolve, minimize_scalar

import gearrattle as gr

Array = NDArray[np.float64]


def body(frequency: float, torque: dict[str, Any], *, clearance: float = 1.0, stiffness_ratio: float = 0.0) -> gr.Model:
    """x'' + 0.1 x' + f(x) = torque, stiffness 1 outside, ``stiffness_ratio`` inside; dimensionless."""
    gap = {"name": "gap", "between": ["body", "ground"], "stiffness": 1.0, "clearance": clearance}
    return gr.Model.from_tables(
        {
            "schema": 1,
            "units": "dimensionless",
            "inertia": [{"name": "body", "J": 1.0, "drag": 0.1}],
            "coupling": [{**gap, "stiffness_ratio": stiffness_ratio}],
            "excitation": {"frequency": frequency},
            "torque": [{"on": "body", **torque}],
        }
    )


def cosine(amplitude: float) -> dict[str, Any]:
    return {"order": 1, "amplitude": amplitude, "phase": np.pi / 2}


# Mason, Piiroinen, Wilson and Homer (2009): gear between two flanks

AMPLITUDE = "torque.0.harmonics.0.amplitude"


def test_mason_the_quiet_motion_parts_where_its_swing_is_its_preload() -> None:
    """Met, derived: 2 k = 200, d = 0.6; eccentricity 0.1526 in the units of the published forcing."""
    k, d = 100.0, 0.6
    limit = 4 * np.pi * d * np.sqrt((2 * k - 4 * np.pi**2) ** 2 + (2 * np.pi * d) ** 2) / (2 * k)
    assert limit / (2 * np.pi * np.sqrt(4 * np.pi**2 + d**2)) == pytest.approx(0.1526, abs=5e-5)
    events = gr.continuation(gr.example("rattle_oscillator"), AMPLITUDE, (4.0, 6.06)).events
    first = events[events["kind"] == "grazing"].iloc[0]
    assert first["value"] == pytest.approx(limit, rel=1e-10)


@pytest.mark.long
def test_mason_quiet_and_rattling_motions_coexist() -> None:
    """Met in words: beside the quiet motion stable ones that strike one flank or both. How many is not compared."""
    orbits = [orbit for orbit in gr.periodic(gr.example("rattle_oscillator"), every=True) if orbit.stable]
    verdicts = {orbit.verdict.verdict for orbit in orbits}
    assert len(orbits) >= 2
    assert "double-sided" in verdicts
    assert any(len(orbit.motion.crossings.time) == 0 for orbit in orbits)


# Comparin and Singh (1989), Kahraman and Singh (1990): preloaded oscillator with backlash, damping ratio 0.05


@pytest.mark.parametrize("mean", [0.1, *(pytest.param(mean, marks=pytest.mark.long) for mean in (0.2, 0.3))])
def test_comparin_contact_is_lost_where_the_alternating_part_is_the_mean(mean: float) -> None:
    """Met, derived: |H(W)| 0.05 W^2 = mean, from below and, where there is one, from above."""

    def excess(w: float) -> float:
        return float(0.05 * w**2 / abs(1 - w**2 + 0.1j * w)) - mean

    branch = gr.continuation(
        body(0.5, {"mean": mean, "harmonics": [cosine(0.05 * 0.5**2)]}), "excitation.frequency", (0.5, 0.6)
    )
    assert not len(branch.events[branch.events["kind"] == "grazing"])
    for first, last in ((0.5, 0.98), (1.6, 1.02)):
        limit = brentq(excess, first, last, xtol=1e-15)
        force = 0.05 * limit**2
        model = body(limit, {"mean": mean, "harmonics": [cosine(0.9 * force)]})
        start = {"angle": [1.0 + mean], "velocity": [0.0]}
        events = gr.continuation(model, AMPLITUDE, (0.9 * force, 1.001 * force), start=start).events
        grazings = events[events["kind"] == "grazing"]
        assert grazings["value"].iloc[0] == pytest.approx(force, rel=1e-9)


ANGLES = (np.arange(2000) + 0.5) / 2000 * 2 * np.pi


def spring(x: Array) -> Array:
    return np.asarray(np.where(x > 1.0, x - 1.0, np.where(x < -1.0, x + 1.0, 0.0)))


def balanced_frequencies(swing: float) -> Array:
    """(2,) W at which mean + swing cos(W t + phase) balances the mean and first harmonic of all forces; NaN if none."""
    middle = brentq(lambda m: float(spring(m + swing * np.cos(ANGLES)).mean()) - 0.1, -2.0, 3.0)
    k = 2.0 * float((spring(middle + swing * np.cos(ANGLES)) * np.cos(ANGLES)).mean()) / swing
    roots = np.roots([1.0 - (0.05 / swing) ** 2, 0.01 - 2.0 * k, k**2])
    return np.sqrt(np.sort(np.where(np.abs(roots.imag) > 0.0, np.nan, roots.real)))


def test_kahraman_jumps_by_harmonic_balance() -> None:
    """Met as far as one harmonic goes: its jump at the upper fold 0.3 % below ours, at the lower 3.9 % below.

    The published solution balances mean and first harmonic; it is derived anew here, by quadrature.
    """
    up = -minimize_scalar(lambda a: -balanced_frequencies(a)[0], bounds=(0.1, 0.2), method="bounded").fun
    swings = np.linspace(0.25, 0.345, 400)
    down = float(np.nanmin([balanced_frequencies(a) for a in swings]))
    example = gr.example("backlash_oscillator").with_({"excitation.speed": 0.3})
    events = gr.continuation(example, "excitation.speed", (0.3, 1.6)).events
    exact = events["value"][events["kind"] == "fold"].to_numpy()
    assert up / exact[0] - 1 == pytest.approx(-0.0029, abs=1e-4)
    assert down / exact[1] - 1 == pytest.approx(-0.0394, abs=5e-4)


# Natsiavas (1989): symmetric trilinear oscillator


def later(law: tuple[float, float, float], w: float, state: Array, times: tuple[float, float]) -> Array:
    """x'' + 0.1 x' + stiffness x + offset = force cos(w t), by one exponential of (x, v, cos, sin, 1)."""
    (stiffness, offset, force), (begin, end) = law, times
    matrix = np.zeros((5, 5))
    matrix[0, 1] = 1.0
    matrix[1] = [-stiffness, -0.1, force, 0.0, -offset]
    matrix[2, 3], matrix[3, 2] = -w, w
    whole = np.array([*state, np.cos(w * begin), np.sin(w * begin), 1.0])
    return np.asarray((expm(matrix * (end - begin)) @ whole)[:2])


@pytest.mark.parametrize(("w", "ratio", "force"), [(0.6, 0.3, 0.5), (0.9, 0.25, 0.8), (1.4, 0.5, 2.0)])
def test_natsiavas_symmetric_motions_by_matching(w: float, ratio: float, force: float) -> None:
    """Met, derived: half a period later the motion is its mirror image; the instants of two crossings by matching."""
    model = body(w, {"harmonics": [cosine(force)]}, stiffness_ratio=ratio)
    orbit = gr.periodic(model)
    run = orbit.run
    events = run.events
    out = events[(events["from_region"] == 0) & (events["to_region"] == 1)].iloc[0]
    back = events[(events["from_region"] == 1) & (events["to_region"] == 0)]
    leave = float(back["time"].iloc[0])
    guess = [
        out["time"],
        out["velocity"],
        leave + (orbit.period if leave < out["time"] else 0.0),
        back["velocity"].iloc[0],
    ]

    def unmatched(z: Array) -> Array:
        begin, speed, end, back_speed = z
        outside = later((1.0, ratio - 1.0, force), w, np.array([1.0, speed]), (begin, end))
        inside = later((ratio, 0.0, force), w, np.array([1.0, back_speed]), (end, begin + np.pi / w))
        return np.array([outside[0] - 1.0, outside[1] - back_speed, inside[0] + 1.0, inside[1] + speed])

    rounded = np.round(np.array(guess, dtype=float), 2)
    solution = fsolve(unmatched, rounded, xtol=1e-13)
    assert np.abs(unmatched(solution)).max() < 1e-11
    np.testing.assert_allclose(guess, solution, rtol=0, atol=1e-9)


# Theodossiades and Natsiavas (2000): gear pair with backlash and alternating mesh stiffness


MASS, RATE = 0.4, 400.0 / 0.4 + 10.0
"""1 / (r^2 / J + r^2 / J) of both gears [kg]; damping and drag over inertia [1/s]."""
LOAD = 1000.0 / 0.05  # N, along the line of action


def mesh_period(speed: float) -> Array:
    """(3, 3) what becomes of (d, d', 1) over a mesh period in contact: d'' + RATE d' + k d / MASS = LOAD / MASS."""
    total = np.eye(3)
    for stiffness, share in ((1e8, 0.6), (0.6e8, 0.4)):
        matrix = np.array([[0.0, 1.0, 0.0], [-stiffness / MASS, -RATE, LOAD / MASS], [0.0, 0.0, 0.0]])
        total = expm(matrix * share * 2 * np.pi / (20 * speed)) @ total
    return np.asarray(total)


def loaded_pair(speed: float) -> gr.Model:
    loads = {"torque.0.mean": 1000.0, "torque.1.mean": -1000.0}
    return gr.example("alternating_mesh").with_({"excitation.speed": speed, **loads})


def in_contact(speed: float) -> gr.orbits.Orbit:
    """The motion in contact, from its state in closed form; the half gap is 0.05 mm."""
    total = mesh_period(speed)
    depth, rate = np.linalg.solve(np.eye(2) - total[:2, :2], total[:2, 2])
    angle, velocity = (0.05e-3 + depth) / 0.1, rate / 0.1  # both radii are 0.05 m
    start = {"angle": [angle, -angle], "velocity": [velocity, -velocity]}
    orbit = gr.periodic(loaded_pair(speed), start=start)
    np.testing.assert_allclose(orbit.state["velocity"], start["velocity"], rtol=0, atol=1e-9)
    return orbit


@pytest.mark.parametrize("speed", [300.0, 500.0, 1000.0, 1450.0])
def test_theodossiades_multipliers_in_contact_are_meissner_s(speed: float) -> None:
    """Met, derived, within the resonance too. Beside them one of the drag, exp(-10 T), and one of the turning."""
    orbit = in_contact(speed)
    assert orbit.run.events.empty
    want = [*np.linalg.eigvals(mesh_period(speed)[:2, :2]), 1.0, np.exp(-10.0 * orbit.period)]
    np.testing.assert_allclose(
        np.sort_complex(np.round(orbit.multipliers, 10)), np.sort_complex(np.round(want, 10)), rtol=0, atol=1e-8
    )
    assert orbit.stable is (speed != 1450.0)


@pytest.mark.parametrize("speed", [1400.0, 1475.0, 1575.0])
def test_theodossiades_a_start_nearby_leads_to_the_motion_in_contact(speed: float) -> None:
    """A search may not begin with the stiffness with which the last period ended: the switch at t = 0 decides."""
    want = in_contact(speed)
    start = {name: [1.0001 * value for value in values] for name, values in want.state.items()}
    orbit = gr.periodic(loaded_pair(speed), start=start)
    np.testing.assert_allclose(orbit.state["velocity"], want.state["velocity"], rtol=0, atol=1e-9)


@pytest.mark.long
def test_theodossiades_the_parametric_resonance_begins_and_ends_where_the_period_doubles() -> None:
    """Met, derived: about twice the natural frequency det(I + M) < 0; the bounds are roots of a closed form."""

    def doubling(speed: float) -> float:
        return float(np.linalg.det(np.eye(2) + mesh_period(speed)[:2, :2]))

    want = [brentq(doubling, *ends, xtol=1e-10) for ends in ((1450.0, 1700.0), (1200.0, 1450.0))]
    branch = gr.continuation(loaded_pair(1600.0), "excitation.speed", (1600.0, 1300.0), start=in_contact(1600.0))
    events = branch.events[(branch.events["branch"] == 0) & (branch.events["kind"] == "period doubling")]
    np.testing.assert_allclose(events["value"], want, rtol=1e-9)
    (note,) = branch.notes  # of the branch of 2 T from the upper bound
    assert note.endswith("its motions have grown a thousandfold.")


@pytest.mark.long
def test_motions_that_a_linear_resonance_leaves_free_are_no_folds() -> None:
    """At its bound the motion in contact may have any amplitude of twice the period: a branch at one speed."""
    branch = gr.continuation(loaded_pair(1545.0), "excitation.speed", (1545.0, 1530.0), start=in_contact(1545.0))
    vertical = branch.curves[1]
    values = np.array([point.parameter for point in vertical.points])
    assert np.ptp(values[:20]) < 1e-6
    assert vertical.points[19].length > 0.2
    kinds = [event.kind for event in vertical.events if event.point.length < vertical.points[19].length]
    assert kinds == []
