"""What was made of an immutable object is kept on it, and on no copy of it."""

from __future__ import annotations

import copy
import gc
import pickle
import weakref
from dataclasses import dataclass, replace
from pathlib import Path

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.derived_values import kept

CASE = Path(__file__).parents[1] / "examples" / "paper" / "case3.toml"


@dataclass(frozen=True)
class Number:
    value: float


@kept
def double(number: Number) -> list[float]:
    return [2.0 * number.value]


@kept
def triple(number: Number) -> list[float]:
    return [3.0 * number.value]


def test_it_is_made_once_for_an_object_and_each_function() -> None:
    one, equal = Number(1.0), Number(1.0)
    assert double(one) is double(one)
    assert double(equal) is not double(one)
    assert (double(one), triple(one)) == ([2.0], [3.0])
    assert one == equal


def test_copies_and_pickles_begin_without_it() -> None:
    one = Number(1.0)
    first = double(one)
    for other in (copy.copy(one), copy.deepcopy(one), pickle.loads(pickle.dumps(one)), replace(one, value=2.0)):
        assert double(other) is not first
        assert double(other) == [2.0 * other.value]
    assert double(one) is first


def test_a_copy_with_other_values_is_assembled_anew() -> None:
    model = gr.load(CASE)
    softer = model.couplings[0].model_copy(update={"stiffness": 0.5 * model.couplings[0].stiffness})
    before = assemble(model).system
    after = assemble(model.model_copy(update={"couplings": (softer, *model.couplings[1:])})).system
    assert after.laws[0].stiffness.tolist() == (0.5 * before.laws[0].stiffness).tolist()
    assert assemble(model).system is before


def test_it_goes_with_its_object() -> None:
    model = gr.load(CASE)
    system = weakref.ref(assemble(model).system)
    assert system() is not None
    del model
    gc.collect()
    assert system() is None


def test_a_model_is_as_large_in_a_pickle_as_before_it_was_assembled() -> None:
    model = gr.load(CASE)
    before = len(pickle.dumps(model))
    gr.simulate(model, cycles=1)
    assert abs(len(pickle.dumps(model)) - before) < 200
    assert pickle.loads(pickle.dumps(model)) == model
