"""Loops: whole periods, no click where they begin again, silence as none."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.signals.sound_loop import LONGEST, RATE, SAMPLES, loop_of

AUDIO = 48_000.0


def test_a_periodic_sound_goes_on_where_it_begins_again() -> None:
    """20 periods of 30 ms, in 24 of which two tones repeat: twice the loop is the sound itself."""
    period = 0.03
    time = np.arange(2 * 48_000) / AUDIO
    loop = loop_of(np.sin(2 * np.pi * 400.0 * time) + 0.5 * np.cos(2 * np.pi * 2200.0 * time), AUDIO, period)
    kept = loop[np.isfinite(loop)]
    assert kept.size == round(25 * period * RATE) == SAMPLES
    begin = 2.0 - kept.size / RATE
    t = begin + np.arange(2 * kept.size) / RATE
    expected = np.sin(2 * np.pi * 400.0 * t) + 0.5 * np.cos(2 * np.pi * 2200.0 * t)
    inside = slice(0, 2 * kept.size - 100)  # the last samples: the filter meets the end of the sound
    assert np.abs(np.tile(kept, 2) - expected)[inside][: kept.size - 100].max() < 2e-3
    assert np.abs(np.diff(np.tile(kept, 2))[kept.size - 3 : kept.size + 3]).max() < 0.5


def test_a_sound_that_does_not_repeat_has_no_click() -> None:
    """Low-passed noise: the step where the loop begins again is one of those within it."""
    noise = np.convolve(np.random.default_rng(1).normal(size=96_000), np.hanning(64), "same")
    loop = loop_of(noise, AUDIO, 0.031)
    kept = loop[np.isfinite(loop)]
    assert kept.size == round(24 * 0.031 * RATE)
    steps = np.abs(np.diff(kept))
    assert abs(kept[0] - kept[-1]) < np.quantile(steps, 0.999)


def test_short_sounds_are_whole_and_silence_is_none() -> None:
    short = loop_of(np.sin(np.arange(9600) * 0.1), AUDIO, 0.1)
    assert np.isfinite(short).sum() == round(0.2 * RATE)
    assert np.isnan(loop_of(np.zeros(48_000), AUDIO, 0.1)).all()
    assert np.isnan(loop_of(np.full(48_000, np.nan), AUDIO, 0.1)).all()
    assert np.isfinite(loop_of(np.ones(96_000), AUDIO, 2.0)).sum() == pytest.approx(LONGEST * RATE)
