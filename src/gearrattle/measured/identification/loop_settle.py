"""The final law of the chosen stages, with the default where samples do not determine a stick stiffness.

Every slider's reach is fitted with all else first, and its density found (``loop_reaches``). A slider whose stiffness
has no upper end keeps the default of the model file, 20 times its stage's slope, if that lies within its interval; so
does one softer than its stage that fits hardly better than the default. All else then gives way to the defaults.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gearrattle.measured.identification.loop_errors import spread
from gearrattle.measured.identification.loop_law import Slider, Solved, heights_of, least, slope_of
from gearrattle.measured.identification.loop_polish import Polish
from gearrattle.measured.identification.loop_reaches import Density, Stretch, densities, stretched
from gearrattle.measured.identification.loop_search import REACH, default_reaches, idle

STICK = 20.0
"""Stick stiffness over the stage's slope where the loop does not determine it: the default of the model file."""
_WORSE = 12.0  # chi-square by which a slider softer than its stage must fit better than the default
_ROUNDS = 4
_BETTER = 0.02  # chi-square by which a law met on the way must fit better to be taken


class Settled(NamedTuple):
    """The law of a loop."""

    polish: Polish
    law: Solved
    reaches: dict[Slider, Density]
    sticks: dict[Slider, Stretch]


def settle(polish: Polish, shape_from: Solved) -> Settled:
    """Fit all parameters, find the density of every reach, and give defaults to sliders that the samples leave open."""
    # least squares with a reach for every slider
    low, high = polish.loop.ends
    shape = shape_from.shape
    reaches = {slider: shape.reach_of(slider, REACH * (high - low)) for slider in shape.sliders()}
    solution = polish.best(polish.at(shape.with_reaches(reaches)))
    polish = replace(polish, without=polish.without | frozenset(idle(solution)))
    solution = polish.whole(polish.at(solution.shape))
    # density of the reaches; a better start that it shows is fitted again
    made: dict[Slider, Density] = {}
    for _ in range(_ROUNDS):
        made, starts = densities(polish, solution, spread(polish, solution))
        best = least((solution, *(polish.smooth(polish.at(start)) for start in starts)))
        if solution.left - best.left < _BETTER * polish.moments.variance(solution):
            break
        solution = polish.whole(best)
    # sliders whose stick stiffness the samples leave open keep the default
    sticks = {slider: stretched(solution, slider, reach) for slider, reach in made.items()}
    fixed = frozenset(_open(polish, solution, sticks))
    if not fixed:
        return Settled(polish, solution, made, sticks)
    polish = replace(polish, held=fixed)
    return Settled(polish, with_defaults(polish, solution), made, sticks)


def _open(polish: Polish, solution: Solved, sticks: dict[Slider, Stretch]) -> list[Slider]:
    """Sliders that get the default."""
    made = []
    variance = polish.moments.variance(solution)
    for slider, stretch in sticks.items():
        slope = slope_of(solution, slider)
        height = heights_of(solution)[slider]
        if not slope > 0.0:
            continue
        if stretch.high == np.inf and stretch.low <= STICK * slope:
            made.append(slider)
        elif height < slope * solution.shape.reach_of(slider, np.inf):
            other = with_defaults(replace(polish, held=frozenset({slider})), solution)
            if other.left - solution.left < _WORSE * variance:
                made.append(slider)
    return made


def with_defaults(polish: Polish, solution: Solved) -> Solved:
    """Fit with the default stick stiffness of the sliders held, whose reaches then follow from their heights."""
    for _ in range(4):
        reaches = default_reaches(solution, STICK)
        shape = solution.shape.with_reaches({slider: reaches[slider] for slider in polish.held if slider in reaches})
        solution = polish.smooth(polish.at(shape))
    return polish.whole(solution)
