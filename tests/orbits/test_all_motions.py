"""The search for all motions tells how far it is, can be ended, and says what it left."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.periodic.symmetry import HalfPeriodMap
from gearrattle.errors import Cancelled, ConvergenceError
from gearrattle.orbits import all_motions
from gearrattle.orbits.known_motions import Known

pytestmark = pytest.mark.slow
NEAR_EDGE = [
    (1.5, 2.0, 0.1, 10.0, 0.0),
    (2.2, 3.0, 0.05, 10.0, 0.4),
    (1.5, 2.0, 0.1, 1e4, 0.0),
    (1.5, 2.0, 0.0, 10.0, -np.pi / 2.0),  # touches at t = 0
]
"""Speed, amplitude, drag, stiffness and phase of a body that floats in its gap (``floating``)."""


def floating(speed: float, amplitude: float, drag: float, stiffness: float = 10.0, phase: float = 0.0) -> gr.Model:
    """x'' + drag x' + f(x) = amplitude sin(w t + phase), f = 0 for |x| < 1."""
    contact = {"stiffness": stiffness, "damping": 0.2, "clearance": 1.0}
    harmonics = [{"order": 1, "amplitude": amplitude, "phase": phase}]
    return gr.Model.from_tables(
        {
            "schema": 1,
            "units": "dimensionless",
            "inertia": [{"name": "body", "J": 1.0, "drag": drag}],
            "coupling": [{"name": "gap", "between": ["body", "ground"], **contact}],
            "excitation": {"speed": speed},
            "torque": [{"on": "body", "harmonics": harmonics}],
        }
    )


def swing_of(speed: float, amplitude: float, drag: float, phase: float = 0.0) -> complex:
    """z of x = x0 + Re(z exp(i w t)), the motion that floats."""
    return complex(-1j * np.exp(1j * phase) * amplitude / (1j * drag * speed - speed**2))


def touch_of(orbit: gr.Orbit) -> float:
    """How far the deflection passes the corners at -1 and 1."""
    lowest, highest, _ = orbit.period_map.levels(orbit.motion)
    return float(max(-lowest[0], highest[0]) - 1.0)


def starts(orbits: list[gr.Orbit]) -> list[Any]:
    return sorted([orbit.cycles, *np.round(orbit.motion.start.y, 6)] for orbit in orbits if not orbit.free)


@pytest.mark.parametrize("cycles", [1, 3])
@pytest.mark.parametrize("numbers", NEAR_EDGE)
def test_a_motion_that_touches_by_less_than_its_residual_tells_is_one_of_the_family_in_the_gap(
    numbers: tuple[float, float, float, float, float], cycles: int
) -> None:
    """Newton's method from 1e-4 outside the family ends 1e-9 outside, with a residual below its tolerance."""
    speed, amplitude, drag, _, phase = numbers
    z = swing_of(speed, amplitude, drag, phase)
    mean = 1.0 - abs(z) + 1e-4
    start = {"angle": [mean + z.real], "velocity": [(1j * speed * z).real]}
    orbit = gr.periodic(floating(*numbers), cycles, start=start)
    assert (orbit.free, orbit.pattern, orbit.stable) == (1, (), True)
    want = [1.0, np.exp(-2.0 * np.pi * cycles * drag / speed)]
    np.testing.assert_allclose(np.abs(orbit.multipliers), want, rtol=0, atol=1e-7)
    (interval,) = orbit.family
    np.testing.assert_allclose([interval.low, interval.high], z.real + np.array([-1, 1]) * (1 - abs(z)), atol=1e-8)
    assert touch_of(orbit) == pytest.approx(abs(z) - 1.0, abs=1e-6)  # in the middle of the family


@pytest.mark.parametrize("cycles", [1, 2, 3])
@pytest.mark.parametrize(("speed", "amplitude"), [(1.5, 2.0), (1.0, 1.0)])
def test_a_family_is_listed_once_and_no_rattle_at_its_edge(speed: float, amplitude: float, cycles: int) -> None:
    """x0 + a sin(w t + p), |x0| <= 1 - a, is one family; no other motion stays within |x| <= 1.001."""
    orbits = gr.periodic(floating(speed, amplitude, 0.1), cycles, every=True)
    floats = [orbit for orbit in orbits if touch_of(orbit) < 1e-3]
    assert [(orbit.cycles, orbit.free, orbit.verdict.verdict) for orbit in floats] == [(1, 1, "quiet")]
    assert touch_of(floats[0]) <= 0.0
    others = [orbit for orbit in orbits if orbit not in floats]
    assert sorted((orbit.cycles, orbit.free, orbit.stable) for orbit in others) == [(1, 0, False), (1, 0, True)]


