"""A frequency response as a path: a round trip through the closed form of modes, its band, lines too far apart."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import gearrattle as gr
from gearrattle.signals.frequency_response import FrequencyResponse, path_of
from gearrattle.signals.impact_sound import CASING, modal_path

RATE = 48_000.0


def modal(frequency: NDArray[np.float64]) -> NDArray[np.complex128]:
    """The assumed casing in closed form [Pa/N]."""
    w = 2.0 * np.pi * frequency
    total = np.zeros(frequency.size, dtype=complex)
    for f, damping, gain in CASING:
        own = 2.0 * np.pi * f
        total += gain * own * np.sqrt(1.0 - damping**2) / (own**2 - w**2 + 2j * damping * own * w)
    return total


def spectrum(response: NDArray[np.float64], lead: int, frequency: NDArray[np.float64]) -> NDArray[np.complex128]:
    time = (np.arange(response.size) - lead) / RATE
    return np.exp(-2j * np.pi * frequency[:, None] * time) @ response / RATE


@pytest.mark.parametrize("spacing", [1.0, 3.125, 7.3])
def test_a_path_has_the_values_of_its_lines_whatever_their_spacing(spacing: float) -> None:
    lines = np.arange(0.0, 23_900.0, spacing)
    path, notes = path_of(FrequencyResponse(lines, modal(lines), "made"), RATE)
    between = np.array([612.3, 640.0, 1153.0, 2788.0, 6111.0])
    assert np.abs(spectrum(path.response, path.lead, between) / modal(between) - 1.0).max() < 2e-3
    assert len(notes) == 1


def test_lines_at_uneven_spacing_are_interpolated() -> None:
    lines = np.unique(np.concatenate([np.arange(0.0, 2000.0, 2.0), np.geomspace(2000.0, 20_000.0, 4000)]))
    path, _ = path_of(FrequencyResponse(lines, modal(lines), "made"), RATE)
    between = np.array([640.5, 1153.0, 2788.0, 6111.0])
    assert np.abs(spectrum(path.response, path.lead, between) / modal(between) - 1.0).max() < 5e-3


def test_outside_of_its_band_nothing_is_heard() -> None:
    lines = np.arange(1000.0, 3000.0, 2.0)
    path, notes = path_of(FrequencyResponse(lines, modal(lines), "made"), RATE)
    outside = np.array([400.0, 640.0, 4200.0, 6100.0])
    assert np.abs(spectrum(path.response, path.lead, outside)).max() < 0.02 * np.abs(modal(lines)).max()
    assert "1000 to 2998 Hz" in notes[0]


def test_lines_too_far_apart_are_noted() -> None:
    lines = np.arange(0.0, 20_000.0, 80.0)
    _, notes = path_of(FrequencyResponse(lines, modal(lines), "made"), RATE)
    assert any("finer resolution" in note for note in notes)


@pytest.mark.parametrize(
    ("lines", "words"),
    [([100.0], "two lines"), ([200.0, 100.0], "ascend"), ([-5.0, 5.0], "from 0 Hz"), ([0.0, 1e-4], "apart")],
)
def test_bad_lines_are_refused(lines: list[float], words: str) -> None:
    response = FrequencyResponse(np.array(lines), np.ones(len(lines), dtype=complex), "made")
    with pytest.raises(gr.ModelError, match=words):
        path_of(response, RATE)


def test_a_path_too_short_to_ring_is_still_one() -> None:
    """Two lines make a response of one period; it is taken as it is."""
    path, _ = path_of(FrequencyResponse(np.array([100.0, 200.0]), np.ones(2, dtype=complex), "made"), RATE)
    assert path.response.size <= RATE / 100.0
    assert modal_path([(100.0, 0.1, 1.0)], RATE, "one").response.size > path.response.size
