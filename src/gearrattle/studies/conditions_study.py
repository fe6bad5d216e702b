"""``conditions``: idle rattle over oil temperature, load and speed, as a practice for judging it by ear varies them.

Parked, in neutral, with the clutch engaged, a gearbox is listened to with cold, middling and hot oil, with accessories
on and off, at idle speeds (SAE J2555; its paid text is not read: its loads, soak, microphones and raters are unknown).
A condition is a case of a grid of these axes. Of each there are the severity and the verdict, the hardest impact and
its part, impacts per cycle, the sound level, and

    threshold margin = smallest of T_drag / (J_loose (R_driver/R_loose) peak |theta_driver''|) of all loose gears,

which is above 1 where every loose gear stays on its flank. A rating from 1 to 10 is a person's. None is computed
but from calibration points of the user's: straight lines between their levels, nothing beyond them.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.factors import FACTOR, Factor
from gearrattle.model.table import did_you_mean, shown
from gearrattle.model.value_kinds import FLAG, Plain, argument_problems
from gearrattle.studies.case_batches import can_follow
from gearrattle.studies.case_runs import DONE
from gearrattle.studies.output import ENERGY, HARDEST, SOUND, Modes
from gearrattle.studies.outputs import Available
from gearrattle.studies.plan import Plan
from gearrattle.studies.prepared import STARTING, Prepared, Progress, available_cores
from gearrattle.studies.sound_output import SOUND_LEVEL, SOUND_LOOP, casing_path
from gearrattle.studies.stored_studies import OUTCOME
from gearrattle.studies.study import MOST
from gearrattle.studies.study import prepare as prepare_grid
from gearrattle.studies.study_axes import RANGE
from gearrattle.studies.study_call import conduct
from gearrattle.studies.study_store import Store

if TYPE_CHECKING:
    import xarray as xr

ROLES = {"load": "", "temperature": "oil.temperature", "speed": "excitation.speed"}
"""The axes in the order of the grid, with the path that varies unless another is named."""
OUTPUTS = Available(
    ("verdict severity", "verdict", "severity", HARDEST, ENERGY, "impacts per cycle", SOUND_LEVEL, SOUND_LOOP, "margin")
)
MOST_HEARD = 120
"""Conditions up to which the sound of every one is kept: 8.6 MB, and less than 6 MB in the page."""
MARGIN = "threshold margin"
HARDEST_PART = "hardest part"
RATING = "rating"
_RATINGS = (1.0, 10.0)
Varied = Sequence[float | str | Factor] | Mapping[str, object]
"""Values that vary: a list, or a table of a path and values, of a range, or of several paths."""
Points = tuple[tuple[float, float], ...]
"""Calibration points: a level [dB], ascending, and the rating of it."""


@dataclass(frozen=True)
class ConditionsPlan(Plan):
    """The cases of a study of conditions: those of a grid, whose axes have roles.

    Attributes
    ----------
    roles
        role -> name of the axis.
    modes
        of the path of the sound; none: the assumed casing.
    """

    kind: ClassVar[str] = "conditions"
    roles: Mapping[str, str] = field(default_factory=dict)
    modes: Modes = ()

    @property
    def attributes(self) -> dict[str, Any]:
        """The roles of the axes, and the path of the sound."""
        rows = "; ".join(f"{frequency:.17g} Hz, {damping:.17g}, {gain:.17g}" for frequency, damping, gain in self.modes)
        return {**self.roles, "sound_path": rows or casing_path(()).source}


@dataclass(frozen=True)
class Conditions(Prepared):
    """Prepared study of conditions, with the user's calibration points."""

    points: Points = ()

    @property
    def scheduler(self) -> str:
        """Return the scheduler on this machine: threads, unless processes are done sooner in spite of their start.

        Threads wait for each other while a condition is evaluated, and only the compiled loop goes on beside.
        """
        if not can_follow(self.outputs, self.plan):
            return super().scheduler
        cores = available_cores()
        work = self.plan.count * self.seconds
        return "threads" if max(self.serial, 1.0 / cores) * work <= STARTING + work / cores else "local"

    def completed(self, store: Store) -> xr.Dataset:
        """Add what follows from the outputs of every condition: margin, hardest part, rating."""
        store.add(evaluated(store.dataset(), self.points))
        return store.dataset()


