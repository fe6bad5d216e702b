"""What scatters by chance, against laws whose scatter is known: Poisson's rate, and Gumbel's largest value."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.workbench.number_scatter import PARTS, best_of, errors_of
from gearrattle.workbench.traces import Hits

RATE, SPAN = 40.0, 25.0  # 1/s, s


def impacts(rng: np.random.Generator, rate: float = RATE) -> Hits:
    """Impacts that know nothing of each other, with speeds of an exponential law."""
    time = np.sort(rng.uniform(0.0, SPAN, rng.poisson(rate * SPAN)))
    speed = rng.exponential(size=time.size)
    return Hits([{"name": "gear", "unit": "m/s"}], time, np.zeros(time.size, np.int64), speed, speed**2)


def numbers(hits: Hits) -> tuple[float, float]:
    return hits.time.size / SPAN, float(hits.velocity.max())


@pytest.fixture(scope="module")
def runs() -> list[Hits]:
    rng = np.random.default_rng(5)
    return [impacts(rng) for _ in range(400)]


BOUNDS = np.linspace(0.0, SPAN, PARTS + 1)


def test_errors_are_those_of_the_laws(runs: list[Hits]) -> None:
    """Root mean squares over 400 runs: known within 3 % of a rate, within 7 % of the heavier tails of the largest."""
    errors = [errors_of(run, BOUNDS)["gear"] for run in runs]
    rms = {key: float(np.sqrt(np.mean([error[key] ** 2 for error in errors]))) for key in errors[0]}
    assert rms["impacts_per_second"] == pytest.approx(np.sqrt(RATE / SPAN), rel=0.06)
    assert rms["max_approach_speed"] == pytest.approx(np.pi / np.sqrt(6.0), rel=0.1)  # Gumbel's law of scale 1


def test_of_runs_of_one_design_none_is_the_best(runs: list[Hits]) -> None:
    """Two standard errors are passed by chance once in twenty; one of eight parts is itself uncertain."""
    marked = np.zeros(2)
    for one, other in zip(runs[::2], runs[1::2], strict=True):
        known = [errors_of(run, BOUNDS)["gear"] for run in (one, other)]
        for number, key in enumerate(("impacts_per_second", "max_approach_speed")):
            values = [numbers(one)[number], numbers(other)[number]]
            best, in_scatter = best_of(values, [error[key] for error in known])
            marked[number] += best is not None
            assert in_scatter == (best is None and values[0] != values[1])
    assert (marked / 200 < 0.12).all()


def test_a_design_that_is_better_is_found() -> None:
    rng = np.random.default_rng(6)
    pair = [impacts(rng), impacts(rng, 0.5 * RATE)]
    errors = [errors_of(run, BOUNDS)["gear"]["impacts_per_second"] for run in pair]
    assert best_of([numbers(run)[0] for run in pair], errors) == (1, False)


@pytest.mark.parametrize(
    ("values", "errors", "answer"),
    [
        ((1.0, 2.0), (0.1, 0.1), (0, False)),
        ((2.0, 1.9, 1.0), (0.1, 0.1, 0.1), (2, False)),
        ((1.0, 1.1, 5.0), (0.1, 0.1, 0.1), (None, True)),
        ((1.0, 1.0), (0.0, 0.0), (None, False)),
        ((None, 1.0, 2.0), (None, 0.1, 0.1), (1, False)),
        ((None, 1.0), (None, 0.1), (None, False)),
        ((1.0, 2.0), (0.1, None), (None, False)),
    ],
)
def test_the_best_is_beyond_two_standard_errors(
    values: tuple[float | None, ...], errors: tuple[float | None, ...], answer: tuple[int | None, bool]
) -> None:
    assert best_of(values, errors) == answer
