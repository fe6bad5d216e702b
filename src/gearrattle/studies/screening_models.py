"""Linear models of a driveline for a screening: friction stuck or released, staged springs in every stage reached.

A linear model holds every element in one stage. One model alone, in the stages at rest and with dry friction released,
is one forecast among several. Where friction sticks, its spring adds to the stiffness of the stage. Where a staged
clutch swings beyond its stage, the stiffness changes, and with it the order that is near a resonance. Where a loose
gear leaves its flank, its driver carries less. (A driveline does not stay in a gap, so gaps are no stages here.) The
real motion passes from one model to another and is none of them. A gear that stays on its flank in all models is
forecast quiet; one that lifts off in all models is forecast to lift off; between these the forecast is undecided.

    lift ratio = largest swing of the mesh towards its gap / its static depth of contact;    above 1 it lifts off
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from math import prod
from typing import NamedTuple

import numpy as np

from gearrattle.analysis.linear.response import steady_deflections, steady_extremes
from gearrattle.engine.system.auxiliary import STICK
from gearrattle.engine.system.equilibrium import PositionAtRest
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.trajectory import Array

_MOST_STAGES = 16
"""Largest number of combinations of stages; beyond it one element at a time leaves the stage it rests in."""
Reach = tuple[Array, Array]


class Linear(NamedTuple):
    """Slope and damping of every element, (m,) each."""

    stiffness: Array
    damping: Array


def at_rest(system: PiecewiseSystem, rest: PositionAtRest) -> Linear:
    """Return the model in the stages at rest, with friction released."""
    return _in_pieces(system, rest.pieces, sticks=False)


def reach_of(system: PiecewiseSystem, linear: Linear) -> Reach:
    """Return (m,) the lower and (m,) the upper bound of every element's steady swing about its rest."""
    return steady_extremes(system, steady_deflections(system, linear.stiffness, linear.damping))


def lift_range(system: PiecewiseSystem, rest: PositionAtRest, meshes: Sequence[int]) -> tuple[Array, Array]:
    """Return (gears,) the least and the largest lift ratio over all linear models."""
    models = list(_models(system, rest, meshes))
    ratios = np.array([lift_ratios(system, rest, reach_of(system, linear), meshes) for linear in models])
    low = ratios.min(axis=0)
    high = ratios.max(axis=0)
    # a gear that may lift off no longer loads its driver: judge the others also without it
    lifted = np.zeros(len(meshes), dtype=np.bool_)
    while np.any((high > 1.0) & ~lifted) and not np.all(high > 1.0):
        lifted = high > 1.0
        held = [mesh for mesh, is_lifted in zip(meshes, lifted, strict=True) if not is_lifted]
        for linear in models:
            without = Linear(linear.stiffness.copy(), linear.damping.copy())
            for column in without:
                column[[mesh for mesh in meshes if mesh not in held]] = 0.0
            ratio = lift_ratios(system, rest, reach_of(system, without), held)
            low[~lifted] = np.minimum(low[~lifted], ratio)
            high[~lifted] = np.maximum(high[~lifted], ratio)
    return low, high


def lift_ratios(system: PiecewiseSystem, rest: PositionAtRest, reach: Reach, meshes: Sequence[int]) -> Array:
    """Return how far meshes swing towards their gaps, over their static depth of contact.

    Infinite if a mesh rests inside its gap.
    """
    return np.array([_lift(system, rest, reach, mesh) for mesh in meshes])


def _lift(system: PiecewiseSystem, rest: PositionAtRest, reach: Reach, mesh: int) -> float:
    """The lift ratio of one mesh."""
    law = system.laws[mesh]
    piece = rest.pieces[mesh]
    at = float(rest.deflection[mesh])
    if not law.corners.size:
        return 0.0
    if law.stiffness[piece] == 0.0:
        return float("inf")
    if piece == law.pieces - 1:
        return float(-reach[0][mesh] / (at - law.corners[-1]))
    return float(reach[1][mesh] / (law.corners[piece] - at))


def is_inside(system: PiecewiseSystem, rest: PositionAtRest, reach: Reach) -> bool:
    """Whether every element stays in the piece it rests in."""
    return all(_reached(system, rest, [reach], k) == [piece] for k, piece in enumerate(rest.pieces))


def _reached(system: PiecewiseSystem, rest: PositionAtRest, reaches: Sequence[Reach], element: int) -> list[int]:
    """Return the pieces that an element visits in this swing; a piece that it only touches counts."""
    law = system.laws[element]
    at = float(rest.deflection[element])
    low = min(at + float(reach[0][element]) for reach in reaches)
    high = max(at + float(reach[1][element]) for reach in reaches)
    first = int(np.searchsorted(law.corners, low, side="left"))
    last = int(np.searchsorted(law.corners, high, side="right"))
    return [*range(first, last + 1)]


def _models(system: PiecewiseSystem, rest: PositionAtRest, meshes: Sequence[int]) -> Iterator[Linear]:
    """Yield all linear models: first in the stages at rest, then with elements in the other stages that they reach."""
    first = list(_frictions(system, rest.pieces))
    reaches = [reach_of(system, linear) for linear in first]
    yield from first
    at = [int(piece) for piece in rest.pieces]
    stages = []
    for k, piece in enumerate(at):
        others = [] if k in meshes else [p for p in _reached(system, rest, reaches, k) if p != piece]
        stages.append([piece, *(p for p in others if system.laws[k].stiffness[p] > 0.0)])
    if prod(map(len, stages)) <= _MOST_STAGES:
        pieces = list(product(*stages))[1:]
    else:
        pieces = [(*at[:k], p, *at[k + 1 :]) for k, reached in enumerate(stages) for p in reached[1:]]
    for chosen in pieces:
        yield from _frictions(system, chosen)


def _frictions(system: PiecewiseSystem, pieces: Sequence[int]) -> Iterator[Linear]:
    """Yield the model with friction released, then, if there is friction, with friction stuck."""
    yield _in_pieces(system, pieces, sticks=False)
    if any(auxiliary.kind == "slider" for auxiliary in system.auxiliaries):
        yield _in_pieces(system, pieces, sticks=True)


def _in_pieces(system: PiecewiseSystem, pieces: Sequence[int], *, sticks: bool) -> Linear:
    """Return the slopes with every element in its piece; where friction sticks, add the springs of engaged sliders."""
    stiffness = np.array([law.stiffness[p] for law, p in zip(system.laws, pieces, strict=True)])
    damping = np.array([law.damping[p] for law, p in zip(system.laws, pieces, strict=True)])
    for auxiliary in system.auxiliaries if sticks else ():
        if auxiliary.kind == "slider" and auxiliary.follow[pieces[auxiliary.element], STICK] == STICK:
            stiffness[auxiliary.element] += auxiliary.memory[STICK]
    return Linear(stiffness, damping)