def prepare(
    model: Model,
    temperature: object,
    speed: object,
    load: object = None,
    *,
    rating: Sequence[Sequence[float]] = (),
    sound_path: Sequence[Sequence[float]] = (),
    sounds: bool = True,
    fixed: Mapping[str, object] | None = None,
    most: int = MOST,
) -> Conditions:
    """Check all arguments of a study of conditions, and run one case. Arguments and errors as ``conditions``."""
    # axes by their roles, calibration points and modes of the path; all refusals together
    problems: list[Problem] = []

    def read(make: Callable[[], Any]) -> Any:
        try:
            return make()
        except ModelError as error:
            problems.extend(error.problems)
            return ()

    asked = {"load": load, "temperature": temperature, "speed": speed}
    axes = {role: read(partial(_axis, role, asked[role], model)) for role in ROLES if asked[role] is not None}
    points = read(partial(calibration_points, rating))
    modes = read(partial(_modes, sound_path))
    problems += argument_problems({"sounds": (FLAG, sounds)})
    if problems:
        raise ModelError(problems)
    # the grid of them
    roles = {role: name for role, (name, _) in axes.items()}
    try:
        grid = prepare_grid(model, dict(axes.values()), OUTPUTS, fixed=fixed, most=most)
    except ModelError as error:
        raise ModelError(replace(problem, place=_by_role(problem.place, roles)) for problem in error.problems) from None
    # its sound through the path that was asked for, kept of few conditions
    outputs = grid.outputs
    if modes:
        chosen = tuple(replace(one, modes=modes) if one.criterion == SOUND else one for one in outputs.chosen)
        outputs = replace(outputs, chosen=chosen, known={})
    if not sounds or grid.plan.count > MOST_HEARD:
        chosen = tuple(one for one in outputs.chosen if one.name != SOUND_LOOP)
        known = {at: {name: of[name] for name in of if name != SOUND_LOOP} for at, of in outputs.known.items()}
        outputs = replace(outputs, chosen=chosen, known=known)
    of = grid.plan
    plan = ConditionsPlan(of.model, of.axes, None, of.chunk_size, {role: roles.get(role, "") for role in ROLES}, modes)
    return Conditions(plan, outputs, grid.seconds, serial=grid.serial, points=points)


