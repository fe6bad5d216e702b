"""Auxiliaries of friction and clipped contact damping: sliders of couplings, limiters of contacts.

The hysteresis of a stage is the full height of its loop, 2 H, with the hysteresis of the stages before included. The
increase over the stage before is a separate slider, which is engaged while the deflection is in the stage or beyond it.
The smaller hysteresis of the two first stages is one slider that is always engaged; its spring is the one of the side
with less friction, and of the drive side if both have the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

from gearrattle.engine.system.auxiliary import Auxiliary, limiters, slider
from gearrattle.engine.system.law import PiecewiseLaw
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Element, Model, Piece
from gearrattle.trajectory import Trajectory

WORDS = ("sticks", "slips forward", "slips backward", "let go", "idle", "limits", "all pairs", "a pair less")
"""States of auxiliaries in words: four for sliders, two for limiters, two for meshes with alternating stiffness."""


class Named(NamedTuple):
    """An auxiliary element with its name and the state in words of every piece."""

    auxiliary: Auxiliary
    name: str
    words: tuple[str, ...]


def switches(system: PiecewiseSystem, motion: Trajectory) -> Iterator[tuple[float, str, str]]:
    """Yield time [s], name and new state in words for every switch of an auxiliary.

    A slider that is engaged or released because its element enters another piece does not count: that is a crossing.
    """
    auxiliaries = motion.auxiliaries
    layout = motion.layout
    if auxiliaries is None:
        return
    pieces = [0] * (len(system.laws) + len(system.auxiliaries))
    first = len(layout.clearance)
    count = len(system.laws)
    for position, piece in zip(
        system.places, (*(motion.initial_region - layout.region_of_first_piece), *auxiliaries.initial), strict=True
    ):
        pieces[position] = int(piece)
    now = tuple(pieces)
    log = auxiliaries.passages
    for time, watch, upward in zip(log.time.tolist(), log.watch.tolist(), log.upward.tolist(), strict=True):
        now = system.beyond(now, watch, upward)
        c = watch - first
        if 0 <= c < len(layout.auxiliary_names):
            yield time, layout.auxiliary_names[c], layout.auxiliary_words[c][now[count + c]]


def is_parted(element: Element) -> bool:
    """Whether the first stages of both sides differ in their friction."""
    return element.drive[0].hysteresis != element.coast[0].hysteresis


def left_out(model: Model) -> tuple[str, ...]:
    """Notes on the friction, damping limits and alternation that linear results neglect; empty without auxiliaries."""
    rubbing = [element.name for element in model.elements if element.rubs]
    clipped = [element.name for element in model.elements if element.contact_damping == "clipped"]
    alternating = [element.name for element in model.elements if element.alternation is not None]
    notes = []
    if alternating:
        notes.append(
            f"the stiffness of {', '.join(alternating)} counts as that with all pairs in contact in linear results."
        )
    if rubbing:
        notes.append(f"dry friction of {', '.join(rubbing)} counts as let go in the equilibrium and in linear results.")
    if clipped:
        notes.append(f"contact damping of {', '.join(clipped)} counts as not clipped in linear results.")
    return tuple(notes)


def auxiliaries_of(index: int, element: Element, law: PiecewiseLaw, period: float) -> Iterator[Named]:
    """Yield the auxiliaries of one element; ``period`` [s] converts rates to deflections.

    ModelError for hysteresis that decreases from stage to stage at the model's speed.
    """
    if element.contact_damping == "clipped":
        for limiter, way in zip(limiters(index, law), ("push", "pull"), strict=True):
            words = tuple("limits" if p > 0 and p % 2 == 0 else "idle" for p in range(limiter.pieces))
            yield Named(limiter, f"{element.name}.{way}", words)
    for name, reach, stick, labels in _sliders(element, law):
        made = slider(index, law, (stick, 0.5 * reach), labels, period)
        yield Named(made, f"{element.name}.{name}", WORDS[:4])


def _sliders(element: Element, law: PiecewiseLaw) -> Iterator[tuple[str, float, float, range]]:
    """Yield for every slider its name, loop height, spring stiffness, and the labels of pieces where it is engaged."""
    last = law.first_label + law.pieces
    drive = element.drive
    coast = element.coast
    inner = min((drive[0], coast[0]), key=lambda piece: piece.hysteresis)
    if inner.hysteresis > 0.0:
        yield "0", inner.hysteresis, inner.stick_stiffness, range(law.first_label, last)
    parted = law.corners.size > 0 and 0.0 in law.corners
    before = Piece(0.0, 0.0, None, inner.hysteresis)
    for side, stages in (("drive", drive), ("coast", coast)):
        for i, (sooner, piece) in enumerate(pairwise((before, *stages))):
            more = piece.hysteresis - sooner.hysteresis
            if more < 0.0:
                fall = f"{sooner.hysteresis:.6g} N m, then {piece.hysteresis:.6g}"
                rule = f"hysteresis must not fall from stage to stage: {fall}"
                raise ModelError(Problem(element.path, f"{side} stage {i}", rule))
            first = i if side == "drive" else -i - parted
            labels = range(first, last) if side == "drive" else range(law.first_label, first + 1)
            if more > 0.0:
                yield f"{side}.{i}", more, piece.stick_stiffness, labels
