"""Equations of motion as text: Python against matrices and against our motion, C against Python, Julia by its formulas.

No Julia runs here: its text is compared with the Python text formula by formula.
"""

from __future__ import annotations

import ctypes
import importlib.util
import re
import shutil
import subprocess
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from tests.exchange.drivelines import tree

NAMES = ["case3", "clutch_staged", "planetary_set", "driveline_lash", "rattle_oscillator", "128 bodies", "ambiguous"]


def model_of(name: str) -> gr.Model:
    if name == "128 bodies":
        return tree()
    if name == "clutch_staged":
        tables: Any = gr.example("clutch_friction").to_tables()
        for row in tables["coupling"]:
            for table in (row, *row.get("stages", ()), *row.get("coast_stages", ())):
                table.pop("hysteresis", None)
                table.pop("stick_stiffness", None)
        return gr.Model.from_tables(tables)
    if name == "driveline_lash":
        return gr.example("driveline_lash").with_({"torque.0.ramps": None, "torque.0.mean": 20.0})
    if name == "ambiguous":
        bodies = [{"name": name, "J": 0.1} for name in ("a", "a_mean", "a-mean", "b")]
        gap = {"stiffness": 1e4, "damping": 2.0, "clearance": 0.01, "contact_damping": "clipped"}
        between = [["a", "a_mean"], ["a_mean", "a-mean"], ["a-mean", "b"]]
        couplings = [{"name": f"c{k}", "between": pair, **gap} for k, pair in enumerate(between)]
        torques = [{"on": "a", "mean": 1.0}, {"on": "b", "harmonics": [{"order": 1, "amplitude": 3.0, "phase": 0.4}]}]
        tables = {
            "schema": 1,
            "inertia": bodies,
            "coupling": couplings,
            "torque": torques,
            "excitation": {"speed": 9.0},
        }
        return gr.Model.from_tables(tables)
    return gr.example(name)


