"""Charts for print: matplotlib figures of a stated width, and files that journals accept.

    style.py              width, fonts, line widths; settings of matplotlib in their own context
    styles_by_colour.py   dashes, markers and hatching by colour
    marks.py              the content of a panel
    row_names.py          names of rows next to a panel
    print_axes.py         limits, labels with units, ticks
    overlap_removal.py    words that overlap are moved, broken or removed
    print_layout.py       the figure
    print_files.py        PDF, EPS, SVG, PNG, TIFF, the same bytes every time

Input are Charts, output are matplotlib Figures and files.
"""

from __future__ import annotations

from gearrattle.report.plots.typeset.print_files import FORMATS, save_figure, saved
from gearrattle.report.plots.typeset.print_layout import matplotlib_figure
from gearrattle.report.plots.typeset.style import Style

__all__ = ["FORMATS", "Style", "matplotlib_figure", "save_figure", "saved"]
