"""The report: every result as an HTML page, a summary in JSON, and a file of numbers.

``save`` puts into a folder:

    report.html     one self-contained page, the answer first
    summary.json    the content of the page for other programs
    results.nc      every number, netCDF-4
    figures/        every figure as SVG, and the charts themselves, for ``figures``

either completely or not at all. ``result_kinds`` lists the kinds of results, ``saved`` writes them, ``notebook_view``
shows a result in a notebook. This file imports nothing, because a result on a terminal needs no figures or templates.
"""
