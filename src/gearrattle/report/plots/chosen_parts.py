"""The choice of bodies and clearances that the figures of a large driveline show.

A report has panels for at most ``MOST`` of them, because a hundred panels would make a page of tens of megabytes. It
shows the worst clearances of the verdict. It shows the driven body, the bodies at these clearances, and then the bodies
with the largest acceleration. Captions state how many are left out and where their numbers are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from gearrattle.signals import parts_of

if TYPE_CHECKING:
    from gearrattle.model import Model
    from gearrattle.quantities.verdict import Verdict
    from gearrattle.results import Run

MOST = 12


class Judged(Protocol):
    """A motion with its verdict, as figures of one motion need it, such as Findings or a periodic motion."""

    @property
    def model(self) -> Model:
        """The driveline."""

    @property
    def motion(self) -> Run:
        """The motion."""

    @property
    def verdict(self) -> Verdict:
        """The verdict of the criteria on it."""


def chosen_clearances(findings: Judged) -> tuple[list[int], str]:
    """Return the clearances that are shown, in element order, and a sentence on the others (empty without others)."""
    names = findings.motion.trajectory.layout.clearance_names
    worst = [names.index(part.name) for part in findings.verdict.parts if part.name in names]
    return sorted(worst[:MOST]), _left_out("clearances", len(worst), "the worst of the verdict")


def ring_words(findings: Judged, what: str) -> str:
    """Return a sentence on what is shown of a bearing with clearance all around; empty without one."""
    layout = findings.motion.trajectory.layout
    shown = [int(layout.clearance[k]) for k in chosen_clearances(findings)[0] if layout.corners[k].size == 1]
    return f" Of a bearing with clearance all around: {what}." if any(layout.is_bearing[shown]) else ""


def chosen_bodies(findings: Judged) -> tuple[list[int], str]:
    """Return the bodies that are shown, in file order, and a sentence on the others (empty without others)."""
    trajectory = findings.motion.trajectory
    layout = trajectory.layout
    names = parts_of(layout).element_names
    elements = [names.index(part.name) for part in findings.verdict.parts if part.rattles]
    ends = [body for element in elements for body in layout.between[element].tolist() if body >= 0]
    loudest = np.argsort(-np.std(trajectory.acceleration, axis=0), kind="stable").tolist()
    order = list(dict.fromkeys([layout.reference, *ends, *loudest]))
    words = "the driven one, those at the parts that rattle worst, then those of the largest acceleration"
    return sorted(order[:MOST]), _left_out("bodies", len(order), words)


def _left_out(what: str, count: int, words: str) -> str:
    """Return a sentence on which bodies or clearances are shown, and where the others are."""
    if count <= MOST:
        return ""
    return f" Shown are {MOST} of {count} {what}: {words}. results.nc holds all of them (gr.open_run)."
