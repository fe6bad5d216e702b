"""Matrices of one region: against the equations by elements, in both kinds of files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

import gearrattle as gr
from gearrattle.assembly import assemble
from tests.exchange.drivelines import tree


@pytest.mark.parametrize("region", [None, {"gear": 0}, {"gear": -1, "clutch": 0}])
def test_rates_and_outputs_in_a_region(region: dict[str, int] | None, tmp_path: Path) -> None:
    model = gr.example("case3")
    path = gr.export_model(model, tmp_path / "a.npz", region=region).path
    held = np.load(path)
    system = assemble(model).system
    n, m = system.size, len(system.laws)
    draw = np.random.default_rng(2)
    x = draw.normal(size=2 * n) * np.repeat([1e-3, 1.0], n)
    torque, error, slope = draw.normal(size=n), 1e-6 * draw.normal(size=m), 1e-3 * draw.normal(size=m)
    u = np.concatenate([torque, error, slope])
    # by elements
    delta = system.rows @ x[:n] - error
    rate = system.rows @ x[n:] - slope
    force = []
    for k, (element, law) in enumerate(zip(model.elements, system.laws, strict=True)):
        piece = (region or {}).get(element.name, law.first_label + law.pieces - 1) - law.first_label
        force.append(law.stiffness[piece] * delta[k] + law.damping[piece] * rate[k] + law.offset[piece])
    acceleration = (torque - system.drag * x[n:] - system.rows.T @ force) / system.inertia
    np.testing.assert_allclose((held["A"] @ x + held["B"] @ u + held["a"])[n:], acceleration, rtol=1e-10)
    outputs = np.concatenate([x, acceleration, delta, force])
    np.testing.assert_allclose(held["G"] @ x + held["P"] @ u + held["b"], outputs, rtol=1e-9, atol=1e-12)
    # second order
    left = held["M"] @ acceleration + held["C"] @ x[n:] + held["K"] @ x[:n] + held["f"]
    np.testing.assert_allclose(left, held["H"] @ u, rtol=1e-9, atol=1e-9 * np.abs(left).max())
    assert list(held["coordinates"]) == ["flywheel", "hub", "input_gear", "output_gear"]


def test_both_files_hold_the_same(tmp_path: Path) -> None:
    model = tree(12)
    held = np.load(gr.export_model(model, tmp_path / "a.npz").path)
    cells = loadmat(gr.export_model(model, tmp_path / "a.mat").path)
    for name in ("M", "C", "K", "H", "A", "B", "G", "P", "W", "pieces"):
        assert np.array_equal(held[name], cells[name])
    assert [str(cell[0]) for cell in cells["elements"][:, 0]] == list(held["elements"])
    assert str(held["format"][0]) == "gearrattle state space 1" == str(cells["format"][0, 0][0])


def test_natural_frequencies_and_inputs_over_time(tmp_path: Path) -> None:
    model = tree()
    held = np.load(gr.export_model(model, tmp_path / "a.npz").path)
    omega = np.sqrt(np.abs(np.linalg.eigvals(np.linalg.solve(held["M"], held["K"]))))
    ours = np.asarray(gr.modes(model).frequencies)
    np.testing.assert_allclose(np.sort(omega), ours, rtol=1e-6, atol=1e-5 * ours.max())
    t = 0.013
    u = held["u_mean"] + held["u_sine"] @ np.sin(held["u_omega"] * t) + held["u_cosine"] @ np.cos(held["u_omega"] * t)
    assert u[0] == pytest.approx(5.0 * np.sin(2 * 60.0 * t + 0.3))


def test_a_region_needs_an_element(tmp_path: Path) -> None:
    with pytest.raises(gr.ModelError, match="region: gear"):
        gr.export_model(gr.example("case3"), tmp_path / "a.npz", region={"gear": 7})
    with pytest.raises(gr.ModelError, match="plays no part"):
        gr.export_model(gr.example("case3"), tmp_path / "a.py", region={"gear": 1})
