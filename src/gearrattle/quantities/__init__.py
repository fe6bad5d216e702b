"""Quantities of a motion: criteria, which judge it, and metrics, which measure it.

``quantity_table.QUANTITIES`` is the one table; ``CRITERIA`` and ``METRICS`` are chosen from it. A criterion and a
metric of one kind (contact, transmissibility) share a file. A new quantity is its file, one line in the table, and its
test. Transmissibility and peak-to-peak values of criteria are of the last eight cycles; all else is of the steady part.
"""

from gearrattle.quantities.metric_sources import recording_of
from gearrattle.quantities.quantity_table import CRITERIA, METRICS

__all__ = ["CRITERIA", "METRICS", "recording_of"]
