"""Results of every kind: the cheapest of each, and those that are empty, failed, large or badly named."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache, partial, reduce
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.orbits import Orbit, PeriodicMotions
from gearrattle.orbits.exact_runs import ExactRun, exact_run, map_of_one_period
from gearrattle.orbits.settled_motion import SettledMotion
from gearrattle.orbits.start_states import state_of
from gearrattle.reproduction.reproduction_record import Reproduction, Section, row
from gearrattle.studies.designs import DESIGNS
from tests.compositions.kinds import BASE, KINDS
from tests.measured.identification.test_loop import ANGLE
from tests.measured.test_gas_torque import engine
from tests.measured.validation import made
from tests.measured.validation.test_run_ups import MODEL as RUN_UP
from tests.measured.validation.test_run_ups import record
from tests.studies import drivelines, oscillator


@cache
def model() -> gr.Model:
    return gr.example("case3")


@cache
def motion() -> gr.Run:
    return gr.simulate(model(), cycles=20, samples_per_cycle=64)


EXAMPLES: dict[str, Callable[[], Any]] = {
    "run": lambda: gr.run(model(), cycles=20, samples_per_cycle=64),
    "motion": motion,
    "verdict": lambda: gr.criteria(motion()),
    "modes": lambda: gr.modes(model()),
    "Campbell diagram": lambda: gr.campbell(model()),
    "comparison": lambda: gr.compare(model(), ["rk4"], cycles=4, samples_per_cycle=32),
    "validation": lambda: gr.validate(made.run(), made.record(gain=1.1)),
    "validation of a run-up": lambda: gr.validate_run_up(gr.simulate(gr.loads(RUN_UP), audit=False), record(1.1)),
    "reproduction": lambda: Reproduction(
        (Section("table-5", "Table 5", "What was done.", (row("sigma", "4 %", "3.9 %", "reproduced", share=3.9),)),),
        quick=True,
        seconds=1.0,
    ),
    "reduction": lambda: gr.reduce(gr.example("eight_dof"), "75 Hz", keep=["clutch", "spline", "mesh_34"]),
    "condensation": lambda: gr.condense(gr.example("eight_dof"), "75 Hz"),
    "scaling": lambda: gr.nondimensionalize(model()),
    "fit": lambda: gr.identification.fit(
        model(),
        {"mode": [{"number": 2, "frequency": "350 rad/s"}, {"number": 3, "frequency": "8000 rad/s"}]},
        ["coupling.clutch.stiffness"],
        starts=1,
    ),
    "stiffness": lambda: gr.stiffness(model()),
    "equilibrium": lambda: gr.equilibrium(model()),
    "advice": lambda: gr.advise(model(), cycles=20),
    "torque over angle": lambda: gr.torque_angle(model(), "clutch"),
    "gas torque": lambda: gr.gas_torque(**engine(1), speed="1500 rpm"),
    "contents": lambda: gr.measured.look(Path(__file__).parents[2] / "examples" / "measured" / "flywheel_speed.csv"),
    "sound": lambda: gr.listen(motion()),
    "loop fit": lambda: gr.identification.fit_loop((ANGLE, 100.0 * ANGLE), stages=1),
    "study": lambda: gr.study(short(), {"torque.0.mean": [10.0, 400.0]}, workers=1),
    "sensitivities": lambda: gr.studies.sensitivities(samples("saltelli"), "crossings per cycle"),
    "rattle probability": lambda: gr.studies.rattle_probability(samples("sobol")),
    "regime boundary": lambda: gr.studies.regime_boundary(result("study")),
    "screening": lambda: gr.screen(model(), [100.0, 150.0, 200.0]),
    "threshold": lambda: gr.threshold(
        gr.example("backlash_oscillator"), "coupling.mesh.kinematic_error.0.amplitude", (0.02, 0.06), workers=1
    ),
    "remedies": lambda: gr.remedies(
        gr.example("backlash_oscillator"), {"torque.0.mean": {"factor": (0.5, 4.0)}}, speeds=[], workers=1
    ),
    "proof of quiet": lambda: gr.prove_quiet(gr.example("backlash_oscillator"), {"torque.0.mean": (0.02, 0.2)}),
    "spectra": lambda: gr.spectra(motion(), CHANNEL, "velocity.flywheel"),
    "density": lambda: gr.spectral.psd(motion(), CHANNEL),
    "cross density": lambda: gr.spectral.cross_psd(motion(), CHANNEL, "velocity.flywheel"),
    "coherence": lambda: gr.spectral.coherence(motion(), CHANNEL, "velocity.flywheel"),
    "order map": lambda: gr.spectral.order_map(motion(), CHANNEL, turns=2),
    "order cuts": lambda: gr.spectral.order_cuts(motion(), CHANNEL, [1.0, 2.0], turns=2),
    "waterfall": lambda: gr.spectral.waterfall(motion(), CHANNEL),
    "metrics": lambda: gr.metrics(motion()),
    "contact ratio": lambda: gr.contact_ratio(motion()),
    "cause": lambda: gr.cause(motion()),
    "periodic motion": lambda: orbit_from(-0.3, -3.9),
    "periodic motions": lambda: PeriodicMotions(
        oscillator.model(), (orbit_from(0.62), orbit_from(0.55), orbit_from(-0.3, -3.9))
    ),
    "map of motions": lambda: gr.continuation(oscillator.model(), oscillator.AMPLITUDE, (5.9, 6.3), start="linear").map(
        "torque.0.mean", (7.4, 7.6), across=3, up=2
    ),
    "event boundary": lambda: gr.continuation(
        oscillator.model(), oscillator.AMPLITUDE, (5.9, 6.3), start="linear"
    ).boundary(0, "torque.0.mean", (7.4, 7.6)),
    "jumps of run-ups": lambda: gr.continuation(
        gr.example("backlash_oscillator"), "excitation.speed", (0.6, 0.9)
    ).run_up(1e-3),
    "settled motion": lambda: SettledMotion(oscillator.model(), settled_run()),
    "branches": lambda: gr.continuation(oscillator.model(), oscillator.AMPLITUDE, (3.6, 6.3)),
}
"""The cheapest example of every kind."""

CHANNEL = "acceleration.hub"


def orbit_from(angle: float, velocity: float = 0.0) -> Orbit:
    """The motion that Newton's method leads to from a state."""
    return gr.periodic(oscillator.model(), start={"angle": [angle], "velocity": [velocity]})


