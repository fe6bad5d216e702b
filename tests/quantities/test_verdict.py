"""A verdict by name, and as a table: the same parts, with the same numbers."""

from __future__ import annotations

from dataclasses import asdict, fields

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.errors import ModelError
from gearrattle.quantities.verdict import Verdict
from gearrattle.quantities.verdict_parts import Part


@pytest.fixture(scope="module")
def verdict() -> Verdict:
    return gr.criteria(gr.simulate(gr.example("case3"), cycles=20, discard=10))


def test_a_part_goes_by_its_name(verdict: Verdict) -> None:
    for part in verdict.parts:
        assert verdict[part.name] is part


@pytest.mark.parametrize(("name", "remedy"), [("gaer", 'did you mean "gear"'), (0, "there are gear, spline, clutch")])
def test_a_name_that_no_part_has_is_refused(verdict: Verdict, name: str, remedy: str) -> None:
    with pytest.raises(ModelError, match=remedy):
        _ = verdict[name]


def test_the_table_has_every_number_of_every_part(verdict: Verdict) -> None:
    table = verdict.to_dataframe()
    assert list(table.index) == [part.name for part in verdict.parts]
    assert set(table.columns) == {field.name for field in fields(Part)} - {"name"} | {"rattles"}
    for part in verdict.parts:
        row = table.loc[part.name]
        assert row["rattles"] == part.rattles
        for key, value in asdict(part).items():
            if key != "name":
                assert np.isnan(row[key]) if value is None else row[key] == value
    assert table["max_impact_energy"].dtype == np.float64
