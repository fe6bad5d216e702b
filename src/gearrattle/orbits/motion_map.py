"""A map of the motions that repeat over two values of a model: where rattle must be, where it may be, where it is not.

In the middle of every cell all motions of the branches of its row are taken. Their stability is that of their
multipliers, whether they rattle that of the criteria. The signs of det(I - M) over all of them add up to 1
if the motions are bounded and none is missing (``all_motions``); so a cell says as well whether one is missing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.period_map import Pass
from gearrattle.engine.periodic.point import Point
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.factors import Written
from gearrattle.model.path_labels import path_label, shown_value
from gearrattle.model.quantity import CALLBACK, FLAG, Count, Reader, argument_problems
from gearrattle.orbits.branch_members import Followed
from gearrattle.orbits.branch_switching import branches_missed, doublings_left
from gearrattle.orbits.curve import Curve
from gearrattle.orbits.gradients import second_of
from gearrattle.orbits.known_motions import Known
from gearrattle.orbits.orbit import CYCLES, Orbit, is_stable
from gearrattle.orbits.over_value import notes_at_end
from gearrattle.orbits.progress import stretch_of
from gearrattle.orbits.rows_of_branches import Plane, Row, in_contact, own_row, rows_of
from gearrattle.orbits.two_parameters.boundary import Border, SpecialPoint, borders_of
from gearrattle.result import Result
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

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
"""What a cell's code means."""
CELLS = Count(1, 512)
"""Numbers of cells over a value."""


class Cell(NamedTuple):
    """The motions of one cell.

    Attributes
    ----------
    quiet, rattling, unstable
        how many motions are stable and quiet, stable and rattle, unstable.
    signs
        sum of the signs of det(I - M) over all fixed points of the map over n periods.
    not_counted
        why the sum need not be 1; empty where it is 1 if no motion is missing.
    """

    quiet: int
    rattling: int
    unstable: int
    signs: int
    not_counted: str

    @property
    def code(self) -> int:
        """What the motions say, one of the keys of ``WORDS``."""
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
    """The motions that repeat, over two values of a model.

    Attributes
    ----------
    model
        the driveline.
    path, second
        of the two values.
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
        where they end or meet.
    notes
        what the user must know.

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

        code (its meaning in ``flag_meanings``), quiet, rattling, unstable (how many motions), signs (their sum), and
        over "border_point" the curves: border_event (row in the events of the branch), border_kind, border_value,
        border_second; over "special_point" special_kind, special_value, special_second.
        """
        import xarray as xr

        dims = ("second", "value")
        names = Cell._fields[:-1]
        counts = {
            name: (dims, np.array([[getattr(cell, name) for cell in row] for row in self.cells])) for name in names
        }
        codes = np.array([[cell.code for cell in row] for row in self.cells], dtype=np.int8)
        meanings = {"flag_values": list(WORDS), "flag_meanings": "; ".join(WORDS.values())}
        unit = {name: {"units": path_label(name, self.model).unit or "1"} for name in (self.path, self.second)}
        points = [(b, v, s) for b in self.borders for v, s in zip(b.value.tolist(), b.second.tolist(), strict=True)]
        along = "border_point"
        curves: dict[str, Any] = {
            "border_event": (along, np.array([b.event for b, _, _ in points], dtype=np.int64)),
            "border_kind": (along, np.array([b.kind for b, _, _ in points], dtype=np.str_)),
            "border_value": (along, np.array([v for _, v, _ in points], dtype=np.float64), unit[self.path]),
            "border_second": (along, np.array([s for _, _, s in points], dtype=np.float64), unit[self.second]),
        }
        for name, column in zip(("kind", "value", "second"), self._special_columns(), strict=True):
            about = unit[self.path] if name == "value" else unit[self.second] if name == "second" else {}
            curves[f"special_{name}"] = ("special_point", column, about)
        axes = {"value": ("value", self.value, unit[self.path]), "second": ("second", self.seconds, unit[self.second])}
        attributes = {
            "result": self.kind,
            "path": self.path,
            "second": self.second,
            "cycles": self.cycles,
            "title": self.model.name,
        }
        return xr.Dataset({"code": (dims, codes, meanings), **counts, **curves}, axes, attributes)

    def _special_columns(self) -> tuple[NDArray[Any], ...]:
        """Kinds, values and second values of the special points."""
        points = self.special_points
        kinds = np.array([point.kind for point in points], dtype=np.str_)
        return kinds, *(np.array([getattr(point, name) for point in points]) for name in ("value", "second"))

    def __repr__(self) -> str:
        up, across = len(self.seconds), len(self.value)
        return f"<MotionMap of {self.model.name!r} over {self.path} and {self.second}: {up} x {across} cells>"