def module(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


def states(model: gr.Model, count: int = 30) -> list[tuple[float, np.ndarray]]:
    """Times and states at random, so that every piece of every element is met."""
    system = assemble(model).system
    draw = np.random.default_rng(5)
    reach = max((np.abs(law.corners).max() for law in system.laws if law.corners.size), default=1.0)
    arm = np.abs(system.rows).max()
    scale = np.repeat([3.0 * reach / arm, 50.0 * reach / arm], system.size)
    return [(draw.uniform(0, 1), draw.normal(size=2 * system.size) * scale) for _ in range(count)]


def rates(model: gr.Model, t: float, y: np.ndarray) -> np.ndarray:
    """y' by matrices, the oracle."""
    system = assemble(model).system
    n = system.size
    inputs = system.inputs
    omega = 2 * np.pi * inputs.cycles / inputs.period
    sine, cosine = np.sin(omega * t), np.cos(omega * t)
    delta = system.rows @ y[:n] - inputs.error_sine @ sine - inputs.error_cosine @ cosine
    rate = system.rows @ y[n:] - inputs.error_sine @ (omega * cosine) + inputs.error_cosine @ (omega * sine)
    force = np.empty(len(system.laws))
    for k, (law, element) in enumerate(zip(system.laws, model.elements, strict=True)):
        piece = law.piece_at(delta[k])
        damping = law.damping[piece] * rate[k]
        if element.contact_damping == "clipped":
            damping = np.clip(damping, -abs(law.elastic(delta[k])), abs(law.elastic(delta[k])))
        force[k] = law.elastic(delta[k]) + damping
    torque = inputs.mean + inputs.torque_sine @ sine + inputs.torque_cosine @ cosine
    return np.append(y[n:], (torque - system.drag * y[n:] - system.rows.T @ force) / system.inertia)


@pytest.mark.parametrize("name", NAMES)
def test_python_has_the_rates_of_the_matrices(name: str, tmp_path: Path) -> None:
    model = model_of(name)
    text = module(gr.export_model(model, tmp_path / "model_text.py").path)
    for t, y in states(model):
        want = rates(model, t, y)
        got_rates = np.array(text.right_hand_side(t, y.tolist()))
        size = np.abs(want).max()
        np.testing.assert_allclose(got_rates, want, rtol=1e-11, atol=1e-13 * size)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_c_has_the_values_of_python(name: str, tmp_path: Path) -> None:
    model = model_of(name)
    text = module(gr.export_model(model, tmp_path / "model_text.py").path)
    source = gr.export_model(model, tmp_path / "model_text.c").path
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O1", "-ffp-contract=off", "-shared", "-fPIC"]
    subprocess.run(["cc", *flags, "-o", tmp_path / "model.so", source, "-lm"], check=True, timeout=120)
    library = ctypes.CDLL(str(tmp_path / "model.so"))
    pointer = ctypes.POINTER(ctypes.c_double)
    count = len(text.SURFACES)
    for t, y in states(model):
        computed = np.zeros(y.size)
        values = np.zeros(count + 1)
        library.right_hand_side(ctypes.c_double(t), y.ctypes.data_as(pointer), None, computed.ctypes.data_as(pointer))
        library.surfaces(ctypes.c_double(t), y.ctypes.data_as(pointer), values.ctypes.data_as(pointer))
        np.testing.assert_allclose(computed, text.right_hand_side(t, y.tolist()), rtol=1e-14, atol=0)
        np.testing.assert_allclose(values[:count], text.surfaces(t, y.tolist()), rtol=1e-14, atol=0)


@pytest.mark.parametrize("name", NAMES)
def test_julia_has_the_formulas_of_python(name: str, tmp_path: Path) -> None:
    model = model_of(name)
    python = gr.export_model(model, tmp_path / "model_text.py").path.read_text()
    julia = gr.export_model(model, tmp_path / "model_text.jl").path.read_text()
    # constants and formulas
    for kind in ("delta", "rate", "force"):
        formula = re.compile(rf"^ +({kind}_\w+) = (.+)$", re.MULTILINE)
        assert formula.findall(julia) == formula.findall(python)
    constant = re.compile(r"^(?:const )?([A-Z]+_\w+|OMEGA|PERIOD) = ([-+.e\d]+)", re.MULTILINE)
    numbers = constant.findall(julia)
    assert numbers == constant.findall(python)
    assert len(numbers) > 5
    # accelerations, by state
    returned = python[python.index("    return [\n") :]
    listed = re.findall(r"^        (.+),$", returned[: returned.index("    ]\n")], re.MULTILINE)
    assert re.findall(r"^    rates\[\d+\] = (.+)$", julia, re.MULTILINE) == listed
    assert re.findall(r"^    rates\[(\d+)\]", julia, re.MULTILINE) == [str(i + 1) for i in range(len(listed))]
    # blocks that begin end
    code = re.sub(r"#.*", "", julia)
    begins = len(re.findall(r"^(?:module|function)\b", code, re.MULTILINE))
    assert begins == len(re.findall(r"^end\b", code, re.MULTILINE)) >= 4
    assert code.count("(") == code.count(")")


@pytest.mark.parametrize(("name", "cycles"), [("case3", 1.0), ("manual_transmission", 0.3)])
def test_scipy_meets_our_crossings_before_chaos(name: str, cycles: float, tmp_path: Path) -> None:
    model = gr.example(name)
    text = module(gr.export_model(model, tmp_path / "model_text.py").path)
    times, path, log = text.solve(cycles * text.PERIOD)
    run = gr.simulate(model, cycles=1, discard=0, samples_per_cycle=60)
    events = run.events[run.events["time"] <= times[-1]]
    layout = run.trajectory.layout
    assert len(log) == len(events) > 5
    assert [entry[1] for entry in log] == [str(clearance).replace("-", "_") for clearance in events["clearance"]]
    np.testing.assert_allclose([entry[0] for entry in log], events["time"], rtol=0, atol=1e-7 * text.PERIOD)
    labels = [layout.region_of_first_piece[text.CLEARANCES.index(entry[1])] + entry[2] for entry in log]
    assert labels == list(events["to_region"])
    sample = round(60 * cycles)
    assert times[-1] == pytest.approx(run.trajectory.time[sample])
    end = np.array(path[-1])[: len(model.inertias)]
    reach = np.ptp(run.trajectory.angle, axis=0).max()
    np.testing.assert_allclose(end, run.trajectory.angle[sample], rtol=0, atol=1e-6 * reach)


def test_what_a_plain_right_hand_side_does_not_hold_is_refused(tmp_path: Path) -> None:
    for name, key in (
        ("clutch_friction", "hysteresis"),
        ("alternating_mesh", "alternation"),
        ("run_up", "sweep"),
        ("tip_in", "ramps"),
    ):
        for ending in ("py", "c", "jl", "npz"):
            with pytest.raises(gr.ModelError, match=key):
                gr.export_model(gr.example(name), tmp_path / f"a.{ending}")
    assert list(tmp_path.iterdir()) == []
