"""Arguments that count: 2.5 is refused everywhere, and so is 3.0, as in a model file and on the command line."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from tests.architecture.public import FUNCTIONS
from tests.measured.readers.rig import rig

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
MODEL = gr.load(EXAMPLES / "paper" / "case1.toml")
BACKLASH = {"mesh.gear.backlash": [1e-4, 2e-4]}
START = {"velocity.flywheel": [0.0, 1.0]}
TRACE = {"angle": np.linspace(0, 4 * np.pi, 40).tolist(), "value": [1e6] * 40}
CYLINDER = {"bore": 0.08, "stroke": 0.09, "rod": 0.15, "pressure": TRACE, "speed": 100.0}
LOOP = 0.1 * np.sin(np.linspace(0.0, 4 * np.pi, 400)), np.sin(np.linspace(0.0, 4 * np.pi, 400))

CALLS: dict[str, Callable[..., Any]] = {
    "advise": lambda **given: gr.advise(MODEL, **given),
    "basins": lambda **given: gr.basins(MODEL, START, **given),
    "bifurcation": lambda **given: gr.bifurcation(MODEL, "mesh.gear.backlash", [1e-4, 2e-4], **given),
    "compare": lambda **given: gr.compare(MODEL, **given),
    "identification.fit": lambda **given: gr.identification.fit(
        MODEL, {"mode": [{"omega": 300.0}]}, ["coupling.clutch.stiffness"], **given
    ),
    "identification.fit_loop": lambda **given: gr.identification.fit_loop(LOOP, **given),
    "gas_torque": lambda **given: gr.gas_torque(**{"cylinders": 4, **CYLINDER, **given}),
    "listen": lambda **given: gr.listen(_run(), **given),
    "optimize": lambda **given: gr.optimize(MODEL, BACKLASH, {"hub: TR rms": "min"}, **given),
    "spectral.order_map": lambda **given: gr.spectral.order_map(_run(), "velocity.hub", **given),
    "run": lambda **given: gr.run(MODEL, **given),
    "screen": lambda **given: gr.screen(MODEL, [100.0, 120.0], simulate=True, **given),
    "simulate": lambda **given: gr.simulate(MODEL, **given),
    "stream": lambda **given: gr.stream(MODEL, **given),
    "study": lambda **given: gr.study(MODEL, BACKLASH, **given),
    "validate": lambda **given: gr.validate(MODEL, rig(), **given),
}


def _run() -> gr.Run:
    return gr.simulate(MODEL, cycles=3, discard=1, samples_per_cycle=64)


def counting() -> list[tuple[str, str]]:
    """Every argument of a public function that is a whole number."""
    return [
        (name, argument.name)
        for name, function in sorted(FUNCTIONS.items())
        for argument in inspect.signature(function).parameters.values()
        if re.fullmatch(r"int( \|.*)?", str(argument.annotation))
    ]


@pytest.mark.parametrize(("name", "argument"), counting())
@pytest.mark.parametrize("value", [2.5, 3.0, True])
def test_a_number_that_is_not_whole_is_refused(name: str, argument: str, value: object) -> None:
    with pytest.raises(gr.ModelError) as caught:
        CALLS[name](**{argument: value})
    assert any(argument in problem.place and "whole number" in problem.rule for problem in caught.value.problems)


@pytest.mark.parametrize("call", [gr.modes, gr.stiffness])
def test_a_region_is_a_whole_number(call: Callable[..., Any]) -> None:
    with pytest.raises(gr.ModelError, match="gear"):
        call(MODEL, region={"gear": 0.6})
