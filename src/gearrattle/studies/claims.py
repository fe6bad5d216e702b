"""Whether a place may take a study: asked before anything is computed, and again when the study begins there.

Takes a Place; raises.
"""

from __future__ import annotations

from gearrattle.errors import ModelError, Problem
from gearrattle.studies.places import Place

ABOUT = "study.json"
"""File of every study that says what it is of."""


def check_place(place: Place, *, resume: bool) -> None:
    """Refuse a place that holds anything but what is resumed.

    Args:
        place: a folder or what lies behind an address; it need not exist.
        resume: whether it may hold a study already.

    Raises:
        ModelError: it holds a study and ``resume`` is not set, or something else.
        NotADirectoryError: it is a file, or lies below one.
    """
    if place.local is not None:
        anchor = place.local.absolute()
        while not anchor.exists() and anchor != anchor.parent:
            anchor = anchor.parent
        if not anchor.is_dir():
            raise NotADirectoryError(20, "a file stands where a folder is needed", str(anchor))
    if place.exists(ABOUT):
        if not resume:
            raise holds_one(place)
    elif not place.is_empty():
        raise ModelError(Problem(place.address, "", "is not empty, and no study", "give another folder"))


def holds_one(place: Place) -> ModelError:
    """Return what to say of a place that holds a study already."""
    return ModelError(Problem(place.address, "", "holds a study already", "resume it, or give another folder"))
