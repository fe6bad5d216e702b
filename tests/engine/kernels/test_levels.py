"""The steps of the marcher's levels: dyadic, falling, and the first that is short enough."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from gearrattle.engine.kernels.march_arrays import DEEPEST, LONGEST, level_within, step_of


def test_steps_are_halves_of_the_longest_and_of_three_quarters_of_it() -> None:
    for level in range(DEEPEST + 1):
        factor = Fraction(3, 4) if level % 2 else Fraction(1)
        assert Fraction(step_of(level)) == Fraction(LONGEST) * factor / 2 ** (level // 2)


@pytest.mark.parametrize("seed", range(5))
def test_the_first_level_within_a_length_is_found(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for longest in (LONGEST * 2.0 ** -rng.uniform(-3.0, 40.0, 200)).tolist():
        level = level_within(longest)
        assert step_of(level) <= longest
        assert level == 0 or step_of(level - 1) > longest


def test_a_step_itself_is_within_its_length() -> None:
    for level in range(80):
        assert level_within(step_of(level)) == level
