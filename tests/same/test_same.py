"""The comparison of two trees sees one bit, one word and one file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import gearrattle as gr
from tests.same.differences import Answers, differences, read, unsteady
from tests.same.record import Record, Tables, record_part


def recorded(value: object) -> Answers:
    record = Record()
    record.add("value", value)
    return Answers(record.texts, record.arrays)


def seen(one: object, other: object) -> list[str]:
    return [key for key, _ in differences(recorded(one), recorded(other), set())]


@pytest.mark.parametrize(
    ("one", "other", "key"),
    [
        (np.array([1.0, 2.0]), np.array([1.0, np.nextafter(2.0, 3.0)]), "value"),
        (0.0, -0.0, "value"),
        (np.zeros(2), np.zeros(3), "value"),
        (1, 1.0, "value"),
        ({"a": 1.5}, {"b": 1.5}, "value [a]"),
        ([1.0, "x"], [1.0, "y"], "value 1"),
        (pd.DataFrame({"a": [1.0]}), pd.DataFrame({"a": [2.0]}), "value column a"),
        (xr.DataArray([1.0], attrs={"unit": "m"}), xr.DataArray([1.0], attrs={"unit": "rad"}), "value attrs [unit]"),
        (xr.Dataset({"a": ("t", [1.0])}), xr.Dataset({"a": ("s", [1.0])}), "value a dims 0"),
    ],
)
def test_a_difference_is_seen_where_it_is(one: object, other: object, key: str) -> None:
    assert key in seen(one, other)
    assert seen(one, one) == []


def test_a_motion_is_recorded_whole() -> None:
    model = gr.load(Path(__file__).parents[2] / "examples" / "paper" / "case3.toml")
    runs = [gr.simulate(model, cycles=2, discard=0, samples_per_cycle=8, audit=audit) for audit in (True, False)]
    keys = seen(*runs)
    assert any("energy" in key for key in keys)
    assert not any(".data angle" in key for key in keys)
    assert recorded(runs[0]).arrays["value .data angle values"].shape == (17, 4)


def test_what_differs_within_one_tree_is_compared_without_numbers() -> None:
    first, second = recorded("took 0.12 s\n3 crossings"), recorded("took 1.7 s\n3 crossings")
    assert (ignored := unsteady(first, second)) == {"value"}
    assert list(differences(first, recorded("took 5 s\n4 crossings"), ignored)) == []
    assert list(differences(first, recorded("took 5 s\n4 impacts"), ignored)) != []


def test_a_saved_record_is_read_as_it_was(tmp_path: Path) -> None:
    record = record_part("refusals", [])
    record.save(tmp_path / "refusals")
    saved = read(tmp_path)
    assert list(differences(Answers(record.texts, record.arrays), saved, set())) == []
    assert sum("ModelError" in text for text in saved.texts.values()) > 100


def test_headings_and_cells_of_a_page_are_its_tables() -> None:
    reader = Tables()
    reader.feed("<h2>Energy</h2><p>prose</p><table><tr><th>a</th><td>1 <b>J</b></td></tr></table>")
    assert reader.lines() == ["Energy |", "a | 1 J |"]