@pytest.mark.parametrize("cycles", [2, pytest.param(4, marks=pytest.mark.long)])
def test_motions_of_a_divisor_are_those_that_it_alone_gives(cycles: int) -> None:
    """The family in the gap, the rattle, and the unstable motion between them."""
    model = floating(1.0, 1.0, 0.1)
    once, more = (gr.periodic(model, n, every=True) for n in (1, cycles))
    assert len(once) == 3
    assert starts(once) == [start for start in starts(more) if start[0] == 1]
    assert sum(orbit.free for orbit in once) == sum(orbit.free for orbit in more) == 1


@pytest.mark.parametrize("cycles", [1, 2, *(pytest.param(n, marks=pytest.mark.long) for n in (3, 4))])
def test_a_motion_of_a_symmetric_driveline_is_kept_with_its_mirror_image(cycles: int) -> None:
    """The mirror image of x(t) is -x(t + T/2), whatever number of periods."""
    model = floating(0.4 * 2.0 * np.pi / 6.0, 1.0, 0.1)
    system = assemble(model).system
    motion = next(orbit for orbit in gr.periodic(model, every=True) if not orbit.symmetric and not orbit.free).motion
    known = Known(PeriodMap(system, cycles), mirror=HalfPeriodMap(system))
    assert known.add(PeriodMap(system, cycles)(motion.start))
    assert [one.is_image for one in known.motions] == [False, True]
    assert known.holds(HalfPeriodMap(system).later(motion.start))
    assert not known.add(known.motions[1].motion)


@pytest.mark.parametrize("fails", [False, True])
def test_branches_that_end_early_are_a_note_with_their_number(fails: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    def breaks_off(*_: object) -> Iterator[object]:
        raise ConvergenceError("it cannot be followed")
        yield

    if fails:
        monkeypatch.setattr(all_motions, "followed_through_families", breaks_off)
    else:
        monkeypatch.setattr(all_motions, "_POINTS", 3)
    for orbit in gr.periodic(gr.example("backlash_oscillator"), every=True):
        (note,) = (note for note in orbit.notes if "over the speed" in note)
        assert note.endswith(" over the speed could not be followed to the end; there may be further motions.")
        assert int(note.split()[0]) >= 2


def test_the_share_of_the_search_never_falls_and_an_exception_ends_it() -> None:
    model, shares = gr.example("backlash_oscillator"), list[float]()
    orbits = gr.periodic(model, every=True, progress=shares.append)
    assert len(orbits) == 3
    assert len(shares) > 50
    assert shares == sorted(shares)
    assert 0.0 < shares[0] < shares[-1] == 1.0

    def stop(share: float) -> None:
        if share > 0.4:
            raise Cancelled("enough")

    with pytest.raises(Cancelled):
        gr.periodic(model, every=True, progress=stop)


def test_branches_that_are_not_followed_to_their_ends_are_a_note(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(all_motions, "_ALL_POINTS", 5)
    for orbit in gr.periodic(gr.example("backlash_oscillator"), every=True):
        assert "Branches over the speed were left after 5 points; they may lead to further motions." in orbit.notes


def test_no_motion_at_all_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Known, "add", lambda *_: False)
    with pytest.raises(ConvergenceError, match="no motion that repeats after 2 periods was found"):
        gr.periodic(gr.example("backlash_oscillator"), 2, every=True)


def test_a_quiet_motion_that_no_start_settles_in_is_known() -> None:
    """Of 33 starts none settles in it; it grows out of the rest with the torque."""
    changes = {"coupling.flanks.clearance": 0.9125, "torque.0.harmonics.0.amplitude": 6.0}
    model = gr.example("rattle_oscillator").with_(changes)
    quiet = gr.periodic(model, start="linear")
    assert (quiet.stable, quiet.verdict.verdict) == (True, "quiet")
    orbits = gr.periodic(model, every=True)
    (known,) = (orbit for orbit in orbits if orbit.verdict.verdict == "quiet")
    assert known.state["angle"] == pytest.approx(quiet.state["angle"], abs=1e-9)
    assert all(orbit.notes == () for orbit in orbits)
    assert len(orbits) == 7


@pytest.mark.long
def test_motions_that_an_irregular_motion_of_a_gearbox_passes() -> None:
    """Case 2 at 150 rad/s: disturbances grow by more than a thousand within a period; hardly all are found."""
    orbits = gr.periodic(gr.example("case2").with_({"excitation.speed": 150.0}), every=True)
    assert orbits
    for orbit in orbits:
        assert orbit.residual < 1e-10
        assert not orbit.stable
