"""The map of the conditions as buttons: a cell shows the row of its condition, and plays its sound.

The loops of all conditions (``signals.sound_loop``) are in the page as whole numbers of 16 bits, at one gain: the
highest peak of all is half of full scale, so what sounds louder is louder. Of 120 conditions they take less than 6 MB.
The script, ``report/conditions.js``, asks nothing of a server.
"""

from __future__ import annotations

from base64 import b64encode
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from gearrattle.report.live_figures import embedded
from gearrattle.report.plots.axis_names import labels_of, title_of
from gearrattle.report.plots.conditions_figure import axis_of, cell_words
from gearrattle.report.plots.palette import NO_VALUE, STATES
from gearrattle.report.tables import Table
from gearrattle.signals.sound_loop import RATE
from gearrattle.studies.dataset_layout import axes_in, rattling_from, words_of
from gearrattle.studies.output import VERDICT_SEVERITY
from gearrattle.studies.sound_output import SOUND_LOOP

if TYPE_CHECKING:
    import xarray as xr

_HERE = Path(__file__).parent
_WHOLE = 32767  # largest integer of 16 bits
_HEADROOM = 0.5  # of full scale: the highest peak
_PLAYED = (
    "Choose a condition to see its row and to hear it, in a loop. All are played at one gain: full scale is {full} Pa, "
    "so what sounds louder is louder."
)
_SEEN = "Choose a condition to see its row."


@dataclass(frozen=True)
class ConditionMap:
    """The part of the page with the map, made when the page is written: its sounds take megabytes.

    ``table`` has a row per condition, in the order of the grid.
    """

    data: xr.Dataset
    table: Table

    def __html__(self) -> Markup:
        """Return style, place and data of the map."""
        style = (_HERE / "conditions.css").read_text(encoding="utf-8")
        return (
            Markup(f'<style>\n{style}</style>\n<div id="conditions"></div>\n')
            + Markup('<script type="application/json" id="conditions-data">')
            + embedded(map_data(self.data, self.table))
            + Markup("</script>")
        )


def map_script() -> Markup:
    """Return the script of the map."""
    return Markup((_HERE / "conditions.js").read_text(encoding="utf-8"))


def map_data(data: xr.Dataset, table: Table) -> dict[str, Any]:
    """Return the data of the script: titles, the conditions of every cell, their rows, words, colours and sounds."""
    # conditions by load, the highest temperature on top
    load = axis_of(data, "load")
    rows = axis_of(data, "temperature")
    columns = axis_of(data, "speed")
    numbers = data["outcome"].copy(data=np.arange(data["outcome"].size).reshape(data["outcome"].shape))
    loads = labels_of(data, load) if load else [""]
    panels = []
    for i, label in enumerate(loads):
        one = numbers.isel({load: i}) if load else numbers
        cells = one.transpose(rows, columns).values[::-1]
        panels.append({"title": f"{title_of(data, load)} = {label}" if load else "", "cells": cells.tolist()})
    # words and colours
    words = words_of(data[VERDICT_SEVERITY])
    codes = data[VERDICT_SEVERITY].transpose(*axes_in(data)).values.ravel().tolist()
    sounds, full = sounds_in(data)
    return {
        "panels": panels,
        "row_title": title_of(data, rows),
        "row_titles": labels_of(data, rows)[::-1],
        "column_title": title_of(data, columns),
        "column_titles": labels_of(data, columns),
        "head": list(table.head),
        "rows": [list(row) for row in table.rows],
        "words": sorted(table.words),
        "cells": [text or "failed" for text in cell_words(data)],
        "rattles": [code >= rattling_from(data[VERDICT_SEVERITY]) for code in codes],
        "colours": [STATES[words[code]] if code >= 0 else NO_VALUE for code in codes],
        "rate": RATE,
        "sounds": sounds,
        "note": _PLAYED.format(full=f"{full:.3g}") if sounds else _SEEN,
    }


def sounds_in(data: xr.Dataset) -> tuple[list[str], float]:
    """Return the loop of every condition as text, empty for silence, and the pressure of full scale [Pa].

    No texts at all where no loops were kept, or all are silent.
    """
    if SOUND_LOOP not in data:
        return [], 0.0
    (sample,) = (dim for dim in data[SOUND_LOOP].dims if dim not in data["outcome"].dims)
    loops = data[SOUND_LOOP].transpose(*axes_in(data), sample).values.reshape(data["outcome"].size, -1)
    peak = float(np.nanmax(np.abs(loops), initial=0.0))
    if peak == 0.0:
        return [], 0.0
    scale = _HEADROOM * _WHOLE / peak
    texts = [
        b64encode(np.rint(scale * loop[np.isfinite(loop)]).astype("<i2").tobytes()).decode("ascii") for loop in loops
    ]
    return texts, peak / _HEADROOM
