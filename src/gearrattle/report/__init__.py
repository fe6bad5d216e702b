"""The report: every result as a page for people, a file for machines, and a file of numbers.

``save`` puts into a folder:

    report.html     one self-contained page, the answer first
    summary.json    the same for machines
    results.nc      every number, netCDF-4
    figures/        every figure as SVG, and the charts themselves, for ``figures``

all of it or nothing. What kinds of results there are stands in ``kinds``, ``saved`` writes them, ``notebook_view``
shows one in a notebook. Nothing is imported here: a result on a terminal needs neither figures nor templates.
"""
