"""The Campbell diagram: every crossing solves the eigenproblem, none is left out, wrong ranges are told."""

from __future__ import annotations

import dataclasses
import json
from math import pi

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from tests.analysis.test_modes import SEEDS, train
from tests.oracles.driveline import Body, Coupling, Driveline, Harmonic, Mesh, Torque


def geared(units: str = "SI") -> gr.Model:
    bodies = (Body("engine", "0.2"), Body("gear1", "0.01"), Body("gear2", "0.02"))
    shafts = (Coupling("shaft", ("engine", "gear1"), "2000"),)
    mesh = Mesh("mesh", ("gear1", "gear2"), ("0.05", "0.08"), "1e7", error=(Harmonic("20", "1e-5"), Harmonic("4", "0")))
    torques = (
        Torque("engine", "0", (Harmonic("2", "50"), Harmonic("20", "1"))),
        Torque("gear2", "-3", (Harmonic("0.5", "1"),)),
    )
    text = Driveline("geared", bodies, shafts, (mesh,), torques, speed="100").toml()
    return gr.loads(text.replace('units = "SI"', f'units = "{units}"'))


def dynamic(model: gr.Model, ratios: dict[str, float], omega: float) -> np.ndarray:
    """K - omega^2 J, symmetrically scaled to J = 1."""
    rows = assemble(model).system.rows / np.sqrt([body.J for body in model.inertias])
    slopes = [element.drive[-1].stiffness * ratios.get(element.name, 1.0) for element in model.elements]
    return rows.T @ np.diag(slopes) @ rows - omega**2 * np.eye(len(model.inertias))


@pytest.mark.parametrize("seed", SEEDS)
def test_crossings_solve_the_eigenproblem_and_none_is_missing(seed: int) -> None:
    model = train(seed)
    top = float(gr.modes(model).frequencies[-1])
    name = model.elements[-1].name
    actual = gr.campbell(model, (0.001 * top, 0.7 * top), {name: [0.2, 1.0]})
    assert [line.order for line in actual.orders] == [1.0, 20.0][: 1 + bool(model.meshes)]
    for crossing in actual.crossings:
        values = np.linalg.eigvalsh(dynamic(model, actual.states[crossing.state], crossing.order * crossing.speed))
        assert np.abs(values).min() <= 1e-9 * np.abs(values).max()
        assert crossing.frequency == actual.frequencies[crossing.state, crossing.mode]
    for j, state in enumerate(actual.states):
        for line in actual.orders:
            below = [
                int(np.sum(np.linalg.eigvalsh(dynamic(model, state, line.order * speed)) < 0.0))
                for speed in actual.speeds
            ]
            met = [c for c in actual.crossings if c.state == j and c.order == line.order]
            assert len(met) == below[1] - below[0]
    assert [c.speed for c in actual.crossings] == sorted(c.speed for c in actual.crossings)


def test_orders_know_what_turns_with_them() -> None:
    actual = gr.campbell(geared())
    lines = {line.order: line.sources for line in actual.orders}
    assert lines == {
        0.5: ("torque on gear2",),
        2.0: ("torque on engine",),
        20.0: ("torque on engine", "transmission error of mesh"),
    }
    assert actual.speeds == (0.0, 200.0)
    modes = actual.modes[0]
    for crossing in actual.crossings:
        shares = dict(zip(modes.sources, modes.excitation[:, crossing.mode], strict=True))
        assert crossing.share == max(shares[source] for source in lines[crossing.order])
        assert shares[crossing.source] == crossing.share
    near = actual.nearest()
    assert near is not None
    assert abs(np.log(near.speed / 100)) == min(abs(np.log(c.speed / 100)) for c in actual.crossings)


def test_a_grid_of_contact_ratios_gives_every_combination() -> None:
    actual = gr.campbell(geared(), contact_ratio={"shaft": 0.5, "mesh": [0.0, 0.1, 1.0]})
    assert actual.states == tuple({"shaft": 0.5, "mesh": ratio} for ratio in (0.0, 0.1, 1.0))
    for state, frequencies in zip(actual.states, actual.frequencies, strict=True):
        assert frequencies.tolist() == gr.modes(geared(), contact_ratio=state).frequencies.tolist()


def test_words_and_numbers_are_the_same_range() -> None:
    words = gr.campbell(geared(), "300 rpm:3000 rpm")
    assert words.speeds == pytest.approx((10 * pi, 100 * pi), rel=1e-15)
    assert gr.campbell(geared(), ("300 rpm", "3000 rpm")).speeds == words.speeds
    assert gr.campbell(geared(), "300:3000 rpm").speeds == words.speeds
    assert gr.campbell(geared(), "10:20").speeds == gr.campbell(geared(), (10, 20)).speeds == (10.0, 20.0)


def test_a_model_without_units_takes_plain_numbers() -> None:
    model = geared("dimensionless")
    assert gr.campbell(model, "10:20").speeds == (10.0, 20.0)
    with pytest.raises(gr.ModelError, match="must be a plain number"):
        gr.campbell(model, "300 rpm:3000 rpm")


@pytest.mark.parametrize(
    ("speeds", "ratio", "message"),
    [
        ("3000 rpm", None, "a lowest and a highest speed"),
        ("3000 rpm:800 rpm", None, "a lowest and a highest speed"),
        ((1.0, 2.0, 3.0), None, "a lowest and a highest speed"),
        ("-1:5", None, "speeds"),
        ("25 Hz:50 Hz", None, "rpm or angle"),
        ((0, float("inf")), None, "speeds"),
        (None, {"mesh": []}, "needs at least one"),
        (None, {"mesh": [0.01 * k for k in range(65)]}, "at most 64"),
        (None, {"mesh": [0.5, 1.5]}, "between 0 and 1"),
        (None, {"mash": [0.5]}, "no such element"),
    ],
)
def test_what_is_wrong_is_told(speeds, ratio, message) -> None:
    with pytest.raises(gr.ModelError, match=message):
        gr.campbell(geared(), speeds, ratio)


def test_nothing_to_cross() -> None:
    free = gr.loads(Driveline("free", (Body("disc", "2"),), speed="1").toml())
    actual = gr.campbell(free)
    assert (actual.orders, actual.crossings, actual.nearest()) == ((), (), None)
    assert actual.frequencies.tolist() == [[0.0]]


def test_it_is_frozen_and_json() -> None:
    actual = gr.campbell(geared())
    with pytest.raises(dataclasses.FrozenInstanceError):
        actual.speeds = (0.0, 1.0)
    content = json.loads(json.dumps(actual.to_dict(), allow_nan=False))
    assert len(content["crossings"]) == len(actual.crossings)
    assert content["crossings"][0]["speed"] == actual.crossings[0].speed
