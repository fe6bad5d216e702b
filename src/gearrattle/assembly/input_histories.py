"""Inputs of a model that are curves over time: records, and the ramps of torques."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from gearrattle.assembly.means import own_mean
from gearrattle.assembly.records import swings
from gearrattle.derived_values import kept
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model, Signal
from gearrattle.model.over_speed import AtSpeed
from gearrattle.model.ramps import level_over_time

_LINES = 'interpolation = "linear" stays between the points'


@kept
def torque_histories(model: Model) -> dict[int, Signal]:
    """Return records and ramps of torques by the index of the torque.

    ModelError for ramps that begin at a mean that is a table over the speed of a sweep.
    """
    signals: dict[int, Signal] = {}
    for index, torque in enumerate(model.torques):
        if torque.signal is not None:
            signals[index] = torque.signal
        elif torque.ramps:
            level = own_mean(model, index)
            if isinstance(level, AtSpeed) and model.excitation.sweep is not None:
                rule = "begin at the mean, which must not follow a sweep of the speed"
                raise ModelError(Problem(f"torque.{index}.ramps", "", rule, "give the mean as a number"))
            signals[index] = level_over_time(torque.ramps, level)
    return signals


class Record(NamedTuple):
    """A record of a model: its signal, the path of its table, its unit in an SI model, and advice on other curves than
    a spline in words.
    """

    signal: Signal
    path: str
    words: str
    unit: str
    instead: str


def records_of(model: Model) -> Iterator[Record]:
    """Yield the records of all torques and motions, ramps included, in file order."""
    for i, signal in torque_histories(model).items():
        torque = model.torques[i]
        instead = 'interpolation = "linear" and "step" stay between the points'
        key = "signal" if torque.signal is not None else "ramps"
        yield Record(signal, f"torque.{i}.{key}", f"torque on {torque.on}", "N m", instead)
    for i, motion in enumerate(model.motions):
        if motion.speed is not None:
            yield Record(motion.speed, f"motion.{i}.speed", f"speed of {motion.on}", "rad/s", _LINES)
        if motion.angle is not None:
            instead = 'a speed in its place may have interpolation = "linear"'
            yield Record(motion.angle, f"motion.{i}.angle", f"angle of {motion.on}", "rad", instead)


def record_notes(model: Model) -> tuple[str, ...]:
    """Notes on records whose spline exceeds the neighbouring points by more than 5 % of the record's span."""
    records = [(record, "s") for record in records_of(model)]
    for i, torque in enumerate(model.torques):
        if torque.engine is not None:
            path = f"torque.{i}.engine.pressure"
            words = f"pressure of the engine on {torque.on}"
            records.append((Record(torque.engine.pressure, path, words, "Pa", _LINES), "rad"))
    return tuple(note for record, along in records if (note := _note(record, along, is_si=model.units == "SI")))


def _note(record: Record, along: str, *, is_si: bool) -> str:
    """A note on how far a record's spline exceeds the neighbouring points; empty if by less than that."""
    unit, of_time = (f" {record.unit}", f" {along}") if is_si else ("", "")
    places = [
        f"{swing.value:.4g}{unit} at {swing.time:.4g}{of_time}, beside a point of {swing.neighbour:.4g}{unit}"
        for swing in swings(record.signal)
    ]
    if not places:
        return ""
    return f"{record.words}: the cubic spline through its points reaches {' and '.join(places)}; {record.instead}."
