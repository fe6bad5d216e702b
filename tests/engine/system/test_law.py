import numpy as np
import pytest

from gearrattle.engine.system.law import Stage, staged
from tests.engine.system.drivelines import clearance, linear


def test_a_linear_element_has_one_piece_and_no_corner() -> None:
    law = linear(7.0, 2.0)
    assert (law.pieces, law.corners.size, law.first_label) == (1, 0, 0)
    assert law.elastic(-3.0) == -21.0


def test_the_clearance_law_is_equation_9_of_the_paper() -> None:
    alpha = 0.25
    b = 0.5
    stiffness = 8.0
    law = clearance(stiffness, 1.0, b, alpha)
    for delta in (-2.0, -0.5, -0.1, 0.0, 0.3, 0.5, 4.0):
        outside = abs(delta) > b
        f = delta - np.sign(delta) * (1 - alpha) * b if outside else alpha * delta
        assert law.elastic(delta) == pytest.approx(stiffness * f, rel=1e-15, abs=1e-15)


def test_an_asymmetric_staged_law_is_continuous_and_labelled_outward_from_the_centre() -> None:
    drive = [Stage(30.0, 0.02, 0.07), Stage(600.0, 0.1, 0.2), Stage(5000.0, 0.1, None)]
    coast = [Stage(30.0, 0.02, 0.05), Stage(800.0, 0.1, None)]
    law = staged(drive, coast, preload=2.0)
    assert law.corners.tolist() == [-0.05, 0.07, 0.2]
    assert law.first_label == -1
    assert law.elastic(0.0) == 2.0
    for c, corner in enumerate(law.corners):
        below = law.stiffness[c] * corner + law.offset[c]
        above = law.stiffness[c + 1] * corner + law.offset[c + 1]
        assert below == pytest.approx(above, rel=1e-15)
    assert law.elastic(0.3) == pytest.approx(2.0 + 30 * 0.07 + 600 * 0.13 + 5000 * 0.1, rel=1e-15)
    assert law.elastic(-0.25) == pytest.approx(2.0 - 30 * 0.05 - 800 * 0.2, rel=1e-15)


def test_unequal_first_stages_make_zero_a_corner_between_0_and_minus_1() -> None:
    law = staged([Stage(5.0, 0.0, None)], [Stage(9.0, 0.0, None)])
    assert law.corners.tolist() == [0.0]
    assert law.first_label == -1
    assert (law.elastic(1.0), law.elastic(-1.0)) == (5.0, -9.0)
    assert law.inner(0, 1) == 1


def test_corners_between_equal_stages_still_count() -> None:
    stages = [Stage(5.0, 0.0, 1.0), Stage(5.0, 0.0, None)]
    assert staged(stages, stages).corners.tolist() == [-1.0, 1.0]
