"""Curves between samples: polynomials where they are exact, and the flow of a motion with many impacts."""

from __future__ import annotations

import numpy as np

import gearrattle as gr
from gearrattle.assembly import deflection_rate
from gearrattle.pipeline import judged
from gearrattle.report.plots.chords import MOST_POINTS, SCREEN
from gearrattle.report.plots.phase_plane import smooth_curve
from gearrattle.report.plots.smooth import PIECES, Knots, between, with_crossings


def test_a_polynomial_comes_back_exactly() -> None:
    """Of fifth degree between samples, of fourth beside one crossing, of third between two."""
    time = np.array([0.0, 0.3, 1.0, 1.2, 2.0])
    for degree, lost in ((5, []), (4, [2]), (3, [2, 3])):
        p = np.polynomial.Polynomial(np.random.default_rng(degree).normal(size=degree + 1))
        second = p.deriv(2)(time)
        second[lost] = np.nan
        curve = between(Knots(time, p(time), p.deriv()(time), second))
        fine = np.append((time[:-1, None] + np.diff(time)[:, None] * np.arange(PIECES) / PIECES).ravel(), time[-1])
        np.testing.assert_allclose(curve, np.column_stack([p(fine), p.deriv()(fine)]), atol=1e-12)


def test_crossings_stand_between_the_samples() -> None:
    samples = Knots(*(np.array([0.0, 1.0, 2.0]) for _ in range(4)))
    knots = with_crossings(samples, np.array([-1.0, 0.5, 1.5, 3.0]), np.full(4, 7.0), np.full(4, 8.0))
    assert knots.time.tolist() == [0.0, 0.5, 1.0, 1.5, 2.0]
    assert np.isnan(knots.second).tolist() == [False, True, False, True, False]


def test_the_phase_plane_of_a_rattling_run_is_smooth() -> None:
    """Case 3, 25 impacts a cycle, 512 samples: chords between samples miss the flow by up to 184 px of 1200 x 600."""
    model = gr.example("case3").with_({"simulation.cycles": 12, "simulation.discard": 10})
    run, fine = judged(gr.simulate(model)), gr.simulate(model, samples_per_cycle=8192).trajectory
    last = slice(-2 * 512 - 1, None)
    for k in range(3):
        curve = smooth_curve(run, k, last)
        assert len(curve) <= MOST_POINTS
        rate = deflection_rate(model, fine, int(fine.layout.clearance[k]))
        flow = np.column_stack([fine.deflection[:, k], rate])[-2 * 8192 - 1 :: 5]
        scale = np.array(SCREEN) / np.ptp(curve, axis=0)
        away = np.array([_distance(point, curve * scale) for point in flow * scale])
        assert np.quantile(away, 0.99) < 0.5
        assert away.max() < 6.0  # a contact of fewer than three samples


def _distance(point: np.ndarray, line: np.ndarray) -> float:
    begin, along = line[:-1], np.diff(line, axis=0)
    off = point - begin
    share = np.clip(np.einsum("ij,ij->i", off, along) / np.maximum(np.einsum("ij,ij->i", along, along), 1e-300), 0, 1)
    return float(np.hypot(*(off - share[:, None] * along).T).min())
