"""Figures: Charts of every result, drawn interactively, as static SVG and for print.

``run_figures`` lists the figures of a run, which are functions from Findings to a Chart. ``svg_charts`` draws a Chart
as SVG, ``interactive`` prepares it for a browser, and ``typeset`` draws it for print. This file imports nothing,
because a table on a terminal needs no figure.
"""
