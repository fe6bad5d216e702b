"""Both records as cycles: one band, one number of samples in a cycle, trends treated alike.

Each record is resampled by the same windowed sinc to S samples in its own period (``signals.conditioning``), so what
lies below 0.4 of the new rate passes in both alike; a lower limit is one Butterworth high pass of fourth order, run
forwards and backwards over both. What filters spoil at the ends of a record is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.recording import Channel, Recording
from gearrattle.signals.conditioning import PASSED, detrended, evened, filtered, resample
from gearrattle.trajectory import Array
from gearrattle.wording import counted

FEWEST = 8
"""Cycles: with fewer, scatter cannot be estimated. The paper's levels are of a span of eight."""
FEWEST_SAMPLES = 4
_KERNEL = 30.0  # samples at the new rate that the windowed sinc reaches to either side
_SETTLED = 1.5  # periods of a high pass after which its start is forgotten
_HIGH_PASS = 4
_ROUNDING = 1e-12  # of a signal: a smaller rest without its trend is rounding


@dataclass(frozen=True)
class Setting:
    """Settings by which records become cycles.

    Attributes
    ----------
    lowest
        of the frequencies compared [Hz]; 0: no high pass.
    trend
        what is taken away: "none", "mean" or "linear".
    """

    samples: int
    lowest: float
    trend: str


@dataclass(frozen=True)
class Cycles:
    """Some channels of a record over whole cycles.

    Attributes
    ----------
    values
        (N, S, C) in the band, trend treated.
    whole
        (N, S, C) the same with mean and trend and without a high pass.
    start
        time of the first sample by the record's clock [s].
    period
        by the same clock [s].
    """

    values: Array
    whole: Array
    start: float
    period: float

    @property
    def count(self) -> int:
        """N."""
        return int(self.values.shape[0])

    @property
    def rate(self) -> float:
        """Samples a second [Hz]."""
        return float(self.values.shape[1] / self.period)

    def lines(self) -> Array:
        """(K, ) numbers of the lines in the band: k stands for the frequency k / period."""
        return np.arange(1, int(PASSED * self.values.shape[1]) + 1, dtype=np.float64)

    def amplitudes(self) -> NDArray[np.complex128]:
        """(N, K, C) amplitudes c_k of every cycle: x = Re sum c_k exp(2 pi i k t / period), t by the record's clock."""
        k = np.arange(1, self.lines().size + 1)
        amplitudes = np.fft.rfft(self.values, axis=1)[:, k] * (2.0 / self.values.shape[1])
        turned = np.exp(-2j * np.pi * k * ((self.start / self.period) % 1.0))
        return np.asarray(amplitudes * turned[:, None])


@dataclass(frozen=True)
class Source:
    """Some channels of a recording, evenly sampled.

    Attributes
    ----------
    values
        (M, C).
    interval
        between samples [s].
    first
        time of the first [s].
    """

    values: Array
    interval: float
    first: float
    name: str

    @property
    def last(self) -> float:
        """Time of the last sample [s]."""
        return self.first + self.interval * (len(self.values) - 1)

    def thinned(self) -> Source:
        """Return every second sample: those of a grid half as fine."""
        return Source(self.values[::2], 2.0 * self.interval, self.first, self.name)


def source_of(recording: Recording, channels: tuple[Channel, ...]) -> tuple[Source, tuple[str, ...]]:
    """Return channels of a recording as evenly spaced samples, and a note where they were not.

    ModelError for fewer than four samples.
    """
    if recording.time.size < 4:
        value = counted(recording.time.size, "sample")
        raise ModelError(Problem(recording.source, value, "is too short: a spectrum takes at least 4 samples"))
    interval = recording.interval
    columns = [channel.values for channel in channels]
    notes: tuple[str, ...] = ()
    if interval is None:
        evens = [evened(recording.time, values) for values in columns]
        interval = evens[0][0]
        columns = [values for _, values in evens]
        notes = (f"{recording.source}: its samples are not evenly spaced; their cubic spline was taken",)
    return Source(np.stack(columns, axis=1), interval, float(recording.time[0]), recording.source), notes


