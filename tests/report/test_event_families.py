"""Events near each other told as one family, narrow ranges left out, and the first sentences of a page of branches."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pandas as pd
import pytest

import gearrattle as gr
from gearrattle.orbits import Branch
from gearrattle.orbits.stability_ranges import Range
from gearrattle.report.event_families import families_of
from gearrattle.report.result_kinds import presentation_of
from gearrattle.report.stable_motion_sentences import counts_of, counts_words

AMPLITUDE = "torque.0.harmonics.0.amplitude"


def events(*located: tuple[float, str], narrow: float = 1e-3) -> Branch:
    table = pd.DataFrame(list(located), columns=["value", "kind"])
    return cast("Branch", SimpleNamespace(events=table, range=(0.0, 1000.0), narrow=narrow, sweeps=None))


def test_doublings_near_each_other_are_a_cascade() -> None:
    doubling = "period doubling"
    branch = events((100.0, "fold"), (500.0, doubling), (500.6, doubling), (500.8, doubling), (500.85, "grazing"))
    single, family = families_of(branch)
    assert (single.words, single.rows) == ("fold", (0,))
    assert family.words == "a cascade: 3 period doublings and 1 grazing"
    assert (family.low, family.high, family.rows) == (500.0, 500.85, (1, 2, 3, 4))


def test_two_events_are_no_family_and_a_width_of_zero_makes_none() -> None:
    pair = events((500.0, "fold"), (500.1, "grazing"))
    assert [family.words for family in families_of(pair)] == ["fold", "grazing"]
    many = events(*[(500.0 + 0.1 * k, "grazing") for k in range(5)])
    assert [family.words for family in families_of(many)] == ["5 grazings"]
    none = events(*[(500.0 + 0.1 * k, "grazing") for k in range(5)], narrow=0.0)
    assert len(families_of(none)) == 5


def stable(*ranges: tuple[float, float]) -> list[Range]:
    return [Range(k, low, high, stable=True, points=9, cause="fold") for k, (low, high) in enumerate(ranges)]


@pytest.mark.parametrize(
    ("ranges", "words"),
    [
        (((0.0, 1000.0),), "one stable motion everywhere"),
        ((), "no stable motion was met"),
        (((0.0, 600.0), (1000.0, 400.0)), "two stable motions 400-600; elsewhere one"),
        (((0.0, 600.0), (600.2, 1000.0)), "one stable motion everywhere"),
        (((0.0, 600.0), (700.0, 1000.0)), "no known stable motion 600-700; elsewhere one"),
    ],
)
def test_how_many_stable_motions_there_are_where(ranges: Any, words: str) -> None:
    counts = counts_of(events(), stable(*ranges))
    assert counts_words(counts, lambda low, high: f"{low:g}-{high:g}") == words


def test_narrow_decides_what_stands_on_the_page_alone() -> None:
    model = gr.example("rattle_oscillator")
    detailed = gr.continuation(model, AMPLITUDE, (3.6, 6.3), narrow=0.0)
    merged = gr.continuation(model, AMPLITUDE, (3.6, 6.3), narrow=0.2)
    assert merged.events.equals(detailed.events)
    tables = [{table.title: table for table in presentation_of(one).tables()} for one in (detailed, merged)]
    of_events = [len(table["Events"].rows) for table in tables]
    assert of_events == [5, 3]
    assert tables[1]["Events"].rows[0][2] == "1 grazing, 1 fold and 1 period doubling"
    ranges = [len(table["Ranges of one stability"].rows) for table in tables]
    assert ranges[0] > ranges[1] >= 2
    assert "narrower than 0.2 of the whole left out" in tables[1]["Ranges of one stability"].note
