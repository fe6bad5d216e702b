"""Equations with one unknown more, against their singular values."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.engine.periodic.equations import Bordered, Factored

SIZES = [1, 4, 8, 128]


def equations(size: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A (N, N + 1), a row that is not at right angles to its null vector, and a direction."""
    generator = np.random.default_rng(seed)
    matrix = generator.standard_normal((size, size + 1))
    return matrix, generator.standard_normal(size + 1), generator.standard_normal(size + 1)


@pytest.mark.parametrize("size", SIZES)
def test_the_null_vector_and_its_determinant_do_not_depend_on_the_row(size: int) -> None:
    matrix, row, direction = equations(size, size)
    expected = np.linalg.svd(matrix)[2][-1]
    expected *= np.sign(expected @ direction)
    for border in (row, -row, expected):
        vector, others, determinant = Bordered(matrix, border).null_vector(direction)
        np.testing.assert_allclose(vector, expected, rtol=0, atol=1e-10)
        assert others == 0
        assert determinant == pytest.approx(float(np.linalg.det(np.vstack([matrix, vector]))), rel=1e-9)


def test_a_row_at_right_angles_to_the_null_vector_gives_the_same() -> None:
    matrix, row, direction = equations(6, 1)
    null = Bordered(matrix, row).null_vector(direction)
    across = row - (row @ null[0]) * null[0]
    equations_across = Bordered(matrix, across)
    assert not equations_across.is_regular
    vector, others, determinant = equations_across.null_vector(direction)
    np.testing.assert_allclose(vector, null[0], rtol=0, atol=1e-12)
    assert (others, determinant) == (0, pytest.approx(null[2], rel=1e-9))


def test_with_several_null_vectors_it_is_the_nearest_to_the_direction() -> None:
    matrix, row, direction = equations(5, 2)
    matrix[4] = matrix[3]
    vector, others, determinant = Bordered(matrix, row).null_vector(direction)
    nulls = np.linalg.svd(matrix)[2][-2:]
    nearest = nulls.T @ (nulls @ direction)
    np.testing.assert_allclose(vector, nearest / np.linalg.norm(nearest), rtol=0, atol=1e-12)
    assert (others, determinant) == (1, 0.0)


@pytest.mark.parametrize("size", SIZES)
def test_determinants_have_the_sign_of_the_exchanged_rows(size: int) -> None:
    square = equations(size, 3)[0][:, :-1] / np.sqrt(size)
    for matrix in (square, square[::-1].copy()):
        assert Factored(matrix).determinant() == pytest.approx(float(np.linalg.det(matrix)), rel=1e-9)


def test_along_singular_directions_nothing_is_done() -> None:
    matrix = np.diag([2.0, 0.0, 4.0])
    np.testing.assert_allclose(Factored(matrix).solution(np.array([2.0, 1.0, 4.0])), [1.0, 0.0, 1.0])
