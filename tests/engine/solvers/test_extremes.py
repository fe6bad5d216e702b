"""Values far from those of any driveline: every run ends soon, with a motion or with an error of ours."""

from __future__ import annotations

import random
import re
import time
import warnings
from collections import OrderedDict
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.errors import ConvergenceError, GearRattleError, ModelError
from gearrattle.model.model_file import loads

pytestmark = pytest.mark.compiled

PAPER = Path(__file__).parents[3] / "examples" / "paper"
TEXTS = {name: (PAPER / f"{name}.toml").read_text() for name in ("case1", "case3")}
VALUES = (1e-300, 1e-30, 1e-6, 1e6, 1e30, 1e300)
KEYS = "J|drag|drag_torque|stiffness|damping|clearance|backlash|speed|mean|order|amplitude|stiffness_ratio"
NUMBERS = re.compile(rf"\b({KEYS})( = )(\"[^\"]*\"|[0-9.e+-]+)")
SECONDS = 10.0
"""Of processor time; all but honest long work takes far less than one."""


def with_number(text: str, which: int, value: float) -> str:
    """The text with its number ``which`` in place of another."""
    match = list(NUMBERS.finditer(text))[which]
    return f"{text[: match.start()]}{match[1]}{match[2]}{value!r}{text[match.end() :]}"


CASES = [
    (name, which, value)
    for name, text in TEXTS.items()
    for which in range(len(NUMBERS.findall(text)))
    for value in VALUES
]


def ends(text: str, **settings: object) -> Exception | None:
    """Simulate one cycle; nothing but an error of ours may come of it, and no warning; the error."""
    begin = time.process_time()

    def progress(_: float) -> None:
        assert time.process_time() - begin < SECONDS, "the run does not end"

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            run = gr.simulate(loads(text), **{"cycles": 1, "discard": 0, "progress": progress, **settings})  # type: ignore[arg-type]
        except GearRattleError as error:
            failure: Exception | None = error
        else:
            failure = None
            assert np.isfinite(run.trajectory.angle).all()
    assert time.process_time() - begin < SECONDS
    return failure


@pytest.fixture(scope="module", autouse=True)
def _compiled() -> None:
    for algorithm in ("exact", "rk4"):
        gr.simulate(loads(TEXTS["case3"]), algorithm, cycles=1, discard=0)


@pytest.mark.parametrize("case", random.Random(20).sample(CASES, 12), ids=str)
def test_a_run_with_an_extreme_value_ends(case: tuple[str, int, float]) -> None:
    name, which, value = case
    ends(with_number(TEXTS[name], which, value))


@pytest.mark.long
@pytest.mark.parametrize("case", CASES, ids=str)
def test_every_run_with_an_extreme_value_ends(case: tuple[str, int, float]) -> None:
    name, which, value = case
    ends(with_number(TEXTS[name], which, value))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("4500 N*s/m", 1e8),
        ("4500 N*s/m", 1e9),
        ("4500 N*s/m", 1e10),
        ("0.225 N*m*s/rad", 1e8),
        ("150 rad/s", 1e-3),
        ("150 rad/s", 1e-6),
        ("1.5e-4 N*m*s/rad", 1e12),
    ],
)
def test_modes_that_die_out_at_once_do_not_hold_a_run_up(old: str, new: float) -> None:
    run = gr.simulate(loads(TEXTS["case1"].replace(f'"{old}"', repr(new), 1)), cycles=1, discard=0)
    cost = run.trajectory.cost
    assert cost.steps < 5000
    assert cost.energy_residual is not None
    assert cost.energy_residual < 1e-8


@pytest.mark.parametrize(
    ("old", "new", "position"),
    [
        ("0.225 N*m*s/rad", 1e30, "coupling.clutch.damping"),
        ("1.5e-4 N*m*s/rad", 1e300, "inertia.flywheel.drag"),
        ("150 rad/s", 1e300, "excitation.speed"),
        ("4.5e-4 kg*m^2", 1e-300, "inertia.hub.J"),
        ("1.5e-4 N*m*s/rad", 1e25, "inertia.flywheel.drag"),
    ],
)
def test_values_beyond_double_precision_are_refused_by_name(old: str, new: float, position: str) -> None:
    with pytest.raises(ModelError) as caught:
        gr.simulate(loads(TEXTS["case1"].replace(f'"{old}"', repr(new), 1)), cycles=1, discard=0)
    problem = caught.value.problems[0]
    assert problem.place.endswith(position)
    assert problem.rule
    assert problem.remedy


@pytest.mark.parametrize("order", [1e15, 1e30])
def test_an_order_whose_phase_rounding_loses_is_refused(order: float) -> None:
    """Steps grow with the root of an order: 8e7 at 1e15, and 3e15, months, at 1e30."""
    error = ends(TEXTS["case1"].replace("order = 1,", f"order = {order!r},", 1))
    assert isinstance(error, ModelError)
    assert error.problems[0].place == "torque.0.harmonics.0.order"
    assert error.problems[0].remedy == "1.59e+14 or less"


@pytest.mark.parametrize("order", [1e8, 1e30])
def test_an_alternation_too_fast_to_be_listed_is_refused(order: float) -> None:
    text = (PAPER.parent / "alternating_mesh.toml").read_text()
    text = re.sub(r"(alternation = \{ order = )\d+", rf"\g<1>{order:.0f}.0", text)
    text = re.sub(r"(?m)^mean .*$", '\\g<0>\nharmonics = [{ order = 1, amplitude = "5 N*m" }]', text, count=1)
    error = ends(text)
    assert isinstance(error, ModelError)
    assert error.problems[0].place.endswith("alternation.order")
    assert "at most 1000000 are followed" in str(error)