def map_of(
    branch: Followed,
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
    values, seconds = middles(plane.ends, across), middles(plane.second_ends, up)
    first_row = own_row(plane, own, branch.curves, branch.range[1], isolated=isolated, progress=progress)
    rows = rows_of(plane, first_row, seconds.tolist(), isolated=isolated, progress=stretch_of(progress, 0.0, 0.5))
    cells = cells_of(plane, rows, values, stretch_of(progress, 0.5, 0.7))
    shown = partial(shown_value, branch.path, branch.model, largest=max(map(abs, branch.range)))
    borders, special_points, notes = borders_of(
        branch.events,
        lambda event: branch.boundary(event, second, ends),
        (plane.ends, plane.second_ends),
        stretch_of(progress, 0.7, 1.0),
        shown,
    )
    notes += dict.fromkeys(note for row in rows for curve in row.curves for note in curve.notes)
    notes += doublings_left([curve for row in rows for curve in row.curves], branch.cycles, shown)
    missed = [row for row in rows if branches_missed(row.curves, branch.cycles, plane.ends, shown)]
    if missed:
        in_rows = counted(len(missed), "row")
        notes.append(f"In {in_rows} not everything that leaves at doublings and breakings of symmetry is followed.")
    if lost := sum(row.lost for row in rows):
        ends_lost = counted(lost, "end of a branch", "ends of branches")
        notes.append(f"{ends_lost} could not be followed from one row to the next: there may be further motions.")
    if not isolated and 2 * branch.cycles <= CYCLES.most:
        longer, shorter = counted(2 * branch.cycles, "period"), counted(branch.cycles, "period")
        notes.append(
            f"Motions of {longer} are known only where they leave a branch of {shorter}, or where a simulation settles "
            "in them at an end of a row; isolated branches were not sought."
        )
    for reason in sorted({cell.not_counted for row in cells for cell in row} - {""}):
        notes.append(f"Where {reason} the signs cannot be counted: others may be missing.")
    return MotionMap(
        branch.model,
        branch.path,
        second,
        plane.ends,
        plane.second_ends,
        branch.cycles,
        values,
        seconds,
        cells,
        tuple(borders),
        tuple(special_points),
        tuple(notes),
    )


def middles(ends: tuple[float, float], count: int) -> Array:
    """Return (count,) middles of equal cells between two ends."""
    return ends[0] + (ends[1] - ends[0]) * (np.arange(count) + 0.5) / count


def cells_of(
    plane: Plane, rows: Sequence[Row], values: Array, progress: Callable[[float], None] | None
) -> tuple[tuple[Cell, ...], ...]:
    """Return the cells of some rows.

    ``values``: (A,) first values [SI].
    """
    cells = []
    for done, row in enumerate(rows, 1):
        cells.append(_judged(plane, row, values.tolist()))
        if progress is not None:
            progress(done / len(rows))
    return tuple(cells)


def _judged(plane: Plane, row: Row, values: Sequence[float]) -> tuple[Cell, ...]:
    """The cells of a row; where no quiet motion is known, that in which no corner is passed is sought."""
    judged = _JudgedRow(plane, row)
    cells = [judged.cell(value) for value in values]
    for i, value in enumerate(values):
        if not cells[i].quiet and (further := in_contact(plane, row, value)):
            row = replace(row, curves=(*row.curves, *further))
            judged = _JudgedRow(plane, row)
            cells = [judged.cell(other) for other in values]
    return tuple(cells)


class _JudgedRow:
    """A row whose motions are judged, each stretch of a branch between two changes of its crossings once."""

    def __init__(self, plane: Plane, row: Row) -> None:
        self._model, self._path = plane.model.with_({plane.second: row.second}), plane.path
        self._single = plane.follower(row.second, plane.cycles)
        followers = {plane.cycles: self._single}
        for curve in row.curves:
            if curve.cycles not in followers:
                followers[curve.cycles] = plane.follower(row.second, curve.cycles)
        self._curves = [_JudgedCurve(self._model, self._path, followers[c.cycles], c) for c in row.curves]

    def cell(self, value: float) -> Cell:
        """The motions at a first value."""
        known = Known(self._single.family.map_at(value))
        stable_quiet = stable_rattling = unstable = 0
        for curve in self._curves:
            for index, point in curve.at(value):
                if known.period_map.cycles % curve.known.cycles == 0 and not known.add(curve.over(known, point)):
                    continue
                if not is_stable(point.multipliers, point.free):
                    unstable += 1
                elif curve.rattles(index, point):
                    stable_rattling += 1
                else:
                    stable_quiet += 1
        return Cell(stable_quiet, stable_rattling, unstable, known.index(), known.not_counted)


class _JudgedCurve:
    """A branch whose motions are judged. Between two points with the same crossings nothing else is crossed either."""

    def __init__(self, model: Model, path: str, follower: Continuation, known: Curve) -> None:
        self._model, self._path, self._follower, self.known = model, path, follower, known
        changes = [before.pattern != after.pattern for before, after in known.steps()]
        self._stretch: IntArray = np.cumsum([False, *changes])
        self._verdicts: dict[int, bool] = {}

    def at(self, value: float) -> Iterator[tuple[int, Point]]:
        """Yield its motions at a parameter value."""
        return self.known.motions_at(self._follower, value)

    def over(self, known: Known, point: Point) -> Pass:
        """Return a motion over the periods of some known ones."""
        is_shorter = self.known.cycles < known.period_map.cycles
        return known.period_map(point.motion.start) if is_shorter else point.motion

    def rattles(self, before: int, point: Point) -> bool:
        """Return whether a motion rattles; ``before`` is the index of the point before it."""
        neighbours = [i for i in (before, before + 1) if i < len(self.known.points)]
        alike = next((i for i in neighbours if self.known.points[i].pattern == point.pattern), None)
        if alike is None:
            return self._judged(point)
        stretch = int(self._stretch[alike])
        if stretch not in self._verdicts:
            self._verdicts[stretch] = self._judged(point)
        return self._verdicts[stretch]

    def _judged(self, point: Point) -> bool:
        """Whether the criteria say that a motion rattles."""
        model = self._model.with_({self._path: float(point.parameter)})
        orbit = Orbit(model, self.known.cycles, point.motion, point.error, point.free)
        return orbit.verdict.verdict != "quiet"
