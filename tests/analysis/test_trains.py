"""Notes on trains: the torque left over on each, by the power of the means; bodies on their own."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr

TRAIN = """
schema = 1
units = "{units}"
inertia = [
  {{ name = "flywheel", J = 0.18 }},
  {{ name = "shaft", J = 3.5e-3, drag_torque = 7.5 }},
  {{ name = "gear", J = 1.2e-3, drag_torque = 0.3 }},
  {{ name = "output", J = 0.02, drag_torque = {lone} }},
]
coupling = [{{ name = "clutch", between = ["flywheel", "shaft"], stiffness = 300.0 }}]
mesh = [{{ name = "mesh", between = ["shaft", "gear"], radii = [0.03, 0.045], stiffness = 3e8, backlash = 8e-5 }}]
excitation = {{ speed = 80.0 }}
torque = [{{ on = "flywheel", mean = {mean} }}]
"""
REMEDY = 'A torque on a train balances it with mean = "balance".'
ALONE = "output: no element connects it to another body."
DIFFERENTIAL = """
schema = 1
inertia = [{ name = "s", J = 0.1 }, { name = "r", J = 0.3 }, { name = "c", J = 0.2 }, { name = "p", J = 1e-3 }]
excitation = { speed = 80.0 }
torque = [{ on = "s", mean = 3.0 }]
[[planetary]]
name = "set"
sun = "s"
ring = "r"
carrier = "c"
planets = ["p"]
radii = { sun = 0.03, planet = 0.02, ring = 0.07 }
stiffness = { sun = 1e7, ring = 1e7 }
"""


def _train(mean: float, lone: float = 0.0, units: str = "SI") -> gr.Equilibrium:
    return gr.equilibrium(gr.loads(TRAIN.format(mean=mean, lone=lone, units=units)))


def test_means_in_balance_need_no_note() -> None:
    """The gear's 0.3 N m are 0.2 N m at the shaft that drives it: 30/45."""
    assert _train(7.7).notes == (ALONE,)


@pytest.mark.parametrize(("mean", "words"), [(8.0, "0.3 N m are left over"), (7.2, "0.5 N m are lacking")])
def test_the_torque_left_over_is_told_where_the_train_begins(mean: float, words: str) -> None:
    rest = _train(mean)
    a = (mean - 7.7) / (0.18 + 3.5e-3 + 1.2e-3 * (30.0 / 45.0) ** 2)
    np.testing.assert_allclose(rest.acceleration, [a, a, a * 30.0 / 45.0, 0.0], rtol=1e-12)
    assert rest.notes[0] == (
        f"the mean torques do not balance: {words} at flywheel, which accelerates uniformly by {a:.6g} rad/s^2 "
        f"with its train. The equilibrium is that of the accelerated train. {REMEDY}"
    )


def test_every_train_is_told_by_itself() -> None:
    note = _train(8.0, lone=0.2).notes[0]
    assert "0.3 N m are left over at flywheel" in note
    assert "0.2 N m are lacking at output, which accelerates uniformly by -10 rad/s^2" in note
    assert note.endswith(f"that of the accelerated trains. {REMEDY}")


def test_without_dimensions_there_are_no_units() -> None:
    note = _train(8.0, units="dimensionless").notes[0]
    assert "0.3 are left over at flywheel" in note
    assert "rad" not in note
    assert "N m" not in note


def test_a_set_that_turns_in_two_ways_has_no_single_torque() -> None:
    rest = gr.equilibrium(gr.loads(DIFFERENTIAL))
    largest = rest.acceleration[np.argmax(np.abs(rest.acceleration))]
    assert f"the train with s accelerates uniformly by up to {largest:.6g} rad/s^2" in rest.notes[0]
    assert REMEDY not in rest.notes[0]


def test_a_long_list_is_cut() -> None:
    bodies = [{"name": f"b{i}", "J": 1.0} for i in range(10)]
    joints = [{"name": f"k{i}", "between": [f"b{i}", f"b{i + 1}"], "stiffness": 1.0} for i in range(0, 10, 2)]
    torques = [{"on": f"b{i}", "mean": 1.0} for i in range(0, 10, 2)]
    tables = {"schema": 1, "inertia": bodies, "coupling": joints, "torque": torques, "excitation": {"speed": 1.0}}
    note = gr.equilibrium(gr.Model.from_tables(tables)).notes[0]
    assert "at b4" in note
    assert "at b6" not in note
    assert "; so do 2 more. " in note


def test_the_remedy_balances_the_train() -> None:
    model = gr.loads(TRAIN.format(mean=8.0, lone=0.0, units="SI")).with_({"torque.0.mean": "balance"})
    rest = gr.equilibrium(model)
    assert rest.notes == (ALONE,)
    assert not rest.acceleration.any()
    np.testing.assert_allclose(rest.balance["flywheel"], 7.7, rtol=1e-15)
