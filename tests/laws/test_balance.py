"""A mean that says "balance" leaves no torque on its train, whatever the train, and follows every change.

The oracle multiplies the ratios along the tree in exact fractions.
"""

from __future__ import annotations

import random
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble, own_mean
from gearrattle.assembly.variant_assembly import coefficients
from gearrattle.engine.kernels.variant_arrays import picked
from gearrattle.engine.system.plain_arrays import coefficients_of

SEEDS = range(30)
TABLE = {"speed": [40.0, 90.0, 130.0, 300.0]}


def tree(seed: int, *, tables: bool = False, sweep: bool = False) -> dict[str, Any]:
    """The tables of a random tree of inertias, couplings and gears, with drags, torques, and one mean that balances."""
    rng = random.Random(seed)
    count = rng.randint(2, 12)

    def torque(low: float, high: float) -> Any:
        if tables and rng.random() < 0.5:
            return {**TABLE, "value": [rng.uniform(low, high) for _ in TABLE["speed"]]}
        return rng.uniform(low, high)

    inertias = [
        {"name": f"b{i}", "J": 10.0 ** rng.uniform(-4, 0), "drag_torque": torque(0.0, 3.0)} for i in range(count)
    ]
    couplings, meshes = [], []
    for i in range(1, count):
        ends = [f"b{rng.randrange(i)}", f"b{i}"]
        if rng.random() < 0.5:
            couplings.append(
                {"name": f"c{i}", "between": ends, "stiffness": 10.0 ** rng.uniform(2, 5), "clearance": 0.01}
            )
        else:
            radii = [rng.uniform(0.01, 0.1), rng.uniform(0.01, 0.1)]
            meshes.append({"name": f"m{i}", "between": ends, "radii": radii, "stiffness": 1e8, "backlash": 1e-4})
    torques = [{"on": f"b{rng.randrange(count)}", "mean": torque(-20.0, 20.0)} for _ in range(rng.randint(0, 3))]
    torques.insert(rng.randint(0, len(torques)), {"on": f"b{rng.randrange(count)}", "mean": "balance"})
    excitation = {"sweep": {"from": 50.0, "to": 200.0, "over": 0.4}} if sweep else {"speed": 100.0}
    return {
        "schema": 1,
        "inertia": inertias,
        "coupling": couplings,
        "mesh": meshes,
        "torque": torques,
        "excitation": excitation,
        "simulation": {"cycles": 4, "discard": 2},
    }


def ratios(model: gr.Model) -> dict[str, Fraction]:
    """Angle of every body in the motion of its train."""
    angles = {model.inertias[0].name: Fraction(1)}
    for element in sorted(model.elements, key=lambda one: int(one.name[1:])):  # element i hangs body i on one before it
        one, other = element.between
        angles[other] = angles[one] * Fraction(element.radii[0]) / Fraction(element.radii[1])
    return angles


def left_over(model: gr.Model, means: np.ndarray) -> float:
    """The part of the sum of moduli that the means leave over on the motion of the train."""
    works = [ratios(model)[body.name] * Fraction(float(mean)) for body, mean in zip(model.inertias, means, strict=True)]
    return float(abs(sum(works)) / sum(map(abs, works)))


def balancing(model: gr.Model) -> int:
    """The index of the torque that balances."""
    return next(i for i, torque in enumerate(model.torques) if torque.mean == "balance")


@pytest.mark.parametrize("seed", SEEDS)
def test_no_torque_is_left_over(seed: int) -> None:
    model = gr.Model.from_tables(tree(seed))
    assert left_over(model, assemble(model).system.inputs.mean) < 1e-15
    rest = gr.equilibrium(model)
    assert not rest.acceleration.any()
    assert not any("balance" in note for note in rest.notes)