def settled_run() -> ExactRun:
    period_map = map_of_one_period(oscillator.model())
    return exact_run(oscillator.model(), period_map, state_of(oscillator.model(), period_map, None), 1.0, blocks=1)


def short() -> gr.Model:
    return model().with_({"simulation.cycles": 20, "simulation.discard": 10})


def samples(method: str) -> xr.Dataset:
    scatter = {"torque.0.mean": {"distribution": "uniform", "from": 5.0, "to": 12.0}}
    return gr.study(
        short(), None, ["crossings per cycle", "verdict"], vary=scatter, samples=4, method=method, workers=1
    )


MARKUP = '<script>alert(1)</script> "&'
CODES = {"flag_values": [0, 1, 2], "flag_meanings": "quiet single-sided double-sided"}
SIZES = {"gap": 4, "load": 3, "drag": 2, "sample": 70}
CASE_FAILED = 4


def study_over(*dims: str, failed: int = 0) -> xr.Dataset:
    """A study of two parts: the joint's regime grows with the index in the grid, the gear is quiet."""
    shape = tuple(SIZES[dim] for dim in dims)
    share = sum(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij")) / max(1, sum(n - 1 for n in shape))
    codes = np.stack([np.floor(2.999 * share), np.zeros(shape)], axis=-1).astype(np.int8)
    numbers = np.stack([10.0 * share, 5.0 - share], axis=-1)
    outcome = np.ones(shape, dtype=np.int8)
    lost = [tuple(map(int, np.unravel_index(case, shape))) for case in range(failed)]
    for case in lost:
        codes[case] = -1
        numbers[case] = np.nan
        outcome[case] = CASE_FAILED
    coordinates: dict[str, Any] = {dim: np.geomspace(0.1, 10.0, SIZES[dim]) for dim in dims if dim != "sample"}
    if "sample" in dims:
        drawn = np.random.default_rng(4).random(SIZES["sample"])
        coordinates |= {"a.J": ("sample", np.arange(float(SIZES["sample"]))), "b.J": ("sample", drawn)}
    return xr.Dataset(
        {
            "regime": ((*dims, "part"), codes, CODES),
            "largest impulse": ((*dims, "part"), numbers, {"units": "N m s, N s"}),
            "outcome": (dims, outcome),
        },
        {**coordinates, "part": ["joint", "gear <1>"]},
        {
            "failures": [f"{case}: the spring <broke>" for case in lost],
            "model": f"name = {json.dumps(MARKUP)}",
            "result": "study",
        },
    )


def designed(method: str, count: int = 64, axis: bool = False) -> xr.Dataset:
    """A study of two values; the level is 3 a + b of them, the gear rattles where a is above a half."""
    shares = DESIGNS[method].shares(2, count, 3)
    points = np.where(np.isnan(shares), 0.25, shares)
    level = points @ [3.0, 1.0]
    data = xr.Dataset(
        {
            "regime": (("sample", "part"), (points[:, :1] > 0.5).astype(np.int8), CODES),
            "level": ("sample", level, {"units": "N s"}),
            "outcome": ("sample", np.ones(len(points), dtype=np.int8)),
        },
        {"b.J": ("sample", points[:, 0]), "a.J": ("sample", points[:, 1]), "part": ["gear"]},
        {"sampling": method, "sampled": ["b.J", "a.J"], "result": "study"},
    )
    return data.expand_dims(gap=[1.0, 2.0]) if axis else data


@cache
def bifurcation() -> xr.Dataset:
    values = [1.0, 2.5, 4.0, 5.5, 7.0]
    return gr.bifurcation(oscillator.model(), oscillator.AMPLITUDE, values, cycles=160, discard=120, workers=1)


@cache
def conditions(which: str = "rated") -> xr.Dataset:
    """Idle conditions of a small driveline: with loads and calibration points, or with one load and without."""
    oil = {"path": "inertia.output_gear.drag_torque", "values": {"factor": [1.0, 4.0]}}
    load = {"path": "torque.0.harmonics.0.amplitude", "values": {"factor": [0.1, 1.0]}}
    speeds = {"from": "700 rpm", "to": "900 rpm", "count": 3}
    points = [(30.0, 9.0), (120.0, 3.0)]
    if which == "rated":
        return gr.conditions(short(), oil, speeds, load, rating=points, workers=1)
    return gr.conditions(short(), oil, ["800 rpm"], workers=1)


X, V = "deflection.flanks", "rate.flanks"
FACTORIAL = ("saltelli", "saltelli-pairs", "one-at-a-time")
"""Designs that have sensitivities."""


@cache
def basins(which: str) -> xr.Dataset:
    """Basins over a grid, of drawn states, over a line, over three variables."""
    box = {X: {"from": -0.6, "to": 0.6}, V: {"from": -4.0, "to": 4.0}}
    plane = {X: {"from": -0.6, "to": 0.8, "count": 6}, V: {"from": -4.0, "to": 4.0, "count": 5}}
    cube = {"deflection.joint": [-0.01, 0.01], "rate.joint": [-1.0, 1.0], "velocity.wheel": [0.0, 1.0, 2.0]}
    short = {"cycles": 60, "discard": 40}
    return {
        "grid": lambda: gr.basins(oscillator.model(), plane, workers=1),
        "drawn": lambda: gr.basins(oscillator.model(), box, samples=12, seed=1, workers=1),
        "line": lambda: gr.basins(oscillator.model(), {V: [-4.0, 0.0, 4.0]}, workers=1, **short),
        "cube": lambda: gr.basins(drivelines.model(), cube, workers=1),
    }[which]()


NAMES = {"three bodies": MARKUP, "engine": 40 * "engine", "joint": 40 * "joint", "gear": 40 * "gear"}
"""A model's name that is markup, and long names of its parts."""


@cache
def of_kind(kind: str) -> gr.Model:
    """A small driveline of a kind."""
    return KINDS[kind].make()


def answer(call: Callable[[gr.Model], Any], kind: str) -> Any:
    """What a call answers for a driveline of a kind."""
    return call(of_kind(kind))


def of_motion(call: Callable[[gr.Run], Any], kind: str) -> Any:
    """What a call answers for the motion of a driveline of a kind."""
    return call(gr.simulate(of_kind(kind)))


@cache
def renamed() -> gr.Model:
    """Three bodies and two elements with the names of `NAMES`."""
    text = reduce(lambda text, name: text.replace(json.dumps(name), json.dumps(NAMES[name])), NAMES, BASE)
    return gr.loads(text)


def of_names(call: Callable[[gr.Model], Any]) -> Any:
    """What a call answers for a driveline with names that are hard to show."""
    return call(renamed())


@cache
def still() -> gr.Run:
    """One body that nothing moves."""
    return gr.simulate(of_kind("one body").with_({"torque": []}), cycles=8, samples_per_cycle=64)


AXES = ("gap",), ("gap", "load"), ("gap", "load", "drag"), ("sample",), ("gap", "sample"), ("gap", "load", "sample")
SINGLE = {
    "modes": gr.modes,
    "stiffness": gr.stiffness,
    "equilibrium": gr.equilibrium,
    "scaling": gr.nondimensionalize,
    "advice": gr.advise,
}
JUDGED = {"metrics": gr.metrics, "verdict": gr.criteria, "contact ratio": gr.contact_ratio}

EXTREMES: dict[str, Callable[[], Any]] = {
    **{f"study over {' and '.join(dims)}": partial(study_over, *dims) for dims in AXES},
    **{f"study over {' and '.join(dims)}, one failed": partial(study_over, *dims, failed=1) for dims in AXES},
    "study, all failed": lambda: study_over("gap", failed=4),
    **{f"{method} design": partial(designed, method, 8) for method in FACTORIAL},
    **{f"{method} design and an axis": partial(designed, method, 8, axis=True) for method in FACTORIAL},
    "bifurcation": bifurcation,
    "bifurcation, one failed": lambda: bifurcation().assign_attrs(failures=["(0, 2): it <failed>"]),
    **{f"conditions, {which}": partial(conditions, which) for which in ("rated", "one load")},
    "conditions, one failed": lambda: conditions().assign_attrs(failures=["(0, 1, 2): it <failed>"]),
    **{f"basins, {which}": partial(basins, which) for which in ("grid", "drawn", "line", "cube")},
    **{f"run of {kind}": partial(answer, gr.run, kind) for kind in ("one body", "no clearance", "dimensionless")},
    **{
        f"run of {kind}": partial(answer, gr.run, kind)
        for kind in ("prescribed motion", "run-up with all", "64 bodies")
    },
    "run of one sample": lambda: gr.run(of_kind("one body"), cycles=1, discard=0, samples_per_cycle=1),
    **{f"{word} of one body": partial(answer, call, "one body") for word, call in SINGLE.items()},
    **{f"{word} of 64 bodies": partial(answer, call, "64 bodies") for word, call in SINGLE.items()},
    **{f"{word} badly named": partial(of_names, call) for word, call in SINGLE.items()},
    "run badly named": lambda: gr.run(renamed()),
    "comparison badly named": lambda: gr.compare(renamed(), ["rk4"], cycles=4),
    "spectra badly named": lambda: gr.spectra(gr.simulate(renamed()), "velocity.hub"),
    **{f"{word} of linear motion": partial(of_motion, call, "no clearance") for word, call in JUDGED.items()},
    "comparison of linear motions": lambda: gr.compare(of_kind("no clearance"), ["rk4", "gear"], cycles=4),
    "spectra of zeros": lambda: gr.spectra(still(), "velocity.engine"),
    "density of zeros": lambda: gr.spectral.psd(still(), "velocity.engine"),
    "coherence of zeros": lambda: gr.spectral.coherence(still(), "velocity.engine", "angle.engine"),
    "waterfall of zeros": lambda: gr.spectral.waterfall(still(), "velocity.engine"),
}
"""Results that are empty, failed, large or badly named."""


CASES = EXAMPLES | EXTREMES
CASE_PARAMETERS = [*EXAMPLES, *(pytest.param(case, marks=pytest.mark.slow) for case in EXTREMES)]
"""For tests of all cases: one of every kind is quick."""


@cache
def result(case: str) -> Any:
    return CASES[case]()
