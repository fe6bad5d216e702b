"""A bounded share of ``make fuzz``: damaged input is read, or refused by an error of ours, quickly and small."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.fuzz.attack import Attack
from tests.fuzz.targets import TARGETS

SLOW = ("MDF record",)
"""Targets of which one input takes a tenth of a second."""


@pytest.mark.slow
@pytest.mark.parametrize("name", TARGETS)
def test_a_few_damaged_inputs_are_read_or_refused(name: str, tmp_path: Path) -> None:
    count = 2 if name in SLOW else 12
    result = Attack(TARGETS[name], tmp_path).run(count, seed=1)
    assert result.finds == {}
    assert result.tried == count


@pytest.mark.long
@pytest.mark.parametrize("name", TARGETS)
def test_many_damaged_inputs_are_read_or_refused(name: str, tmp_path: Path) -> None:
    count = 100 if name in SLOW else 2000
    result = Attack(TARGETS[name], tmp_path).run(count, seed=2)
    assert result.finds == {}
    assert result.tried == count
    assert result.refused > 0
