"""A map of periodic motions over two values of a model: where rattle is certain, where possible, where there is none.

A row of cells has one second value and its own branches. Each cell is judged by all motions of these branches at the
middle of the cell. Multipliers decide stability, criteria decide rattle. The sum of the signs of det(I - M) over all
motions is 1 if the motions are bounded and none is missing (``all_motions``); so a cell also shows a missing motion.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.point import Point
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.factors import Written
from gearrattle.model.path_labels import path_label, shown_value
from gearrattle.model.value_kinds import CALLBACK, FLAG, Count, Reader, argument_problems
from gearrattle.orbits.branch_switching import branches_missed, doublings_left
from gearrattle.orbits.followed_branch import Curve
from gearrattle.orbits.gradients import second_of
from gearrattle.orbits.known_motions import Known
from gearrattle.orbits.orbit import CYCLES, Orbit, is_stable
from gearrattle.orbits.progress import Progress, never_falling, stretch_of
from gearrattle.orbits.two_parameters.branches_at_second_value import Plane, Row, own_row, rows_of
from gearrattle.orbits.two_parameters.event_boundary import Border, borders_of
from gearrattle.orbits.two_parameters.special_points import SpecialPoint
from gearrattle.orbits.value_family import notes_at_end
from gearrattle.result import Result
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

    from gearrattle.orbits.branch import Branch

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

QUIET, BESIDE, MUST, NOTHING_STABLE, MISSING, NOT_COUNTED = range(6)
WORDS = {
    QUIET: "no rattle was found, and the sum of signs agrees",
    BESIDE: "rattle exists beside a quiet motion",
    MUST: "only rattling motions are stable",
    NOTHING_STABLE: "no stable motion was found, and the sum of signs agrees",
    MISSING: "a motion is missing, as the sum of signs is not 1",
    NOT_COUNTED: "no rattle was found, and the signs cannot be counted",
}
"""Meaning of the code of a cell."""
CELLS = Count(1, 512)
"""Numbers of cells over a value."""


class Cell(NamedTuple):
    """The motions of one cell.

    Attributes
    ----------
    quiet, rattling, unstable
        numbers of motions: stable without rattle, stable with rattle, unstable.
    signs
        sum of the signs of det(I - M) over all fixed points of the map over n periods.
    not_counted
        why the sum need not be 1 even if no motion is missing; empty if it must be 1.
    """

    quiet: int
    rattling: int
    unstable: int
    signs: int
    not_counted: str

    @property
    def code(self) -> int:
        """Judgement on the cell, a key of ``WORDS``."""
        if self.quiet and self.rattling:
            return BESIDE
        if not self.not_counted and self.signs != 1:
            return MISSING
        if self.rattling:
            return MUST
        if self.not_counted:
            return NOT_COUNTED
        return QUIET if self.quiet else NOTHING_STABLE


@dataclass(frozen=True)
class MotionMap(Result):
    """Periodic motions over two values of a model.

    Attributes
    ----------
    model
        the driveline.
    path, second
        paths of the two values.
    range, second_range
        (2,) ascending ends of their ranges [SI].
    cycles
        n, periods T after which the motions repeat.
    value, seconds
        (A,) and (U,) middles of the cells [SI].
    cells
        U rows of A cells.
    borders
        folds, grazings and ends of families of the branch at the model's own second value, as curves.
    special_points
        points at which these curves end or meet.
    notes
        sentences that the user must know.

    Examples
    --------
    >>> model = gr.example("rattle_oscillator")
    >>> branch = gr.continuation(model, "torque.0.harmonics.0.amplitude", (3.0, 6.6), start="linear")
    >>> motions = branch.map("torque.0.mean", (7.0, 8.0), across=6, up=2)
    >>> motions.data["code"].values[0].tolist()
    [1, 1, 1, 1, 1, 2]
    """

    kind: ClassVar[str] = "map of motions"
    model: Model = field(repr=False, compare=False)
    path: str
    second: str
    range: tuple[float, float]
    second_range: tuple[float, float]
    cycles: int
    value: Array = field(repr=False, compare=False)
    seconds: Array = field(repr=False, compare=False)
    cells: tuple[tuple[Cell, ...], ...] = field(repr=False, compare=False)
    borders: tuple[Border, ...] = field(default=(), repr=False, compare=False)
    special_points: tuple[SpecialPoint, ...] = field(default=(), repr=False, compare=False)
    notes: tuple[str, ...] = ()

    @cached_property
    def data(self) -> xr.Dataset:
        """A Dataset over "second" and "value", the middles of the cells [SI].

        code (meaning in ``flag_meanings``), quiet, rattling, unstable (numbers of motions), signs (sum of signs), and
        over "border_point" the curves: border_event (row in the events of the branch), border_kind, border_value,
        border_second; over "special_point" special_kind, special_value, special_second.
        """
        import xarray as xr

        # the cells
        dims = ("second", "value")
        names = Cell._fields[:-1]
        counts = {
            name: (dims, np.array([[getattr(cell, name) for cell in row] for row in self.cells])) for name in names
        }
        codes = np.array([[cell.code for cell in row] for row in self.cells], dtype=np.int8)
        meanings = {"flag_values": list(WORDS), "flag_meanings": "; ".join(WORDS.values())}
        value_unit, second_unit = (
            {"units": path_label(name, self.model).unit or "1"} for name in (self.path, self.second)
        )
        # the curves of events, and their special points
        points = [(b, v, s) for b in self.borders for v, s in zip(b.value.tolist(), b.second.tolist(), strict=True)]
        special = self.special_points
        along = "border_point"
        at = "special_point"
        curves = {
            "border_event": (along, np.array([b.event for b, _, _ in points], dtype=np.int64)),
            "border_kind": (along, np.array([b.kind for b, _, _ in points], dtype=np.str_)),
            "border_value": (along, np.array([v for _, v, _ in points], dtype=np.float64), value_unit),
            "border_second": (along, np.array([s for _, _, s in points], dtype=np.float64), second_unit),
            "special_kind": (at, np.array([point.kind for point in special], dtype=np.str_)),
            "special_value": (at, np.array([point.value for point in special], dtype=np.float64), value_unit),
            "special_second": (at, np.array([point.second for point in special], dtype=np.float64), second_unit),
        }
        axes = {"value": ("value", self.value, value_unit), "second": ("second", self.seconds, second_unit)}
        about = {"result": self.kind, "path": self.path, "second": self.second, "cycles": self.cycles}
        attributes = {**about, "title": self.model.name}
        return xr.Dataset({"code": (dims, codes, meanings), **counts, **curves}, axes, attributes)

    def __repr__(self) -> str:
        up = len(self.seconds)
        across = len(self.value)
        return f"<MotionMap of {self.model.name!r} over {self.path} and {self.second}: {up} x {across} cells>"


def map_of(
    branch: Branch,
    second: str,
    range: Sequence[Written],
    counts: tuple[int, int],
    *,
    isolated: bool,
    progress: Callable[[float], None] | None,
) -> MotionMap:
    """Return the map of a branch over a second value; see ``Branch.map``.

    Raises ModelError: a path that leads nowhere, a range without sense; too few or too many cells.
    """
    across, up = counts
    rules: dict[str, tuple[Reader, Any]] = {"across": (CELLS, across), "up": (CELLS, up), "isolated": (FLAG, isolated)}
    if problems := argument_problems({**rules, "progress": (CALLBACK, progress)}):
        raise ModelError(problems)
    own, ends = second_of(branch.model, branch.path, second, range)
    if left := notes_at_end(branch.model, branch.path, branch.range):
        raise ModelError(Problem("branch", repr(branch), left[0], "follow it to a value a little before that"))
    first, last = sorted(branch.range)
    plane = Plane(branch.model, branch.path, second, (first, last), ends, branch.cycles)
    values = middles(plane.ends, across)
    seconds = middles(plane.second_ends, up)
    work = never_falling(progress)
    # the branches of every row, and notes on branches that were not followed
    own_branches = own_row(plane, own, branch.curves, branch.range[1], isolated=isolated, progress=work)
    rows = rows_of(own_branches, seconds.tolist(), isolated=isolated, progress=stretch_of(work, 0.0, 0.5))
    shown = partial(shown_value, branch.path, branch.model, largest=max(map(abs, branch.range)))
    left = _notes_of(rows, shown, isolated=isolated)
    # the cells, and the borders between them
    cells = cells_of(rows, values, stretch_of(work, 0.5, 0.7))
    borders, special_points, notes = borders_of(
        branch.events,
        lambda event: branch.boundary(event, second, ends),
        (plane.ends, plane.second_ends),
        stretch_of(work, 0.7, 1.0),
        shown,
    )
    notes += left
    for reason in sorted({cell.not_counted for row in cells for cell in row} - {""}):
        notes.append(f"Where {reason} the signs cannot be counted: others may be missing.")
    return MotionMap(
        model=branch.model,
        path=branch.path,
        second=second,
        range=plane.ends,
        second_range=plane.second_ends,
        cycles=branch.cycles,
        value=values,
        seconds=seconds,
        cells=cells,
        borders=tuple(borders),
        special_points=tuple(special_points),
        notes=tuple(notes),
    )


def _notes_of(rows: Sequence[Row], shown: Callable[[float], str], *, isolated: bool) -> list[str]:
    """Notes on the branches of the rows, and on branches that may be missing."""
    plane = rows[0].plane
    curves = [curve for row in rows for curve in row.curves]
    notes = [*dict.fromkeys(note for curve in curves for note in curve.notes)]
    notes += doublings_left(curves, plane.cycles, shown)
    if missed := [row for row in rows if branches_missed(row.curves, plane.cycles, plane.ends, shown)]:
        in_rows = counted(len(missed), "row")
        notes.append(f"In {in_rows} not everything that leaves at doublings and breakings of symmetry is followed.")
    if lost := sum(row.lost for row in rows):
        ends_lost = counted(lost, "end of a branch", "ends of branches")
        notes.append(f"{ends_lost} could not be followed from one row to the next: there may be further motions.")
    if not isolated and 2 * plane.cycles <= CYCLES.most:
        longer = counted(2 * plane.cycles, "period")
        shorter = counted(plane.cycles, "period")
        notes.append(
            f"Motions of {longer} are known only where they leave a branch of {shorter}, or where a simulation settles "
            "in them at an end of a row; isolated branches were not sought."
        )
    return notes


def middles(ends: tuple[float, float], count: int) -> Array:
    """Return (count,) middles of equal cells between two ends."""
    return ends[0] + (ends[1] - ends[0]) * (np.arange(count) + 0.5) / count


def cells_of(rows: Sequence[Row], values: Array, progress: Progress) -> tuple[tuple[Cell, ...], ...]:
    """Return the cells of some rows at (A,) first values [SI]; in cells without a quiet motion one is sought."""
    cells = []
    for done, row in enumerate(rows, 1):
        own = _judged(row, values)
        for i, value in enumerate(values.tolist()):
            if not own[i].quiet and row.add_in_contact(value):
                own = _judged(row, values)
        cells.append(own)
        progress(done / len(rows))
    return tuple(cells)


def _judged(row: Row, values: Array) -> tuple[Cell, ...]:
    """The cells of a row."""
    curves = [_JudgedCurve(row, curve) for curve in row.curves]
    return tuple(_cell(row, curves, value) for value in values.tolist())


def _cell(row: Row, curves: Sequence[_JudgedCurve], value: float) -> Cell:
    """The motions of a row at a first value."""
    known = Known(row.follower(row.plane.cycles).family.map_at(value))
    quiet = 0
    rattling = 0
    unstable = 0
    for judged in curves:
        for index, point in judged.curve.motions_at(row.follower(judged.curve.cycles), value):
            if judged.is_known(known, point):
                continue
            if not is_stable(point.multipliers, point.free):
                unstable += 1
            elif judged.rattles(index, point):
                rattling += 1
            else:
                quiet += 1
    return Cell(quiet, rattling, unstable, known.index(), known.not_counted)


class _JudgedCurve:
    """A branch whose motions are judged once for every stretch in which the order of crossings stays the same."""

    def __init__(self, row: Row, curve: Curve) -> None:
        self._row = row
        self.curve = curve
        changes = [before.pattern != after.pattern for before, after in curve.steps()]
        self._stretch: IntArray = np.cumsum([False, *changes])
        self._verdicts: dict[int, bool] = {}

    def is_known(self, known: Known, point: Point) -> bool:
        """Return whether a motion is one of some known motions; otherwise add it, if its periods divide theirs."""
        cycles = known.period_map.cycles
        if cycles % self.curve.cycles:
            return False
        motion = known.period_map(point.motion.start) if self.curve.cycles < cycles else point.motion
        return not known.add(motion)

    def rattles(self, before: int, point: Point) -> bool:
        """Return whether a motion rattles; ``before`` is the index of the point before it."""
        neighbours = [i for i in (before, before + 1) if i < len(self.curve.points)]
        alike = next((i for i in neighbours if self.curve.points[i].pattern == point.pattern), None)
        if alike is None:
            return self._judged(point)
        stretch = int(self._stretch[alike])
        if stretch not in self._verdicts:
            self._verdicts[stretch] = self._judged(point)
        return self._verdicts[stretch]

    def _judged(self, point: Point) -> bool:
        """Whether the criteria say that a motion rattles."""
        model = self._row.model.with_({self._row.plane.path: float(point.parameter)})
        orbit = Orbit(model, self.curve.cycles, point.motion, point.error, point.free)
        return orbit.verdict.verdict != "quiet"
