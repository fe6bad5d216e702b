"""Curves between samples: polynomials where they are exact, and the flow of a motion with many impacts."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import deflection_rate
from gearrattle.engine.system import exact_statistics
from gearrattle.model.examples import example_files
from gearrattle.pipeline import Findings, judged
from gearrattle.report.plots.chords import MOST_POINTS, SCREEN, WITHIN
from gearrattle.report.plots.curve_between_samples import PIECES, Knots, between, with_crossings
from gearrattle.report.plots.phase_plane import phase_curves
from gearrattle.signals import last_cycles
from gearrattle.trajectory import Array, Trajectory


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


def test_the_phase_plane_of_a_rattling_run_is_its_flow() -> None:
    """Case 3, 25 impacts a cycle, 512 samples: chords between samples miss the flow by up to 184 px of 1200 x 600."""
    model = gr.example("case3").with_({"simulation.cycles": 12, "simulation.discard": 10})
    run, fine = judged(gr.simulate(model)), gr.simulate(model, samples_per_cycle=8192).trajectory
    for k, curve in enumerate(_curves(run)):
        assert len(curve) <= MOST_POINTS
        assert _farthest(curve, model, fine, k) < 1.0


@pytest.mark.slow
@pytest.mark.parametrize("name", example_files())
def test_every_sample_stands_on_the_curve_of_the_exact_motion(name: str) -> None:
    run = gr.simulate(gr.example(name), cycles=3, discard=2)
    motion, model = run.trajectory, run.model
    names = motion.layout.clearance_names
    assert motion.exact is not None
    pieces = motion.exact.phase_curves(motion, names, 1)
    assert pieces is not None
    curves = np.concatenate(list(pieces))
    part = slice(2 * motion.samples_per_cycle, None, max(1, motion.samples_per_cycle // 64))
    for k, curve in enumerate(np.moveaxis(curves, 1, 0)):
        rate = deflection_rate(model, motion, int(motion.layout.clearance[k]))
        samples = np.column_stack([motion.deflection[part, k], rate[part]])
        frame = np.ptp(curve, axis=0)
        moves = frame > 1e-12 * np.abs(curve).max(axis=0)  # before an event a driveline stands still, but for rounding
        scale = np.array(SCREEN) / np.where(moves, frame, 1.0)
        assert max(_distance(point, curve * scale) for point in samples * scale) < 0.35


def test_curves_in_pieces_are_those_in_one(monkeypatch: pytest.MonkeyPatch) -> None:
    run = judged(gr.simulate(gr.example("case3"), cycles=12, discard=10))
    motion = run.motion.trajectory
    names = motion.layout.clearance_names
    whole = list(motion.exact.phase_curves(motion, names, 2))
    drawn = _curves(run)
    monkeypatch.setattr(exact_statistics, "_PIECE", 20_000)
    pieces = list(motion.exact.phase_curves(motion, names, 2))
    assert len(whole) == 1
    assert len(pieces) > 5
    frames = np.ptp(whole[0], axis=0)
    np.testing.assert_allclose(np.concatenate(pieces) / frames, whole[0] / frames, atol=1e-13)  # rounding of products
    for curve, in_one in zip(_curves(run), drawn, strict=True):
        assert len(curve) <= MOST_POINTS
        scale = np.array(SCREEN) / np.ptp(in_one, axis=0)
        assert max(_distance(point, curve * scale) for point in in_one[::5] * scale) < 2.0 * WITHIN


def test_curves_of_a_stiff_contact_take_little_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 915 000 points of six numbers, 152 MB were asked for at once; eight cycles at 1e12 N m/rad took 1.8 GB."""
    stiff = gr.example("case3").with_({"mesh.gear.stiffness": 7.2e15})
    run = judged(gr.simulate(stiff, cycles=3, discard=1))
    monkeypatch.setattr(exact_statistics, "_PIECE", 200_000)
    tracemalloc.start()
    try:
        curves = _curves(run)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert all(len(curve) <= MOST_POINTS for curve in curves)
    assert peak < 5e7


def _curves(run: Findings) -> list[Array]:
    return phase_curves(run, [0, 1, 2], last_cycles(run.motion.trajectory, 2))[0]


def _farthest(curve: Array, model: gr.Model, fine: Trajectory, k: int) -> float:
    """Largest distance of a fine motion's last two cycles from the chords of a curve [px]."""
    rate = deflection_rate(model, fine, int(fine.layout.clearance[k]))
    flow = np.column_stack([fine.deflection[:, k], rate])[-2 * 8192 - 1 :: 5]
    scale = np.array(SCREEN) / np.ptp(curve, axis=0)
    return max(_distance(point, curve * scale) for point in flow * scale)


def _distance(point: np.ndarray, line: np.ndarray) -> float:
    begin, along = line[:-1], np.diff(line, axis=0)
    off = point - begin
    share = np.clip(np.einsum("ij,ij->i", off, along) / np.maximum(np.einsum("ij,ij->i", along, along), 1e-300), 0, 1)
    return float(np.hypot(*(off - share[:, None] * along).T).min())
