"""Sine and cosine of turns against many digits."""

import numpy as np
import pytest
from mpmath import mp

from gearrattle.engine.kernels.equation_of_motion import sine_cosine


@pytest.mark.parametrize("most", [1.0, 1e6])
def test_sine_and_cosine_of_turns(most: float) -> None:
    rng = np.random.default_rng(7)
    turns = np.concatenate([np.arange(-16, 17) / 16, rng.uniform(-most, most, 2000)])
    with mp.workdps(40):
        for turn in turns.tolist():
            sine, cosine = sine_cosine(turn)
            assert abs(sine - mp.sinpi(2 * mp.mpf(turn))) <= 3e-16
            assert abs(cosine - mp.cospi(2 * mp.mpf(turn))) <= 3e-16


def test_quarters_are_exact() -> None:
    assert [sine_cosine(k / 4) for k in range(4)] == [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)]