@pytest.mark.parametrize("seed", SEEDS)
def test_it_follows_a_change(seed: int) -> None:
    model = gr.Model.from_tables(tree(seed))
    angles, index, body = ratios(model), balancing(model), model.inertias[-1]
    more = model.with_({f"inertia.{body.name}.drag_torque": body.drag_torque + 1.0})
    assert left_over(more, assemble(more).system.inputs.mean) < 1e-15
    change = float(angles[body.name] / angles[model.torques[index].on])
    np.testing.assert_allclose(own_mean(more, index) - own_mean(model, index), change, rtol=1e-11)


@pytest.mark.parametrize("seed", SEEDS)
def test_what_is_written_reads_alike(seed: int) -> None:
    model = gr.Model.from_tables(tree(seed, tables=True))
    again = gr.loads(model.to_toml())
    index = balancing(model)
    assert again == model
    assert again.to_tables()["torque"][index]["mean"] == "balance"
    assert own_mean(again, index) == own_mean(model, index)
    number = model.with_({f"torque.{index}.mean": own_mean(model, index)})
    means = [assemble(one).system.inputs.mean for one in (number, model)]
    np.testing.assert_allclose(
        *means, rtol=0.0, atol=1e-14 * sum(abs(own_mean(model, i)) for i in range(len(model.torques)))
    )
    assert number.with_({f"torque.{index}.mean": "balance"}) == model


@pytest.mark.parametrize("seed", SEEDS)
def test_along_a_sweep_it_balances_at_every_speed(seed: int) -> None:
    model = gr.Model.from_tables(tree(seed, tables=True, sweep=True))
    index = balancing(model)
    balanced = own_mean(model, index)
    for speed in np.linspace(50.0, 200.0, 31).tolist():
        fixed = model.with_({"excitation.speed": speed})
        at_speed = getattr(balanced, "at", lambda _, same=balanced: same)(speed)
        size = np.abs(assemble(fixed).system.inputs.mean).sum() + abs(at_speed)
        assert abs(at_speed - own_mean(fixed, index)) < 1e-14 * size


@pytest.mark.parametrize("seed", range(10))
def test_signals_of_a_sweep_leave_nothing_over(seed: int) -> None:
    model = gr.Model.from_tables(tree(seed, tables=True, sweep=True))
    system, angles = assemble(model).system, ratios(model)
    motion = np.array([float(angles[body.name]) for body in model.inertias])
    size = np.abs(motion) @ np.abs(system.inputs.mean)
    assert abs(motion @ system.inputs.mean) < 1e-14 * size
    if system.signals is not None:
        torques = system.signals.at(np.linspace(0.0, 0.5, 101)) @ system.signals.torque.T
        assert np.abs(torques @ motion).max() < 1e-12 * max(size, np.abs(torques).max())


@pytest.mark.parametrize("seed", SEEDS)
def test_variants_have_the_same_bits(seed: int) -> None:
    model = gr.Model.from_tables(tree(seed, tables=True))
    rng = np.random.default_rng(seed)
    columns = {"excitation.speed": rng.uniform(41.0, 299.0, 5)}
    columns |= {f"inertia.{body.name}.drag_torque": rng.uniform(0.0, 3.0, 5) for body in model.inertias[::2]}
    columns |= {
        f"torque.{i}.mean": rng.uniform(-9.0, 9.0, 5) for i, t in enumerate(model.torques) if t.mean != "balance"
    }
    many, good = coefficients(model, columns, 5)
    assert good.all()
    for v in range(5):
        alone = model.with_({path: float(column[v]) for path, column in columns.items()})
        mean = picked(many, v).mean
        assert np.array_equal(mean, coefficients_of(assemble(alone).system).mean)
        assert left_over(alone, mean) < 1e-15


def test_a_number_may_vary_in_its_place() -> None:
    model = gr.Model.from_tables(tree(3))
    index = balancing(model)
    values = np.array([1.0, -2.0, 0.25])
    many, good = coefficients(model, {f"torque.{index}.mean": values}, 3)
    assert good.all()
    for v, value in enumerate(values.tolist()):
        alone = model.with_({f"torque.{index}.mean": value})
        assert np.array_equal(picked(many, v).mean, coefficients_of(assemble(alone).system).mean)
