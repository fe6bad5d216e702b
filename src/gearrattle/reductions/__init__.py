"""Reductions of a system for a frequency band: a smaller system in a subspace.

The methods are interchangeable (``REDUCTIONS``); ``accuracy`` measures their errors. Only lumping results in bodies,
and so in a driveline; the other methods result in matrices. All methods keep the ends of clearances free, so that one
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
