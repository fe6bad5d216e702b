"""The stated error holds: in contact states that the estimate has not seen, on random drivelines."""

from __future__ import annotations

from functools import cache
from math import pi

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.analysis.linear.matrices import LinearSystem, linearised
from gearrattle.analysis.linear.response import accelerance
from gearrattle.assembly import assemble
from gearrattle.reductions.states import contact_states
from tests.reductions.drivelines import random_driveline

COUNTS = pytest.mark.parametrize("count", [6, pytest.param(48, marks=pytest.mark.long)])
"""Drivelines."""
PROBES = 20


def measured(model: gr.Model, small: gr.typing.Reduction, rng: np.random.Generator) -> float:
    """Largest error of a frequency in the band over random contact ratios of the clearances kept, by ``modes``."""
    gaps = [e.name for e in (*small.model.couplings, *small.model.meshes) if len(e.drive_pieces) > 1]
    worst = 0.0
    for _ in range(PROBES):
        ratio = {name: float(rng.choice([rng.uniform(), 10 ** rng.uniform(-2.3, 0), 0.0, 1.0])) for name in gaps}
        full, less = (gr.modes(entry, contact_ratio=ratio).frequencies for entry in (model, small.model))
        rigid = int(np.count_nonzero(full == 0.0))
        assert rigid == np.count_nonzero(less == 0.0)
        inside = full[rigid:][full[rigid:] <= small.up_to]
        actual = np.append(less[rigid:], np.full(full.size, np.inf))[: inside.size]
        assert np.all(actual >= inside * (1 - 1e-9))
        worst = max(worst, float(np.max(np.abs(actual - inside) / inside, initial=0.0)))
    return worst


@cache
def reduced(seed: int) -> tuple[gr.Model, gr.typing.Reduction]:
    model, rng = random_driveline(seed), np.random.default_rng(1000 + seed)
    omega = gr.modes(model).frequencies
    omega = omega[omega > 1e-6 * omega.max()]
    band = omega[min(int(rng.integers(0, 4)), omega.size - 1)] * rng.uniform(0.9, 1.6)
    return model, gr.reduce(model, float(band) / (2 * pi))


@COUNTS
def test_the_stated_error_is_not_optimistic(count: int) -> None:
    ratios, merged = [], 0
    for seed in range(count):
        (model, small), rng = reduced(seed), np.random.default_rng(2000 + seed)
        assert float(small.error) <= small.error.limit
        merged += any(fate.merged for fate in small.elements.values())
        actual = measured(model, small, rng)
        if actual > 1e-9:
            ratios.append(actual / float(small.error))
    assert merged >= 0.7 * count
    assert len(ratios) >= 0.5 * count
    assert max(ratios) <= 1.5
    assert np.mean(np.array(ratios) <= 1.0 + 1e-6) >= 0.95


def closed(model: gr.Model) -> LinearSystem:
    system = assemble(model).system
    return linearised(system, *contact_states(system, ())[0][:2])


@COUNTS
def test_the_stated_errors_of_responses_are_not_optimistic(count: int) -> None:
    """Against a grid that knows nothing of resonances; torque on the first body, acceleration of every body kept."""
    ratios = []
    for seed in range(count):
        model, small = reduced(seed)
        if not small.groups:
            continue
        names, kept = ([body.name for body in entry.inertias] for entry in (model, small.model))
        at = {member: (owner, ratio) for owner, group in small.groups.items() for member, ratio in group.items()}
        owner, ratio = at.get("b0", ("b0", 1.0))
        omega = np.linspace(0.0, small.up_to, 1501)[1:]
        watch = np.eye(len(names))[[names.index(name) for name in kept]]
        full = accelerance(closed(model), omega, np.eye(len(names))[names.index("b0")], watch)
        less = accelerance(closed(small.model), omega, ratio * np.eye(len(kept))[kept.index(owner)], np.eye(len(kept)))
        resonances = closed(model).frequencies()
        resonances = resonances[(resonances > 0) & (resonances <= small.up_to)]
        peak = np.abs(full).max(axis=0)
        if resonances.size:
            tops = accelerance(closed(model), resonances, np.eye(len(names))[names.index("b0")], watch)
            peak = np.maximum(peak, np.abs(tops).max(axis=0))
        shares = np.max(np.abs(full - less) / peak)
        levels = np.where(np.abs(full) >= 0.01 * peak, 20 * np.abs(np.log10(np.abs(less) / np.abs(full))), 0.0).max()
        if small.error.response_peak > 1e-9:
            ratios.append(max(shares / small.error.response_peak, levels / small.error.response_db))
    assert len(ratios) >= 0.6 * count
    assert max(ratios) <= 1.5
    assert np.mean(np.array(ratios) <= 1.01) >= 0.95
