"""The page of a study of conditions: what its sentences, map and table say is what the Dataset holds."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from gearrattle.report.plots.conditions_figure import conditions_map
from gearrattle.report.plots.palette import PAPER, STATES
from gearrattle.report.plots.svg_charts import draw
from gearrattle.report.study_pages.conditions_page import (
    closest_margin,
    condition_table,
    content,
    counts_of,
    remarks,
    sections,
    setting_of,
    summary_of,
    worst_condition,
)
from tests.report.examples import conditions

WORDS = ("quiet", "touches", "rattles")


@pytest.fixture(scope="module")
def data() -> xr.Dataset:
    return conditions("rated")


def test_the_map_has_a_panel_per_load_and_a_word_in_every_cell(data: xr.Dataset) -> None:
    chart = conditions_map(data)
    assert len(chart.panels) == 2
    codes = data["verdict severity"].values  # load, temperature, speed
    for panel, of_load in zip(chart.panels, codes, strict=True):
        assert {cells.colour for cells in panel.cells} == {STATES[WORDS[code]] for code in np.unique(of_load)}
        said = {(label.y, label.x): label.words.split()[0] for label in panel.labels}
        assert said == {(float(i), float(j)): WORDS[code] for (i, j), code in np.ndenumerate(of_load)}
        assert [word for _, word in panel.x_ticks] == ["700", "800", "900"]


def test_words_in_cells_are_of_paper_and_have_no_rim(data: xr.Dataset) -> None:
    drawn = draw(conditions_map(data), legend=True).decode()
    words = [text for text in drawn.split("<text") if f'fill="{PAPER}"' in text and 'font-size="10.5"' in text]
    assert len(words) == 12
    assert all('text-anchor="middle"' in text and "stroke" not in text.partition("</text>")[0] for text in words)


def test_many_speeds_have_no_words_in_their_cells(data: xr.Dataset) -> None:
    speed = data.attrs["speed"]
    wide = xr.concat([data.assign_coords({speed: data[speed] + 100.0 * k}) for k in range(4)], speed, data_vars="all")
    wide = wide.assign_attrs(data.attrs)
    assert all(not panel.labels for panel in conditions_map(wide).panels)


def test_the_first_sentences_count_name_the_worst_and_the_closest_margin(data: xr.Dataset) -> None:
    codes = data["verdict severity"].values
    first, worst, margin = summary_of(data).split(". ", 2)
    assert first.startswith(f"Of 12 conditions {(codes == 0).sum()} ")
    at = worst_condition(data)
    assert at is not None
    assert data["hardest impact"].values[at] == data["hardest impact"].values.max()
    assert "The worst is " in worst
    assert f"speed {round(float(data[data.attrs['speed']].values[at[2]]) * 30 / np.pi)} rpm" in worst + margin
    near = closest_margin(data)
    assert near is not None
    ratio = np.abs(np.log(data["threshold margin"].values))
    assert ratio[near] == ratio.min()
    assert "closest to 1" in margin


def test_a_study_without_an_impact_or_a_loose_gear_says_so(data: xr.Dataset) -> None:
    still = data.copy(deep=True).assign({"hardest impact": 0.0 * data["hardest impact"]}).drop_vars("threshold margin")
    still = still.assign(
        {"verdict severity": (0 * data["verdict severity"]).assign_attrs(data["verdict severity"].attrs)}
    )
    assert summary_of(still) == "Of 12 conditions 12 are quiet. No condition has an impact."


def test_the_table_has_every_condition_with_its_values(data: xr.Dataset) -> None:
    table = condition_table(data)
    assert len(table.rows) == data["outcome"].size
    at = {name: i for i, name in enumerate(table.head)}
    for row, index in zip(table.rows, np.ndindex(*data["outcome"].shape), strict=True):
        assert row[at["severity"]] == WORDS[int(data["verdict severity"].values[index])]
        level = float(data["sound level"].values[index])
        assert row[at["sound level [dB]"]] == ("–" if np.isnan(level) else f"{level:.3g}")
        assert row[at["rating by own points"]] == (
            "–" if np.isnan(level) else f"{float(data['rating'].values[index]):.2g}"
        )
    assert "rating by own points" not in condition_table(conditions("one load")).head


def test_what_it_is_not_is_said_and_ratings_only_of_ones_own_points(data: xr.Dataset) -> None:
    words = " ".join(remarks(data))
    assert "its paid text is not read" in words
    assert "a person's. None is computed" in words
    assert "30 dB: 9, 120 dB: 3" in words
    assert "assumed casing of six modes" in words
    without = " ".join(remarks(conditions("one load")))
    assert "calibration points" not in without
    (first, second) = (section.title for section in sections(data, {}))
    assert (first, second) == ("All conditions", "What this is not")


def test_a_study_of_one_load_has_one_panel_and_says_whose_load_it_is() -> None:
    single = conditions("one load")
    assert len(conditions_map(single).panels) == 1
    assert "The load is the model's own." in setting_of(single)
    assert len(counts_of(single).rows) == 2


def test_a_condition_that_failed_is_counted_nowhere(data: xr.Dataset) -> None:
    failed = data.copy(deep=True)
    failed["outcome"].values[0, 1, 2] = 4
    for name in ("verdict severity", "verdict", "severity", "hardest part"):
        failed[name].values[0, 1, 2] = -1
    for name in ("hardest impact", "largest impact energy", "impacts per cycle", "sound level", "threshold margin"):
        failed[name].values[0, 1, 2] = np.nan
    assert "Of 11 conditions" in summary_of(failed)
    assert "1 more condition failed" in summary_of(failed)
    assert condition_table(failed).rows[5][3] == "failed"
    assert [section.title for section in sections(failed, {(0, 1, 2): "why"})][-1] == "Conditions that failed"


def test_machines_get_every_condition_in_si(data: xr.Dataset) -> None:
    values = content(data)
    assert values["axes"]["speed"] == "excitation.speed"
    assert len(values["conditions"]) == 12
    assert sum(values["counts"].values()) == 12
    first = values["conditions"][0]
    assert first["excitation.speed"] == pytest.approx(700 * np.pi / 30)
    assert first["hardest impact"] == float(data["hardest impact"].values[0, 0, 0])
