"""What the definitions say of friction and clipped damping, at every one of many samples of random drivelines.

Each statement is about instants and what lies between two of them, so growth of perturbations plays no part.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

import gearrattle as gr
from tests.oracles.dressed import FAMILIES, dressed_problem
from tests.oracles.driveline import Coupling, Driveline
from tests.oracles.fixed_point import to_float
from tests.oracles.law import law_of
from tests.oracles.stick_slip import frictions

SAMPLES = 1000
NOTHING = 1e-11
"""Of the size of what is compared: rounding of sums over the run's sizes."""


def deflections(model: Driveline, run: gr.Run, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Deflection and rate of element k at all samples, from angles and velocities, transmission errors by hand."""
    element = model.elements[k]
    names = [b.name for b in model.bodies]
    t = run.data.time.values
    delta, rate = np.zeros(len(t)), np.zeros(len(t))
    for end, radius, sign in zip(element.between, element.radii, (1, -1), strict=True):
        if end != "ground":
            delta = delta + sign * float(radius) * run.data.angle.values[:, names.index(end)]
            rate = rate + sign * float(radius) * run.data.velocity.values[:, names.index(end)]
    for h in element.error:
        omega = float(Fraction(h.order) * Fraction(model.speed))
        delta = delta - float(h.amplitude) * np.sin(omega * t + float(h.phase))
        rate = rate - float(h.amplitude) * omega * np.cos(omega * t + float(h.phase))
    return delta, rate


def hold_sliders(model: Driveline, run: gr.Run) -> int:
    """Check every slider; return how many there are."""
    data = run.data
    words = run.data.slider.attrs["flag_meanings"].split(", ")
    count = 0
    times = run.trajectory.auxiliaries.passages.time
    passed = np.searchsorted(times, data.time.values)
    for k, element in enumerate(model.elements):
        delta, rate = deflections(model, run, k)
        size, hurry = np.abs(run.data.angle.values).max() + np.abs(delta).max(), np.abs(rate).max()
        for friction in frictions(element):
            of = data.sel(auxiliary=friction.name)
            limit, reach = to_float(friction.limit), to_float(friction.reach)
            state = of.slider.values
            force = of.slider_force.values
            stretch = of.slider_stretch.values
            forward, backward, sticks, off = (
                state == words.index(w) for w in ("slips forward", "slips backward", "sticks", "let go")
            )
            assert np.all(forward | backward | sticks | off)
            assert np.allclose(force[forward], limit, rtol=1e-14)
            assert np.allclose(force[backward], -limit, rtol=1e-14)
            assert np.all(force[off] == 0.0)
            assert np.allclose(force[sticks], limit / reach * stretch[sticks], rtol=1e-12, atol=1e-14)
            assert np.all(np.abs(stretch) <= reach * (1 + 1e-11))
            assert np.all(rate[forward] >= -NOTHING * hurry)
            assert np.all(rate[backward] <= NOTHING * hurry)
            together = sticks[1:] & sticks[:-1] & (passed[1:] == passed[:-1])  # nothing happened in between
            moved = np.abs(np.diff(stretch) - np.diff(delta))[together]
            assert moved.max(initial=0.0) <= NOTHING * (size + reach)
            if name_of_region(model, k):
                region = data.region.sel(clearance=element.name).values
                engaged = (region >= friction.low) & (region <= friction.high)
                assert np.array_equal(engaged, ~off)
            count += 1
    return count


def name_of_region(model: Driveline, k: int) -> bool:
    return k in model.clearances


def hold_clipping(model: Driveline, run: gr.Run) -> int:
    """Check the whole force of every element with clipped damping against min and max; return how many."""
    count = 0
    for k, element in enumerate(model.elements):
        if element.contact_damping != "clipped" or (isinstance(element, Coupling) and frictions(element)):
            continue
        law = law_of(element)
        delta, rate = deflections(model, run, k)
        half, slope, damping = (to_float(x) for x in (law.corners[-1], law.stiffness[-1], law.damping[-1]))
        spring = slope * np.sign(delta) * np.maximum(np.abs(delta) - half, 0.0)
        size = np.abs(spring)
        damped = np.where(size > 0.0, np.clip(damping * rate, -size, size), 0.0)
        force = run.data.force.sel(clearance=element.name).values
        room = NOTHING * (slope * (np.abs(run.data.angle.values).max() + half) + np.abs(damping * rate).max() + 1.0)
        off = np.abs(force - spring - damped)
        assert off.max() <= room, (element.name, off.max(), room)
        count += 1
    return count


def attack(family: str, seeds: range) -> None:
    checked = switched = 0
    for seed in seeds:
        problem = dressed_problem(family, seed)
        cycles = min(problem.cycles, 3)
        run = gr.simulate(gr.loads(problem.model.toml()), cycles=cycles, samples_per_cycle=SAMPLES, discard=0)
        assert run.cost.energy_residual <= 1e-12, (family, seed)
        if run.trajectory.auxiliaries is None:
            continue
        checked += hold_sliders(problem.model, run) + hold_clipping(problem.model, run)
        switched += len(run.switches)
    assert checked > 0
    assert switched > len(seeds)


QUICK = ("chain", "loop", "mesh", "stiff", "static")


@pytest.mark.parametrize(
    "family", [name if name in QUICK else pytest.param(name, marks=pytest.mark.long) for name in FAMILIES]
)
def test_every_sample(family):
    attack(family, range(100, 103))


@pytest.mark.long
@pytest.mark.parametrize("part", range(10))
@pytest.mark.parametrize("family", FAMILIES)
def test_every_sample_of_many(family, part):
    attack(family, range(200 + 20 * part, 220 + 20 * part))
