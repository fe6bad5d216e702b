"""Events over a second value: against their closed form, and up to the cusp in which two folds meet."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from tests.orbits.test_branch import over_frequency


def test_a_grazing_stays_on_its_closed_form() -> None:
    """Contact is lost where the amplitude of x = 1 + mean + amplitude cos is the mean."""
    curve = over_frequency().boundary(0, "torque.0.mean", (0.095, 0.11))
    w = curve["value"].values
    amplitude = 0.05 * w**2 / np.abs(1.0 - w**2 + 0.1j * w)
    np.testing.assert_allclose(amplitude, curve["second"].values, rtol=0, atol=1e-10)
    assert curve["second"].values[[0, -1]].tolist() == [0.095, 0.11]
    assert curve.attrs["notes"] == []


def test_both_folds_end_in_one_cusp() -> None:
    ends = []
    for event in (1, 3):
        curve = over_frequency().boundary(event, "torque.0.mean", (0.1, 0.45))
        assert curve.attrs["kind"] == "fold"
        assert len(curve.attrs["notes"]) == 1
        ends.append((float(curve["second"][-1]), float(curve["value"][-1])))
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=1e-4)


def test_on_the_way_it_meets_the_events_of_changed_models() -> None:
    branch = over_frequency()
    curve = branch.boundary(1, "torque.0.mean", (0.09, 0.11))
    changed = branch.model.with_({"torque.0.mean": 0.11})
    events = gr.continuation(changed, branch.path, branch.range).events
    folds = events[events["kind"] == "fold"]["value"].to_numpy()
    assert float(curve["value"][-1]) == pytest.approx(folds[0], abs=1e-9)


def test_a_range_without_the_models_own_value_is_refused() -> None:
    with pytest.raises(gr.ModelError, match=r"must contain the model's own value, 0\.1"):
        over_frequency().boundary(1, "torque.0.mean", (0.2, 0.3))
    with pytest.raises(gr.ModelError, match="this is known of"):
        over_frequency().boundary(2, "torque.0.mean", (0.05, 0.3))
