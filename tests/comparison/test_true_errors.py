"""The errors a comparison quotes are those against the fifty-digit oracle, at three instants of three motions."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.comparison.pointwise import deflection_scale, error_history
from tests.literature.paper_cases import paper_case
from tests.oracles.exact_mp import solve

INSTANTS = (9, 17, 24)  # of 24 samples a cycle


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "algorithm"),
    [
        (1, "rk2"),
        *(pytest.param(*case, marks=pytest.mark.long) for case in ((2, "rkv"), (3, "adams"), (3, "bulirsch-stoer"))),
    ],
)
def test_errors_quoted_are_true_errors(number: int, algorithm: str) -> None:
    driveline = paper_case(number, loaded=True)
    model = gr.loads(driveline.toml())
    grid = {"cycles": 1, "samples_per_cycle": 24, "discard": 0}
    values = gr.simulate(model, algorithm=algorithm, tolerance=1e-6, **grid).trajectory
    reference = gr.simulate(model, **grid).trajectory
    quoted = error_history(values, reference, deflection_scale(reference, reference.time.size))
    oracle = solve(driveline, 1, 24).array("deflection")[:, reference.layout.clearance]
    half_gaps = np.array([np.abs(corners).max() for corners in reference.layout.corners])
    true = np.abs(values.deflection - oracle) / half_gaps
    assert true.max() > 1e-7  # there is an error to quote
    for i in INSTANTS:
        assert quoted[i] == pytest.approx(true[i], abs=1e-11)
