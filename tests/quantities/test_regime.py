"""Regime entries, one for every mesh and clearance."""

from __future__ import annotations

import pytest

from gearrattle.quantities.regime import ImpactRegime
from tests import synthetic
from tests.quantities.reading import evaluate, one
from tests.signals.handmade import chain, staged, trajectory


@pytest.mark.parametrize("kind", synthetic.DEFLECTIONS)
def test_known_motion(kind: str) -> None:
    entries = evaluate(ImpactRegime(), synthetic.trajectory(kind))
    assert [item.subject for item in entries] == ["clutch", "spline", "gear"]
    assert one(entries, "gear", "regime").value == kind


def test_a_mesh_without_a_gap_is_judged_and_quiet() -> None:
    plate = staged([-1.0, 1.0], -1, [5.0, 1.0, 5.0])
    entries = evaluate(ImpactRegime(), trajectory(plate, chain([0, 1, 0, -1], [0.5, 1.0, 1.5])))
    assert [(item.subject, item.value) for item in entries] == [("spring", "double-sided"), ("gear", "quiet")]
