"""V6 and V11: a rigid-body mode under a step, and a two-body backlash with parallel elements."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from tests.literature import systems


def test_v6_struck_pair():
    run = gr.simulate(
        gr.loads(systems.struck_pair().toml()), algorithm="exact", cycles=1, samples_per_cycle=1000, discard=0
    )
    last = run.data.isel(time=-1)
    assert float(last.time) == pytest.approx(0.05, rel=1e-15)
    assert last["angle"].values == pytest.approx([0.151183299793715739, 0.148854376289275298], rel=1e-12)
    assert last["velocity"].values == pytest.approx([6.00170355985988, 6.23935275087575], rel=1e-12)
    twist = run.data["angle"].values @ [1.0, -1.0]
    largest = 0.00479182045278902
    assert largest * (1 - 1e-4) < twist.max() <= largest * (1 + 1e-12)
    rate = run.data["velocity"].values @ [1.0, -1.0]
    torque = run.data["element_torque"].sel(element="shaft").values
    assert np.allclose(torque, 1800 * twist + 1.2 * rate, rtol=0, atol=1e-9)
    acceleration = run.data["acceleration"].values
    assert np.allclose(acceleration, np.column_stack([(35 - torque) / 0.25, torque / 0.04]), rtol=0, atol=1e-8)
    assert len(run.events) == 0


def test_v11_two_body_backlash():
    run = gr.simulate(
        gr.loads(systems.two_body_backlash().toml()), algorithm="exact", cycles=1, samples_per_cycle=1, discard=0
    )
    last = run.data.isel(time=-1)
    assert last["angle"].values == pytest.approx([0.561188003790941962, 0.509468424696395138], abs=1e-11)
    assert last["velocity"].values == pytest.approx([-2.11430269757913, 0.222944531344402799], abs=1e-10)
    assert len(run.events) == 10
    assert run.events["time"][0] == pytest.approx(0.0517903237784, abs=1e-13)
    assert set(run.events["clearance"]) == {"gap"}
