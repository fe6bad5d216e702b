"""Outputs over all stable motions: those of the search for all motions, closed forms, the same bits in processes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.errors import Cancelled, ModelError
from gearrattle.orbits import Orbit
from gearrattle.studies.output import REGIMES
from gearrattle.studies.stable_motion_outputs import COUNT, SWING
from tests.orbits.test_families import train

SPEED = "excitation.speed"
ACCELERATION = "peak-to-peak acceleration"
OUTPUTS = [COUNT, SWING, f"{ACCELERATION} over all stable motions", "verdict over all stable motions", ACCELERATION]
FOLDS = (0.708031618722, 0.828463984388)
"""Between these speeds the oscillator has two stable motions."""


def oscillator() -> gr.Model:
    return gr.example("backlash_oscillator").with_({"simulation.cycles": 80, "simulation.discard": 60})


@pytest.fixture(scope="module")
def data() -> xr.Dataset:
    return gr.study(oscillator(), {SPEED: [0.5, 0.70, 0.72, 0.80, 0.835]}, outputs=OUTPUTS, workers=1)


def swing(orbit: Orbit) -> float:
    low, high, _ = orbit.period_map.levels(orbit.motion)
    return float(high[0] - low[0])


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.72, 0.80])
def test_between_the_folds_it_is_the_larger_of_both_stable_motions(data: xr.Dataset, speed: float) -> None:
    case = data.sel({SPEED: speed})
    stable = [o for o in gr.periodic(oscillator().with_({SPEED: speed}), every=True) if o.stable]
    assert float(case[COUNT]) == len(stable) == 2
    assert float(case[SWING].sel(part="mesh")) == pytest.approx(max(map(swing, stable)), rel=1e-9)
    both = [
        next(e.value for e in o.verdict.entries if (e.subject, e.quantity) == ("gear", ACCELERATION)) for o in stable
    ]
    assert float(case[OUTPUTS[2]].sel(inertia="gear")) == pytest.approx(max(both), rel=1e-9)
    settled = float(case[ACCELERATION].sel(inertia="gear"))  # the one that the model's own start leads to
    assert min(abs(settled - value) for value in both) < 1e-3 * settled
    assert REGIMES[int(case["verdict over all stable motions"])] == "single-sided"


def test_beyond_the_folds_there_is_one(data: xr.Dataset) -> None:
    count = data[COUNT].values
    speeds = data[SPEED].values
    np.testing.assert_array_equal(count, np.where((speeds > FOLDS[0]) & (speeds < FOLDS[1]), 2.0, 1.0))


def test_in_contact_it_is_the_closed_form(data: xr.Dataset) -> None:
    w = 0.5
    amplitude = 0.05 * w**2 / abs(1.0 - w**2 + 0.1j * w)
    assert float(data[SWING].sel({SPEED: w, "part": "mesh"})) == pytest.approx(2.0 * amplitude, rel=1e-9)


def test_a_motion_that_does_not_settle_counts_itself() -> None:
    light = {"torque.0.mean": 0.5, "torque.0.harmonics.0.amplitude": 2.0}
    chaotic = gr.example("rattle_oscillator").with_({**light, "simulation.cycles": 60, "simulation.discard": 30})
    data = gr.study(chaotic, {"torque.0.mean": [0.5]}, outputs=[COUNT, SWING], workers=1)
    run = gr.simulate(chaotic)
    assert float(data[COUNT][0]) == 0.0
    late = run.trajectory.deflection[30 * run.trajectory.samples_per_cycle :]
    assert float(data[SWING][0, 0]) == pytest.approx(float(np.ptp(late)), rel=1e-12)


@pytest.mark.long
def test_stopped_and_resumed_by_two_processes_it_gives_the_same_bits(tmp_path: Path, data: xr.Dataset) -> None:
    def progress(share: float) -> None:
        if share > 0.3:
            raise Cancelled("enough")

    axes = {SPEED: [0.5, 0.70, 0.72, 0.80, 0.835]}
    with pytest.raises(Cancelled):
        gr.study(oscillator(), axes, outputs=OUTPUTS, output=tmp_path / "a", workers=1, progress=progress)
    again = gr.study(
        oscillator(), axes, outputs=OUTPUTS, output=tmp_path / "a", workers=2, scheduler="local", resume=True
    )
    for name in OUTPUTS:
        np.testing.assert_array_equal(again[name], data[name])


def test_an_optimisation_takes_it_as_its_objective() -> None:
    best = gr.optimize(
        oscillator(),
        {SPEED: (0.6, 0.72)},
        {f"mesh: {SWING}": "min"},
        population=4,
        generations=1,
        workers=1,
    )
    assert best.attrs["senses"] == ["min"]
    slowest = int(np.argmin(best[SPEED].values))
    assert int(best.attrs["best"]) == slowest  # below the folds the response rises with the speed


def test_a_file_may_ask_for_it(tmp_path: Path) -> None:
    (tmp_path / "model.toml").write_text(oscillator().to_toml(), encoding="utf-8")
    (tmp_path / "study.toml").write_text(
        f'model = "model.toml"\noutputs = ["{SWING}"]\n[axis]\n"{SPEED}" = [0.5, 0.75]\n', encoding="utf-8"
    )
    assert main(["study", str(tmp_path / "study.toml"), "-o", str(tmp_path / "out"), "--workers", "1"]) == 0
    kept = gr.open_study(tmp_path / "out")
    assert kept[SWING].dims == (SPEED, "part")


@pytest.mark.parametrize("name", ["regimen over all stable motions", "stable motion"])
def test_names_that_are_none_are_refused(name: str) -> None:
    with pytest.raises(ModelError, match="over all stable motions"):
        gr.study(oscillator(), {SPEED: [0.5]}, outputs=[name], workers=1)


def test_a_driveline_whose_state_cannot_repeat_is_refused() -> None:
    driven = train(drag=0.0, means=2.0).with_({"torque.1.mean": -1.9})
    with pytest.raises(ModelError, match="must balance"):
        gr.study(driven, {"torque.1.mean": [-1.9]}, outputs=[COUNT], workers=1)
