"""Names of rows, at the left of their panel.

On the page, charts of horizontal bars have the names of rows inside the panel, whose x axis is extended to the left for
them (``Label`` at the left limit, no y ticks). In print, letters are larger relative to a panel, so that names would
overlap bars. Here the names become words of the y axis, words at the right end are moved beyond the axis, and the x
axis ends at the ends of the bars.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gearrattle.report.plots.chart import Label, Panel

_ROOM = 0.02


@dataclass(frozen=True)
class Rows:
    """A panel, and words beyond its x axis, by their heights.

    A ``wordy`` y axis has words instead of numbers, so that a unit is not of that axis.
    """

    panel: Panel
    right: tuple[Label, ...] = ()
    wordy: bool = False


def rows_of(panel: Panel) -> Rows:
    """Take the names of rows out of a panel; another one stays as it is."""
    # panels without names of rows at the left limit stay as they are
    if panel.x_range is None or panel.y_range is None:
        return Rows(panel, wordy=_words(panel))
    low, high = panel.x_range
    below = all(not panel.y_range[0] <= at <= panel.y_range[1] or not word for at, word in panel.y_ticks)
    names = [label for label in panel.labels if label.x == low]
    if not panel.y_ticks or not below or not names:
        return Rows(panel, wordy=_words(panel))
    # words at the right end, beyond all bars
    others = [label for label in panel.labels if label.x != low]
    edge = max((float(np.nanmax(c.right, initial=-np.inf)) for c in panel.cells), default=-np.inf)
    right = [label for label in others if label.x > edge]
    # limits of the x axis: from where bars, lines, rules and ticks begin to the words at the right end
    ends = [float(np.nanmin(values, initial=np.inf)) for c in panel.cells for values in (c.left, c.right)]
    ends += [float(np.nanmin(line.x, initial=np.inf)) for line in panel.lines]
    ends += [rule.at for rule in panel.rules if rule.along == "x"] + [at for at, _ in panel.x_ticks]
    last = min((label.x for label in right), default=high)
    if panel.x_log:
        first = min(ends) * (last / min(ends)) ** -_ROOM
    else:
        first = min([last - _ROOM * (last - low), *ends])
        first -= _ROOM * (last - first)
    # names become words of the y axis
    trimmed = replace(
        panel,
        x_range=(first, last),
        y_ticks=tuple((label.y, label.words) for label in names),
        labels=tuple(label for label in others if label not in right),
    )
    return Rows(trimmed, tuple(label for label in right if label.words), wordy=True)


def _words(panel: Panel) -> bool:
    """Whether the labels of a y axis are words."""
    return bool(panel.y_ticks) and not any(word and word[0] in "0123456789−-≤≥" for _, word in panel.y_ticks)
