"""The cases built in code are those of the example files."""

from __future__ import annotations

import pytest

import gearrattle as gr
from gearrattle.reproduction import load_case
from tests.architecture.places import EXAMPLES

_SHARED = ("units", "inertias", "couplings", "meshes", "excitation", "torques")


@pytest.mark.parametrize("loaded", [False, True])
@pytest.mark.parametrize("case", [1, 2, 3])
def test_light_cases_are_the_example_files(case, loaded):
    file = gr.load(EXAMPLES / "paper" / f"case{case}{'_loaded' if loaded else ''}.toml")
    ours = load_case(case, 0.05, loaded=loaded)
    for name in _SHARED:
        assert getattr(ours, name) == getattr(file, name), name


@pytest.mark.parametrize("loaded", [False, True])
def test_mean_torques_balance_at_any_ratio(loaded):
    for ratio in (0.05, 0.5):
        model = load_case(3, ratio, loaded=loaded)
        means = sum(table.mean for table in model.torques) - sum(body.drag_torque for body in model.inertias)
        assert model.torques[0].mean == pytest.approx(ratio * 202.5)
        assert means == pytest.approx(0.0, abs=1e-12)
