"""Charts for print: matplotlib figures of a stated width, and files a journal takes.

    style.py    width, letters, strokes; our settings of matplotlib, in a context of their own
    looks.py    dashes, markers and hatching by colour
    marks.py    what a panel holds
    axes.py     limits, labels with units, ticks
    settle.py   words that would collide give way
    layout.py   the figure
    files.py    PDF, EPS, SVG, PNG, TIFF, the same bytes every time

Takes Charts; gives matplotlib Figures and files.
"""

from __future__ import annotations

from gearrattle.report.plots.typeset.print_files import FORMATS, save_figure, saved
from gearrattle.report.plots.typeset.print_layout import matplotlib_figure
from gearrattle.report.plots.typeset.style import Style

__all__ = ["FORMATS", "Style", "matplotlib_figure", "save_figure", "saved"]
