"""A ring of four bodies, one of its couplings 3400 times as stiff as the next: it rests, and so it runs."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.model.model_file import loads

STIFFNESSES = (57601089.69808486, 11768.719033784835, 692778.6835663491, 40001951238.446724)
MEANS = (21.742652053997585, -185.6306790048291, -8.96961409820812, -124.66144205175148)
INERTIAS = (0.004304203751434495, 0.0001517402431372791, 0.00015668623422475362, 0.9924404574858076)
RING = "\n".join(
    [
        "schema = 1",
        *(f'[[inertia]]\nname = "i{i}"\nJ = {j}' for i, j in enumerate(INERTIAS)),
        *(
            f'[[coupling]]\nname = "c{i}"\nbetween = ["i{i}", "i{(i + 1) % 4}"]\nstiffness = {k}\ndamping = 0.01'
            for i, k in enumerate(STIFFNESSES)
        ),
        "[excitation]\nfrequency = 20.0",
        *(f'[[torque]]\non = "i{i}"\nmean = {mean}' for i, mean in enumerate(MEANS)),
        "[simulation]\ncycles = 1\ndiscard = 0",
    ]
)


def test_a_ring_of_unequal_couplings_rests_and_stays_at_rest() -> None:
    model = loads(RING)
    rest = gr.equilibrium(model)
    t = gr.simulate(model).trajectory
    assert np.isfinite(list(rest.deflection.values())).all()
    assert np.ptp(t.element_torque, axis=0).max() <= 1e-6 * np.abs(t.element_torque).max()


def test_a_study_of_a_ring_with_a_gap_has_the_numbers_of_single_runs() -> None:
    text = RING.replace("damping = 0.01", "damping = 0.01\nclearance = 1e-4", 1)
    text = text.replace(str(MEANS[1]), f"{MEANS[1]}\nharmonics = [{{ order = 1.0, amplitude = 300.0 }}]")
    model, values = loads(text), [30.0, 40.0, 50.0, 60.0, 70.0]
    data = gr.study(model, {"excitation.frequency": values}, ["crossings per cycle"], scheduler="threads")
    single = [gr.simulate(loads(text.replace("= 20.0", f"= {value}"))).trajectory for value in values]
    counted = data["crossings per cycle"].values
    assert counted.tolist() == pytest.approx([len(t.events.time) / t.cycles for t in single])
    assert counted.max() > 0
