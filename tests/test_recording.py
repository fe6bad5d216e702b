"""A recording says what it holds, and refuses what it does not."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.errors import ModelError
from gearrattle.recording import Channel, Recording

TIME = np.arange(5) * 0.25
RIG = Recording(
    TIME,
    (
        Channel("n1", "velocity", "flywheel", "rad/s", np.sin(TIME)),
        Channel("n2", "velocity", "gear", "rad/s", np.cos(TIME)),
    ),
    "rig.csv",
)


def test_a_channel_is_found_by_its_name_or_by_what_it_holds() -> None:
    """A quantity alone finds the first; with a subject that of the subject; nothing where there is none."""
    assert RIG["n2"].subject == "gear"
    assert RIG.find("velocity") is RIG["n1"]
    assert RIG.find("velocity", "gear") is RIG["n2"]
    assert RIG.find("torque") is None
    assert RIG.find("velocity", "hub") is None


def test_a_name_that_is_not_there_is_refused_with_those_that_are() -> None:
    """The message names the source and the channels."""
    with pytest.raises(ModelError, match=r"rig.csv.*n3.*n1, n2"):
        RIG["n3"]


def test_the_interval_is_that_of_uniform_samples_only() -> None:
    """A gap in the samples is no interval."""
    assert RIG.interval == 0.25
    assert RIG.with_(time=np.array([0.0, 0.25, 0.5, 1.0, 1.25])).interval is None
    assert RIG.with_(time=np.array([0.0])).interval is None


RATES = (44100.0, 3000.0, 1.0 / 0.7e-4, 12800.0)


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("start", [0.0, 3.7, -0.25])
@pytest.mark.parametrize("form", ["%.9g", "%.8g", "%.9f", "%.7f"])
def test_times_that_are_rounded_to_their_last_digit_are_uniform(rate: float, start: float, form: str) -> None:
    exact = start + np.arange(20_000) / rate
    written = np.array([float(form % value) for value in exact])
    assert Recording(written, (), "").interval == pytest.approx(1.0 / rate, rel=1e-6)


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("form", ["%.9g", "%.9f", "%.17g"])
@pytest.mark.parametrize("stray", [0.02, 0.2])
def test_times_that_are_off_by_more_than_rounding_are_not(rate: float, form: str, stray: float) -> None:
    """One sample late, samples that jitter, a rate that drifts: by a part of an interval that the digits do show."""
    number = np.arange(20_000)
    one, jitter = np.zeros(number.size), np.random.default_rng(1).uniform(-stray, stray, number.size)
    one[12_345] = stray
    for off in (one, jitter, 40.0 * stray * (number / number.size) ** 2):
        written = np.array([float(form % value) for value in (number + off) / rate])
        assert Recording(written, (), "").interval is None


@pytest.mark.parametrize("time", [[0.0, 1.0, 3.0], [0.0, 0.1, 0.2, 0.31], [1.0, 2.0, 3.0, 5.0], [0.0, 0.1, 0.3]])
def test_few_digits_say_nothing_about_the_sampling(time: list[float]) -> None:
    assert Recording(np.array(time), (), "").interval is None