@pytest.mark.parametrize(
    ("settings", "position", "says"),
    [
        ({"samples_per_cycle": 10**7}, "simulation.samples_per_cycle", "from 1 to 1000000"),
        ({"cycles": 10**9}, "simulation.cycles", "GiB of memory"),
        ({"algorithm": "rk4", "step": 1e-300}, "simulation.step", "must not be smaller than 1e-30"),
        ({"algorithm": "rk4", "step": 1e-12}, "simulation.step", "4.19e+10 steps of this length"),
        ({"algorithm": "rk2", "step": 1e-29}, "simulation.step", "steps of this length"),
    ],
)
def test_work_that_is_too_large_is_refused_before_it_begins(
    settings: dict[str, object], position: str, says: str
) -> None:
    error = ends(TEXTS["case1"], progress=lambda _: pytest.fail("the work has begun"), **settings)
    assert isinstance(error, ModelError)
    assert error.problems[0].place.endswith(position)
    assert says in str(error)


def test_a_train_too_long_for_tables_is_refused_before_memory_is_taken() -> None:
    text = chain(3000).replace("clearance", "hysteresis = 2.0\nstick_stiffness = 1e4\nclearance", 1)
    error = ends(text)
    assert isinstance(error, ModelError)
    assert "inertia: found 3000; exact needs tables for friction" in str(error)
    assert "gearrattle reduce" in str(error)


def test_too_many_regions_of_many_states_end_a_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gearrattle.engine.solvers.exact._BUILDING", 1.0)
    monkeypatch.setattr("gearrattle.engine.solvers.region_slots._KEPT", OrderedDict())
    with pytest.raises(ConvergenceError, match=r"visits too many regions for so many inertias in \w+ at t = .*reduce"):
        gr.simulate(loads(TEXTS["case3"]), cycles=2, discard=0)


def test_a_stream_of_many_cycles_is_not_refused_but_a_chunk_is() -> None:
    model = loads(TEXTS["case1"])
    next(iter(gr.stream(model, cycles=10**9, chunk=1)))
    with pytest.raises(ModelError, match=r"chunk: found 1000000000; .* GiB of memory"):
        gr.stream(model, cycles=10**9, chunk=10**9)


def test_an_explicit_algorithm_that_hardly_gets_on_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gearrattle.engine.solvers.stepwise._MOST_STEPS", 2000)
    text = TEXTS["case1"].replace('"4500 N*s/m"', "1e10", 1)
    with pytest.raises(ConvergenceError, match="needs too many steps"):
        gr.simulate(loads(text), "dop853", cycles=1, discard=0)


@pytest.mark.parametrize(
    "algorithm",
    ["adams", *(pytest.param(name, marks=pytest.mark.long) for name in ("dop853", "bulirsch-stoer", "rkv"))],
)
def test_steps_that_a_stiff_element_holds_too_short_end_a_run_in_seconds(algorithm: str) -> None:
    text = re.sub(r'"4500 N\*s/m"', "1e9", TEXTS["case3"])
    error = ends(text, algorithm=algorithm)
    assert isinstance(error, ConvergenceError)
    assert f"{algorithm}: the motion needs too many steps: gear moves too fast for its inertias, at t = " in str(error)
    assert error.time is not None
    assert "less stiffness or damping in the element named" in str(error)


def test_steps_that_a_tolerance_holds_too_short_are_not_laid_to_an_element(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("_MOST_STEPS", 20), ("_MOST_A_PERIOD", 20.0), ("_SLICE", 0.0)):
        monkeypatch.setattr(f"gearrattle.engine.solvers.stepwise.{name}", value)
    monkeypatch.setattr("gearrattle.engine.solvers.vector_field._HELD_BY_STABILITY", 100.0)
    with pytest.raises(ConvergenceError, match=r"needs too many steps, at t = .*a larger tolerance"):
        gr.simulate(loads(TEXTS["case3"]), "dop853", tolerance=1e-13, cycles=1, discard=0)


def chain(size: int) -> str:
    """A row of bodies; the coupling in the middle has a clearance."""
    lines = ['schema = 1\nunits = "SI"\n[excitation]\nspeed = 100\n']
    lines += [f'[[inertia]]\nname = "i{i}"\nJ = 0.01\ndrag = 0.001\n' for i in range(size)]
    for i in range(size - 1):
        gap = "clearance = 0.01\nstiffness_ratio = 0.1\n" if i == size // 2 else ""
        ends_at = f'between = ["i{i}", "i{i + 1}"]'
        lines.append(f'[[coupling]]\nname = "c{i}"\n{ends_at}\nstiffness = 1e5\ndamping = 0.1\n{gap}')
    lines.append('[[torque]]\non = "i0"\nmean = 1\nharmonics = [{ order = 1, amplitude = 5 }]\n')
    lines.append(f'[[torque]]\non = "i{size - 1}"\nmean = -1\n')
    return "".join(lines)


@pytest.fixture(scope="module", autouse=True)
def compiled() -> None:
    """Compile before the time of any case counts."""
    for text in (*TEXTS.values(), chain(250)):
        gr.simulate(loads(text), cycles=1, discard=0, samples_per_cycle=16)


@pytest.mark.long
def test_a_thousand_inertias_with_one_gap_take_seconds() -> None:
    assert ends(chain(1000), samples_per_cycle=16) is None
