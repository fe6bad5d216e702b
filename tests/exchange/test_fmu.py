"""FMUs: what they hold, their slaves against runs, and two of them against the whole; hosts in ``test_fmu_hosts``."""

from __future__ import annotations

import sys
import zipfile
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import period_of
from gearrattle.errors import NotInstalled
from gearrattle.exchange import fmu as module
from gearrattle.exchange.fmu_variables import structured
from tests.exchange.fmus import LIBRARIES, Slave, parts_of, ports_in

VERSIONS = tuple(LIBRARIES)


@pytest.fixture(params=VERSIONS)
def version(request: pytest.FixtureRequest) -> str:
    pytest.importorskip(LIBRARIES[request.param])
    return str(request.param)


def test_names_are_structured() -> None:
    assert structured("torque.flywheel") == "torque.flywheel"
    assert structured("torque.0.mean") == "torque.'0'.mean"
    assert structured("velocity.input-gear") == "velocity.'input-gear'"


def test_without_the_library(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "pythonfmu3", None)
    with pytest.raises(NotInstalled, match=r"gearrattle\[fmu\]"):
        gr.export_fmu(gr.example("case3"), tmp_path / "x.fmu")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"path": "x.zip"}, "ends in .fmu"),
        ({"version": "1.0"}, 'must be "3.0" or "2.0"'),
        ({"torques": "flywheel"}, "list of texts"),
        ({"torques": ["flywheal"]}, 'did you mean "flywheel"'),
        ({"parameters": ["mesh.gear.backlsh"]}, "backlash"),
        ({"parameters": ["mesh.*.backlsh"]}, "matches no value"),
        ({"step": -1.0}, "step"),
        ({"step": "1 mm"}, "step"),
        ({"audit": 1}, "audit"),
    ],
)
def test_wrong_arguments(arguments: dict[str, object], words: str, tmp_path: Path, version: str) -> None:
    call = {"path": "x.fmu", "version": version, **arguments}
    target = tmp_path / str(call.pop("path"))
    with pytest.raises(gr.ModelError, match=words):
        gr.export_fmu(gr.example("case3"), target, **call)
    assert not list(tmp_path.iterdir())


def test_what_an_fmu_holds(tmp_path: Path, version: str) -> None:
    path = tmp_path / "case 3.fmu"
    path.write_text("something old")
    before = list(sys.path), set(sys.modules)
    fmu = gr.export_fmu(gr.example("case3"), path, version, torques=["flywheel"], audit=True, step="0.1 ms")
    assert list(sys.path) == before[0]
    assert not {name for name in set(sys.modules) - before[1] if "case" in name}
    assert [entry.name for entry in tmp_path.iterdir()] == ["case 3.fmu"]
    assert fmu.step == 1e-4
    assert fmu.names("input") == ("torque.flywheel", "torque_rate.flywheel")
    with zipfile.ZipFile(path) as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
        names = archive.namelist()
    assert root.get("fmiVersion") == version
    kind = root.find("CoSimulation")
    assert kind is not None
    states = {key: value for key, value in kind.attrib.items() if "State" in key or "state" in key}
    assert len(states) == 2
    assert set(states.values()) == {"true"}
    assert kind.get("canHandleVariableCommunicationStepSize") == "true"
    assert any("linux" in name and name.endswith(".so") for name in names)
    assert any("win" in name and name.endswith(".dll") for name in names)
    tags = root.iter() if version == "3.0" else root.iter("ScalarVariable")
    described = {entry.get("name"): entry for entry in tags if entry.get("causality")}
    assert {variable.name for variable in fmu.variables} | ({"time"} if version == "3.0" else set()) == set(described)
    ports = ports_in(fmu)
    assert ports["torques"] == ["flywheel"]
    assert ports["step"] == 1e-4
    assert "mesh.gear.backlash" in ports["paths"]
    assert "energy_residual" in described


