"""Facts on the reliability of the numbers of a run.

They are the method of computation, the part of the motion that the verdict uses, and the agreement of its first and
second half.
"""

from __future__ import annotations

import numpy as np

from gearrattle.engine.system.perturbation_growth import GROWTH, ROUNDING, ROUNDING_95
from gearrattle.pipeline import Findings
from gearrattle.signals import by_parts, find_impacts, steady
from gearrattle.wording import counted

_METHODS = {
    "exact": "Between corners the motion is computed in closed form, and every crossing of a corner is located and "
    "logged: no step size limits the result, and the output samples never limit the integration.",
}
_STEPPING = (
    "The motion is stepped by {algorithm}, with its own truncation error; compare with the algorithm “exact” before "
    "relying on single events."
)
_ENERGY = (
    "Energy audit: work, losses and stored energy, integrated apart from the motion, balance to {residual:.0e} of all "
    "that was turned over."
)
_SENSITIVE = (
    "Predictability horizon: {cycles}. By then some perturbation has grown ten-million-fold, and rounding "
    "has put deflections off by about {error:.0e} half-gaps (95 of 100 motions: by less than {most:.0e}). "
    "Beyond it rates, shares and spectra hold as averages, about as well as the two "
    "halves agree; the instant of a single impact, the largest value, a regime decided by a few rare impacts do not."
)


def trust(findings: Findings) -> list[str]:
    """Return facts on the reliability of the verdict, as items of one or two sentences."""
    # the method
    trajectory = findings.motion.trajectory
    window = steady(trajectory)
    algorithm = trajectory.cost.algorithm
    sentences = [_METHODS.get(algorithm, _STEPPING.format(algorithm=algorithm))]
    # the part that is judged
    judged = f"{window.cycles} of {counted(trajectory.cycles, 'cycle')} {'is' if window.cycles == 1 else 'are'} judged"
    judged += f", the first {trajectory.discard} left out as start-up." if trajectory.discard else "."
    # the start-up: impacts in both halves of this part
    impacts = find_impacts(by_parts(trajectory)).within(window)
    event = findings.verdict.event
    is_steady = event is None and findings.model.excitation.sweep is None
    if event is not None and event.settled is None:
        judged += " The event has not settled when the run ends: a longer run may have more of it."
    if len(impacts) and window.cycles > 1 and is_steady:
        middle = 0.5 * (window.start + window.end)
        early = int(np.count_nonzero(impacts.time < middle))
        judged += (
            f" Impacts in the first and second half of them: {early} and {len(impacts) - early}; "
            "far apart, they would mean that the start-up is not over."
        )
    sentences.append(judged)
    # energy audit and predictability
    if (residual := trajectory.cost.energy_residual) is not None:
        sentences.append(_ENERGY.format(residual=residual))
    sentences.append(_predictable(findings.motion.predictability_horizon, trajectory.layout.period, trajectory.end))
    return sentences


def _predictable(horizon: float, period: float, end: float) -> str:
    """Return a sentence on the time up to which the motion is predicted point by point."""
    if horizon > end:
        return (
            "Small perturbations stay small: over the whole run no perturbation grows ten-million-fold, so single "
            "instants are predicted to the end."
        )
    return _SENSITIVE.format(
        cycles=counted(horizon / period, "cycle"), error=GROWTH * ROUNDING, most=GROWTH * ROUNDING_95
    )
