"""The last step of the layout for print: no two words overlap, and none lies outside the paper.

The size of a word is known only after it is set in a font. So the figure is laid out, every tick and title is measured,
and overlaps are removed: an axis of numbers gets fewer ticks; words in a row are broken or turned; panels whose rows
have names become higher; long titles are broken; words inside a panel are moved to the other side of their point, or
left out if both sides are occupied.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from gearrattle.report.plots.typeset.print_axes import broken, spread

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from matplotlib.text import Annotation, Text
    from matplotlib.transforms import Bbox

_ROOM = 4.0
"""Least distance between two words of an axis [pt]."""
_ROUNDS = 8
_NEAR = 0.01
_HIGHER = 1.2


def settle_axes(figure: Figure, titles: Mapping[Axes, Text], height: float) -> None:
    """Remove ticks and break titles until no words overlap and all are on the paper; set the height of panels [in].

    The figure must have its layout engine.
    """
    for _ in range(_ROUNDS):
        figure.draw_without_rendering()
        changed = _grown(figure, next(iter(titles)), height)
        crowded = [axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis) if _crowded(axis, figure)]
        for axis in crowded:
            _give_way(axis)
        height *= _HIGHER if any(_name(axis) == "y" and _names_rows(axis) for axis in crowded) else 1.0
        changed |= bool(crowded)
        for axes, title in titles.items():
            left, right = _column(figure, axes, titles)
            changed |= _within(title, left, right) | _within(axes.xaxis.label, left, right)
            changed |= _shorter(axes.yaxis.label, 1.05 * axes.get_window_extent().height)
        if not changed:
            return
    figure.draw_without_rendering()


def _grown(figure: Figure, axes: Axes, height: float) -> bool:
    """Give the panels their height, by adding the height of titles, labels and legend to the figure."""
    spec = axes.get_subplotspec()
    rows = 1 if spec is None else spec.get_gridspec().nrows
    missing = height - float(axes.get_window_extent().height) / figure.dpi
    figure.set_figheight(max(height, figure.get_figheight() + rows * missing))
    return abs(missing) > _NEAR * height


def _column(figure: Figure, axes: Axes, panels: Collection[Axes]) -> tuple[float, float]:
    """Return the left and right limit for the words of a panel: the next panels, or the edge of the paper [px]."""
    own = axes.get_window_extent()
    others = [other.get_window_extent() for other in panels if other is not axes]
    level = [box for box in others if box.y0 < own.y1 and box.y1 > own.y0]
    away = 3.0 * figure.dpi / 72.0
    left = max((box.x1 for box in level if box.x1 <= own.x0), default=0.0)
    right = figure.bbox.x1 if not any(box.x0 >= own.x1 for box in level) else own.x1
    scales = [other.get_window_extent().x0 for other in figure.axes if other not in panels]
    right = min([right, *(at for at in scales if at > own.x1)])
    return left + away, right - away if right > own.x1 else right


def _within(words: Text, left: float, right: float) -> bool:
    """Move a title, or break it into lines, if it exceeds the limits."""
    text = words.get_text()
    if not text:
        return False
    box = words.get_window_extent()
    if box.x0 >= left and box.x1 <= right:
        return False
    room = right - (box.x0 if words.get_horizontalalignment() == "left" else left)
    if box.width > room:
        share = room / box.width
        lines = broken(_joined(text), max(8, int(0.95 * share * max(map(len, text.split("\n"))))))
        if lines != text:
            words.set_text(lines)
            return True
    if words.get_horizontalalignment() == "center":  # an x axis' title, longer than its axis: ends where that ends
        side = "right" if box.x1 > right else "left"
        words.set(horizontalalignment=side, x=1.0 if side == "right" else 0.0)
        return True
    return False


def _shorter(words: Text, most: float) -> bool:
    """Break a vertical title into lines if it is longer than its axis."""
    text = words.get_text()
    length = words.get_window_extent().height
    if not text or length <= most:
        return False
    longest = max(map(len, text.split("\n")))
    lines = broken(_joined(text), max(8, int(0.95 * most / length * longest)))
    words.set_text(lines)
    return lines != text


def settle_words(figure: Figure, words: dict[Axes, list[Annotation]]) -> None:
    """Move or leave out words inside panels that overlap others or leave their panel, after the layout is done."""
    for axes, written in words.items():
        inside = axes.get_window_extent()
        placed: list[Bbox] = []
        for word in written:
            if not any(_fits(word, inside, placed, figure) for _ in _sides(word)):
                word.set_visible(False)


def shown_words(axis: Axis) -> list[Text]:
    """Return the words of an axis that are drawn: within its limits, and not empty."""
    low, high = sorted(axis.get_view_interval())
    below = 1e-9 * (high - low)
    above = 1e-9 * (high - low)
    if axis.get_scale() == "log":
        below = 1e-9 * low
        above = 1e-9 * high
    return [
        tick.label1
        for tick in axis.get_major_ticks()
        if tick.label1.get_visible() and tick.label1.get_text() and low - below <= tick.get_loc() <= high + above
    ]


def _name(axis: Axis) -> str:
    return str(getattr(axis, "axis_name", ""))


def _crowded(axis: Axis, figure: Figure) -> bool:
    boxes = [word.get_window_extent() for word in shown_words(axis)]
    least = _ROOM * figure.dpi / 72.0
    if _name(axis) == "x":
        boxes.sort(key=lambda box: box.x0)
        return any(second.x0 - first.x1 < least for first, second in pairwise(boxes))
    boxes.sort(key=lambda box: box.y0)
    return any(second.y0 - first.y1 < 0.0 for first, second in pairwise(boxes))


def _give_way(axis: Axis) -> None:
    """Remove overlaps of the ticks of an axis: words are broken or turned first, then every other tick is removed."""
    from matplotlib import ticker

    # an axis of numbers takes fewer ticks
    locator: Any = axis.get_major_locator()
    if not isinstance(locator, ticker.FixedLocator):
        spread(axis, max(2, len(shown_words(axis)) - 2))
        return
    if _name(axis) == "y" and _names_rows(axis):
        return
    # prescribed words are broken, then turned
    formatter: Any = axis.get_major_formatter()
    fixed: Any = locator
    places = list(fixed.locs)
    words = list(formatter.seq)
    if _name(axis) == "x" and not _are_numbers(words):
        longest = max(len(part) for word in words for part in (*broken(word, 1).split("\n"), "letter"))
        narrow = [broken(_joined(word), longest) for word in words]
        if narrow != words and not _is_vertical(axis):
            axis.set_major_formatter(ticker.FixedFormatter(narrow))
            return
        if not _is_vertical(axis):
            axis.set_major_formatter(ticker.FixedFormatter([_joined(word) for word in words]))
            axis.set_tick_params(rotation=90.0)
            return
    # otherwise every other word is left out
    axis.set_major_locator(ticker.FixedLocator(places[::2]))
    axis.set_major_formatter(ticker.FixedFormatter(words[::2]))


def _joined(text: str) -> str:
    """Return words in one line again."""
    return re.sub(r"(?<=[._])\n", "", text).replace("\n", " ")


def _names_rows(axis: Axis) -> bool:
    """Whether an axis has the names of rows, none of which may be left out."""
    words = [word.get_text() for word in shown_words(axis)]
    return bool(words) and not any(_are_numbers([word]) for word in words)


def _is_vertical(axis: Axis) -> bool:
    return bool(axis.get_tick_params().get("labelrotation", 0.0) == 90.0)


def _are_numbers(words: list[str]) -> bool:
    return all(not word or word[0] in "0123456789−-–≤≥∞." for word in words)


def _sides(word: Annotation) -> Any:
    """Yield positions of a word: first on its own side of the point, then on the other side."""
    yield word
    x, y = word.get_position()
    word.set_position((-x, y))
    word.set(horizontalalignment={"left": "right", "right": "left"}.get(word.get_horizontalalignment(), "center"))
    yield word


def _fits(word: Annotation, inside: Bbox, placed: list[Bbox], figure: Figure) -> bool:
    """Keep the current position of a word if it is free; return whether it is."""
    box = word.get_window_extent().padded(-0.3 * figure.dpi / 72.0)
    within = inside.padded(1.0 * figure.dpi / 72.0)
    if box.x0 < within.x0 or box.x1 > within.x1 or box.y0 < within.y0 or box.y1 > within.y1:
        return False
    if any(box.overlaps(other) for other in placed):
        return False
    placed.append(box)
    return True
