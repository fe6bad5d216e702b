"""Branches of periodic motions over a value of a model: their points, their events, and what is asked about them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import astuple, dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from gearrattle.assembly import assemble
from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events.event_record import Event
from gearrattle.engine.periodic.families import Family
from gearrattle.engine.periodic.point import Point
from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.errors import ConvergenceError
from gearrattle.model import Model
from gearrattle.model.factors import Written
from gearrattle.model.path_labels import path_label
from gearrattle.model.value_kinds import Plain
from gearrattle.orbits.followed_branch import Curve
from gearrattle.orbits.gradients import gradients_of, scatter_of, tolerances_of
from gearrattle.orbits.motion_map import MotionMap, map_of
from gearrattle.orbits.orbit import Orbit
from gearrattle.orbits.run_ups import RunUpJumps, run_up_of
from gearrattle.orbits.swept_motions import Sweeps
from gearrattle.orbits.two_parameters.event_boundary import boundary_of
from gearrattle.orbits.value_family import check_index, family_of, unit_of, watched_names
from gearrattle.result import Result
from gearrattle.wording import counted

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

Array = NDArray[np.float64]
MEAN = "mean at corner"
_LOCATED = 1e-12  # of the way between two points

NARROW = 1e-3
"""Share of the range: events nearer to each other are shown as one family, narrower ranges not at all."""
NARROW_RULE = Plain("non-negative")
_COLUMNS = ("branch", "kind", "value", "point", "clearance", "collision", "grazing", "root")


@dataclass(frozen=True)
class Levels:
    """How far a motion deflects the clearances, and where their corners are."""

    deflections: Array  # (3, K) lowest, highest and mean deflections [rad or m]
    corners: tuple[Array, ...]  # of every clearance (any number) [rad or m]


def levels_of(family: Family, point: Point, like: Sequence[Array]) -> Levels:
    """Return the levels of a motion; ``like`` has the corners of the clearances of the model itself.

    Where a clearance has closed there is none of that name, and all are NaN; so are the corners of a clearance that has
    other ones.
    """
    period_map = family.map_at(point.parameter)
    corners = [period_map.system.laws[k].corners for k in period_map.system.clearances]
    if len(corners) != len(like):
        return Levels(np.full((3, len(like)), np.nan), tuple(np.full(own.shape, np.nan) for own in like))
    known = (
        own if own.shape == model.shape else np.full(model.shape, np.nan)
        for own, model in zip(corners, like, strict=True)
    )
    return Levels(period_map.levels(point.motion), tuple(known))


def corners_of(levels: Sequence[Levels]) -> tuple[Array, ...]:
    """Return of every clearance (levels, corners) where its corners are."""
    return tuple(np.stack(own) for own in zip(*(one.corners for one in levels), strict=True))


def mean_events(curve: Continuation, known: Curve, levels: Sequence[Levels]) -> list[Event]:
    """Return where means pass corners along one branch."""
    return [
        event
        for ends, before, after in zip(known.steps(), levels[:-1], levels[1:], strict=True)
        for event in _between(curve, ends, before, after)
    ]


def _between(curve: Continuation, ends: tuple[Point, Point], before: Levels, after: Levels) -> Iterator[Event]:
    """Yield where means pass corners between two points."""

    def distance(share: float, watch: int, corner: int) -> float:
        point = curve.between(*ends, share)
        return float(_away(levels_of(curve.family, point, before.corners), watch)[corner])

    for watch in range(len(before.corners)):
        for corner in np.flatnonzero(_away(before, watch) * _away(after, watch) < 0.0).tolist():
            with suppress(ConvergenceError):  # a corner of the branch in between
                share = float(brentq(distance, 0.0, 1.0, (watch, corner), xtol=_LOCATED))
                yield Event(MEAN, curve.between(*ends, share), watch)


def _away(levels: Levels, watch: int) -> Array:
    """How far the mean of a clearance is beyond each of its corners [rad or m]."""
    return np.asarray(levels.deflections[2, watch] - levels.corners[watch])


@dataclass(frozen=True)
class Branch(Result):
    """Branches of periodic motions over a value of the model.

    Attributes
    ----------
    model
        the driveline.
    path
        of the value.
    range
        (2,) its ends [SI].
    cycles
        periods T after which the motions repeat.
    curves
        the branches as the engine has them; the first starts at the first end of the range.
    notes
        what the user must know.
    sweeps
        stable motions by exact runs, where branches could not be followed in the time allowed; there may be no
        branches then. None: the branches say all.
    narrow
        share of the range: on the page events nearer to each other are one family, narrower ranges are left out.

    Examples
    --------
    >>> model = gr.example("rattle_oscillator")
    >>> branch = gr.continuation(model, "torque.0.harmonics.0.amplitude", (4.0, 7.0))
    >>> branch.data.sizes["point"] > 20, list(branch.data.data_vars)[:3]
    (True, ['branch', 'cycles', 'value'])
    """

    kind: ClassVar[str] = "branches"
    model: Model = field(repr=False, compare=False)
    path: str
    range: tuple[float, float]
    cycles: int
    curves: tuple[Curve, ...] = field(repr=False, compare=False)
    notes: tuple[str, ...] = ()
    sweeps: Sweeps | None = field(default=None, repr=False, compare=False)
    narrow: float = NARROW

    @cached_property
    def points(self) -> tuple[Point, ...]:
        """The points of all branches, one after the other."""
        return tuple(point for curve in self.curves for point in curve.points)

    @cached_property
    def data(self) -> xr.Dataset:
        """A Dataset over "point".

        branch (0: the one that starts at the first end of the range), cycles (periods of its motions), value [SI],
        stable, multiplier (point, mode), peak_to_peak, mean, lowest and highest deflection (point, clearance) [rad or
        m], crossings (of corners, how many), error of the state over its size. With ``sweeps`` also over "motion", the
        exact runs: swept_value, swept_upward, swept_cycles (0: does not repeat), swept_periods, swept_verdict,
        swept_rms, swept_swing, swept_impacts (motion, clearance); and over "jump": jump_value, jump_error (half the
        width of its bracket) [SI], jump_upward, jump_clearance, jump_kind.
        """
        import xarray as xr

        # multipliers, the largest first; those of the trains that turn freely are 1
        points = self.points
        names = assemble(self.model).layout.clearance_names
        turning = len(relative_coordinates(assemble(self.model).system).references)
        modes = [np.append(point.multipliers, np.ones(turning)) for point in points]
        multipliers = np.array(modes).reshape(len(points), len(modes[0]) if modes else 0)
        order = np.argsort(-np.round(np.abs(multipliers), 12), axis=1, kind="stable")
        multipliers = np.take_along_axis(multipliers, order, axis=1)
        # deflections
        known = [one.deflections for levels in self._levels for one in levels]
        low, high, mean = np.stack(known, axis=1) if known else np.zeros((3, 0, len(names)))
        unit = {"units": "1" if self.model.units != "SI" else "rad, or m for a mesh"}
        of_value = {"units": path_label(self.path, self.model).unit or "1"}
        clearances = ("point", "clearance")
        variables = {
            "branch": ("point", np.repeat(np.arange(len(self.curves)), [len(c.points) for c in self.curves])),
            "cycles": ("point", np.repeat([c.cycles for c in self.curves], [len(c.points) for c in self.curves])),
            "value": (
                "point",
                np.array([point.parameter for point in points]),
                of_value,
            ),
            "stable": ("point", np.array([stable for curve in self.curves for stable in curve.stable])),
            "multiplier": (("point", "mode"), multipliers),
            "peak_to_peak": (clearances, high - low, unit),
            "lowest": (clearances, low, unit),
            "highest": (clearances, high, unit),
            "mean": (clearances, mean, unit),
            "crossings": ("point", np.array([(p.motion.crossings.watch < len(names)).sum() for p in points])),
            "error": ("point", np.array([point.error for point in points])),
        }
        if self.sweeps is not None:
            variables |= self.sweeps.variables(of_value, unit)
        attributes = {"result": self.kind, "path": self.path, "cycles": self.cycles, "title": self.model.name}
        return xr.Dataset(variables, {"clearance": list(names)}, attributes)

    @cached_property
    def events(self) -> pd.DataFrame:
        """The events of all branches, in the order of each branch.

        branch, kind, value [SI], point (the last one before it), clearance (what grazes or crosses; empty for none),
        collision (whether the gradient jumps there), grazing (its kind: "compliant", "jump", "release" or "rigid";
        empty for other events), root (of a grazing: change of the gradient's trace beyond it over the square root of
        that of the value, in the limit; NaN where the gradient jumps, at a limiter's bound, in a vertical branch, and
        for other events).
        """
        import pandas as pd

        rows: list[tuple[object, ...]] = []
        first = 0
        names = watched_names(self.model)
        for number, (curve, events) in enumerate(zip(self.curves, self.events_of_curves, strict=True)):
            lengths = [point.length for point in curve.points]
            for event in events:
                before = max(0, int(np.searchsorted(lengths, event.point.length, side="right")) - 1)
                name = names[event.watch] if event.watch >= 0 else ""
                row = number, event.kind, event.point.parameter, first + before, name, event.is_collision
                rows.append((*row, *(("", np.nan) if event.grazing is None else astuple(event.grazing))))
            first += len(curve.points)
        return pd.DataFrame(rows, columns=list(_COLUMNS))

    def gradients(self, event: int, paths: Sequence[str] | None = None) -> pd.DataFrame:
        """Return how an event moves with the numbers of the model.

        Parameters
        ----------
        event
            its row in ``events``; a fold, period doubling, Neimark-Sacker, grazing, symmetry breaking or end of a
            family.
        paths
            of the numbers; None: of all that are not zero.

        Returns
        -------
        pandas.DataFrame
            path, value [SI], gradient (change of the event's value for a unit of the number), per_10_percent (change
            for 10 % more of it); what moves the event most comes first. NaN where a number cannot be changed alone, or
            where a grazing lies nearer than 3e-7 of arclength to an event of another kind.

        Raises
        ------
        ModelError
            no such event, or one of another kind.

        Examples
        --------
        >>> model = gr.example("rattle_oscillator")
        >>> branch = gr.continuation(model, "torque.0.harmonics.0.amplitude", (5.9, 6.1), start="linear")
        >>> table = branch.gradients(0, ["torque.0.mean"])  # contact is lost in proportion to the mean torque
        >>> round(float(table["per_10_percent"][0]) / float(branch.events["value"][0]), 6)
        0.1
        """
        chosen, curve = self._located(event)
        return gradients_of(self.model, self.path, curve, chosen, paths)

    def boundary(
        self,
        event: int,
        second: str,
        range: tuple[Written, Written],
        *,
        progress: Callable[[float], None] | None = None,
    ) -> xr.Dataset:
        """Follow an event over a second value of the model: a border curve in the plane of both values.

        Parameters
        ----------
        event
            its row in ``events``; a fold, period doubling, Neimark-Sacker, grazing, symmetry breaking or end of a
            family.
        second
            path of the other value.
        range
            its ends, numbers in SI or strings with a unit; the model's own value lies between them.
        progress
            called with the finished share; an exception from it ends the work.

        Returns
        -------
        xr.Dataset
            Over "point", the second value ascending: second, value of the event, special, error of its state [SI].
            ``special`` names what lies at a point, and is empty at most of them: "cusp" (a fold has met another one),
            "turning point" (the event has met its like otherwise), "fold meets grazing". The curve may end at points
            of other kinds, which are not named. ``notes`` in the attributes say where it ends inside the range.

        Raises
        ------
        ModelError
            no such event, one of another kind, a path that leads nowhere, a range without sense.

        Examples
        --------
        >>> model = gr.example("rattle_oscillator")
        >>> branch = gr.continuation(model, "torque.0.harmonics.0.amplitude", (5.9, 6.1), start="linear")
        >>> curve = branch.boundary(0, "torque.0.mean", (7.0, 8.0))  # contact is lost in proportion to the mean torque
        >>> bool(np.ptp(curve["value"] / curve["second"]) < 1e-9)
        True
        """
        return boundary_of(self, self._located(event), second, range, progress)

    def map(
        self,
        second: str,
        range: tuple[Written, Written],
        *,
        across: int = 32,
        up: int = 20,
        isolated: bool = False,
        progress: Callable[[float], None] | None = None,
    ) -> MotionMap:
        """Say over two values of the model where rattle must be, where it may be and where it is not.

        The branches are followed at every second value, from those of the value before. What a simulation settles in
        at both ends of the range is added there, and followed to the values on both sides.

        Parameters
        ----------
        second
            path of the other value.
        range
            its ends, numbers in SI or strings with a unit; the model's own value lies between them.
        across, up
            numbers of cells over the value of the branch and over the second one.
        isolated
            whether in every row branches are sought as well that are not connected to those of the row before.
        progress
            called with the finished share; an exception from it ends the work.

        Returns
        -------
        MotionMap
            For every cell its motions and what they say; folds, grazings and ends of families as curves.

        Raises
        ------
        ModelError
            a path that leads nowhere, a range without sense, too few or too many cells.

        Examples
        --------
        >>> model = gr.example("rattle_oscillator")
        >>> branch = gr.continuation(model, "torque.0.harmonics.0.amplitude", (5.9, 6.3), start="linear")
        >>> branch.map("torque.0.mean", (7.5, 7.6), across=4, up=1).data["signs"].values.tolist()
        [[1, 1, 1, 1]]
        """
        return map_of(self, second, range, (across, up), isolated=isolated, progress=progress)

    def run_up(self, rate: float | str, *, progress: Callable[[float], None] | None = None) -> RunUpJumps:
        """Simulate a run-up and a run-down over the range of a branch over the speed, and say where they jump.

        Each begins on the stable motion at its end of the range.

        Parameters
        ----------
        rate
            by which the speed changes: a number in rad/s^2, or a string with a unit, such as "100 rpm/s". Each run
            must last at least a cycle of the fastest input, or a 64th of the period T.
        progress
            called with the finished share; an exception from it ends the work.

        Returns
        -------
        RunUpJumps
            Every event that they pass at which a motion ends or loses its stability, with the speed of the jump and its
            delay: a jump belongs to the last such event before it of a motion on which the run was.

        Raises
        ------
        ModelError
            a branch over something else than the speed, a rate without sense or at which a run is too short or long.

        Examples
        --------
        >>> branch = gr.continuation(gr.example("backlash_oscillator"), "excitation.speed", (0.6, 0.9))
        >>> [jump.upward for jump in branch.run_up(1e-3).jumps]
        [True, False]
        """
        return run_up_of(self, rate, progress)

    def _located(self, event: int) -> tuple[Event, Continuation]:
        """An event by its row, and the Continuation of its branch."""
        check_index("event", event, (0, len(self.events)))
        located = zip(self.curves, self.events_of_curves, strict=True)
        chosen, own = [(one, curve) for curve, events in located for one in events][event]
        return chosen, self.follower(own)

    def scatter(self, event: int, tolerances: Mapping[str, Written]) -> float:
        """Return the standard deviation of an event under tolerances: independent numbers, to first order [SI].

        Parameters
        ----------
        event
            its row in ``events``.
        tolerances
            standard deviations by path: numbers in SI, strings with a unit, or factors of what the model says; at a
            pattern all that match scatter, each by itself.

        Raises
        ------
        ModelError
            no such event, a path that leads nowhere, a deviation below zero.
        """
        read = tolerances_of(self.model, self.path, tolerances)
        table = self.gradients(event, list(read)).set_index("path")
        return scatter_of(table["gradient"].to_dict(), read)

    def orbit(self, i: int) -> Orbit:
        """Return the periodic motion at a point.

        Parameters
        ----------
        i
            the point, from 0; negative ones count from the end.

        Raises
        ------
        ModelError
            there is no such point.
        """
        check_index("point", i, (-len(self.points), len(self.points)))
        return self.orbit_at(self.points[i], int(np.concatenate([[c.cycles] * len(c.points) for c in self.curves])[i]))

    def orbit_at(self, point: Point, cycles: int) -> Orbit:
        """Return the periodic motion of a point of the engine, of an event for example, and its periods."""
        model = self.model.with_({self.path: float(point.parameter)})
        return Orbit(model, cycles, point.motion, point.error, point.free)

    def __repr__(self) -> str:
        points = counted(len(self.points), "point")
        branches = counted(len(self.curves), "branch", "branches")
        return f"<Branch of {self.model.name!r} over {self.path}: {branches}, {points}>"

    @cached_property
    def event_levels(self) -> Array:
        """(E, 3, K) lowest, highest and mean deflection of the K clearances at the E events of ``events``."""
        clearances = len(assemble(self.model).layout.clearance_names)
        levels = [one.deflections for one in self._levels_of_events]
        return np.array(levels).reshape(len(levels), 3, clearances)

    @cached_property
    def corners(self) -> tuple[Array, ...]:
        """(P, corners) of every clearance, its corners at the points [rad or m]: the value may move them."""
        return corners_of([one for levels in self._levels for one in levels])

    @cached_property
    def event_corners(self) -> tuple[Array, ...]:
        """(E, corners) of every clearance, its corners at the events [rad or m]."""
        return corners_of(self._levels_of_events)

    @cached_property
    def _levels(self) -> tuple[tuple[Levels, ...], ...]:
        """For every branch and each of its points: deflections and corners of the clearances."""
        like = assemble(self.model).layout.corners
        followers = [(curve, self.follower(curve).family) for curve in self.curves]
        return tuple(tuple(levels_of(family, point, like) for point in curve.points) for curve, family in followers)

    @cached_property
    def _levels_of_events(self) -> list[Levels]:
        """For every event: deflections and corners of the clearances."""
        like = assemble(self.model).layout.corners
        return [
            levels_of(self.follower(curve).family, event.point, like)
            for curve, events in zip(self.curves, self.events_of_curves, strict=True)
            for event in events
        ]

    @cached_property
    def events_of_curves(self) -> tuple[tuple[Event, ...], ...]:
        """The events of every branch in order, those of the means included."""
        merged = []
        for curve, levels in zip(self.curves, self._levels, strict=True):
            means = mean_events(self.follower(curve), curve, levels)
            merged.append(tuple(sorted([*curve.events, *means], key=lambda event: event.point.length)))
        return tuple(merged)

    def follower(self, curve: Curve) -> Continuation:
        """Return the Continuation of a branch, in the units of its points."""
        first = curve.points[0]
        family = family_of(self.model, self.path, first.parameter, curve.cycles, unit_of(self.range))
        return Continuation(family, units=(first.scale, first.size))
