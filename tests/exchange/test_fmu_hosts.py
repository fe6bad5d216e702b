"""FMUs in FMPy, a host in Python: valid, the bits of the driveline without a host, a hundred at once (`make hosts`)."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import period_of
from gearrattle.simulation.co_simulation import CoSimulation
from gearrattle.simulation.co_simulation_ports import Ports
from tests.exchange.fmus import LIBRARIES, parts_of

pytestmark = pytest.mark.slow
pytest.importorskip("fmpy")

HOST = """
import json, sys
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

class Host:
    def __init__(self, path, count=1):
        about = read_model_description(path)
        self.is_new = about.fmiVersion == "3.0"
        folder = extract(path)
        self.vr = {v.name: v.valueReference for v in about.modelVariables}
        kind = FMU3Slave if self.is_new else FMU2Slave
        name = about.coSimulation.modelIdentifier
        self.all = [kind(guid=about.guid, unzipDirectory=folder, modelIdentifier=name, instanceName=f"i{i}")
                    for i in range(count)]
        for one in self.all:
            one.instantiate()
            if not self.is_new:
                one.setupExperiment()
            one.enterInitializationMode()
            one.exitInitializationMode()

    def get(self, i, names):
        one = self.all[i]
        return (one.getFloat64 if self.is_new else one.getReal)([self.vr[name] for name in names])

    def set(self, i, **values):
        one = self.all[i]
        names = [self.vr[name.replace("__", ".")] for name in values]
        (one.setFloat64 if self.is_new else one.setReal)(names, list(values.values()))

    def step(self, i, now, length):
        self.all[i].doStep(currentCommunicationPoint=now, communicationStepSize=length)

def answer(value):
    print(json.dumps(value), flush=True)

def resident():
    return int(open("/proc/self/statm").read().split()[1]) * 4096
"""


@pytest.fixture(params=tuple(LIBRARIES))
def version(request: pytest.FixtureRequest) -> str:
    pytest.importorskip(LIBRARIES[request.param])
    return str(request.param)


def hosted(script: str, *arguments: object) -> object:
    """Return what a script in a process of its own answers; how the process ends does not count.

    With FMI 3.0 it may abort at its end, after all is done: pythonfmu3 ends the interpreter a second time.
    """
    words = [json.dumps(argument) for argument in arguments]
    done = subprocess.run([sys.executable, "-c", HOST + script, *words], capture_output=True, text=True, check=False)
    assert done.stdout, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_it_is_valid(version: str, tmp_path: Path) -> None:
    path = tmp_path / "x.fmu"
    gr.export_fmu(gr.example("planetary_set"), path, version, audit=True)
    script = "from fmpy.validation import validate_fmu\nanswer(validate_fmu(json.loads(sys.argv[1])))"
    assert hosted(script, str(path)) == []


def test_the_bits_without_a_host(version: str, tmp_path: Path) -> None:
    """Torque and rate of every step, and a state that is serialised and goes into another instance."""
    path = tmp_path / "x.fmu"
    model = gr.example("case3")
    length = period_of(model).period / 10
    gr.export_fmu(model, path, version, torques=["flywheel"], step=length)
    torque = (5.0 * np.sin(0.7 * np.arange(101))).tolist()
    names = [f"{kind}.{inertia.name}" for kind in ("angle", "acceleration") for inertia in model.inertias]
    script = """
path, length, torque, names = map(json.loads, sys.argv[1:])
host = Host(path, 2)
rows = []
for k in range(100):
    if k == 50:
        one, other = host.all
        if host.is_new:
            state = one.serializeFMUState(one.getFMUState())
            other.setFMUState(other.deserializeFMUState(state))
        else:
            state = one.serializeFMUstate(one.getFMUstate())
            other.setFMUstate(other.deSerializeFMUstate(state))
    i = int(k >= 50)
    host.set(i, torque__flywheel=torque[k], torque_rate__flywheel=(torque[k + 1] - torque[k]) / length)
    host.step(i, k * length, length)
    rows.append(host.get(i, names))
answer(rows)
"""
    under_way = CoSimulation(model, Ports(torques=("flywheel",)), length)
    want = []
    for k in range(100):
        under_way.inputs[0] = torque[k], (torque[k + 1] - torque[k]) / length
        under_way.step(k * length + length)
        want.append([*under_way.now.angle.tolist(), *under_way.now.acceleration.tolist()])
    assert hosted(script, str(path), length, torque, names) == want


def test_a_hundred_at_once(version: str, tmp_path: Path) -> None:
    """Every instance has its own motion, and steps take no memory."""
    path = tmp_path / "x.fmu"
    model = gr.example("case3")
    fmu = gr.export_fmu(model, path, version, torques=["flywheel"])
    script = """
path, length = map(json.loads, sys.argv[1:])
host = Host(path, 100)
for i in range(100):
    host.set(i, torque__flywheel=0.1 * i)
sizes = []
for part in range(4):
    for k in range(20 * part, 20 * part + 20):
        for i in range(100):
            host.step(i, k * length, length)
    sizes.append(resident())
answer([[host.get(i, ["velocity.flywheel"])[0] for i in range(100)], sizes])
"""
    speeds, sizes = hosted(script, str(path), fmu.step)
    under_way = CoSimulation(model, Ports(torques=("flywheel",)), fmu.step)
    for i in (0, 1, 50, 99):
        under_way.inputs[0] = 0.1 * i, 0.0
        under_way.begin()
        for k in range(80):
            under_way.step(k * fmu.step + fmu.step)
        assert speeds[i] == under_way.now.velocity[0]
    assert sizes[-1] - sizes[0] < 4e6


def test_two_in_one_host(version: str, tmp_path: Path) -> None:
    """Two FMUs in one process, coupled at a hundredth of a period, against the whole driveline."""
    model = gr.example("case1_loaded").with_({"simulation.initial": "static"})
    flywheel, rest = parts_of(model)
    length = period_of(model).period / 100
    paths = [tmp_path / "flywheel.fmu", tmp_path / "rest.fmu"]
    gr.export_fmu(flywheel, paths[0], version, step=length)
    gr.export_fmu(rest, paths[1], version, speeds=["flywheel"], step=length)
    script = """
first, second, length = map(json.loads, sys.argv[1:])
one, other = Host(first), Host(second)
torque = [other.get(0, ["element_torque.clutch"])[0]]
angles = []
for k in range(200):
    rate = 0.0 if k == 0 else (torque[-1] - torque[-2]) / length
    one.set(0, torque__flywheel=-torque[-1], torque_rate__flywheel=-rate)
    one.step(0, k * length, length)
    other.set(0, speed__flywheel=one.get(0, ["velocity.flywheel"])[0])
    other.step(0, k * length, length)
    torque += other.get(0, ["element_torque.clutch"])
    angles.append(other.get(0, ["angle.hub", "angle.output_gear"]))
answer(angles)
"""
    angles = np.array(hosted(script, *map(str, paths), length))
    run = gr.simulate(model, cycles=2, samples_per_cycle=100, discard=0)
    want = run.data["angle"].sel(inertia=["hub", "output_gear"]).to_numpy()[1:] - gr.equilibrium(model).angle[0]
    assert np.abs(angles - want).max() < 4e-4
