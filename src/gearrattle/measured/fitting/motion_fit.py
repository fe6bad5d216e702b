"""``fit_motion``: the parameters of a rough model whose motion agrees best with a recorded one.

One motion is simulated at every start; those that fit best and lie apart are followed by the search that modes and
responses are fitted by. Where the simulated motion does not repeat itself, what the search ends with is settled on a
response surface (``surface``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ConvergenceError, ModelError
from gearrattle.measured.fitting.measured_motion import Measured
from gearrattle.measured.fitting.motion_problem import ROUGH, Judged, MotionProblem, Simulates
from gearrattle.measured.fitting.recording_table import RecordingTable
from gearrattle.measured.fitting.run_up_motion import run_up_motion, run_up_problems
from gearrattle.measured.fitting.run_up_residuals import MeasuredRunUp
from gearrattle.measured.fitting.steady_motion import steady_motion
from gearrattle.measured.fitting.surface import Surface, settle
from gearrattle.measured.identification.estimates import Progress, Searched, Settings, estimates
from gearrattle.measured.identification.fit_result import Fit
from gearrattle.measured.identification.free_parameters import free_parameters
from gearrattle.measured.identification.multi_start import Effort, Minimum, search, spread_out
from gearrattle.measured.validation.measured_cycles import check_names
from gearrattle.measured.validation.pairing import paired
from gearrattle.measured.validation.simulated_recording import to_be_recorded
from gearrattle.measured.validation.validation_arguments import problems_of
from gearrattle.model import Model
from gearrattle.recording import Recording
from gearrattle.simulation.simulate import simulate
from gearrattle.wording import counted

Array = NDArray[np.float64]

FOLLOWED = 3
"""Starts that are followed, of those that were tried."""
_SMOOTH = Effort(40, 1e-4, 1e-2)
_JUMPING = Effort(10, 1e-2, None, settles=False)
_NEARBY = Effort(40, 1e-4, None, settles=False)
_WORSE = 10.0  # times the best chi-square: a start of a motion that does not settle is not followed
_APART = 0.15  # of the width of the bounds: starts nearer to a better one are in its valley
_EXPECTED = 10  # evaluations of a local search, for the progress alone


def fit_motion(
    model: Model,
    recordings: Sequence[Recording],
    table: RecordingTable,
    free: Sequence[str],
    settings: Settings,
) -> Fit:
    """Find the parameters with which the simulated motion agrees with a recorded one best; arguments as of ``fit``.

    ModelError as of ``fit``; ConvergenceError where no start converged, or the start has no motion.
    """
    # check the arguments
    wanted = table.wanted(settings.seed)
    problems = [*problems_of(wanted), *run_up_problems(table, len(recordings), model.excitation.sweep is not None)]
    if problems:
        raise ModelError(problems)
    # free parameters, and pairs of measured and simulated channels
    parameters = free_parameters(model, free, settings.bounds, settings.factor, sets_the_period)
    pairings = [paired(recording, to_be_recorded(model), wanted.match) for recording in recordings]
    for pairing in pairings:
        check_names(pairing, wanted)
    # the start's motion, and its compared values
    steps = Steps(settings.starts, len(parameters.paths), settings.progress)
    run = simulate(model, **table.settings, audit=False, progress=steps.watch)
    measured: Measured
    simulator: Simulates
    if model.excitation.sweep is None:
        measured, simulator, notes = steady_motion(run, recordings[0], (pairings[0], wanted), table, steps.watch)
    else:
        measured, simulator, notes = run_up_motion(run, recordings, (pairings, wanted), table, steps.watch)
    # the least-squares problem, its search and the notes of it
    problem = MotionProblem(measured, simulator, model, parameters, settings.prior, steps.count)
    steps.count()
    searched, judged, said = _searched(problem, settings.starts, settings.seed)
    if settings.profile and isinstance(judged, Surface):
        settings = replace(settings, profile=False)
        said = [
            *said,
            "no profiles: of a motion that does not repeat itself only slopes are known, over a small range.",
        ]
    # notes of pairs and records
    of_records = [note for pair in zip(pairings, recordings, strict=True) for one in pair for note in one.notes]
    said = [*notes, *said, *dict.fromkeys(of_records)]
    # standard errors and intervals at the minimum
    fitted = estimates(model, judged, parameters, searched, settings, notes=said)
    if isinstance(judged.of.recorded, MeasuredRunUp):
        names = [channel.name for channel in pairings[0].simulated]
        fitted = replace(fitted, tracks=judged.of.recorded.tracks(judged.of.motion(searched.minima[0].x), names))
    if settings.progress is not None:
        settings.progress(1.0)
    return fitted


def sets_the_period(path: str) -> tuple[str, str] | None:
    """Return why a value cannot be fitted to a motion; None for any other."""
    if path.startswith("simulation."):
        return "is a setting of the simulation, not of the driveline", "leave it out of free"
    if path.startswith("excitation.") or path.rsplit(".", 1)[-1] == "order":
        return "sets the period that both motions are cut by", "leave it out of free"
    return None


class Steps:
    """Progress of a fit, in simulations."""

    def __init__(self, starts: int, count: int, progress: Progress | None) -> None:
        self._done = 0
        self._progress = progress
        self._all = starts + min(starts, FOLLOWED) * (1 + 2 * count) * _EXPECTED

    def count(self) -> None:
        """Count one more simulation."""
        self._done += 1
        self._all = max(self._all, int(1.1 * self._done) + 1)
        self.watch(0.0)

    def watch(self, _share: float) -> None:
        """Report the share that is done."""
        if self._progress is not None:
            self._progress(self._done / self._all)


def _searched(problem: MotionProblem, starts: int, seed: int) -> tuple[Searched, Judged, list[str]]:
    """Return the minima, the problem by which the best of them is judged, and notes on the search."""
    # the noise of a motion that does not repeat itself, at the start
    origin = np.zeros(len(problem.parameters.paths))
    if problem.jitter(origin) > ROUGH:
        problem = problem.scattering(origin, seed)
    # one simulation at every start; the best ones that lie apart are followed
    points, failed, reason = _tried(problem, starts, seed)
    if not points:
        raise ConvergenceError(f"none of {counted(starts, 'start')} has a motion: {reason}", remedy="narrower bounds")
    rough = problem.jitter(points[0][1]) > ROUGH
    if rough:
        problem = problem.scattering(points[0][1], seed)
        points = sorted(((problem.chi_square(point), point) for _, point in points), key=lambda one: one[0])
        points = [(chi, point) for chi, point in points if chi <= _WORSE * points[0][0]]
    followed = _apart(points, problem.parameters.box)
    # local searches, with the step of the differences by the jitter
    differences = problem.differences(problem.jitter(followed[0]))
    effort = _JUMPING if rough else _SMOOTH
    minima, lost = search(differences.residuals, followed, problem.parameters.box, effort)
    said = [f"{counted(starts, 'start')} tried, the {len(followed)} that fit best followed."] if len(points) > 1 else []
    if failed:
        said.append(f"{counted(failed, 'start')} had no motion that could be compared: {reason}")
    # choose the compared lines anew at the best minimum
    searched = problem
    problem = problem.judged_at(minima[0].x)
    after = problem.jitter(minima[0].x)
    # a motion that scatters is settled on a response surface
    if after > ROUGH:
        problem = problem.scattering(minima[0].x, seed)
        best, judged = settle(problem.differences(problem.jitter(minima[0].x)), minima[0])
        return Searched((best, *_anew(judged.of, minima[1:])), len(followed), lost), judged, said
    # otherwise search again where residuals or compared lines have changed
    jumped = rough or differences.step > 3.0 * problem.step(after)  # the start's motion jumps, the best one's does not
    if jumped or not problem.recorded.compares_as(searched.recorded):
        differences = problem.differences(after)
        effort = _SMOOTH if jumped else _NEARBY
        again, _ = search(differences.residuals, [minima[0].x], problem.parameters.box, effort)
        minima = (replace(again[0], times=minima[0].times), *_anew(problem, minima[1:]))
    return Searched(minima, len(followed), lost, _SMOOTH), differences, said


def _anew(problem: MotionProblem, minima: Sequence[Minimum]) -> list[Minimum]:
    """Return minima with their chi-square in the standard errors of the best one."""
    judged = [replace(minimum, chi_square=problem.level(minimum.x)) for minimum in minima]
    return sorted(judged, key=lambda minimum: minimum.chi_square)


def _tried(problem: MotionProblem, starts: int, seed: int) -> tuple[list[tuple[float, Array]], int, str]:
    """Return chi-square at every start that has a motion, the best first; how many have none, and why."""
    tried: list[tuple[float, Array]] = []
    reason = ""
    for point in spread_out(problem.parameters.box, starts, seed):
        try:
            tried.append((problem.chi_square(point), point))
        except ConvergenceError as error:
            reason = str(error)
    return sorted(tried, key=lambda one: one[0]), starts - len(tried), reason


def _apart(tried: Sequence[tuple[float, Array]], box: tuple[Array, Array]) -> list[Array]:
    """Return the best starts that lie in different valleys."""
    chosen: list[Array] = []
    for _, point in tried:
        if len(chosen) == FOLLOWED:
            break
        if all(np.max(np.abs(point - other) / (box[1] - box[0])) > _APART for other in chosen):
            chosen.append(point)
    return chosen
