"""What samples say satisfies the equations: laws, balance of torques, and each sample by itself."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.engine.solvers.exact import ExactMarch
from gearrattle.engine.solvers.samples_in_si import sampled_quantities, sampled_z
from gearrattle.simulation.simulate import prepare
from tests.architecture.places import EXAMPLES
from tests.engine.solvers.tasks import finished, task
from tests.engine.system.drivelines import random_chain


def march_of(seed: int) -> ExactMarch:
    system, rng = random_chain(seed), np.random.default_rng(seed)
    start = list(rng.normal(size=system.size) * 0.01), list(rng.normal(size=system.size))
    march = ExactMarch(task(system, *start, cycles=3, samples=16))
    finished(march)
    return march


def march_of_example(name: str) -> ExactMarch:
    settings = {"cycles": 3, "samples_per_cycle": 16, "discard": 0}
    march = ExactMarch(prepare(gr.load(EXAMPLES / name), settings, audit=False).task)
    finished(march)
    return march


MARCHES = [*range(12), "clutch_friction.toml", "run_up.toml"]


@pytest.mark.parametrize("of", MARCHES)
def test_samples_satisfy_laws_and_balance(of: int | str) -> None:
    march = march_of_example(of) if isinstance(of, str) else march_of(of)
    flow, system, z = march.flow, march.flow.system, march.sampled_z()
    sampled, (of_auxiliaries, _) = sampled_quantities(flow, march.samples)
    deflection, rate, velocity = z @ flow.deflection.T, z @ flow.rate.T, z @ flow.velocity.T
    force = np.zeros_like(deflection)
    for k, law in enumerate(system.laws):
        pieces = march.samples.pieces.T[system.places.index(k)] if k in system.places else np.zeros(len(z), np.int64)
        force[:, k] = law.stiffness[pieces] * deflection[:, k] + law.damping[pieces] * rate[:, k] + law.offset[pieces]
    for c, auxiliary in enumerate(system.auxiliaries):
        force[:, auxiliary.element] += of_auxiliaries[:, c]
    balance = z @ flow.torque.T - system.drag * velocity - force @ system.rows
    clearances = list(system.clearances)
    for name, expected, size in (
        ("velocity", velocity, np.abs(velocity).max()),
        ("deflection", deflection[:, clearances], np.abs(deflection).max(initial=1e-300)),
        ("force", force, np.abs(force).max(initial=1e-300)),
        ("acceleration", balance / system.inertia, np.abs(force @ np.abs(system.rows) / system.inertia).max() + 1.0),
    ):
        np.testing.assert_allclose(sampled[name], expected, rtol=0, atol=1e-11 * size, err_msg=name)
    references = march.samples.states[:, flow.states :][:, : len(flow.coordinates.references)]
    turned = sampled["angle"] - references @ flow.coordinates.angle_from_reference.T
    np.testing.assert_allclose(turned @ system.rows.T, sampled["angle"] @ system.rows.T, rtol=0, atol=1e-9)
    assert all(np.isfinite(values).all() for values in sampled.values())


@pytest.mark.parametrize("of", MARCHES)
def test_some_rows_are_those_of_all(of: int | str) -> None:
    march = march_of_example(of) if isinstance(of, str) else march_of(of)
    rows = np.array([0, 5, 17, len(march.samples.states) - 1])
    assert np.array_equal(sampled_z(march.flow, march.samples, rows), march.sampled_z()[rows])


@pytest.mark.parametrize("of", MARCHES)
def test_each_sample_is_worked_out_by_itself(of: int | str) -> None:
    march = march_of_example(of) if isinstance(of, str) else march_of(of)
    whole, samples = sampled_quantities(march.flow, march.samples)[0], march.samples
    first = 7
    part = samples._replace(
        first=samples.first + first,
        states=np.ascontiguousarray(samples.states[first:]),
        pieces=np.ascontiguousarray(samples.pieces[first:]),
    )
    for name, values in sampled_quantities(march.flow, part)[0].items():
        assert np.array_equal(values, whole[name][first:]), name
