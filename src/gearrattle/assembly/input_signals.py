"""Inputs of a model other than harmonics of one speed, as ``Signals``: records, and all harmonics along a sweep.

A recorded torque is split into its mean, which the static start uses, and the difference from the mean. A recorded
motion is an error of the elements at its inertia. Along a sweep of the speed, every driven inertia, every mesh and
every motion by harmonics has one channel. Harmonics follow the angle of the reference shaft; amplitudes, means and drag
torques follow their tables over the speed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import ceil, pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly.drag_torques import drag_torques
from gearrattle.assembly.elements import rows_of
from gearrattle.assembly.input_histories import records_of, torque_histories
from gearrattle.assembly.means import mean_torque, own_mean
from gearrattle.assembly.period import period_of
from gearrattle.assembly.prescribed_motion import angle_of, columns_of, prescribed_indices, specified_angle
from gearrattle.assembly.records import Recorded, channel_of
from gearrattle.assembly.ripple import load_ripples
from gearrattle.assembly.sideways import beside_directions
from gearrattle.assembly.sines import ramp_of, speeds_of, tone, tones_of
from gearrattle.derived_values import kept
from gearrattle.engine.system.piecewise_channels import Channel, joined
from gearrattle.engine.system.piecewise_signals import Signals, Specified
from gearrattle.engine.system.run_up_signals import Sound, Tone, TooLong, channels
from gearrattle.engine.system.specified_inputs import NotKept, Swept, checked
from gearrattle.errors import ModelError, Problem
from gearrattle.model import DEFAULTS, Harmonic, Model
from gearrattle.model.over_speed import AtSpeed
from gearrattle.wording import counted

Array = NDArray[np.float64]
_MOST_NUMBERS = 200_000_000  # polynomial coefficients of all channels


def default_cycles(model: Model) -> int:
    """Length of a run in periods if the settings have none: from the duration of the excitation, else to the end of the
    sweep, else the default.
    """
    ramp = ramp_of(model)
    length = model.excitation.duration
    if length is None and ramp is not None:
        length = ramp.over
    return DEFAULTS.cycles if length is None else max(1, ceil(length / period_of(model).period * (1.0 - 1e-12)))


def end_of_run(model: Model) -> float:
    """End of the run, up to which inputs along a sweep and held last values must be known [s]."""
    cycles = model.simulation.cycles or default_cycles(model)
    return cycles * period_of(model).period * (1.0 + 1e-9)


def lasts_as_the_run(model: Model) -> bool:
    """Whether the model has inputs that extend to the end of any run: a sweep, or a record with a held last value."""
    return ramp_of(model) is not None or any(record.signal.is_held for record in records_of(model))


class _Part(NamedTuple):
    """A channel and its specification, with the torques (n,) on inertias and errors (m,) of elements per unit of it."""

    channel: Channel
    specified: Specified
    torque: Array
    error: Array


@kept
def signals_of(model: Model) -> Signals | None:
    """Inputs other than harmonics of one speed; None without such inputs.

    ModelError for a run-up with too many intervals, or if polynomials do not represent an input to 1e-12.
    """
    parts = [*_records(model), *_motions(model), *_swept(model)]
    if not parts:
        return None
    numbers = (
        sum(len(p.channel.knots) for p in parts) * len(parts) * max(p.channel.coefficients.shape[1] for p in parts)
    )
    if numbers > _MOST_NUMBERS:
        raise _too_long(f"{numbers:.3g} coefficients")
    torque, error = (np.column_stack(columns) for columns in ([p.torque for p in parts], [p.error for p in parts]))
    specified = tuple(part.specified for part in parts)
    signals = replace(
        joined([p.channel for p in parts], beside_directions(model, torque)[columns_of(model)], error),
        specified=specified,
    )
    try:
        return checked(signals)
    except NotKept as wrong:
        rule = "its polynomials must represent the input to 1e-12"
        raise ModelError(Problem("excitation", str(wrong), rule, "this is a fault of the program: report it")) from None


def _unit(size: int, index: int | None = None) -> Array:
    """A vector of zeros, with a one at ``index``."""
    out = np.zeros(size)
    if index is not None:
        out[index] = 1.0
    return out


def _too_long(value: str) -> ModelError:
    rule = "the inputs along the run are too many to hold"
    return ModelError(Problem("simulation.cycles", value, rule, "simulate fewer cycles, or a shorter sweep"))


def _records(model: Model) -> Iterator[_Part]:
    names = [inertia.name for inertia in model.inertias]
    for index, signal in torque_histories(model).items():
        beyond_mean = own_mean(model, index) - mean_torque(model, index)
        on = _unit(len(names), names.index(model.torques[index].on))
        channel = channel_of(signal, end_of_run(model)).plus(beyond_mean)
        specified = Recorded(signal, offset=beyond_mean)
        yield _Part(channel, specified, on, _unit(len(model.elements)))


def _motions(model: Model) -> Iterator[_Part]:
    rows = rows_of(model)
    for motion, column in zip(model.motions, prescribed_indices(model), strict=True):
        if motion.signal is not None:
            yield _Part(angle_of(motion), specified_angle(motion), _unit(len(model.inertias)), -rows[:, column])


def check_length(model: Model, end: float) -> None:
    """Refuse a run up to ``end`` [s] that is longer than a record, unless the last value of the record is held.

    The ModelError names every such record.
    """
    problems = []
    for signal, path, words, *_ in records_of(model):
        last = float(signal.time[-1]) - signal.start
        if not signal.is_held and end > last * (1.0 + 1e-9):
            most = int(last / period_of(model).period * (1.0 + 1e-9))
            remedy = f"simulate {counted(most, 'cycle')} at most, or record longer" if most else "record longer"
            rule = f"the run takes {end:.6g} s, and nothing is known of the {words} after that"
            problems.append(Problem(path, f"a record that ends after {last:.6g} s", rule, remedy))
    if problems:
        raise ModelError(problems)


def _swept(model: Model) -> Iterator[_Part]:
    """Channels of all harmonics, and of all means that are tables over speed, along a sweep."""
    ramp = ramp_of(model)
    if ramp is None:
        return
    # torques on bodies over the sweep: drag, joints, means and harmonics
    range_ = speeds_of(ramp)
    bodies = len(model.inertias)
    count = len(model.elements)
    driven: list[tuple[Array, Array]] = []
    sounds: list[Sound] = []
    ripples = load_ripples(model)
    drags = drag_torques(model)
    for i, inertia in enumerate(model.inertias):
        tones = list(_changing(drags[i], -1.0, range_))
        tones += tones_of(ripples.get(inertia.name, ()), ramp)
        for index, torque in enumerate(model.torques):
            if torque.on == inertia.name:
                tones += _changing(own_mean(model, index), 1.0, range_)
                tones += tones_of(torque.harmonics, ramp)
        if tones:
            driven.append((_unit(bodies, i), _unit(count)))
            sounds.append(Sound(tuple(tones), smooth=False))
    # transmission errors and prescribed motions by harmonics
    for harmonics, error_of in _error_harmonics(model):
        driven.append((_unit(bodies), error_of))
        sounds.append(Sound(tones_of(harmonics, ramp), smooth=True))
    if not sounds:
        return
    # piecewise polynomials of all of them along the sweep
    try:
        made = channels(ramp, sounds, end_of_run(model), period_of(model).period)
    except TooLong as error:
        raise _too_long(str(error)) from None
    for channel, sound, (torque_on, error_of) in zip(made, sounds, driven, strict=True):
        yield _Part(channel, Swept(ramp, sound.tones, sound.smooth), torque_on, error_of)


def _error_harmonics(model: Model) -> Iterator[tuple[Sequence[Harmonic], Array]]:
    """Harmonics of an error or a prescribed angle, with the errors (m,) of all elements per unit of it."""
    for k, element in enumerate(model.elements):
        if element.errors:
            yield element.errors, _unit(len(model.elements), k)
    rows = rows_of(model)
    for motion, column in zip(model.motions, prescribed_indices(model), strict=True):
        if motion.harmonics:
            yield motion.harmonics, -rows[:, column]


def _changing(value: float, sign: float, speeds: tuple[float, float]) -> Iterator[Tone]:
    """Tones of the difference between a mean that is a table over speed and its value at the first speed."""
    if isinstance(value, AtSpeed):
        yield tone(0.0, sign * pi / 2.0, value, speeds, float(value))
