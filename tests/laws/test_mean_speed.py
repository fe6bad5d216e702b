"""The mean speed of a run is the speed of its file: every free train begins on its periodic rigid response."""

from __future__ import annotations

import math
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble, coordinates_of
from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.engine.system.free_trains import trains
from gearrattle.model import Model

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("**/*.toml"))
MODELS = [path for path in EXAMPLES if path.parent.name not in ("studies", "measured", "remedies")]
SMALL = 1e-3  # of the amplitude of a body's fluctuation


def means_of(run: gr.Run) -> np.ndarray:
    """(n,) mean velocities over the judged part, exact from the angles, as parts of the amplitudes."""
    trajectory = run.trajectory
    judged = trajectory.time >= run.model.simulation.discard * trajectory.layout.period * (1.0 - 1e-12)
    time, angle, velocity = trajectory.time[judged], trajectory.angle[judged], trajectory.velocity[judged]
    mean = (angle[-1] - angle[0]) / (time[-1] - time[0])
    amplitude = np.abs(velocity - mean).max(axis=0)
    return np.abs(mean) / np.maximum(amplitude, 1e-12)


def trains_of(run: gr.Run) -> np.ndarray:
    """(n,) mean velocities of the trains of the bodies over the judged part, as parts of the bodies' amplitudes."""
    system = assemble(run.model).system
    trajectory = run.trajectory
    first = run.model.simulation.discard * run.model.simulation.samples_per_cycle
    means, amplitudes = np.zeros((2, system.size))
    for train in trains(system):
        if train.freedoms == 1:
            # dampers alone, such as the drag of a gear on its shaft, hold no train
            springs = [k for k, law in enumerate(system.laws) if np.any(law.stiffness)]
            bodies, motion = train.bodies, relative_coordinates(system, springs).angle_from_reference
            shape = motion[:, np.flatnonzero(motion[bodies].any(axis=0))[0]]
            momentum = coordinates_of(run.model, trajectory) @ (system.inertia * shape)
            mean = (momentum[-1] - momentum[first]) / (trajectory.time[-1] - trajectory.time[first])
            means[bodies] = mean * shape[bodies] / (system.inertia @ shape**2)
            amplitudes[bodies] = np.ptp(coordinates_of(run.model, trajectory, 1)[first:, bodies], axis=0) / 2
    return np.abs(means) / np.maximum(amplitudes, 1e-12)


def keeps_its_speed(run: gr.Run) -> bool:
    """Whether every train keeps its speed, and a note tells of a body that swings about another one within it."""
    is_told = any("the mean speed of" in note for note in run.notes)
    return trains_of(run).max() < SMALL and is_told == (means_of(run).max() >= SMALL)


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_examples_keep_their_speed(path: Path) -> None:
    model = gr.load(path)
    has_records = any(table.signal for table in (*model.torques, *model.motions))
    has_ramps = any(torque.ramps for torque in model.torques)
    if model.excitation.sweep is not None or has_records or has_ramps:
        pytest.skip("its inputs have no period over which to average")
    assert keeps_its_speed(gr.simulate(model, samples_per_cycle=64, audit=False))


def random_train(seed: int) -> Model:
    """A free train of two to seven bodies, some linked with clearances, under balanced means and orders with phases."""
    rng = random.Random(f"mean speed {seed}")
    n = rng.randint(2, 7)
    names = [f"b{i}" for i in range(n)]
    inertias = [
        {
            "name": name,
            "J": 10 ** rng.uniform(-3.0, -0.5),
            "drag": rng.choice([0.0, 10 ** rng.uniform(-5.0, -2.5)]),
            "drag_torque": rng.choice([0.0, rng.uniform(0.0, 1.0)]),
        }
        for name in names
    ]
    ratio, means, links = [1.0], [], {"coupling": [], "mesh": []}
    for i in range(1, n):
        link: dict[str, Any] = {"name": f"l{i}", "between": [names[i - 1], names[i]]}
        if rng.random() < 0.5:
            radii = [rng.uniform(0.03, 0.1), rng.uniform(0.03, 0.1)]
            backlash = rng.choice([0.0, 1e-4])
            link |= {"radii": radii, "stiffness": 1e8, "damping": 2e3, "backlash": backlash}
            ratio.append(ratio[-1] * radii[0] / radii[1])
            links["mesh"].append(link)
        else:
            link |= {"stiffness": 10 ** rng.uniform(3.0, 4.5), "damping": 0.3, "clearance": rng.choice([0.0, 0.02])}
            ratio.append(ratio[-1])
            links["coupling"].append(link)
    harmonics = [
        {"order": order, "amplitude": rng.uniform(1.0, 60.0), "phase": rng.uniform(-math.pi, math.pi)}
        for order in rng.sample([0.5, 1, 2, 3, 4], rng.randint(1, 3))
    ]
    means = [rng.uniform(-5.0, 5.0) if i < n - 1 else 0.0 for i in range(n)]
    work = sum(r * (m - inertia["drag_torque"]) for r, m, inertia in zip(ratio, means, inertias, strict=True))
    means[-1] = -work / ratio[-1]
    torques = [{"on": name, "mean": mean} for name, mean in zip(names, means, strict=True)]
    torques[rng.randrange(n)]["harmonics"] = harmonics
    tables = {"schema": 1, "inertia": inertias, "torque": torques, "excitation": {"speed": rng.uniform(60.0, 200.0)}}
    return Model.from_tables({**tables, **{kind: rows for kind, rows in links.items() if rows}})


