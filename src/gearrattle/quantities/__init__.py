"""Quantities of a motion: criteria, on which the verdict rests, and metrics.

All quantities are in the table ``quantity_table.QUANTITIES``; ``CRITERIA`` and ``METRICS`` are parts of it. A criterion
and a metric for the same effect (contact, transmissibility) share a file. A new quantity needs a file, one line in the
table, and a test. The criteria transmissibility and peak-to-peak use the last eight cycles; all other quantities use
the steady part.
"""

from gearrattle.quantities.metric_sources import recording_of
from gearrattle.quantities.quantity_table import CRITERIA, METRICS

__all__ = ["CRITERIA", "METRICS", "recording_of"]
