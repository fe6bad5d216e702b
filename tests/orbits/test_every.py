"""The search for all motions tells how far it is, can be ended, and says what it left."""

from __future__ import annotations

import pytest

import gearrattle as gr
from gearrattle.errors import Cancelled, ConvergenceError
from gearrattle.orbits import every
from gearrattle.orbits.search import Known

pytestmark = pytest.mark.slow


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
    monkeypatch.setattr(every, "_ALL_POINTS", 5)
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
