"""The stated error holds: in contact states that the estimate has not seen, on random drivelines."""

from __future__ import annotations

from math import pi

import numpy as np

import gearrattle as gr
from tests.reductions.drivelines import random_driveline

DRIVELINES = 48
PROBES = 20


def measured(model: gr.Model, small: gr.Reduction, rng: np.random.Generator) -> float:
    """Largest error of a frequency in the band over random contact ratios of the clearances kept, by ``modes``."""
    gaps = [e.name for e in (*small.model.couplings, *small.model.meshes) if len(e.drive_pieces) > 1]
    worst = 0.0
    for _ in range(PROBES):
        ratio = {name: float(rng.choice([rng.uniform(), 10 ** rng.uniform(-2.3, 0), 0.0, 1.0])) for name in gaps}
        full, less = (gr.modes(each, contact_ratio=ratio).frequencies for each in (model, small.model))
        rigid = int(np.count_nonzero(full == 0.0))
        assert rigid == np.count_nonzero(less == 0.0)
        inside = full[rigid:][full[rigid:] <= small.up_to]
        found = np.append(less[rigid:], np.full(full.size, np.inf))[: inside.size]
        assert np.all(found >= inside * (1 - 1e-9))
        worst = max(worst, float(np.max(np.abs(found - inside) / inside, initial=0.0)))
    return worst


def test_the_stated_error_is_not_optimistic() -> None:
    ratios, merged = [], 0
    for seed in range(DRIVELINES):
        model, rng = random_driveline(seed), np.random.default_rng(1000 + seed)
        omega = gr.modes(model).frequencies
        omega = omega[omega > 1e-6 * omega.max()]
        band = omega[min(int(rng.integers(0, 4)), omega.size - 1)] * rng.uniform(0.9, 1.6)
        small = gr.reduce(model, float(band) / (2 * pi))
        assert float(small.error) <= small.error.limit
        merged += any(fate.merged for fate in small.elements.values())
        found = measured(model, small, rng)
        if found > 1e-9:
            ratios.append(found / float(small.error))
    assert merged >= 0.7 * DRIVELINES
    assert len(ratios) >= 0.5 * DRIVELINES
    assert max(ratios) <= 1.5
    assert np.mean(np.array(ratios) <= 1.0 + 1e-6) >= 0.95
