"""``fit_loop``: the stages of a coupling from a measured torque-angle loop.

The law is the package's own, a staged characteristic with Jenkins sliders (``assembly.friction_sliders``), so what is
fitted is what a run will use: ``LoopFit.drawn`` is its loop by ``torque_angle``. Breaks, slopes, heights and the
stretch before slip come from one least-squares fit over both branches (``loop_law``, ``loop_search``); the numbers of
stages of the drive and of the coast side are chosen by BIC unless given. Where the samples after a reversal do not
determine the stick stiffness of a slider, the default of the model file is used, and a note says so.
"""

from __future__ import annotations

import os
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.measured.identification.loop_data import Loop, read_loop
from gearrattle.measured.identification.loop_errors import resampled, rubbing, spread
from gearrattle.measured.identification.loop_intervals import NORMAL, intervals, places, smaller
from gearrattle.measured.identification.loop_law import CENTRE, COAST, DRIVE, Slider, Solved
from gearrattle.measured.identification.loop_moments import Moments
from gearrattle.measured.identification.loop_polish import Polish
from gearrattle.measured.identification.loop_result import FittedStage, LoopFit
from gearrattle.measured.identification.loop_search import MOST, REACH, idle, select
from gearrattle.measured.identification.loop_settle import STICK, settle, with_defaults
from gearrattle.measured.identification.loop_values import KEYS, derivatives, values_of
from gearrattle.model.value_kinds import SEED, argument_problems

Array = NDArray[np.float64]


def fit_loop(
    data: str | os.PathLike[str] | tuple[ArrayLike, ArrayLike],
    stages: int | tuple[int, int] | None = None,
    *,
    angle: str = "angle",
    torque: str = "torque",
    name: str = "damper",
    between: tuple[str, str] = ("flywheel", "hub"),
    bootstrap: int = 0,
    seed: int = 0,
) -> LoopFit:
    """Fit stages, hysteresis and preload to a measured torque-angle loop.

    Parameters
    ----------
    data
        path of a CSV file whose header names the units, such as ``angle [deg], torque [N*m]``, or a pair of
        arrays of equal length: deflection [rad] and torque [N m], in the order measured. Slow enough that damping
        plays no part; one whole cycle at least.
    stages
        how many on each side, or a pair, drive side and coast side; None: chosen by BIC, at most 6.
    angle, torque
        names of the file's columns.
    name, between
        of the coupling that is made.
    bootstrap
        how often blocks of residuals are resampled to check the standard errors; 0: never.
    seed
        of the resampling.

    Returns
    -------
    LoopFit
        The law with standard errors, ready for a model file.

    Raises
    ------
    ModelError
        a file that cannot be read, a unit missing, too few points, no reversal, a loop that is not
        closed, ends on one side of zero, stages or draws that are no number.

    Examples
    --------
    >>> turn = np.linspace(0.0, 4.0 * np.pi, 2001)
    >>> angle = 0.2 * np.sin(turn)
    >>> torque = 100.0 * angle + 2.0 * np.sign(np.cos(turn))
    >>> fit = gr.identification.fit_loop((angle, torque), stages=1)
    >>> round(fit.stages[0].stiffness, 1)
    99.7
    """
    if not isinstance(bootstrap, int) or bootstrap < 0 or bootstrap == 1:
        raise ModelError(Problem("bootstrap", repr(bootstrap), "must be 0, or a whole number from 2", "such as 200"))
    if problems := argument_problems({"seed": (SEED, seed)}):
        raise ModelError(problems)
    loop = read_loop(data, angle, torque)
    low, high = loop.ends
    if not low < 0.0 < high:
        span = f"{np.degrees(low):.4g} to {np.degrees(high):.4g} deg"
        rule = "the loop must reach to both sides of zero: drive and coast side are fitted apart"
        raise ModelError(Problem(loop.source, span, rule, "shift the angle's zero to the damper's rest"))
    return _fitted(loop, _numbers(stages), (name, between), (bootstrap, seed))


