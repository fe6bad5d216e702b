"""Contact shares from event times."""

from __future__ import annotations

import pytest

from gearrattle.quantities.contact import ContactShare
from tests.quantities.reading import evaluate, value
from tests.signals.handmade import chain, staged, trajectory


def test_contact_and_every_region() -> None:
    plate = staged([-1.0, 1.0, 2.0], -1, [5.0, 1.0, 5.0, 9.0])
    rows = chain([0, 1, 2, 1, 0, -1, 0], [1.25, 1.5, 2.0, 2.5, 3.0, 3.125])
    entries = evaluate(ContactShare(), trajectory(plate, rows, cycles=5, discard=1))
    assert value(entries, "spring", "contact share") == pytest.approx(1.375 / 4, rel=1e-15)
    shares = [value(entries, "spring", f"share of region {label}") for label in ("-1", "0", "+1", "+2")]
    assert shares == pytest.approx([0.125 / 4, 2.625 / 4, 0.75 / 4, 0.5 / 4], rel=1e-15)
    assert len(entries) == 5


def test_elements_without_a_corner_have_no_entry() -> None:
    assert {item.subject for item in evaluate(ContactShare(), trajectory())} == {"gear"}
