"""Bounds over boxes hold every value in them: forms, polynomials and solutions against random points."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from gearrattle.studies.quiet.branch_and_bound import Search
from gearrattle.studies.quiet.coefficients import family_of
from gearrattle.studies.quiet.decay_proof import all_decays
from gearrattle.studies.quiet.edges import edges_of
from gearrattle.studies.quiet.taylor_forms import Array, Form, Quadratic
from tests.studies.quiet.drivelines import BOX, gearbox

COUNT = 3


def points(count: int = 200) -> Array:
    """Random points of the box, its corners among them."""
    random = np.random.default_rng(5)
    return np.concatenate([random.uniform(-1.0, 1.0, (count, COUNT)), np.sign(random.normal(size=(count, COUNT)))])


def held(form: Form, at: Array, values: NDArray[np.generic]) -> bool:
    """Whether a form holds values at a point."""
    off = np.abs(values - form.value - np.tensordot(at, form.slopes, 1))
    return bool((off <= form.rest * (1.0 + 1e-9) + 1e-15).all())


def quadratic(seed: int, size: int = 5) -> Quadratic:
    random = np.random.default_rng(seed)
    square = random.normal(size=(COUNT, COUNT, size))
    return Quadratic(random.normal(size=size), random.normal(size=(COUNT, size)), square + np.swapaxes(square, 0, 1))


def test_forms_of_polynomials_their_sums_and_products_hold_them() -> None:
    one, other = quadratic(1), quadratic(2)
    centre, radius = np.array([0.2, -0.4, 0.1]), np.array([0.3, 0.2, 0.5])
    first, second = one.over(centre, radius), other.over(centre, radius)
    for t in points():
        a, b = one.at(centre + radius * t), other.at(centre + radius * t)
        assert held(first, t, a)
        assert held(first.plus(second, 2.0 - 1.0j), t, a + (2.0 - 1.0j) * b)
        assert held(first.times(second), t, a * b)
        assert held(first.times(second.scaled(1j)), t, 1j * a * b)


def test_rests_of_products_are_of_second_order() -> None:
    one, other = quadratic(1), quadratic(2)
    rests = [
        one.over(np.zeros(COUNT), np.full(COUNT, r)).times(other.over(np.zeros(COUNT), np.full(COUNT, r))).rest.max()
        for r in (1e-2, 1e-3)
    ]
    assert rests[0] / rests[1] == pytest.approx(100.0, rel=0.2)


@pytest.mark.parametrize("radius", [0.3, 0.03])
def test_motions_over_a_box_hold_those_at_its_points(radius: float) -> None:
    """The linear motion at random points of a box, by the same equations without any box."""
    model = gearbox()
    family = family_of(model, edges_of(BOX, model))
    state = Search(family)._queue[0][3]
    centre = np.array([0.3, -0.2, 0.4])
    motion, _ = state.motion(family.over(centre, np.full(COUNT, radius)))
    assert motion is not None
    for t in points(50):
        exact, _ = state.motion(family.over(centre + radius * t, np.zeros(COUNT)))
        assert exact is not None
        assert held(motion.mean, t, exact.mean.value)
        assert held(motion.orders, t, exact.orders.value)


def test_bounds_of_motions_are_of_second_order() -> None:
    model = gearbox()
    family = family_of(model, edges_of(BOX, model))
    state = Search(family)._queue[0][3]
    rests = []
    for radius in (0.02, 0.002):
        motion, _ = state.motion(family.over(np.zeros(COUNT), np.full(COUNT, radius)))
        assert motion is not None
        rests.append(motion.orders.rest[0])
    assert (rests[0] / rests[1]).max() < 130.0
    assert (rests[0] / rests[1]).min() > 70.0


def test_decay_needs_damping_that_reaches_all_bodies() -> None:
    """A chain of three: damping between two of them moves with every mode; beside equal ends it may not."""
    rows = np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0]])
    stiff = np.ones(2, dtype=np.bool_)
    nothing = np.zeros(3, dtype=np.bool_)
    assert all_decays(rows, stiff, np.array([True, False]), nothing)
    assert all_decays(rows, stiff, np.array([False, False]), np.array([True, False, False]))
    assert not all_decays(rows, stiff, np.array([False, False]), nothing)
    assert not all_decays(rows, stiff, np.array([False, False]), np.array([False, True, False]))


def test_undamped_modes_of_random_drivelines_are_seen() -> None:
    """Where the structure says that all decays, no eigenvalue of a random driveline has a real part of zero."""
    random = np.random.default_rng(3)
    said = 0
    for _ in range(300):
        size = int(random.integers(3, 7))
        rows = np.array([np.eye(size)[i] - np.eye(size)[int(random.integers(i))] for i in range(1, size)])
        damped = random.random(size - 1) < 0.4
        dragged = random.random(size) < 0.1
        if not all_decays(rows, np.ones(size - 1, dtype=np.bool_), damped, dragged):
            continue
        said += 1
        inertia, stiffness = random.choice([1.0, 2.0], size), np.ones(size - 1)
        loss = (rows.T * (0.3 * damped)) @ rows + np.diag(0.3 * dragged)
        matrix = np.block(
            [
                [np.zeros((size, size)), np.eye(size)],
                [-((rows.T * stiffness) @ rows) / inertia[:, None], -loss / inertia[:, None]],
            ]
        )
        values = np.linalg.eigvals(matrix)
        elastic = values[np.abs(values) > 1e-4]
        assert (elastic.real < -1e-9).all()
    assert said > 50
