"""The map of a study of conditions: severity over temperature and speed, a panel per load, with words in the cells."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearrattle.report.plots.axis_names import cell_ticks, labels_of, title_of, words_of_axis
from gearrattle.report.plots.chart import Chart, Key, Label, Panel
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.palette import PAPER, STATES
from gearrattle.report.plots.study_maps import MOST_PANELS, NOTHING, cells_of, edge_between
from gearrattle.studies.dataset_layout import axes_in, rattling_from, words_of
from gearrattle.studies.output import VERDICT_SEVERITY
from gearrattle.studies.sound_output import SOUND_LEVEL
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

_ROW = 26
_MOST_WORDED = 8
"""Speeds up to which there is room for words in the cells."""


def axis_of(data: xr.Dataset, role: str) -> str:
    """Return the name of the axis of a role; empty for a load that does not vary."""
    return str(data.attrs.get(role, ""))


def conditions_map(data: xr.Dataset) -> Chart:
    """Draw the severity: speeds across, temperatures up, a panel per load."""
    rows = axis_of(data, "temperature")
    columns = axis_of(data, "speed")
    load = axis_of(data, "load")
    severity = data[VERDICT_SEVERITY].transpose(*axes_in(data))
    legend = (*(Key(word, STATES[word]) for word in words_of(severity)), NOTHING)
    across = labels_of(data, columns)
    up = labels_of(data, rows)
    loads = labels_of(data, load) if load else [""]
    panels = []
    # a panel per load
    for i, label in enumerate(loads[:MOST_PANELS]):
        one = data.isel({load: i}) if load else data
        codes = one[VERDICT_SEVERITY].transpose(rows, columns).values.astype(np.int64)
        panels.append(
            Panel(
                f"{title_of(data, load)} = {label}" if load else "severity",
                f"↑ {title_of(data, rows)}",
                title_of(data, columns),
                cells=cells_of(codes, legend),
                lines=edge_between(codes >= rattling_from(severity), codes >= 0),
                labels=_words(one, rows, columns) if len(across) <= _MOST_WORDED else (),
                x_range=(-0.5, len(across) - 0.5),
                y_range=(-0.5, len(up) - 0.5),
                x_ticks=cell_ticks(across, 12),
                y_ticks=cell_ticks(up, 12),
            )
        )
    # caption and legend
    drawn = {cells.name for panel in panels for cells in panel.cells}
    levels = ", and the sound level [dB]" if SOUND_LEVEL in data and len(across) <= _MOST_WORDED else ""
    left = len(loads) - MOST_PANELS
    more = f" Not drawn: {counted(left, 'load')} more." if left > 0 else ""
    caption = (
        f"Severity{levels} of every condition, over {words_of_axis(data, columns)} (horizontal) and "
        f"{words_of_axis(data, rows)} (vertical); the thick line separates what rattles from what touches or is "
        f"quiet.{more}"
    )
    return Chart(
        "map",
        "Map of the conditions",
        caption,
        tuple(panels),
        panel_height=_ROW * len(up) + 14,
        share_x=False,
        legend=tuple(key for key in legend if key is not NOTHING or key.name in drawn),
    )


def _words(data: xr.Dataset, rows: str, columns: str) -> tuple[Label, ...]:
    """Return the word, and the level, of every cell of a panel."""
    shape = (data.sizes[rows], data.sizes[columns])
    words = np.array(cell_words(data.transpose(rows, columns, ...)), dtype=object).reshape(shape)
    return tuple(Label(float(j), float(i), text, PAPER, "at") for (i, j), text in np.ndenumerate(words) if text)


def cell_words(data: xr.Dataset) -> list[str]:
    """Return severity and sound level of every condition, in the order of the grid; empty where one failed."""
    grid = axes_in(data)
    codes = data[VERDICT_SEVERITY].transpose(*grid).values
    words = words_of(data[VERDICT_SEVERITY])
    levels = data[SOUND_LEVEL].transpose(*grid).values if SOUND_LEVEL in data else np.full(codes.shape, np.nan)
    return [
        f"{words[code]} {numeral(float(level), 3)}".removesuffix(" –") if code >= 0 else ""
        for code, level in zip(codes.ravel().tolist(), levels.ravel().tolist(), strict=True)
    ]