def margin_of(period: float, setting: Setting) -> float:
    """Return the margin at each end of a record that filters spoil [s]."""
    high_pass = _SETTLED / setting.lowest if setting.lowest else 0.0
    return _KERNEL * period / setting.samples + high_pass


def cut(source: Source, period: float, setting: Setting, bounds: tuple[float, float], *, whole_start: bool) -> Cycles:
    """Return the whole cycles of a record.

    Parameters
    ----------
    period
        by its clock [s].
    bounds
        first and last time wanted [s].

    Raises
    ------
    ModelError
        fewer than ``FEWEST`` cycles.
    """
    # the span that filters leave, in whole cycles
    margin = margin_of(period, setting)
    step = period / setting.samples
    begin = max(bounds[0], source.first + margin)
    end = min(bounds[1], source.last - margin)
    if whole_start:
        begin = period * np.ceil(begin / period - 1e-9)
    count = int(np.floor((end - begin) / period + 1e-9))
    if count < FEWEST:
        value = f"{max(count, 0)} whole cycles of {period:.6g} s in {max(end - begin, 0.0):.6g} s"
        rule = f"is too short: at least {FEWEST} cycles are needed to tell scatter from difference"
        remedy = f"a longer record or run; {margin:.3g} s at each end go to filters"
        raise ModelError(Problem(source.name, value, rule, remedy))
    # the grid of samples, from the start of the record to its end
    before = int(np.floor((begin - source.first) / step + 1e-9))
    total = before + int(np.floor((source.last - begin) / step + 1e-9)) + 1
    grid = np.clip(begin + step * (np.arange(total) - before), source.first, source.last)
    used = slice(before, before + count * setting.samples)
    # resample, filter and treat the trend, channel by channel
    kept = []
    treated = []
    for near in resample(source.values, source.interval, source.first, grid, 1.0 / step).T:
        kept.append(near[used])
        band = filtered(near, 1.0 / step, "highpass", (setting.lowest,), _HIGH_PASS) if setting.lowest else near
        treated.append(_levelled(grid[used], band[used], setting.trend))
    # cut into cycles
    shape = (len(kept), count, setting.samples)
    both = (np.moveaxis(np.reshape(array, shape), 0, -1) for array in (treated, kept))
    values, whole = (np.ascontiguousarray(array) for array in both)
    return Cycles(values, whole, float(begin), period)


def _levelled(time: Array, values: Array, trend: str) -> Array:
    if trend == "none":
        return values
    left = detrended(time, values, 0 if trend == "mean" else 1)
    rest = float(np.max(np.abs(left))) <= _ROUNDING * float(np.max(np.abs(values)))
    return np.zeros(left.size) if rest else left


def samples_for(sources: tuple[Source, Source], period: float, highest: float | None) -> int:
    """Return how many samples a cycle gets: as many as both records have, or what a highest frequency needs.

    The band then ends at 0.4 of these over the period, which is at the highest frequency or, as their number is whole,
    somewhat above it. ModelError for a record too coarse for eight samples in a cycle, or for the frequency wanted.
    """
    most = int(np.floor(min(period / source.interval for source in sources) + 1e-6))
    coarser = max(sources, key=lambda source: source.interval)
    if most < 8:
        value = f"{1.0 / coarser.interval:.6g} Hz, {period / coarser.interval:.3g} samples in a cycle of {period:.6g} s"
        raise ModelError(Problem(coarser.name, value, "at least 8 samples in a cycle are needed"))
    if highest is None:
        return most
    wanted = max(FEWEST_SAMPLES, int(np.ceil(highest * period / PASSED - 1e-9)))
    if wanted > most:
        top = PASSED * most / period
        rule = f"must be at most {top:.6g} Hz, 0.4 of the rate of {coarser.name}"
        raise ModelError(Problem("band", f"up to {highest:.6g} Hz", rule))
    return wanted
