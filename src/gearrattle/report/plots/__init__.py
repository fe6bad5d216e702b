"""Figures: Charts of every result, drawn interactively, as static SVG and for print.

``run_figures`` has those of a run, each one a function from Findings to a Chart; ``static`` and ``interactive`` draw a
Chart, ``typeset`` does for print. Nothing is imported here: a table on a terminal needs no figure.
"""
