"""Joints written as sines, and planets' masses in the J of their carrier, make the same system."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.assembly.written_out import written_out
from gearrattle.model import Model

EXAMPLES = Path(__file__).parents[2] / "examples"
WRITTEN = {"planetary_set": ("planet_mass", "centre_distance"), "propeller_shaft": ("hooke",)}


@pytest.mark.parametrize("name", WRITTEN)
def test_a_model_written_out_is_the_same_system(name: str) -> None:
    model = gr.load(EXAMPLES / f"{name}.toml")
    tables = written_out(model, at_speed=True)
    assert any(key in str(model.to_tables()) for key in WRITTEN[name])
    assert not any(key in str(tables) for key in WRITTEN[name])
    one, other = assemble(model).system, assemble(Model.from_tables(tables)).system
    for part in ("inertia", "drag", "rows"):
        np.testing.assert_allclose(getattr(other, part), getattr(one, part), rtol=1e-15)
    for part in ("period", "cycles", "mean", "torque_sine", "torque_cosine", "error_sine", "error_cosine"):
        expected = np.asarray(getattr(one.inputs, part))
        largest = np.max(np.abs(expected), initial=0.0)
        np.testing.assert_allclose(getattr(other.inputs, part), expected, rtol=1e-14, atol=1e-15 * largest)
    assert [law.stiffness.tolist() for law in one.laws] == [law.stiffness.tolist() for law in other.laws]
