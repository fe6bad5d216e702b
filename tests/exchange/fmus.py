"""FMUs for tests, and their slaves without a host: the script of an FMU, run in this Python."""

from __future__ import annotations

import importlib.util
import json
import zipfile
from pathlib import Path
from typing import Any

import gearrattle as gr
from gearrattle.exchange.fmu import Fmu

LIBRARIES = {"3.0": "pythonfmu3", "2.0": "pythonfmu"}


def resources_of(fmu: Fmu) -> Path:
    """Return the folder of an FMU's resources, unpacked beside it."""
    folder = fmu.path.with_suffix("")
    with zipfile.ZipFile(fmu.path) as archive:
        archive.extractall(folder)
    return folder / "resources"


class Slave:
    """A slave with its variables by name, as a host sees it."""

    def __init__(self, fmu: Fmu, start: float = 0.0) -> None:
        folder = resources_of(fmu)
        script = (folder / "slavemodule.txt").read_text()
        spec = importlib.util.spec_from_file_location(script, folder / f"{script}.py")
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        made = getattr(module, script.rpartition("_")[0])
        self.slave: Any = made(instance_name="one", resources=str(folder))
        self.by_name = {variable.name: variable for variable in self.slave.vars.values()}
        self.start = start

    def begin(self) -> None:
        self.slave.setup_experiment(self.start, None, None)
        self.slave.enter_initialization_mode()
        self.slave.exit_initialization_mode()

    def __getitem__(self, name: str) -> Any:
        return self.by_name[name].getter()

    def __setitem__(self, name: str, value: float) -> None:
        self.by_name[name].setter(value)

    def step(self, current: float, length: float) -> bool:
        """Take a step; return whether it was accepted."""
        answer = self.slave.do_step(current, length)
        return answer if isinstance(answer, bool) else answer.status == 0


def ports_in(fmu: Fmu) -> dict[str, Any]:
    """Return the ports that an FMU holds."""
    return json.loads((resources_of(fmu) / "ports.json").read_text())


def parts_of(whole: gr.Model) -> tuple[gr.Model, gr.Model]:
    """Return the flywheel alone, and the whole driveline, whose flywheel a host can turn."""
    tables = whole.to_tables()
    flywheel = {
        "schema": 1,
        "name": "flywheel",
        "inertia": [tables["inertia"][0]],
        "excitation": tables["excitation"],
        "torque": [row for row in tables["torque"] if row["on"] == "flywheel"],
        "simulation": {"initial": "zero"},
    }
    return gr.Model.from_tables(flywheel), whole
