"""Values that no study can have are refused with file and line, before anything is written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.errors import ModelError
from gearrattle.studies.study_file import read_study
from tests.studies.drivelines import TOML

HUGE = "1" + "0" * 400
AXIS = '[axis]\n"torque.0.mean" = [0.3, 0.6]\n'
SCATTER = '[vary]\n"torque.0.mean" = {{ {} }}\n[sample]\n{}\n'
NORMAL = 'distribution = "normal", mean = {}, deviation = {}, cut = {}'
SWEEP = '[sweep]\n"torque.0.mean" = [0.3, 0.6]\n'
OVER = '[over]\n"deflection.joint" = {}\n'
GOAL = '[variable]\n"torque.0.mean" = {}\n[objective]\n{} = {}\n'
PAIR = "{ from = 0.3, to = 0.6 }"


def named(name: str) -> str:
    return f'[axis]\n{name} = {{ "torque.0.mean" = [0.3, 0.6], "joint" = [1] }}\n'


CASES = {
    "a table among outputs": ("outputs = [{ a = 1 }]\n" + AXIS, 3, "must be a list of texts"),
    "a number among outputs": ("outputs = [1]\n" + AXIS, 3, "must be a list of texts"),
    "a list as distribution": (SCATTER.format("distribution = [1]", "count = 4"), 4, "distribution must be one of"),
    "a table as distribution": (SCATTER.format("distribution = {}", "count = 4"), 4, "distribution must be one of"),
    "a negative seed": (SCATTER.format(NORMAL.format(1, 0.1, 3), "count = 4\nseed = -1"), 7, "whole number from 0"),
    "a huge seed": (SCATTER.format(NORMAL.format(1, 0.1, 3), f"count = 4\nseed = {HUGE}"), 7, "whole number from 0"),
    "a huge deviation": (SCATTER.format(NORMAL.format(1, HUGE, 3), "count = 4"), 4, "beyond the range of a double"),
    "a huge cut": (SCATTER.format(NORMAL.format(1, 0.1, HUGE), "count = 4"), 4, "beyond the range of a double"),
    "a tiny width": (SCATTER.format(NORMAL.format(1, 0.1, 3), "half_width = 1e-29"), 6, "between 1e-09 and 0.5"),
    "a huge range": (f'[axis]\n"torque.0.mean" = {{ from = 1, to = {HUGE}, count = 3 }}\n', 4, "beyond the range"),
    "too wide a range": ('[axis]\n"torque.0.mean" = { from = -1.7e308, to = 1.7e308, count = 3 }\n', 4, "must not be"),
    "a huge count": (f'[axis]\n"torque.0.mean" = {{ from = 1, to = 2, count = {HUGE} }}\n', 4, "from 2 to 10000000"),
    "a list as spacing": ('[axis]\n"torque.0.mean" = { from = 1, to = 2, count = 2, spacing = [1] }\n', 4, '"linear"'),
    "a huge value": (f'[axis]\n"torque.0.mean" = [1, {HUGE}]\n', 4, "beyond the range of a double"),
    "an empty name": (named('""'), 3, "letters, digits"),
    "dots as name": (named('".."'), 4, "letters, digits"),
    "a path as name": (named('"a/b"'), 4, "letters, digits"),
    "a NUL as name": (named('"\\u0000"'), 4, "letters, digits"),
    "a long name": (named('"' + "x" * 300 + '"'), 4, "60 at most"),
    "an output's name": (named('"regime"'), 4, "the results of studies use this name"),
    "a dimension's name": (named('"part"'), 4, "the results of studies use this name"),
    "a file's name": (named('"zarr.json"'), 4, "letters, digits"),
    "a kept output's name": (
        'outputs = ["impacts per cycle"]\n[axis]\n"impacts per cycle" = { "torque.0.mean" = [0.3, 0.6] }\n',
        5,
        "this is the name of another axis",
    ),
    "a huge tolerance": (f'kind = "bifurcation"\ntolerance = {HUGE}\n{SWEEP}', 4, "beyond the range"),
    "a phase that is no number": (f'kind = "bifurcation"\nphase = nan\n{SWEEP}', 4, "finite"),
    "a number as section": (f'kind = "bifurcation"\nsection = [1]\n{SWEEP}', 4, "must be a list of texts"),
    "a huge start": ('kind = "basins"\n' + OVER.format(f"[1, {HUGE}]"), 5, "beyond the range"),
    "a huge box": ('kind = "basins"\n' + OVER.format(f"{{ from = 1, to = {HUGE}, count = 2 }}"), 5, "beyond the range"),
    "a list as goal": ('kind = "optimization"\n' + GOAL.format(PAIR, '"verdict"', "[1]"), 7, 'must be "min" or "max"'),
    "an unknown goal": ('kind = "optimization"\n' + GOAL.format(PAIR, '"verdikt"', '"min"'), 7, "no such output"),
    "a huge limit": (
        'kind = "optimization"\n'
        + GOAL.format(PAIR, '"verdict"', '"min"')
        + f'[constraint]\n"joint: impacts per cycle" = {{ below = {HUGE} }}\n',
        9,
        "beyond the range",
    ),
    "a limit that is no number": (
        'kind = "optimization"\n'
        + GOAL.format(PAIR, '"verdict"', '"min"')
        + '[constraint]\n"joint: impacts per cycle" = { below = nan }\n',
        9,
        "finite",
    ),
    "a huge generation": (
        f'kind = "optimization"\npopulation = {HUGE}\n' + GOAL.format(PAIR, '"verdict"', '"min"'),
        4,
        "whole number",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_a_bad_value_is_refused_with_file_and_line_before_anything_is_written(folder: Path, name: str) -> None:
    text, line, words = CASES[name]
    (folder / "s.toml").write_text(f'schema = 1\nmodel = "two.toml"\n{text}', encoding="utf-8")
    with pytest.raises(ModelError) as caught:
        read_study("s.toml").prepare()
    reported = [problem for problem in map(str, caught.value.problems) if words in problem]
    assert reported
    assert reported[0].startswith(f"s.toml:{line}: ")


def test_the_command_refuses_them_with_exit_code_2_and_writes_nothing(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("a table among outputs", "a list as distribution", "a negative seed", "a huge range", "a NUL as name"):
        (folder / "s.toml").write_text(f'schema = 1\nmodel = "two.toml"\n{CASES[name][0]}', encoding="utf-8")
        assert main(["study", "s.toml"]) == 2
        assert "s.toml:" in capsys.readouterr().err
    assert sorted(path.name for path in folder.iterdir()) == ["s.toml", "two.toml"]


GOOD = {"torque.0.mean": [0.3, 0.6]}
SPREAD = {"torque.0.mean": {"distribution": "uniform", "from": 0.3, "to": 0.6}}
CALLS: dict[str, Callable[[gr.Model], object]] = {
    "axes": lambda m: gr.study(m, [1]),  # type: ignore[arg-type]
    "a number as path": lambda m: gr.study(m, {1: [0.3]}),  # type: ignore[dict-item]
    "a number for values": lambda m: gr.study(m, {"torque.0.mean": 1.0}),
    "an array without dimension": lambda m: gr.study(m, {"torque.0.mean": np.array(1.0)}),
    "an array of two dimensions": lambda m: gr.study(m, {"torque.0.mean": np.ones((2, 2))}),
    "dates": lambda m: gr.study(m, {"torque.0.mean": np.array(["2020-01-01"], "datetime64[ns]")}),
    "complex numbers": lambda m: gr.study(m, {"torque.0.mean": np.array([1j])}),
    "outputs": lambda m: gr.study(m, GOOD, 3),  # type: ignore[arg-type]
    "a table among outputs": lambda m: gr.study(m, GOOD, [{"a": 1}]),  # type: ignore[list-item]
    "fixed": lambda m: gr.study(m, GOOD, fixed=[1]),  # type: ignore[arg-type]
    "vary": lambda m: gr.study(m, vary=[1], samples=4),  # type: ignore[arg-type]
    "a list as distribution": lambda m: gr.study(m, vary={"torque.0.mean": {"distribution": [1]}}, samples=4),
    "a negative seed": lambda m: gr.study(m, vary=SPREAD, samples=4, seed=-1),
    "a huge seed": lambda m: gr.study(m, vary=SPREAD, samples=4, seed=10**5000),
    "a hugely negative seed": lambda m: gr.study(m, vary=SPREAD, samples=4, seed=-(10**5000)),
    "a huge number of samples": lambda m: gr.study(m, vary=SPREAD, samples=10**5000),
    "a list as method": lambda m: gr.study(m, vary=SPREAD, samples=4, method=[1]),  # type: ignore[arg-type]
    "a function of no numbers": lambda m: gr.study(m, GOOD, function=lambda _: {"x": "y"}),  # type: ignore[dict-item]
    "a function of a path": lambda m: gr.study(m, GOOD, function=lambda _: {"../x": 1.0}),
    "a function of an axis": lambda m: gr.study(m, GOOD, function=lambda _: {"torque.0.mean": 1.0}),
    "a function of a number": lambda m: gr.study(m, GOOD, function=lambda _: {1: 1.0}),  # type: ignore[dict-item]
    "a swept text": lambda m: gr.bifurcation(m, "torque.0.mean", "abc"),
    "a number as sweep": lambda m: gr.bifurcation(m, 1, [0.3, 0.6]),  # type: ignore[arg-type]
    "a list as direction": lambda m: gr.bifurcation(m, "torque.0.mean", [0.3, 0.6], direction=[1]),  # type: ignore[arg-type]
    "a table as section": lambda m: gr.bifurcation(m, "torque.0.mean", [0.3, 0.6], section=[{}]),  # type: ignore[list-item]
    "a huge tolerance": lambda m: gr.bifurcation(m, "torque.0.mean", [0.3, 0.6], tolerance=10**5000),
    "a huge phase": lambda m: gr.bifurcation(m, "torque.0.mean", [0.3, 0.6], phase=10**5000),
    "over": lambda m: gr.basins(m, [1]),  # type: ignore[arg-type]
    "a huge start": lambda m: gr.basins(m, {"deflection.joint": [0.0, 10**5000]}),
    "a huge number of states": lambda m: gr.basins(m, {"deflection.joint": {"from": 0, "to": 1}}, samples=10**5000),
    "a list for same": lambda m: gr.basins(m, {"deflection.joint": [0.0, 1e-3]}, same=[1]),  # type: ignore[arg-type]
    "variables": lambda m: gr.optimize(m, [1], {"verdict": "min"}),  # type: ignore[arg-type]
    "objectives": lambda m: gr.optimize(m, {"torque.0.mean": (0.3, 0.6)}, "verdict"),  # type: ignore[arg-type]
    "a number as objective": lambda m: gr.optimize(m, {"torque.0.mean": (0.3, 0.6)}, {1: "min"}),  # type: ignore[dict-item]
    "constraints": lambda m: gr.optimize(m, {"torque.0.mean": (0.3, 0.6)}, {"verdict": "min"}, constraints=[1]),  # type: ignore[arg-type]
    "a text as outputs": lambda m: gr.optimize(m, {"torque.0.mean": (0.3, 0.6)}, {"verdict": "min"}, outputs="regime"),
    "a function of a result": lambda m: gr.optimize(
        m, {"torque.0.mean": (0.3, 0.6)}, {"x": "min"}, function=lambda _: {"x": 1.0, "violation": 1.0}
    ),
}


@pytest.mark.parametrize("name", CALLS)
def test_a_call_with_a_bad_value_is_refused(name: str) -> None:
    with pytest.raises(ModelError):
        CALLS[name](gr.loads(TOML))


def test_a_path_that_is_too_long_for_a_file_is_refused() -> None:
    model = gr.loads(TOML.replace('"joint"', '"' + "j" * 300 + '"'))
    with pytest.raises(ModelError, match="200 bytes at most"):
        gr.study(model, {f"coupling.{'j' * 300}.clearance": [0.01, 0.02]})


VALUES = [0.3, 0.6]
ARRAYS: dict[str, Any] = {
    "a tuple": tuple(VALUES),
    "numpy": np.array(VALUES),
    "numpy scalars": list(np.array(VALUES)),
    "pandas": pd.Series(VALUES, index=["a", "b"]),
    "a pandas index": pd.Index(VALUES),
    "xarray": xr.DataArray(VALUES, dims="load", attrs={"units": "N m"}),
    "xarray in another unit": xr.DataArray([300.0, 600.0], dims="load", attrs={"units": "mN*m"}),
    "texts": pd.Series(["0.3 N*m", "0.6 N*m"]),
}


@pytest.mark.parametrize("name", ARRAYS)
def test_axes_are_lists_or_arrays_of_numpy_pandas_and_xarray(name: str) -> None:
    model = gr.loads(TOML).with_({"simulation.cycles": 2, "simulation.discard": 1})
    expected = gr.study(model, {"torque.0.mean": VALUES}, workers=1)
    actual = gr.study(model, {"torque.0.mean": ARRAYS[name]}, workers=1)
    if "unit" in name:
        assert np.allclose(actual["torque.0.mean"], VALUES, rtol=1e-15)
    else:
        assert actual["torque.0.mean"].equals(expected["torque.0.mean"])
        assert actual["verdict"].equals(expected["verdict"])


def test_the_unit_of_an_array_counts() -> None:
    with pytest.raises(ModelError, match="mm is not"):
        gr.study(gr.loads(TOML), {"torque.0.mean": xr.DataArray([1.0], dims="x", attrs={"units": "mm"})})
    with pytest.raises(ModelError, match="finite"):
        gr.study(gr.loads(TOML), {"torque.0.mean": pd.Series([1.0, None])})