def conditions(
    model: Model,
    temperature: Varied,
    speed: Varied,
    load: Varied | None = None,
    *,
    rating: Sequence[Sequence[float]] = (),
    sound_path: Sequence[Sequence[float]] = (),
    sounds: bool = True,
    fixed: Mapping[str, object] | None = None,
    most: int = MOST,
    output: str | os.PathLike[str] | None = None,
    resume: bool = False,
    retry_failed: bool = False,
    workers: int | None = None,
    scheduler: object = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Simulate and judge idle rattle over oil temperature, load and speed.

    Parameters
    ----------
    model
        the driveline, as it idles: its file's settings hold for every condition.
    temperature, speed, load
        values of "oil.temperature", of "excitation.speed", and of the path that is named: a list or a range, as an
        axis of ``study``; or ``{"path": ..., "values": ...}``, where ``values`` may be a mapping from several paths to
        lists, which then vary together. None: the load of the model.
    rating
        calibration points of the user's, (sound level [dB], rating from 1 to 10); straight lines between, no rating
        beyond them.
    sound_path
        modes of the path from an impulse to sound pressure: rows of frequency [Hz], damping ratio and gain
        [Pa/(N s)]; none: the assumed casing of ``listen``.
    sounds
        whether a loop of the sound of every condition is kept, which the page plays: at most 0.75 s each, of at most
        120 conditions.
    fixed
        other values of the model, by path.
    most
        a study of more conditions is refused.
    output
        folder or address to keep it in; None: in memory.
    resume, retry_failed
        go on with what is there; and compute chunks with failed conditions anew.
    workers, scheduler, progress
        as in ``study``.

    Returns
    -------
    xr.Dataset
        A Dataset over load, temperature and speed: ``verdict severity``, ``verdict``, ``severity``, ``hardest impact``
        [J], ``hardest part``, ``largest impact energy``, ``impacts per cycle``, ``sound level`` [dB re 20 uPa, through
        the path], ``sound loop`` [Pa], ``threshold margin`` (drag torque over the torque that a loose gear needs, the
        smallest of all; above 1 it stays on its flank), ``rating``, ``outcome``. What the driveline cannot have is not
        there. Its attributes ``load``, ``temperature`` and ``speed`` name the axes.

    Raises
    ------
    ModelError
        anything wrong with the arguments, such as the temperature of the oil of a model without ``[oil]``.
    ConvergenceError, NotInstalled, SchedulerLost
        as in ``study``.

    Examples
    --------
    >>> oil = {"path": "inertia.*.drag_torque", "values": {"factor": [1, 4]}}
    >>> model = gr.example("case3").with_({"simulation.cycles": 8, "simulation.discard": 4})
    >>> gr.conditions(model, oil, [80.0, 90.0], workers=1)["verdict severity"].dims
    ('inertia.*.drag_torque', 'excitation.speed')
    """
    return conduct(prepare, **locals())  # every argument, by its name


def calibration_points(rating: object) -> Points:
    """Return calibration points in the order of their levels.

    ModelError: fewer than two, two of one level, a rating beyond the scale, or one that a louder sound raises.
    """
    rows: list[Any] = list(rating) if isinstance(rating, Sequence) and not isinstance(rating, str) else [rating]
    if not rows:
        return ()
    if not all(isinstance(row, Sequence) and not isinstance(row, str) and len(row) == 2 for row in rows):
        rule = "must be a list of calibration points, each a level [dB] and its rating"
        raise ModelError(Problem(RATING, shown(rating), rule, "such as (55, 8), (70, 5)"))
    problems: list[Problem] = []
    for i, (level, rated) in enumerate(rows):
        problems += argument_problems({f"rating.{i}.level": (Plain(), level), f"rating.{i}.rating": (Plain(), rated)})
    if problems:
        raise ModelError(problems)
    # levels that ascend, ratings within the scale that descend
    points = sorted((float(level), float(rated)) for level, rated in rows)
    levels, ratings = np.array(points).T
    words = ", ".join(f"{level:g} dB: {rated:g}" for level, rated in points)
    if len(points) < 2:
        problems.append(Problem(RATING, words, "a line needs two calibration points", "rate another condition"))
    if np.any(np.diff(levels) == 0.0):
        problems.append(Problem(RATING, words, "two calibration points have one level", "leave one of them out"))
    if ratings.min() < _RATINGS[0] or ratings.max() > _RATINGS[1]:
        problems.append(Problem(RATING, words, "a rating must be from 1 to 10", "10: none is heard"))
    if np.any(np.diff(ratings) > 0.0):
        rule = "a louder sound must not be rated better"
        problems.append(Problem(RATING, words, rule, "level alone does not decide then: leave the rating out"))
    if problems:
        raise ModelError(problems)
    return tuple(points)


def _axis(role: str, asked: object, model: Model) -> tuple[str, object]:
    """Return name and values of the axis of a role, as a grid takes them."""
    path = ROLES[role]
    values = asked
    if isinstance(asked, Mapping) and ({"path", "values"} & set(asked)):
        if unknown := [key for key in asked if key not in ("path", "values")]:
            rule = "has path and values alone"
            raise ModelError(Problem(role, shown(unknown[0]), rule, did_you_mean(unknown[0], ("path", "values"))))
        if "values" not in asked:
            raise ModelError(Problem(f"{role}.values", "none", "must be a list of values, a range, or several paths"))
        values = asked["values"]
        path = asked.get("path") or path
        if not isinstance(path, str):
            raise ModelError(Problem(f"{role}.path", shown(path), "must be a path of the model, in quotes"))
    # several paths together, under the name of the role
    if isinstance(values, Mapping) and not set(values) & {*RANGE, FACTOR}:
        if isinstance(asked, Mapping) and asked.get("path"):
            rule = "stands beside values by paths"
            raise ModelError(Problem(f"{role}.path", shown(path), rule, "leave it out, or give one list of values"))
        return role, values
    if not path:
        remedy = 'path = "torque.1.mean", or values by paths'
        raise ModelError(Problem(f"{role}.path", "none", "must say what varies: no load has a path of its own", remedy))
    if path == ROLES["temperature"] and not model.paths("oil.*"):
        rule = "the model has no [oil], so its oil has no temperature"
        remedy = (
            'add [oil] to the model, or vary what the temperature changes: path = "inertia.*.drag_torque", '
            "values = { factor = [8, 3, 1] }"
        )
        raise ModelError(Problem(f"{role}.path", path, rule, remedy))
    return path, values


def _by_role(location: str, roles: Mapping[str, str]) -> str:
    """Return the place of a problem by the role of the axis that it names."""
    for role, name in roles.items():
        if location.startswith(f"axis {name}: "):
            return f"{role}: {location.removeprefix(f'axis {name}: ')}"
    return location


def _modes(rows: Sequence[Sequence[float]]) -> Modes:
    """Return the modes of a path of sound. ModelError: no rows of three numbers, or modes out of range."""
    if isinstance(rows, Sequence) and not len(rows):
        return ()
    try:
        modes = tuple((float(frequency), float(damping), float(gain)) for frequency, damping, gain in rows)
    except (TypeError, ValueError):
        rule = "must be rows of frequency [Hz], damping ratio and gain [Pa/(N s)]"
        raise ModelError(Problem("sound_path", shown(rows), rule, "such as [[1200, 0.02, 1.0]]")) from None
    try:
        casing_path(modes)
    except ModelError as error:
        raise ModelError(replace(problem, place=f"sound_{problem.place}") for problem in error.problems) from None
    return modes


def evaluated(data: xr.Dataset, points: Points) -> xr.Dataset:
    """Return what follows from the outputs of every condition.

    ``threshold margin`` and ``hardest part`` where the driveline has loose gears, and gaps; ``rating`` where it has a
    sound level, NaN in silence and beyond the calibration points.
    """
    import xarray as xr

    grid = data[OUTCOME].dims
    is_done = data[OUTCOME].values == DONE
    added: dict[str, Any] = {}
    # drag torque over the torque needed, of the loose gear nearest to lifting off
    if "margin" in data:
        ratios = 10.0 ** (data["margin"].transpose(*grid, "part").values / 20.0)
        largest = np.max(np.nan_to_num(ratios, nan=-1.0, posinf=np.inf), axis=-1)
        with np.errstate(divide="ignore"):
            margin = np.where(largest >= 0.0, 1.0 / np.maximum(largest, 0.0), np.nan)
        added[MARGIN] = (grid, margin, {"units": "1"})
    # the gap of the hardest impact
    gaps = str(data["severity"].attrs.get("can_rattle", "")).split() if "severity" in data else []
    if ENERGY in data and gaps:
        energies = np.nan_to_num(data[ENERGY].sel(part=gaps).transpose(*grid, "part").values)
        where = np.where(is_done & (energies.max(axis=-1) > 0.0), energies.argmax(axis=-1), -1).astype(np.int8)
        meanings = {"flag_values": list(range(len(gaps))), "flag_meanings": " ".join(gaps), "units": "1"}
        added[HARDEST_PART] = (grid, where, meanings)
    # straight lines between the user's points
    if SOUND_LEVEL in data:
        added[RATING] = (grid, rated(data[SOUND_LEVEL].values, points), {"units": "1"})
    words = ", ".join(f"{level:g} dB: {rating:g}" for level, rating in points)
    return xr.Dataset(added, attrs={"calibration": words})


def rated(levels: NDArray[np.float64], points: Points) -> NDArray[np.float64]:
    """Return the ratings of levels [dB]: NaN without calibration points, and beyond them."""
    if not points:
        return np.full(levels.shape, np.nan)
    known, ratings = np.array(points).T
    return np.asarray(np.interp(levels, known, ratings, left=np.nan, right=np.nan), dtype=np.float64)
