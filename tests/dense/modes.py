"""What every part of a dressed driveline is doing, and what it may do next: the check's own rules, said in words.

A slider sticks while the stretch of its spring is below its reach, then slips until the deflection turns back; it is
let go, unstretched, where it is not engaged. The damping of a contact that begins is held down to the spring's force
(there is none yet), then acts in full, then is held up to it when the contact lets go.

Those that may change by themselves are numbered as the program's log numbers them: elements with corners, then two
limiters (pushing, pulling) for every clipped element, the sliders, the alternating elements.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tests.dense.dressed import Dressed

STICKS = "sticks"
FORWARD = "slips forward"
BACKWARD = "slips backward"
OFF = "off"
_OF_SLIDERS = (STICKS, FORWARD, BACKWARD, OFF)


class Impossible(ValueError):
    """A log asks for what cannot be."""


@dataclass(frozen=True)
class Modes:
    """Piece of every element; word of every slider; limits of clipped elements (push, pull); who lacks."""

    pieces: tuple[int, ...]
    sliders: tuple[str, ...]
    limits: tuple[tuple[bool, bool], ...]
    lacking: tuple[bool, ...]


def contact(case: Dressed, element: int, piece: int) -> int:
    """The side, 1 or -1, on which an element is in contact in a piece; 0 if it is not, or without damping."""
    law = case.laws[element]
    if law.stiffness[piece] == 0.0 or law.damping[piece] == 0.0:
        return 0
    return 1 if piece == law.corners.size else -1


def engaged(case: Dressed, pieces: tuple[int, ...]) -> list[bool]:
    """Which sliders are engaged."""
    return [pieces[slider.element] in slider.engaged for slider in case.sliders]


def stretch(case: Dressed, modes: Modes, i: int) -> float | None:
    """The stretch of a slider's spring where its mode says it."""
    reach = case.sliders[i].reach
    return {STICKS: None, FORWARD: reach, BACKWARD: -reach, OFF: 0.0}[modes.sliders[i]]


def at_start(case: Dressed, pieces: tuple[int, ...], delta: np.ndarray, rate: np.ndarray) -> Modes:
    """The modes in which a run begins, springs unstretched; (m,) deflections and their rates."""
    limits = []
    for k in case.clipped:
        law = case.laws[k]
        piece = pieces[k]
        side = contact(case, k, pieces[k])
        elastic = side * (law.stiffness[piece] * delta[k] + law.offset[piece])
        damper = side * law.damping[piece] * rate[k]
        limits.append((bool(side and damper > elastic), bool(side and damper < -elastic)))
    sliders = tuple(STICKS if on else OFF for on in engaged(case, pieces))
    return Modes(pieces, sliders, tuple(limits), tuple(pair.begins_lacking for pair in case.pairs))


def after(case: Dressed, modes: Modes, watch: int, upward: int) -> tuple[Modes, dict[int, float]]:
    """The modes after one of those watched has left its own, and the stretches that are new (or known again).

    Raises
    ------
    Impossible
        there is nothing beyond.
    """
    count = len(case.clearances)
    if watch < count:
        return _moved(case, modes, case.clearances[watch], upward)
    watch -= count
    if watch < 2 * len(case.clipped):
        i, which = divmod(watch, 2)
        if not contact(case, case.clipped[i], modes.pieces[case.clipped[i]]):
            raise Impossible("a limiter without contact")
        limits = list(modes.limits)
        pair = list(limits[i])
        if bool(upward) != pair[which]:  # limiting ends upward, begins downward
            raise Impossible(f"a limiter that {'limits' if pair[which] else 'idles'} leaves the wrong way")
        pair[which] = not pair[which]
        limits[i] = (pair[0], pair[1])
        if pair[0] and pair[1]:
            raise Impossible("both limits at once")
        return replace(modes, limits=tuple(limits)), {}
    watch -= 2 * len(case.clipped)
    if watch < len(case.sliders):
        return _slid(case, modes, watch, upward)
    lacking = list(modes.lacking)
    lacking[watch - len(case.sliders)] ^= True
    return replace(modes, lacking=tuple(lacking)), {}


def _slid(case: Dressed, modes: Modes, i: int, upward: int) -> tuple[Modes, dict[int, float]]:
    """A slider slips, or sticks again."""
    way = {(STICKS, 1): FORWARD, (STICKS, 0): BACKWARD, (FORWARD, 0): STICKS, (BACKWARD, 1): STICKS}
    now = modes.sliders[i]
    if (now, upward) not in way:
        raise Impossible(f"a slider that is {now} goes {('down', 'up')[upward]}")
    there = replace(modes, sliders=(*modes.sliders[:i], way[now, upward], *modes.sliders[i + 1 :]))
    known = stretch(case, there, i)
    return there, {} if known is None else {i: known}


def _moved(case: Dressed, modes: Modes, element: int, upward: int) -> tuple[Modes, dict[int, float]]:
    """An element enters the next piece of its law; what stands beside it follows."""
    piece = modes.pieces[element] + (1 if upward else -1)
    if not 0 <= piece <= case.laws[element].corners.size:
        raise Impossible(f"element {element} has no piece {piece}")
    pieces = (*modes.pieces[:element], piece, *modes.pieces[element + 1 :])
    sliders, new = list(modes.sliders), {}
    for i, (was, now) in enumerate(zip(engaged(case, modes.pieces), engaged(case, pieces), strict=True)):
        if was != now:
            sliders[i], new[i] = (STICKS if now else OFF), 0.0
    begins = (bool(contact(case, element, piece)), False)
    limits = tuple(begins if k == element else old for k, old in zip(case.clipped, modes.limits, strict=True))
    return replace(modes, pieces=pieces, sliders=tuple(sliders), limits=limits), new


def read(case: Dressed, clearances: np.ndarray, others: np.ndarray) -> Modes:
    """The modes that the program's own numbers of pieces mean: (K,) of clearances, (C,) of auxiliaries."""
    pieces = [0] * len(case.laws)
    for k, piece in zip(case.clearances, clearances, strict=True):
        pieces[k] = int(piece)
    first, c = 2 * len(case.clipped), [int(p) for p in others]
    limits = tuple((_limits(c[2 * i]), _limits(c[2 * i + 1])) for i in range(len(case.clipped)))
    sliders = tuple(_OF_SLIDERS[p] for p in c[first : first + len(case.sliders)])
    lacking = []
    for pair, p in zip(case.pairs, c[first + len(case.sliders) :], strict=True):
        changed, piece = divmod(p, case.laws[pair.element].stiffness.size)
        if piece != pieces[pair.element]:
            raise Impossible(f"the alternating element {pair.element} is in two pieces at once")
        lacking.append(pair.begins_lacking != bool(changed))
    return Modes(tuple(pieces), sliders, limits, tuple(lacking))


def _limits(piece: int) -> bool:
    return piece > 0 and piece % 2 == 0