@pytest.mark.parametrize(("size", "torques"), [(4, 4), (128, 2)])
def test_usual_ports(size: int, torques: int, tmp_path: Path, version: str) -> None:
    tables = gr.example("case3").to_tables()
    more = [{"name": f"b{i}", "J": 1e-3} for i in range(size - 4)]
    ends = ["output_gear", *(body["name"] for body in more)]
    shafts = [{"name": f"s{i}", "between": [a, b], "stiffness": 1e4} for i, (a, b) in enumerate(pairwise(ends))]
    model = gr.Model.from_tables(
        {
            **tables,
            "inertia": [*tables["inertia"], *more],
            "coupling": [*tables["coupling"], *shafts],
            "torque": tables["torque"][:1],
        }
    )
    if size > 4:
        model = model.with_({"simulation.initial": "zero"})
    fmu = gr.export_fmu(model, tmp_path / "x.fmu", version)
    assert len(fmu.names("input")) == 2 * torques
    assert "velocity.flywheel" in fmu.names("output")
    slave = Slave(fmu)
    slave.begin()
    assert slave.step(0.0, fmu.step)
    assert np.isfinite([slave[name] for name in fmu.names("output")]).all()


def test_a_slave_moves_as_a_run(tmp_path: Path, version: str) -> None:
    """Case 1, loaded, over four cycles to 1e-8; the host's time does not begin at zero."""
    model = gr.example("case1_loaded")
    length = period_of(model).period / 10
    slave = Slave(gr.export_fmu(model, tmp_path / "x.fmu", version, audit=True), start=7.0)
    slave.begin()
    assert slave["energy_residual"] == 0.0
    names = {kind: [name for name in slave.by_name if name.startswith(f"{kind}.")] for kind in ("angle", "velocity")}
    actual: dict[str, list[list[float]]] = {kind: [] for kind in names}
    for k in range(40):
        assert slave.step(7.0 + k * length, length)
        for kind, which in names.items():
            actual[kind].append([slave[name] for name in which])
    run = gr.simulate(model, cycles=4, samples_per_cycle=10, discard=0)
    for kind, values in actual.items():
        want = run.data[kind].to_numpy()[1:]
        assert np.abs(np.array(values) - want).max() < 1e-8 * np.abs(want).max()
    assert slave["impacts.clutch"] > 0
    assert 0.0 < slave["energy_residual"] < 1e-11
    if version == "3.0":
        assert slave["time"] == pytest.approx(7.0 + 4 * period_of(model).period)


def test_values_and_inputs_of_the_start(tmp_path: Path, version: str) -> None:
    """What is set in the initialization takes effect at once, a value in between from there on."""
    model = gr.example("case3")
    fmu = gr.export_fmu(model, tmp_path / "x.fmu", version)
    slave = Slave(fmu)
    slave["torque.flywheel"] = 3.0
    slave["mesh.gear.backlash"] = 2e-4
    slave.begin()
    more = gr.simulate(
        model.with_({"mesh.gear.backlash": 2e-4}), cycles=1, samples_per_cycle=10, discard=0, initial="steady"
    )
    assert slave["angle.hub"] == more.data["angle"].sel(inertia="hub").to_numpy()[0]
    want = more.data["acceleration"].sel(inertia="flywheel").to_numpy()[0] + 3.0 / model["inertia.flywheel.J"]
    assert slave["acceleration.flywheel"] == pytest.approx(want, rel=1e-9)
    assert slave.step(0.0, fmu.step)
    slave["mesh.gear.backlash"] = 3e-4
    assert slave["mesh.gear.backlash"] == 3e-4
    assert slave.step(fmu.step, fmu.step)


