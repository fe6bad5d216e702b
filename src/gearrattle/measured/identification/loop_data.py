"""A measured torque-angle loop: the file or arrays, cut into legs where the rate changes its sign.

    angle [deg], torque [N*m]
    -12.00, -310.2
    -11.95, -300.8

A leg goes from one end of the loop to the other. One cycle that begins and ends between the ends, such as 0, 12, -12,
0 deg, is joined where it closes; it must come back to its first torque. Otherwise what comes before the first end and
after the last one is no part of a closed loop and is left out. A turn counts once the angle has come back by a
twentieth of its range, so noise of the angle makes none.

All values of a loop are in SI.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.model import units
from gearrattle.model.csv_columns import read_columns
from gearrattle.model.csv_layout import RecordError
from gearrattle.wording import counted

Array = NDArray[np.float64]

FEWEST = 40
"""Samples that a loop must have."""
_TURN = 0.05  # share of the angle's range: a smaller way back is no turn
_REACH = 0.03  # share of the angle's range: largest distance of a leg's end from the end of the loop
_GAP = 0.1  # share of the torque's range: largest gap between begin and end of a closed loop
_JOINED = "the test began between its ends: its last samples are joined to its first ones"


@dataclass(frozen=True, eq=False)
class Loop:
    """Samples of closed legs between two ends, in the order in which they were measured.

    Attributes
    ----------
    deflection
        (N,) [rad].
    torque
        (N,) [N m].
    way
        (N,) +1 on a leg with growing deflection, -1 on one with falling deflection.
    turn
        (N,) the deflection at which the sample's leg began [rad].
    leg
        (N,) number of the leg, counted from 0.
    angle_unit
        "deg" where the file's angles are degrees, else "rad".
    """

    deflection: Array
    torque: Array
    way: Array
    turn: Array
    leg: NDArray[np.int64]
    source: str
    notes: tuple[str, ...] = ()
    angle_unit: str = "rad"

    @property
    def ends(self) -> tuple[float, float]:
        """Lowest and highest deflection [rad]."""
        return float(self.deflection.min()), float(self.deflection.max())

    @property
    def full_scale(self) -> float:
        """Largest magnitude of the torque [N m]."""
        return float(np.abs(self.torque).max())

    def with_torque(self, torque: Array) -> Loop:
        """Return a loop with another torque [N m] at the same deflections."""
        return replace(self, torque=torque)


def read_loop(data: Any, angle: str = "angle", torque: str = "torque") -> Loop:
    """Read a loop and cut it into legs.

    Parameters
    ----------
    data
        path of a CSV file whose header names the units, or a pair of arrays, deflection [rad] and torque [N m].

    Raises
    ------
    ModelError
        no such file, a column or its unit missing, too few samples, no reversal, a loop that is not closed.
    """
    # a file: columns with the units of its header
    if isinstance(data, str | os.PathLike):
        path = Path(data)
        if not path.exists():
            raise ModelError(Problem(str(path), "", "no such file", "a CSV file with angle and torque is needed"))
        try:
            columns = read_columns(path, {angle: units.ANGLE, torque: units.TORQUE}, False)
        except RecordError as error:
            raise ModelError(Problem(error.place, error.value, error.rule, error.remedy)) from None
        loop = _cut(columns.values[angle], columns.values[torque], str(path))
        degrees = units.convert(f"1 {columns.unit(angle)}", units.ANGLE) == units.convert("1 deg", units.ANGLE)
        return replace(loop, angle_unit="deg" if degrees else "rad")
    # arrays, which are checked
    try:
        deflection, torques = (np.asarray(values, dtype=np.float64) for values in data)
    except (TypeError, ValueError):
        rule = "must be a path, or a pair of arrays: deflection [rad] and torque [N m]"
        raise ModelError(Problem("data", type(data).__name__, rule)) from None
    if deflection.ndim != 1 or deflection.shape != torques.shape:
        shapes = f"shapes {deflection.shape} and {torques.shape}"
        raise ModelError(Problem("data", shapes, "must be two arrays of the same length"))
    if not (np.isfinite(deflection).all() and np.isfinite(torques).all()):
        raise ModelError(Problem("data", "a value that is not finite", "must hold finite numbers only"))
    return _cut(deflection, torques, "arrays")


def _cut(deflection: Array, torque: Array, source: str) -> Loop:
    # enough samples, which move
    if deflection.size < FEWEST:
        rule = f"too few points for a fit: a loop needs at least {FEWEST}"
        raise ModelError(Problem(source, counted(deflection.size, "sample"), rule, "sample the test more densely"))
    span = float(np.ptp(deflection))
    if not (span > 0.0 and np.ptp(torque) > 0.0):
        raise ModelError(Problem(source, "a constant angle or torque", "a loop needs an angle and a torque that move"))
    # legs between the turns
    turns = _turns(deflection, _TURN * span)
    if len(turns) < 3:
        rule = "no reversal: the angle goes one way only, so friction cannot be separated from stiffness"
        raise ModelError(Problem(source, f"{len(turns) - 1} leg", rule, "give the way out and the way back"))
    # one cycle that begins between its ends is joined where it closes
    if _is_one_cycle_begun_between_its_ends(deflection, torque, turns):
        order = np.r_[turns[1] : deflection.size, : turns[1] + 1]
        loop = _cut(deflection[order], torque[order], source)
        return replace(loop, notes=(*loop.notes, _JOINED))
    # legs that go from one end to the other, on both ways
    low = float(deflection.min())
    high = float(deflection.max())
    whole = [
        (first, last)
        for first, last in pairwise(turns)
        if min(deflection[first], deflection[last]) <= low + _REACH * span
        and max(deflection[first], deflection[last]) >= high - _REACH * span
    ]
    ways = {bool(deflection[last] > deflection[first]) for first, last in whole}
    if len(ways) < 2:
        turns_text = f"turns at {', '.join(f'{np.degrees(deflection[t]):.4g} deg' for t in turns[:8])}"
        rule = "the loop is not closed: no way out and way back reach both of its ends"
        raise ModelError(
            Problem(source, turns_text, rule, "let the test go from one end to the other and back to the first")
        )
    # the loop must close
    _meets(deflection, torque, whole, source)
    return _gathered(deflection, torque, whole, source)


def _is_one_cycle_begun_between_its_ends(deflection: Array, torque: Array, turns: Sequence[int]) -> bool:
    """Whether a record of two turns comes back to the angle and the torque from which it began."""
    if len(turns) != 4 or turns[3] < deflection.size - 3:
        return False
    if abs(deflection[0] - deflection[-1]) > _REACH * np.ptp(deflection):
        return False
    gap = abs(float(np.median(torque[:3]) - np.median(torque[-3:])))
    return gap <= _GAP * float(np.ptp(torque))


def _turns(deflection: Array, least: float) -> list[int]:
    """Positions of the first sample, of every turn, and of the last sample."""
    turns = [0]
    extreme = 0
    way = 0.0
    values = deflection.tolist()
    for i, value in enumerate(values):
        if way == 0.0:
            if abs(value - values[0]) > least:
                way = 1.0 if value > values[0] else -1.0
                extreme = i
        elif way * (value - values[extreme]) >= 0.0:
            extreme = i
        elif way * (values[extreme] - value) > least:
            turns.append(extreme)
            way = -way
            extreme = i
    if extreme > turns[-1]:
        turns.append(extreme)
    return turns


def _meets(deflection: Array, torque: Array, whole: Sequence[tuple[int, int]], source: str) -> None:
    """Refuse a loop whose last leg does not come back to the torque from which the first one began."""
    (first, _) = whole[0]
    (_, last) = whole[-1]
    if deflection[first] > deflection[last] + 0.5 * np.ptp(deflection) or (
        deflection[last] > deflection[first] + 0.5 * np.ptp(deflection)
    ):
        return  # an odd number of legs ends at the other end
    near = max(3, (whole[0][1] - first) // 500)
    gap = abs(float(np.median(torque[first : first + near]) - np.median(torque[last - near : last + 1])))
    if gap > _GAP * float(np.ptp(torque)):
        rule = "the loop is not closed: it comes back to another torque than it began with"
        raise ModelError(
            Problem(source, f"a gap of {gap:.4g} N m", rule, "leave out the first loading; check the zero")
        )


def _gathered(deflection: Array, torque: Array, whole: Sequence[tuple[int, int]], source: str) -> Loop:
    rows = [np.arange(first if n == 0 else first + 1, last + 1) for n, (first, last) in enumerate(whole)]
    kept = np.concatenate(rows)
    counts = [r.size for r in rows]
    way = np.repeat([np.sign(deflection[last] - deflection[first]) for first, last in whole], counts)
    turn = np.repeat([deflection[first] for first, _ in whole], counts)
    leg = np.repeat(np.arange(len(rows)), counts)
    lost = deflection.size - kept.size
    words = f"{lost} of {counted(deflection.size, 'sample')} belong to no whole leg of the loop and are left out"
    notes = (words,) if lost > 1 else ()
    if kept.size < FEWEST:
        rule = f"too few points for a fit: whole legs need at least {FEWEST}"
        raise ModelError(Problem(source, counted(kept.size, "sample"), rule, "sample the test more densely"))
    return Loop(deflection[kept], torque[kept], way, turn, leg, source, notes)
