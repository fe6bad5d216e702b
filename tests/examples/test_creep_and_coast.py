"""Creep and the coasting reducer rattle as they are, and are quiet where the how-to on drag says."""

from __future__ import annotations

from typing import Any

import pytest

import gearrattle as gr


def severity(example: str, changes: dict[str, Any]) -> str:
    run = gr.simulate(gr.example(example).with_(changes), cycles=40, discard=20, samples_per_cycle=32)
    return gr.criteria(run).severity


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, "rattles"),
        ({"torque.1.mean": -20.0}, "quiet"),
        ({"torque.1.mean": -80.0}, "rattles"),
        ({"oil.temperature": "0 degC"}, "quiet"),
        ({"oil.temperature": "20 degC"}, "rattles"),
        ({"coupling.damper.stages.0.until": "14 deg"}, "quiet"),
    ],
)
def test_creep(changes: dict[str, Any], expected: str) -> None:
    assert severity("creep", changes) == expected


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, "rattles"),
        ({"torque.0.mean": -10.0}, "quiet"),
        ({"bearing.intermediate_bearings.clearance": "1 um"}, "rattles"),
        ({"mesh.*.transmission_error.*.amplitude": gr.factor(0.05)}, "quiet"),
    ],
)
def test_coast(changes: dict[str, Any], expected: str) -> None:
    assert severity("electric_reducer_coast", changes) == expected
