"""Comparison of two motions of one driveline: one by any algorithm, and a reference, usually the exact one.

Inside the reference's predictability horizon the error itself can be measured (``pointwise``) and crossings can be
matched one by one (``crossing_comparison``). Beyond it all digits are lost: only statistics (``motion_statistics``) can
be compared with those of exact motions begun nearby (``nearby_motions``, ``statistics_comparison``). Transmissibilities
and coherences are the paper's own indices, the latter with what chance gives.

The package knows no solver.
"""

from gearrattle.comparison.coherence_comparison import compare_coherence
from gearrattle.comparison.crossing_comparison import EventComparison, compare_crossings, compare_impacts
from gearrattle.comparison.motion_statistics import Portrait, portrait
from gearrattle.comparison.pointwise import PointwiseError, error_history, pointwise
from gearrattle.comparison.statistics_comparison import Item, StatisticalComparison, compare_statistics
from gearrattle.comparison.transmissibility_comparison import TransmissibilityComparison, compare_transmissibility

__all__ = [
    "EventComparison",
    "Item",
    "PointwiseError",
    "Portrait",
    "StatisticalComparison",
    "TransmissibilityComparison",
    "compare_coherence",
    "compare_crossings",
    "compare_impacts",
    "compare_statistics",
    "compare_transmissibility",
    "error_history",
    "pointwise",
    "portrait",
]
