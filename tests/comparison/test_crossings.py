"""Event logs that were shifted, thinned and added to by hand."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from gearrattle.comparison import compare_crossings, compare_impacts
from gearrattle.trajectory import EventLog
from tests import synthetic
from tests.signals import handmade

REFERENCE = synthetic.trajectory()  # 48 crossings, all of the gear
T = synthetic.PERIOD


def logged(keep=None, shift=0.0):
    """The reference with its log shifted [s], and only the rows to keep."""
    rows = np.arange(len(REFERENCE.events)) if keep is None else keep
    columns = {f.name: getattr(REFERENCE.events, f.name)[rows] for f in fields(EventLog)}
    columns["time"] = columns["time"] + shift
    return replace(REFERENCE, events=EventLog(**columns))


def test_the_same_log_has_no_error():
    actual = compare_crossings(REFERENCE, REFERENCE)
    assert actual.total.matched == actual.total.reference == len(REFERENCE.events) > 40
    assert (actual.total.missed, actual.total.invented, actual.total.largest) == (0, 0, 0.0)
    assert sum(actual.of(name).matched for name in ("clutch", "spline", "gear")) == actual.total.matched


def test_a_shifted_log_tells_its_shift():
    shift = 1e-5
    assert shift < compare_crossings(REFERENCE, REFERENCE).reach
    actual = compare_crossings(logged(shift=shift), REFERENCE, 11.0 * T)
    total = actual.total
    assert (total.missed, total.invented) == (0, 0)
    np.testing.assert_allclose([total.largest, total.median, total.rms], shift, rtol=1e-9)
    assert all(np.all(match_.time_error > 0.0) for match_ in actual.matches)


def test_random_errors_have_their_rms_and_median():
    rng = np.random.default_rng(0)
    errors = rng.normal(scale=1e-6, size=len(REFERENCE.events))
    actual = compare_crossings(logged(shift=errors), REFERENCE).total
    assert actual.matched == errors.size
    assert actual.rms == pytest.approx(np.sqrt(np.mean(errors**2)), rel=1e-9)
    assert actual.median == pytest.approx(np.median(np.abs(errors)), rel=1e-9)


def test_deleted_and_inserted_crossings_are_counted_and_shift_nothing():
    """Both members of three brief visits are taken away: six missed; seen from the other side, six invented."""
    mine = np.flatnonzero(REFERENCE.events.clearance == 2)
    gone = np.concatenate([mine[4:6], mine[11:13], mine[20:22]])
    thinned = logged(np.setdiff1d(np.arange(len(REFERENCE.events)), gone), shift=1e-6)
    actual = compare_crossings(thinned, REFERENCE)
    assert (actual.total.missed, actual.total.invented) == (6, 0)
    assert actual.total.largest == pytest.approx(1e-6, rel=1e-6)
    missed = np.sort(np.concatenate([match_.missed for match_ in actual.matches]))
    np.testing.assert_array_equal(missed, np.sort(REFERENCE.events.time[gone]))
    assert actual.of("gear").missed == 6
    assert actual.of("spline").missed == 0
    reverse = compare_crossings(REFERENCE, thinned).total
    assert (reverse.missed, reverse.invented) == (0, 6)


def test_only_crossings_inside_the_horizon_count_but_partners_may_lie_beyond():
    at = REFERENCE.events.time[20]
    actual = compare_crossings(logged(shift=1e-6), REFERENCE, at + 0.5e-6).total
    assert (actual.reference, actual.matched, actual.invented) == (21, 21, 0)
    gone = logged(np.arange(21), shift=1e-6)
    assert compare_crossings(gone, REFERENCE, at + 0.5e-6).total.missed == 0
    assert compare_crossings(gone, REFERENCE).total.missed == len(REFERENCE.events) - 21


def test_lone_crossings_just_beyond_the_horizon_are_neither_missed_nor_invented():
    short, long = (handmade.trajectory(rows=handmade.chain([0, 1, 0][:n], [0.1, 0.22][: n - 1])) for n in (2, 3))
    assert compare_crossings(short, long, 0.2, reach=0.05).total.missed == 0
    assert compare_crossings(long, short, 0.2, reach=0.05).total.invented == 0
    assert compare_crossings(short, long, 0.3, reach=0.05).total.missed == 1
    assert compare_crossings(long, short, 0.3, reach=0.05).total.invented == 1


def test_corners_and_directions_do_not_mix():
    rows = handmade.chain([0, 1, 0, -1, 0], [0.1, 0.2, 0.3, 0.4])
    actual = compare_crossings(handmade.trajectory(rows=rows), handmade.trajectory(rows=rows))
    assert [(match_.corner, match_.direction) for match_ in actual.matches] == [
        (-1.0, -1),
        (-1.0, 1),
        (1.0, -1),
        (1.0, 1),
    ]
    other = handmade.chain([0, -1, 0, 1, 0], [0.1, 0.2, 0.3, 0.4])
    mixed = compare_crossings(handmade.trajectory(rows=other), handmade.trajectory(rows=rows), reach=0.05).total
    assert (mixed.matched, mixed.missed, mixed.invented) == (0, 4, 4)


def test_impacts_are_the_outward_crossings():
    rows = handmade.chain([0, 1, 0, -1, 0, 1], [0.1, 0.2, 0.3, 0.4, 0.5])
    fewer = handmade.chain([0, 1, 0, 1], [0.1, 0.2, 0.51])
    actual = compare_impacts(handmade.trajectory(rows=fewer), handmade.trajectory(rows=rows))
    assert (actual.total.reference, actual.total.matched, actual.total.missed) == (3, 2, 1)
    assert actual.total.largest == pytest.approx(0.01)
    assert actual.kind == "impact"


def test_no_events_at_all():
    quiet = handmade.trajectory()
    actual = compare_crossings(quiet, quiet)
    assert actual.matches == ()
    assert np.isnan(actual.total.rms)
    assert actual.to_dict()["total"]["rms"] is None
