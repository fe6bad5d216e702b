"""A measured frequency response, pressure per force, as an impulse response.

Of lines at equal spacing df, every line of the response H(f_k) is kept: the sum

    h(t) = 2 df Re sum_k H(f_k) exp(2 pi i f_k t)

has exactly these values at the lines, and repeats after 1/df. One such period is taken; a response that has not decayed
within it overlaps itself, which is noted: its lines lie too far apart. Lines at unequal spacing are first interpolated
to the smallest spacing, by cubic splines of real and imaginary part: of magnitudes and phases the phase could jump
between lines. Outside of the band of the lines nothing is known, and the response is 0 there: such frequencies are not
heard. The sum is taken at the sampling rate of the sound by a chirp z-transform, which needs no common measure of rate
and spacing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.signals.impact_sound import LEAD, LONGEST, SoundPath
from gearrattle.wording import counted

Array = NDArray[np.float64]

_EVEN = 1e-3  # share of the spacing by which lines may lie off a uniform grid
_LEAD_SHARE = 32  # the part of a response that is kept before its impulse
_END = 8  # the last part of a response, which must be quiet
_DECAYED = 1e-3  # largest share of its energy there
_QUIET = 1e-9  # share of the energy: an end with less is left out


class FrequencyResponse(NamedTuple):
    """Pressure per force over frequency.

    Attributes
    ----------
    frequency
        (K,) ascending [Hz].
    value
        (K,) complex [Pa/N].
    source
        file, and the function in it.
    """

    frequency: Array
    value: NDArray[np.complex128]
    source: str


def path_of(response: FrequencyResponse, rate: float) -> tuple[SoundPath, tuple[str, ...]]:
    """Return the path of a frequency response at a sampling rate [Hz], and notes.

    ModelError for fewer than two lines, lines that do not ascend or lie so near each other that the response would be
    too long, negative frequencies, and a band that begins above half the rate.
    """
    # lines on a uniform grid
    source = response.source
    frequency = response.frequency
    steps = np.diff(frequency)
    if frequency.size < 2 or steps.min() <= 0.0 or frequency[0] < 0.0:
        rule = "a frequency response needs two lines or more, at frequencies from 0 Hz that ascend"
        raise ModelError(Problem(source, counted(frequency.size, "line"), rule))
    spacing = float(steps.min())
    if np.all(np.abs(steps - spacing) <= _EVEN * spacing):
        spacing = float(frequency[-1] - frequency[0]) / steps.size
    if 1.0 / spacing > LONGEST:
        rule = f"lines must lie at least {1.0 / LONGEST:.2g} Hz apart"
        raise ModelError(Problem(source, f"{spacing:.3g} Hz", rule, "leave lines out"))
    lines = frequency[0] + spacing * np.arange(1 + int((frequency[-1] - frequency[0]) / spacing + 0.5))
    lines = lines[lines < 0.5 * rate]
    if not lines.size:
        raise ModelError(Problem(source, f"from {frequency[0]:g} Hz", f"must begin below {0.5 * rate:g} Hz"))
    value = _at(response, lines, spacing)
    # sum of the lines over one period
    samples = max(2, int(rate / spacing))
    lead = min(max(LEAD, samples // _LEAD_SHARE), samples // 2)
    summed = _sum_of_lines(value, float(lines[0]), spacing, (np.arange(samples) - lead) / rate)
    # what the user must know
    band = f"{lines[0]:.6g} to {lines[-1]:.6g} Hz"
    notes = [f"{source}: measured from {band}; what lies outside is not heard"]
    end = summed[-max(1, samples // _END) :]
    if np.sum(end**2) > _DECAYED * np.sum(summed**2):
        notes.append(
            f"{source}: the response has not decayed after {1.0 / spacing:.3g} s, so lines {spacing:.3g} Hz apart miss "
            "its resonances: measure with a finer resolution"
        )
    return SoundPath(_until_quiet(summed, lead), rate, lead, f"{source}, {band}"), tuple(notes)


def _until_quiet(response: Array, lead: int) -> Array:
    """Return a response without its end, where that has ``_QUIET`` of its energy at most."""
    left = np.cumsum(response[::-1] ** 2)[::-1]
    return response[: max(lead + 1, int(np.count_nonzero(left > _QUIET * left[0])))]


def _at(response: FrequencyResponse, lines: Array, spacing: float) -> NDArray[np.complex128]:
    """Return the response at lines: its own, or cubic splines between them."""
    nearest = response.frequency[: lines.size]
    if lines.size <= response.frequency.size and np.all(np.abs(nearest - lines) <= _EVEN * spacing):
        return response.value[: lines.size]
    from scipy.interpolate import CubicSpline

    kind = "not-a-knot" if response.frequency.size > 2 else "natural"
    value = CubicSpline(response.frequency, response.value, bc_type=kind)(np.minimum(lines, response.frequency[-1]))
    return np.asarray(value, dtype=np.complex128)


def _sum_of_lines(value: NDArray[np.complex128], first: float, spacing: float, time: Array) -> Array:
    """Return 2 df Re sum H exp(2 pi i f t) at uniform times [s]; a line at 0 Hz counts once."""
    from scipy.signal import czt

    weights = np.full(value.size, 2.0 * spacing)
    weights[0] = spacing if first == 0.0 else 2.0 * spacing
    step = float(time[1] - time[0])
    turn = np.exp(2j * np.pi * spacing * step)
    begin = np.exp(-2j * np.pi * spacing * time[0])
    summed = czt(weights * value, time.size, turn, begin)
    return np.asarray((summed * np.exp(2j * np.pi * first * time)).real, dtype=np.float64)
