"""Reductions of a system for a frequency band: a smaller system in a subspace.

Interchangeable parts (``REDUCTIONS``); ``accuracy`` measures what any of them costs. Only lumping gives
bodies again, and with them a driveline; the others give matrices. All keep the ends of clearances free, so that one
basis serves every contact state.
"""

from gearrattle.reductions import craig_bampton, guyan, lumping, modal
from gearrattle.reductions.accuracy import Accuracy, accuracy
from gearrattle.reductions.reduction_request import Reducer, Request, Subspace

REDUCTIONS: dict[str, Reducer] = {
    "lumping": lumping.subspace,
    "guyan": guyan.subspace,
    "craig-bampton": craig_bampton.subspace,
    "modal": modal.subspace,
}
"""Every reduction by name."""

__all__ = ["REDUCTIONS", "Accuracy", "Reducer", "Request", "Subspace", "accuracy"]
