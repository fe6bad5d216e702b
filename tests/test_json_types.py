"""Values for machines: JSON's types, nested as they were."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
import pytest

from gearrattle.json_types import json_text, json_value


@dataclass(frozen=True)
class Level:
    name: str
    values: np.ndarray
    ratio: float


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (None, None),
        ("word", "word"),
        (True, True),
        (np.bool_(False), False),
        (np.int64(3), 3),
        (np.float64(0.5), 0.5),
        (float("nan"), None),
        (np.float64("-inf"), None),
        (np.str_("word"), "word"),
        ((1, 2.0), [1, 2.0]),
        (np.array([[1.0, np.nan]]), [[1.0, None]]),
        ({1: np.array([2])}, {"1": [2]}),
        (Level("a", np.array([1.5]), float("inf")), {"name": "a", "values": [1.5], "ratio": None}),
        ([Level("a", np.zeros(0), 1.0)], [{"name": "a", "values": [], "ratio": 1.0}]),
    ],
)
def test_values_become_json_types(value: object, expected: object) -> None:
    assert json_value(value) == expected
    assert type(json_value(value)) is type(expected)
    assert json.loads(json_text(value)) == expected


def test_what_json_cannot_hold_is_refused() -> None:
    with pytest.raises(TypeError):
        json_text({"value": object()})