def test_a_state_goes_into_another_slave(tmp_path: Path, version: str) -> None:
    fmu = gr.export_fmu(gr.example("case3"), tmp_path / "x.fmu", version, audit=True)
    length = 7.0 * fmu.step
    one, other = Slave(fmu), Slave(fmu)
    one["mesh.gear.backlash"] = 1.2e-4
    for slave in (one, other):
        slave.begin()
    one["torque.flywheel"] = 1.0
    for k in range(20):
        assert one.step(k * length, length)
    state = one.slave._get_fmu_state()
    stored = one.slave._fmu_state_to_bytes(state)
    assert isinstance(stored, bytes)
    other.slave._set_fmu_state(other.slave._fmu_state_from_bytes(stored))
    names = [variable.name for variable in fmu.variables]

    def motion(slave: Slave) -> list[list[float]]:
        rows = []
        for k in range(20, 40):
            assert slave.step(k * length, length)
            rows.append([slave[name] for name in names if name != "energy_residual"])
        return rows

    want = motion(one)
    assert motion(other) == want
    one.slave._set_fmu_state(state)
    assert motion(one) == want
    assert other["energy_residual"] < 1e-11


def test_no_exception_leaves_a_slave(tmp_path: Path, version: str) -> None:
    """What a host does wrong is logged and refused; then the motion goes on."""
    fmu = gr.export_fmu(gr.example("case3"), tmp_path / "x.fmu", version)
    slave = Slave(fmu)
    slave.begin()
    assert slave.step(0.0, fmu.step)
    here = slave["angle.hub"]
    slave["torque.flywheel"] = float("nan")
    assert not slave.step(fmu.step, fmu.step)
    slave["torque.flywheel"] = 0.0
    assert not slave.step(0.0, 0.5 * fmu.step)
    assert not slave.step(0.0, float("inf"))
    slave["mesh.gear.backlash"] = -1.0
    assert slave["angle.hub"] == here
    assert slave["mesh.gear.backlash"] == 1e-4
    slave.slave._set_fmu_state({})
    texts = [entry.msg for entry in slave.slave._get_log_queue()]
    assert len(texts) == 5
    for words, text in zip(("finite", "before", "before", "must not be negative", "used"), texts, strict=True):
        assert words in text
    assert slave.step(fmu.step, fmu.step)


@pytest.mark.parametrize("steps", [100, 400])
def test_two_fmus_against_the_whole(steps: int, tmp_path: Path, version: str) -> None:
    """The flywheel first, under the torque of the clutch by its last two values; its speed turns the other one."""
    model = gr.example("case1_loaded").with_({"simulation.initial": "static"})
    flywheel, rest = parts_of(model)
    period = period_of(model).period
    length = period / steps
    one = Slave(gr.export_fmu(flywheel, tmp_path / "flywheel.fmu", version, step=length))
    other = Slave(gr.export_fmu(rest, tmp_path / "rest.fmu", version, speeds=["flywheel"], step=length))
    for slave in (one, other):
        slave.begin()
    names = [f"angle.{inertia.name}" for inertia in model.inertias]
    torque = [other["element_torque.clutch"]]
    angles = []
    for k in range(2 * steps):
        one["torque.flywheel"] = -torque[-1]
        one["torque_rate.flywheel"] = 0.0 if k == 0 else -(torque[-1] - torque[-2]) / length
        assert one.step(k * length, length)
        other["speed.flywheel"] = one["velocity.flywheel"]
        assert other.step(k * length, length)
        torque.append(other["element_torque.clutch"])
        angles.append([one[names[0]], *(other[name] for name in names[1:])])
    run = gr.simulate(model, cycles=2, samples_per_cycle=steps, discard=0)
    want = run.data["angle"].to_numpy()[1:] - gr.equilibrium(model).angle[0]
    error = np.abs(np.array(angles) - want).max()
    assert error < {100: 4e-4, 400: 3e-5}[steps]


def test_scripts_of_two_fmus_have_names_of_their_own(tmp_path: Path, version: str) -> None:
    scripts = set()
    for folder, model in (("a", "case3"), ("b", "case2")):
        (tmp_path / folder).mkdir()
        fmu = gr.export_fmu(gr.example(model), tmp_path / folder / "x.fmu", version)
        with zipfile.ZipFile(fmu.path) as archive:
            scripts.add(archive.read("resources/slavemodule.txt"))
    assert len(scripts) == 2
    assert module._identifier("1 class") == "m_1_class"
    assert module._identifier("class") == "m_class"