@pytest.mark.parametrize("seed", range(50))
def test_random_trains_keep_their_speed(seed: int) -> None:
    run = gr.simulate(random_train(seed), cycles=40, discard=20, samples_per_cycle=64, audit=False)
    assert keeps_its_speed(run)


def oscillator(**changes: Any) -> Model:
    """Two bodies behind a shaft that turn freely, under one order with a phase."""
    tables = {
        "schema": 1,
        "inertia": [{"name": "engine", "J": 0.3, "drag": 0.02}, {"name": "load", "J": 0.1}],
        "coupling": [{"name": "shaft", "between": ["engine", "load"], "stiffness": 1e4, "damping": 1.0}],
        "excitation": {"speed": 100.0},
        "torque": [{"on": "engine", "harmonics": [{"order": 2, "amplitude": 30.0, "phase": 0.4}]}],
    }
    return Model.from_tables(tables).with_(changes)


def test_the_start_is_the_response_of_the_train_as_one_body() -> None:
    run = gr.simulate(oscillator(), cycles=2, audit=False)
    response = 30.0 * np.exp(0.4j) / (-(200.0**2) * 0.4 + 200.0j * 0.02)
    velocity = run.data.velocity.isel(time=0).values
    angle = run.data.angle.isel(time=0).values
    assert velocity == pytest.approx([200.0 * response.real] * 2, rel=1e-13)
    assert angle == pytest.approx([response.imag] * 2, rel=1e-13)


def test_static_and_zero_begin_with_velocities_zero() -> None:
    for start in ("static", "zero"):
        run = gr.simulate(oscillator(), cycles=2, initial=start, audit=False)
        assert not run.data.velocity.isel(time=0).values.any()


def test_a_dashpot_between_two_trains_counts_as_drag() -> None:
    """Two bodies with nothing but damping between them: their speeds are those of the linear equations."""
    model = oscillator().with_({"coupling.shaft.stiffness": 0.0, "coupling.shaft.damping": 5.0})
    run = gr.simulate(model, cycles=60, discard=40, audit=False)
    matrix = -(200.0**2) * np.diag([0.3, 0.1]) + 200.0j * np.array([[5.02, -5.0], [-5.0, 5.0]])
    response = np.linalg.solve(matrix, [30.0 * np.exp(0.4j), 0.0])
    assert run.data.velocity.isel(time=0).values == pytest.approx(200.0 * response.real, rel=1e-12)
    assert run.data.velocity.isel(time=-1).values == pytest.approx(200.0 * response.real, rel=1e-9)


def test_a_train_whose_means_do_not_balance_begins_at_rest() -> None:
    run = gr.simulate(oscillator(**{"torque.0.mean": 2.0}), cycles=2, audit=False)
    assert not run.data.velocity.isel(time=0).values.any()
    assert any('begins as "static"' in note and "engine" in note for note in run.notes)


def test_a_train_that_a_record_drives_begins_at_rest() -> None:
    model = oscillator(
        **{"torque.0.harmonics": [], "torque.0.signal": {"time": [0.0, 1.0, 2.0, 3.0], "value": [0.0, 1.0, 0.0, -1.0]}}
    )
    run = gr.simulate(model, cycles=2, audit=False)
    assert not run.data.velocity.isel(time=0).values.any()
    assert any("a record of a torque drives it" in note for note in run.notes)


def test_a_sweep_begins_on_the_response_at_its_first_speed() -> None:
    sweep = {"from": 100.0, "to": 110.0, "over": 2.0}
    swept = oscillator(**{"excitation.speed": None, "excitation.sweep": sweep})
    run = gr.simulate(swept, audit=False)
    still = gr.simulate(oscillator(), cycles=2, audit=False)
    assert run.data.velocity.isel(time=0).values == pytest.approx(still.data.velocity.isel(time=0).values, rel=1e-13)


def test_a_study_begins_each_case_on_its_own_response() -> None:
    """The compiled loop over cases and one case at a time give the same bits."""
    model = gr.example("case3").with_({"simulation.cycles": 6, "simulation.discard": 2})
    speeds = [140.0, 150.0, 160.0, 170.0, 180.0]
    study = gr.study(model, axes={"excitation.speed": speeds}, outputs=["crossings per cycle"])
    for speed in speeds:
        run = gr.simulate(model.with_({"excitation.speed": speed}), audit=False)
        crossings = len(run.events[run.events.time > 2 * run.trajectory.layout.period])
        assert float(study["crossings per cycle"].sel({"excitation.speed": speed})) == crossings / 4
