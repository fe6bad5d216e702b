"""The report: every result as a page for people, a file for machines, and a file of numbers.

``save`` puts into a folder:

    report.html     one self-contained page, the answer first
    summary.json    the same for machines
    results.nc      every number, netCDF-4
    figures/        every figure as SVG, and the charts themselves, for ``figures``

all of it or nothing; what kinds of results there are stands in ``kinds``. ``notebook_view`` shows one in a notebook.
"""

from gearrattle.report.notebook import notebook_view
from gearrattle.report.saved import fill, save

__all__ = ["fill", "notebook_view", "save"]
