"""One mapped channel, step by step: gaps, turns, pulses, other quantity; then another rate, trend, filter.

The order is fixed, and every step that guesses says so in a note. Filters and trends come after resampling, so they see
uniform samples; the filter comes last, so derivatives lose their noise.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gearrattle.measured.readers.mapping import Mapped
from gearrattle.measured.readers.mapping_tables import DERIVATIVES, TachoTable
from gearrattle.recording import Array, Recording
from gearrattle.signals.conditioning import REACH, bridged, detrended, evened, filtered, resample
from gearrattle.signals.encoder import FallError, unwrapped
from gearrattle.signals.kinematics import derived
from gearrattle.signals.tacho import levels, pulse_times, shaft
from gearrattle.signals.wheel_teeth import PulseError, Teeth, teeth_passed
from gearrattle.wording import counted, with_article

_SI = {"angle": "rad", "velocity": "rad/s", "acceleration": "rad/s^2", "shaft angle": "rad", "speed": "rad/s"}
_FEWEST = 4
_MOST_TOLD = 5
_BESIDE = 1e-5  # of an interval: times that differ by less are the same


class Conditioned(NamedTuple):
    """Times, values and unit of a channel after its conversion, with notes on assumptions."""

    time: Array
    values: Array
    unit: str
    notes: tuple[str, ...]


def became(channel: Mapped) -> Conditioned:
    """Convert a channel to the quantity it shall have, at its own times.

    A ModelError refuses samples that are no numbers or too few, and pulses from which no angle follows.
    """
    row = channel.table
    notes = []
    if channel.time.size < _FEWEST:
        rule = f"a channel needs {_FEWEST} samples or more"
        raise channel.wrong("", counted(channel.time.size, "sample"), rule, "is this the whole record?")
    # bridge gaps, and let an encoder's angle go on over its falls
    channel, said = _whole(channel)
    notes += said
    time = channel.time
    values = channel.values
    if row.starts_over is not None:
        values, said = _unwrapped(channel, row.starts_over)
        notes += said
    # pulses become the angle or the speed of the shaft
    measured = row.measured or row.quantity
    if measured == "pulses" and row.quantity != "pulses" and row.tacho is not None:
        time, values, said = _turned(channel, row.tacho)
        return Conditioned(time, values, _SI[row.quantity], (*notes, *said))
    # derivatives or integrals to the quantity wanted
    if measured == row.quantity:
        return Conditioned(time, values, channel.unit, tuple(notes))
    times = DERIVATIVES[row.quantity] - DERIVATIVES[measured]
    if times == 0:
        return Conditioned(time, values, channel.unit, tuple(notes))
    if times < 0:
        notes.append(f"{row.name}: integrated from {with_article(measured)}; 0 at its first sample")
    return Conditioned(time, derived(time, values, times), _SI[row.quantity], tuple(notes))


def _whole(channel: Mapped) -> tuple[Mapped, list[str]]:
    """Refuse or bridge samples that are no numbers."""
    bad = ~np.isfinite(channel.values)
    if not bad.any():
        return channel, []
    at = int(np.argmax(bad))
    count = int(bad.sum())
    if channel.table.gaps != "bridge":
        value = f"{_gap(channel, at)}; {count} in all"
        raise channel.wrong("", value, "samples must be finite numbers", 'cut with start and end, or gaps = "bridge"')
    # a stretch can be bridged only between two numbers
    numbers = np.flatnonzero(~bad)
    if numbers.size < _FEWEST:
        value = f"{counted(numbers.size, 'number')} among {counted(bad.size, 'sample')}"
        raise channel.wrong("gaps", value, f"a channel needs {_FEWEST} numbers or more to be bridged")
    ends = [f"{_gap(channel, end)}, in the {which} row" for end, which in ((0, "first"), (-1, "last")) if bad[end]]
    if ends:
        first, last = channel.time[numbers[[0, -1]]]
        cuts = [f'start = "{first:.9g} s"'] if bad[0] else []
        cuts += [f'end = "{last:.9g} s"'] if bad[-1] else []
        rule = "only what lies between numbers can be bridged"
        raise channel.wrong("gaps", " and ".join(ends), rule, f"cut the record: {', '.join(cuts)}")
    # straight lines over the gaps
    values, longest = bridged(channel.time, channel.values)
    missing = f"{channel.table.name}: {counted(count, 'sample')} without a number"
    note = f"{missing}; straight lines bridge what is missing, {longest:.6g} s at most"
    return replace(channel, values=values), [note]


def _gap(channel: Mapped, at: int) -> str:
    """Return what the file has in place of a number, and where."""
    return f"{channel.values[at]} at {channel.time[at]:.9g} s (sample {at % channel.values.size})"


def _unwrapped(channel: Mapped, span: float) -> tuple[Array, list[str]]:
    """Make the angle of an encoder continuous where it starts over."""
    try:
        angle = unwrapped(channel.values, span)
    except FallError as error:
        raise channel.wrong("starts_over", "", error.rule, error.remedy) from None
    if not angle.falls:
        return angle.values, []
    falls = f"{counted(angle.falls, 'fall')} of the encoder over several samples, as after a filter"
    note = (
        f"{channel.table.name}: {falls}; {counted(angle.replaced, 'sample')} replaced by the spline through the others"
    )
    return angle.values, [note]


def _turned(channel: Mapped, tacho: TachoTable) -> tuple[Array, Array, list[str]]:
    """Turn pulses into the angle or the speed of their shaft, between the first pulse and the last."""
    row = channel.table
    notes = []
    # threshold and hysteresis, as stated or by the height of the signal
    threshold, hysteresis = levels(channel.values)
    if tacho.threshold is None or tacho.hysteresis is None:
        threshold = threshold if tacho.threshold is None else tacho.threshold
        hysteresis = hysteresis if tacho.hysteresis is None else tacho.hysteresis
        notes.append(f"{row.name}: a pulse begins at {threshold:.6g}, hysteresis {hysteresis:.6g}")
    else:
        threshold = tacho.threshold
        hysteresis = tacho.hysteresis
    # times of the pulses
    times = pulse_times(channel.time, channel.values, threshold, hysteresis, tacho.edge == "rising")
    if times.size < _FEWEST:
        low = float(channel.values.min())
        high = float(channel.values.max())
        rule = f"needs {_FEWEST} pulses or more; the signal lies between {low:.6g} and {high:.6g}"
        remedy = "choose threshold and hysteresis within the signal"
        raise channel.wrong("tacho", f"{counted(times.size, 'pulse')} at the threshold {threshold:.6g}", rule, remedy)
    # teeth passed at every pulse: gaps of the wheel, pulses lost or too many
    try:
        pulses = teeth_passed(times, tacho.pulses_per_turn, tacho.missing)
    except PulseError as error:
        raise channel.wrong("tacho", "", error.rule, error.remedy) from None
    notes += [f"{row.name}: {words}" for words in _faults(pulses)]
    # angle and speed by a spline through the pulses
    inside = channel.time[(channel.time >= pulses.times[0]) & (channel.time <= pulses.times[-1])]
    angle, speed = shaft(pulses.times, 2.0 * np.pi / tacho.pulses_per_turn * pulses.passed, inside)
    return inside, speed if row.quantity in ("speed", "velocity") else angle, notes


def _faults(pulses: Teeth) -> list[str]:
    """Say which pulses of a wheel were lost or too many, and which intervals may hide some."""
    said = []
    if pulses.lost.size:
        said.append(
            f"{counted(pulses.lost.size, 'pulse')} lost, at {_instants(pulses.lost)}; the angle goes on over it"
        )
    if pulses.extra.size:
        said.append(f"{counted(pulses.extra.size, 'pulse')} too many left out, at {_instants(pulses.extra)}")
    if pulses.unsure.size:
        words = f"{counted(pulses.unsure.size, 'interval')} far from the neighbours left as measured, from"
        words += f" {_instants(pulses.unsure)} on: a start, a stop or strong vibration of the shaft, or a lost pulse"
        said.append(words)
    return said


def _instants(times: Array) -> str:
    """Return the first instants in words, and how many more there are."""
    words = ", ".join(f"{time:.6g} s" for time in times[:_MOST_TOLD])
    return words if times.size <= _MOST_TOLD else f"{words} and {times.size - _MOST_TOLD} more"


class Even(NamedTuple):
    """Uniform samples of a channel."""

    first: float
    interval: float
    values: Array
    were_even: bool

    def places(self, grid: Array) -> Array | None:
        """Return the sample at each time of a grid of the same rate; None if samples lie at other times."""
        at = (grid - self.first) / self.interval
        whole = np.rint(at)
        return whole.astype(np.int64) if np.all(np.abs(at - whole) <= _BESIDE) else None

    def beyond(self, grid: Array, rate: float) -> float:
        """Return the margins at both ends at which a grid of this rate is not known within 1e-4 [s]."""
        same = abs(self.interval * rate - 1.0) <= _BESIDE and self.places(grid) is not None
        return 0.0 if same else REACH / min(1.0 / self.interval, rate)


def uniform(own: Conditioned) -> Even:
    """Return uniform samples of a channel from its first time on."""
    first = float(own.time[0])
    interval = Recording(own.time, (), "").interval
    if interval is not None:
        return Even(first, interval, own.values, True)
    return Even(first, *evened(own.time, own.values), False)


def brought(even: Even, grid: Array, rate: float) -> Array:
    """Resample a channel at the times of the recording; at its own times it stays as it is.

    Parameters
    ----------
    grid
        (M,) times within them [s].
    rate
        of the grid [Hz].
    """
    if not even.beyond(grid, rate):
        places = even.places(grid)
        assert places is not None
        return np.asarray(even.values[places])
    return resample(even.values, even.interval, even.first, grid, rate)


def finished(channel: Mapped, time: Array, values: Array, interval: float | None) -> Array:
    """Remove the trend, then filter.

    A ModelError refuses samples that are not uniform or too few, and a cutoff beyond half their rate.
    """
    row = channel.table
    if row.detrend is not None:
        values = detrended(time, values, 0 if row.detrend == "mean" else 1)
    if row.filter is None:
        return values
    if interval is None:
        rule = "a filter needs uniform samples, and these are not"
        raise channel.wrong("filter", "", rule, 'resample: rate = "10 kHz" at the top of the mapping')
    half = 0.5 / interval
    if row.filter.cutoff[-1] >= half:
        value = f"{row.filter.cutoff[-1]:.6g} Hz"
        rule = f"must lie below half the sampling rate, {half:.6g} Hz"
        raise channel.wrong("filter.cutoff", value, rule, "lower it, or raise rate")
    try:
        return filtered(values, 1.0 / interval, row.filter.kind, row.filter.cutoff, row.filter.order)
    except ValueError as error:
        words = " ".join(str(error).split())
        raise channel.wrong("filter", counted(values.size, "sample"), f"too few for this filter: {words}") from None
