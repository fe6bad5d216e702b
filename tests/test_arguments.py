"""Arguments of public calls: what counts is a whole number, a switch true or false, and what is called a function."""

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
    "advise": lambda **settings: gr.advise(MODEL, **settings),
    "basins": lambda **settings: gr.basins(MODEL, START, **settings),
    "bifurcation": lambda **settings: gr.bifurcation(MODEL, "mesh.gear.backlash", [1e-4, 2e-4], **settings),
    "conditions": lambda **settings: gr.conditions(
        MODEL, {"path": "inertia.output_gear.drag_torque", "values": [4.0, 8.0]}, [150.0], **settings
    ),
    "compare": lambda **settings: gr.compare(MODEL, **settings),
    "continuation": lambda **settings: gr.continuation(MODEL, "excitation.speed", (150.0, 151.0), **settings),
    "export_fmu": lambda **settings: gr.export_fmu(MODEL, "x.fmu", **settings),
    "identification.fit": lambda **settings: gr.identification.fit(
        MODEL, {"mode": [{"omega": 300.0}]}, ["coupling.clutch.stiffness"], **settings
    ),
    "identification.fit_loop": lambda **settings: gr.identification.fit_loop(LOOP, **settings),
    "gas_torque": lambda **settings: gr.gas_torque(**{"cylinders": 4, **CYLINDER, **settings}),
    "export_model": lambda **settings: gr.export_model(MODEL, "case1.c", **settings),
    "import_model": lambda **settings: gr.import_model("case1.mo", **settings),
    "listen": lambda **settings: gr.listen(_run(), **settings),
    "optimize": lambda **settings: gr.optimize(MODEL, BACKLASH, {"hub: TR rms": "min"}, **settings),
    "spectral.order_map": lambda **settings: gr.spectral.order_map(_run(), "velocity.hub", **settings),
    "periodic": lambda **settings: gr.periodic(MODEL, **settings),
    "prove_quiet": lambda **settings: gr.prove_quiet(MODEL, {"mesh.gear.backlash": (1e-4, 2e-4)}, **settings),
    "remedies": lambda **settings: gr.remedies(MODEL, {"torque.0.mean": {"factor": (0.9, 1.1)}}, **settings),
    "run": lambda **settings: gr.run(MODEL, **settings),
    "screen": lambda **settings: gr.screen(MODEL, [100.0, 120.0], **{"simulate": True, **settings}),
    "simulate": lambda **settings: gr.simulate(MODEL, **settings),
    "stream": lambda **settings: gr.stream(MODEL, **settings),
    "study": lambda **settings: gr.study(MODEL, BACKLASH, **settings),
    "threshold": lambda **settings: gr.threshold(MODEL, "mesh.gear.backlash", (1e-4, 2e-4), **settings),
    "validate": lambda **settings: gr.validate(MODEL, rig(), **settings),
    "validate_run_up": lambda **settings: gr.validate_run_up(MODEL, rig(), **settings),
    "modes": lambda **settings: gr.modes(MODEL, **settings),
    "stiffness": lambda **settings: gr.stiffness(MODEL, **settings),
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


def switches_and_functions() -> list[tuple[str, str, str]]:
    """Every argument of a public function that is true or false, or called, with the rule that it obeys."""
    rules = {"bool": "must be true or false", "Callable": "must be a function", "Progress": "must be a function"}
    return [
        (name, argument.name, rules[kind[0]])
        for name, function in sorted(FUNCTIONS.items())
        for argument in inspect.signature(function).parameters.values()
        if (kind := re.findall(r"^(bool|Callable|Progress)(?! \| int)", str(argument.annotation)))
        and argument.name != "function"
    ]


@pytest.mark.parametrize(("name", "argument", "rule"), switches_and_functions())
@pytest.mark.parametrize("value", ["no", 3])
def test_a_switch_and_a_function_are_nothing_else(name: str, argument: str, rule: str, value: object) -> None:
    with pytest.raises(gr.ModelError) as caught:
        CALLS[name](**{argument: value})
    assert [(problem.place, problem.rule.split(",")[0]) for problem in caught.value.problems] == [(argument, rule)]


def test_the_switches_and_functions_are_known() -> None:
    assert {("periodic", "every"), ("study", "progress"), ("run", "phase")} <= {
        (name, argument) for name, argument, _ in switches_and_functions()
    }


@pytest.mark.parametrize("call", [gr.modes, gr.stiffness])
def test_a_region_is_a_whole_number(call: Callable[..., Any]) -> None:
    with pytest.raises(gr.ModelError, match="gear"):
        call(MODEL, region={"gear": 0.6})
