"""Arguments of what is asked about branches and motions: what they must be is said, with what they are."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable
from typing import Any

import pytest

import gearrattle as gr
from gearrattle.model.path_labels import dimension_at, shown_value
from gearrattle.model.path_values import change_in_si, in_si
from gearrattle.orbits import Branch, Orbit
from gearrattle.orbits.gradients import numbers_of, second_of
from gearrattle.orbits.start_states import check_repeats
from gearrattle.orbits.value_family import follower_over
from gearrattle.report.plots.branches_figure import measure_over
from tests.studies import oscillator

MEAN = "torque.0.mean"
NAN = float("nan")


@pytest.fixture(scope="module")
def branch() -> Branch:
    return gr.continuation(oscillator.model(), oscillator.AMPLITUDE, (5.9, 6.1), start="linear")


@pytest.fixture(scope="module")
def over_speed() -> Branch:
    return gr.continuation(gr.example("backlash_oscillator"), "excitation.speed", (0.3, 0.31))


OF_BRANCH: dict[str, Callable[..., Any]] = {
    "boundary": lambda branch, **one: branch.boundary(**{"event": 0, "second": MEAN, "range": (7.0, 8.0), **one}),
    "map": lambda branch, **one: branch.map(**{"second": MEAN, "range": (7.0, 8.0), **one}),
    "scatter": lambda branch, **one: branch.scatter(**{"event": 0, "tolerances": {MEAN: 0.1}, **one}),
    "gradients": lambda branch, **one: branch.gradients(**{"event": 0, **one}),
    "orbit": lambda branch, **one: branch.orbit(**one),
}


@pytest.mark.parametrize(
    ("call", "argument", "value", "message"),
    [
        ("boundary", "event", 1.0, "event: found 1.0; must be a whole number from 0 to"),
        ("boundary", "event", True, "event: found true; must be a whole number from 0 to"),
        ("boundary", "second", "torque.0.mea", 'did you mean "mean"'),
        ("boundary", "second", 3, "second: found 3; must be text"),
        ("boundary", "second", oscillator.AMPLITUDE, "is what the branch is followed over"),
        ("boundary", "range", (7.0, NAN), f"{MEAN}: found nan; must be a finite number"),
        ("boundary", "range", (), r"range: found \[\]; must be two values"),
        ("boundary", "range", (8.0, 9.0), f"range: found .*; must contain the model's own {MEAN}"),
        ("boundary", "progress", 3, "progress: found 3; must be a function, or None"),
        ("map", "range", (NAN, 8.0), f"{MEAN}: found nan; must be a finite number"),
        ("map", "range", (7.6, 7.6), "range: found .*; must be two different values"),
        ("map", "across", 2.5, "across: found 2.5; must be a whole number from 1 to 512"),
        ("map", "up", True, "up: found true; must be a whole number from 1 to 512"),
        ("map", "isolated", "no", 'isolated: found "no"; must be true or false'),
        ("map", "progress", 3, "progress: found 3; must be a function, or None"),
        ("scatter", "tolerances", MEAN, 'tolerances: found "torque.0.mean"; must be standard deviations by path'),
        ("scatter", "tolerances", {MEAN: NAN}, f"tolerances: {MEAN}: found nan; must be a finite number"),
        ("scatter", "tolerances", {MEAN: -0.1}, f"tolerances: {MEAN}: found -0.1; must not be negative"),
        ("scatter", "tolerances", {"torque.0.mea": 0.1}, 'did you mean "torque.0.mean"'),
        ("scatter", "tolerances", {3: 0.1}, "paths: found 3; must be text"),
        ("gradients", "paths", MEAN, 'paths: found "torque.0.mean"; must be a list of paths'),
        ("gradients", "paths", 3, "paths: found 3; must be a list of paths"),
        ("gradients", "paths", [3], "paths: found 3; must be text"),
        ("gradients", "paths", ["torque.0.harmonics.0.order"], "cannot be changed a little"),
        ("gradients", "paths", ["simulation.cycles"], "is no number of the driveline"),
        ("orbit", "i", 1.5, "point: found 1.5; must be a whole number"),
    ],
)
def test_an_argument_of_a_branch(branch: Branch, call: str, argument: str, value: object, message: str) -> None:
    with pytest.raises(gr.ModelError, match=message):
        OF_BRANCH[call](branch, **{argument: value})


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (0.0, "rate: found 0.0; must be greater than zero"),
        (NAN, "rate: found nan; must be a finite number"),
        (True, "rate: found true; must be a plain number"),
    ],
)
def test_a_rate(over_speed: Branch, value: object, message: str) -> None:
    with pytest.raises(gr.ModelError, match=message):
        over_speed.run_up(value)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("ends", "message"),
    [
        ((NAN, 6.0), "found nan; must be a finite number"),
        ((6.0, NAN), "found nan; must be a finite number"),
        ((6.0, float("inf")), "found inf; must be a finite number"),
        ((), "must be two values"),
        (None, "must be two values"),
        ({5.9, 6.0}, "must be two values"),
        ((6.0, 6.0), "two different values"),
        ((True, 6.0), "found true; must be a plain number"),
    ],
)
def test_a_range_of_a_branch(ends: Any, message: str) -> None:
    with pytest.raises(gr.ModelError, match=message):
        gr.continuation(oscillator.model(), oscillator.AMPLITUDE, ends)


def test_the_methods_that_take_switches_and_functions_are_those_of_the_tables_here() -> None:
    methods = [*inspect.getmembers(Branch, inspect.isfunction), *inspect.getmembers(Orbit, inspect.isfunction)]
    taking = {
        name
        for name, method in methods
        if not name.startswith("_")
        for argument in inspect.signature(method).parameters.values()
        if re.match("bool|Callable", str(argument.annotation))
    }
    assert taking == {"boundary", "map", "run_up"}


def test_a_run_up_reports_to_a_function(over_speed: Branch) -> None:
    with pytest.raises(gr.ModelError, match="progress: found 3; must be a function, or None"):
        over_speed.run_up(1e-3, progress=3)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["case3", "eight_dof", "rattle_oscillator"])
def test_a_change_is_read_as_the_model_reads_the_number(name: str) -> None:
    model = gr.example(name)
    for path in numbers_of(model, ""):
        dimension = dimension_at(path)
        written = dimension.example if dimension is not None and model.units == "SI" else 0.5
        assert change_in_si(path, written, model, "non-negative", "change") == in_si(path, written, model), path


def test_a_change_need_not_be_a_value_that_the_model_takes() -> None:
    stages = [{"stiffness": 1.0, "damping": 0.1, "until": 0.2}, {"stiffness": 3.0, "damping": 0.1, "until": 0.6}]
    stages.append({"stiffness": 9.0, "damping": 0.1})
    coupling = {"name": "clutch", "between": ["disc", "ground"], "stages": stages}
    model = gr.Model.from_tables(
        {
            "schema": 1,
            "inertia": [{"name": "disc", "J": 1.0, "drag": 0.1}],
            "coupling": [coupling],
            "excitation": {"speed": 1.0},
            "torque": [{"on": "disc", "mean": 0.1, "harmonics": [{"order": 1, "amplitude": 0.1}]}],
        }
    )
    path = "coupling.clutch.stages.1.until"
    with pytest.raises(gr.ModelError):
        in_si(path, 0.01, model)  # below the end of the stage before
    assert change_in_si(path, 0.01, model, "non-negative", "change") == 0.01


def test_progress_of_a_boundary_reaches_the_end_and_stops_the_work(branch: Branch) -> None:
    shares: list[float] = []
    branch.boundary(0, MEAN, (7.5, 7.6), progress=shares.append)
    assert shares == sorted(shares)
    assert shares[0] < 1.0
    assert shares[-1] == 1.0

    def stop(share: float) -> None:
        raise gr.Cancelled(f"{share}")

    with pytest.raises(gr.Cancelled):
        branch.boundary(0, MEAN, (7.5, 7.6), progress=stop)


@pytest.mark.parametrize("size", [3.0, 2e-3, 7e-5, 4e-8])
def test_messages_write_a_value_in_the_unit_of_the_tables(size: float) -> None:
    """Of every number of a model, whatever the range of it that is followed, small values within it as well."""
    model = gr.example("case3")
    for path in numbers_of(model, ""):
        shown = measure_over(model, path, (0.2 * size, size))
        for value in (size, 0.2 * size, 1e-3 * size):
            words = shown_value(path, model, value, 6, size)
            assert words == f"{value * shown.factor:.6g} {shown.unit}".rstrip(), path


def test_notes_of_branches_write_a_value_in_the_unit_of_the_tables() -> None:
    model, path = gr.example("case3"), "mesh.gear.backlash"
    follower = follower_over(model, path, (8e-5, 2e-5), 1, first=8e-5)
    assert [follower.family.shown(value) for value in (8e-5, 2.3e-7)] == ["80 µm", "0.23 µm"]
    assert measure_over(model, path, (8e-5, 2e-5)).unit == "µm"
    with pytest.raises(gr.ModelError, match=r"found 200 µm to 300 µm; must contain the model's own .*, 100 µm"):
        second_of(model, "excitation.speed", path, ("0.2 mm", "0.3 mm"))


def test_a_torque_left_over_has_the_unit_of_the_model() -> None:
    """Two gears that turn freely, pushed by 0.2 N m more than they are held."""
    mesh = {"name": "gear", "between": ["a", "b"], "radii": ["50 mm", "50 mm"], "stiffness": 1e6, "damping": 10.0}
    tables = {
        "schema": 1,
        "inertia": [{"name": "a", "J": 1.0}, {"name": "b", "J": 1.0}],
        "mesh": [mesh],
        "excitation": {"speed": 1.0},
        "torque": [{"on": "a", "mean": 2e-4, "harmonics": [{"order": 1, "amplitude": 0.1}]}],
    }
    with pytest.raises(gr.ModelError, match=r"found 200 µN m left over"):
        check_repeats(gr.Model.from_tables(tables))
    plain = {**mesh, "radii": [0.05, 0.05]}
    with pytest.raises(gr.ModelError, match=r"found 0\.0002 left over"):
        check_repeats(gr.Model.from_tables({**tables, "mesh": [plain], "units": "dimensionless"}))


def test_a_step_limit_may_have_a_unit() -> None:
    path, ends = "coupling.driveshaft.clearance", ("1 deg", "1.05 deg")
    model = gr.example("driveline_lash")
    in_degrees, in_radians = (
        gr.continuation(model, path, ends, step_limit=limit) for limit in ("0.01 deg", math.radians(0.01))
    )
    assert len(in_degrees.points) == len(in_radians.points) > 5


@pytest.mark.parametrize("ends", [(1.0, "2 deg"), ("1 deg", 2)])
def test_a_range_has_a_unit_at_both_ends_or_none(ends: tuple[Any, Any]) -> None:
    with pytest.raises(gr.ModelError, match="one end has a unit, the other none"):
        gr.continuation(gr.example("driveline_lash"), "coupling.driveshaft.clearance", ends)


def test_a_range_may_begin_at_zero_without_a_unit() -> None:
    branch = gr.continuation(gr.example("driveline_lash"), "torque.0.harmonics.0.amplitude", (0, "5 N*m"))
    assert branch.range == (0.0, 5.0)