def _fitted(
    loop: Loop, stages: tuple[int, int] | None, coupling: tuple[str, tuple[str, str]], draws: tuple[int, int]
) -> LoopFit:
    """Choose the stages, fit the law and its errors, and return the result."""
    # choose the stages, then fit the law over every sample
    chosen, steps = select(loop, stages)
    low, high = loop.ends
    settled = settle(Polish(Moments(loop, REACH * (high - low)), frozenset(idle(chosen))), chosen)
    polish = settled.polish
    law = settled.law
    # covariance of coefficients, breaks and reaches, and the density of every break
    fixed = polish.held
    known = spread(polish, law)
    breaks = places(settled, known)
    # the numbers of the coupling, their covariance and standard errors
    values = values_of(law, fixed)
    slopes = derivatives(law, fixed, known)
    slopes_told = slopes * smaller(settled, known, breaks)
    open_ = ~np.isfinite(np.diag(known.covariance))
    covariance = slopes_told @ np.where(np.isfinite(known.covariance), known.covariance, 0.0) @ slopes_told.T
    covariance[np.diag_indices(len(values))] += np.where(np.any(slopes[:, open_] != 0.0, axis=1), np.inf, 0.0)
    errors = dict(zip(values, np.sqrt(np.maximum(np.diag(covariance), 0.0)).tolist(), strict=True))
    # 95 % intervals; a stick stiffness has its error from its interval
    ends = intervals(settled, known, (values, errors), breaks)
    for stick in (key for key in values if key.endswith("stick_stiffness")):
        low_end, high_end = ends[stick]
        errors[stick] = 0.5 * (high_end - low_end) / NORMAL
    # the bootstrap as a check
    checked: Mapping[str, float] = {}
    if draws[0] > 0:
        again = resampled(polish, law, *draws)
        made = [values_of(with_defaults(own, solution) if fixed else solution, fixed) for own, solution in again]
        checked = {key: float(np.std([repeat.get(key, np.nan) for repeat in made], ddof=1)) for key in values}
    return LoopFit(
        name=coupling[0],
        between=coupling[1],
        stages=_stages(values, KEYS[DRIVE]),
        coast_stages=_stages(values, KEYS[COAST]),
        preload=values["preload"],
        values=values,
        errors=errors,
        intervals=ends,
        covariance=covariance,
        bootstrap_errors=checked,
        residual=float(np.sqrt(np.mean(known.residual**2))),
        tau=known.tau,
        measured=(loop.deflection, loop.torque),
        residuals=known.residual,
        source=loop.source,
        steps=tuple(steps),
        notes=(*loop.notes, *_remarks(law, fixed, loop)),
        angle_unit=loop.angle_unit,
    )


def _numbers(stages: int | tuple[int, int] | None) -> tuple[int, int] | None:
    if stages is None:
        return None
    pair = (stages, stages) if isinstance(stages, int) else stages
    fine = isinstance(pair, tuple) and len(pair) == 2 and all(type(n) is int and 1 <= n <= MOST for n in pair)
    if not fine or isinstance(stages, bool):
        rule = f"must be a whole number from 1 to {MOST}, or a pair of them: drive side and coast side"
        raise ModelError(Problem("stages", repr(stages), rule))
    return pair


def _stages(law: Mapping[str, float], key: str) -> tuple[FittedStage, ...]:
    number = sum(1 for name in law if name.startswith(f"{key}.") and name.endswith(".stiffness"))
    return tuple(
        FittedStage(
            law[f"{key}.{i}.stiffness"],
            law.get(f"{key}.{i}.until"),
            law[f"{key}.{i}.hysteresis"],
            law.get(f"{key}.{i}.stick_stiffness"),
        )
        for i in range(number)
    )


def _remarks(solution: Solved, fixed: frozenset[Slider], loop: Loop) -> list[str]:
    notes = ["a slow loop says nothing of damping: it is left at 0"]
    words = ["the centre" if side == CENTRE else f"{side} stage {index}" for side, index in sorted(fixed)]
    if words:
        rule = f"stick stiffness of {', '.join(words)}: the samples behind the turns do not tell it"
        notes.append(f"{rule}; the default of {STICK:g} times the stage's slope stands")
    if not rubbing(solution):
        notes.append("no friction was found")
    low, high = loop.ends
    for side, end in ((DRIVE, high), (COAST, -low)):
        beyond = end - max(solution.shape.breaks(side), default=0.0)
        if beyond < 0.05 * (high - low):
            notes.append(f"the last {side} stage is determined by only {np.degrees(beyond):.3g} deg of the loop")
    return notes
