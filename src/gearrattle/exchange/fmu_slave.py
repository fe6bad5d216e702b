"""What an FMU runs: a driveline as the slave of a host, in the Python of the host.

The script in an FMU (``fmu.export_fmu``) derives its class from ``DrivelineSlave`` and from the slave of pythonfmu (FMI
2.0) or pythonfmu3 (FMI 3.0). These call the methods here. None of them may raise: an exception that leaves a callback
makes the host crash later. What goes wrong is logged, and the step is refused.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Mapping
from functools import lru_cache, partial
from importlib import import_module
from math import nan
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from gearrattle.assembly import period_of
from gearrattle.errors import GearRattleError
from gearrattle.exchange.fmu_variables import UNITS, Variable, variables_of
from gearrattle.formats import check_format, version_of
from gearrattle.model import Model, loads
from gearrattle.simulation.co_simulation import CoSimulation
from gearrattle.simulation.co_simulation_ports import Ports

MODEL = "model.toml"
PORTS = "ports.json"
_SHOWN_PERIODS = 10  # length of the experiment that a host proposes
_INITIAL = "InitialUnknowns"
_MODELS_KEPT = 8


@lru_cache(maxsize=_MODELS_KEPT)
def _model(text: str) -> Model:
    """The model of a text: instances of one FMU share it, with all that follows from it."""
    return loads(text)


class DrivelineSlave:
    """A driveline with the callbacks of an FMU."""

    interface: str
    """2.0 or 3.0, set by the class in the FMU."""

    vars: Mapping[int, Any]
    log: Callable[..., None]
    register_variable: Callable[..., None]

    def __init__(self, **kwargs: Any) -> None:
        """Read the model and the ports from the resources of the FMU, and register all variables."""
        super().__init__(**kwargs)
        folder = Path(kwargs["resources"])
        self._fmi: Any = import_module("pythonfmu3" if self.interface == "3.0" else "pythonfmu")
        # the driveline at its start
        model = _model((folder / MODEL).read_text(encoding="utf-8"))
        settings = json.loads((folder / PORTS).read_text(encoding="utf-8"))
        check_format(settings.get("format", ""), folder / PORTS, "fmu")
        ports = Ports(*(tuple(settings[name]) for name in Ports._fields))
        self.motion = CoSimulation(model, ports, settings["step"], audit=settings["audit"])
        self._is_stale = False
        self._begin = 0.0
        # what a host reads first
        self.description = model.name
        self.default_experiment = self._fmi.DefaultExperiment(
            start_time=0.0, stop_time=_SHOWN_PERIODS * period_of(model).period, step_size=self.motion.length
        )
        for variable in variables_of(self.motion):
            self._register(variable)
        if self.interface == "3.0":
            self._register_time()

    # ---- variables

    def _register(self, variable: Variable) -> None:
        fmi = self._fmi
        number = "3" if self.interface == "3.0" else "2"
        causality, variability, initial = (
            getattr(fmi, f"Fmi{number}{kind}") for kind in ("Causality", "Variability", "Initial")
        )
        source = variable.source
        keys: dict[str, Any] = {"causality": causality[variable.causality], "description": _words(variable, number)}
        if variable.causality == "input":
            keys |= {"getter": partial(self._input, *source), "setter": partial(self._set_input, *source)}
            keys |= {"variability": variability.continuous}
        elif variable.causality == "parameter":
            keys |= {"getter": partial(self._value, *source), "setter": partial(self._set_value, *source)}
            keys |= {"variability": variability.tunable, "initial": initial.exact}
        else:
            getter = partial(self._output, *source) if source[1:] else self._residual
            keys |= {"getter": getter, "initial": initial.calculated}
            keys |= {"variability": variability.discrete if variable.is_whole else variability.continuous}
        kinds = ("Float64", "Int32") if number == "3" else ("Real", "Integer")
        if number == "3" and variable.unit:
            self.register_units([fmi.Unit(variable.unit, **UNITS[variable.unit])])  # type: ignore[attr-defined]
            keys["unit"] = variable.unit
        self.register_variable(getattr(fmi, kinds[variable.is_whole])(variable.name, **keys), nested=False)

    def _register_time(self) -> None:
        fmi = self._fmi
        keys = {"causality": fmi.Fmi3Causality.independent, "variability": fmi.Fmi3Variability.continuous}
        time = fmi.Float64("time", description="time", getter=lambda: self._begin + self.motion.time, **keys)
        self.register_variable(time, nested=False)

    def _input(self, channel: int, order: int) -> float:
        return float(self.motion.inputs[channel, order])

    def _set_input(self, channel: int, order: int, value: float) -> None:
        self.motion.inputs[channel, order] = value
        self._is_stale = True

    def _value(self, path: str) -> float:
        return self.motion.values[path]

    def _set_value(self, path: str, value: float) -> None:
        self.motion.values[path] = value
        self._is_stale = True

    def _output(self, kind: str, index: int) -> Any:
        if self._is_stale:
            self._settle()
        return getattr(self.motion.now, kind)[index]

    def _residual(self) -> float:
        """The relative residual of the energy balance; 0 before the first step."""
        try:
            energy = self.motion.energy()
        except Exception as error:
            self._report(error)
            return nan
        return 0.0 if energy is None else energy.relative_residual

    def _settle(self) -> None:
        """Take over new inputs and values; values that the model refuses are logged, and the last ones put back."""
        self._is_stale = False
        try:
            self.motion.settle()
        except Exception as error:
            self._report(error)

    # ---- callbacks

    def setup_experiment(self, start_time: float, *_: Any) -> None:
        """Take the host's time at the start: there the phases of all harmonics are those of the file."""
        self._begin = start_time

    def enter_initialization_mode(self) -> None:
        """Do nothing: values and inputs that are set take effect when an output is read, or with the first step."""

    def exit_initialization_mode(self) -> None:
        """Begin with the inputs and values that were set."""
        self._settle()

    def do_step(self, current_time: float, step_size: float) -> Any:
        """March to the end of a step; refuse it if that fails, without an exception."""
        try:
            self._is_stale = False
            self.motion.step(current_time + step_size - self._begin)
        except BaseException as error:
            self._report(error)
            return self._answer(done=False)
        return self._answer(done=True)

    def _answer(self, *, done: bool) -> Any:
        """The answer to a step: a status in FMI 3.0, whether it is done in FMI 2.0 (else it is discarded)."""
        if self.interface != "3.0":
            return done
        status = self._fmi.Fmi3Status
        return self._fmi.Fmi3StepResult(status=status.ok if done else status.discard)

    def _report(self, error: BaseException) -> None:
        """Log what went wrong."""
        kind = "" if isinstance(error, GearRattleError) else f"{type(error).__name__}: "
        status = import_module(f"{self._fmi.__name__}.enums")
        which = status.Fmi3Status if self.interface == "3.0" else status.Fmi2Status
        self.log(f"{kind}{error}", which.discard)

    def terminate(self) -> None:
        """Do nothing: a slave holds nothing but memory."""

    # ---- state

    def _get_fmu_state(self) -> dict[str, Any]:
        return self.motion.snapshot()

    def _set_fmu_state(self, state: Mapping[str, Any]) -> None:
        try:
            self.motion.restore(state)
            self._is_stale = False
        except Exception as error:
            self._report(error)

    @staticmethod
    def _fmu_state_to_bytes(state: Mapping[str, Any]) -> bytes:
        return json.dumps(_packed(state)).encode()

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        return {name: _unpacked(value) for name, value in json.loads(bytes(state).decode()).items()}

    # ---- description

    def to_xml(self, *arguments: Any) -> Element:
        """Return the model description, with what the library leaves out."""
        root: Element = super().to_xml(*arguments)  # type: ignore[misc]
        root.set("generationTool", f"gearrattle {version_of('gearrattle')}, {root.get('generationTool')}")
        structure = root.find("ModelStructure")
        if self.interface != "3.0" and structure is not None:
            unknowns = SubElement(structure, _INITIAL)
            for index, variable in enumerate(self.vars.values(), start=1):
                if variable.causality is self._fmi.Fmi2Causality.output:
                    SubElement(unknowns, "Unknown", attrib={"index": str(index)})
        return root


def _words(variable: Variable, number: str) -> str:
    """The description of a variable; in FMI 2.0, whose library knows no units, with its unit."""
    return f"{variable.words} [{variable.unit}]" if variable.unit and number == "2" else variable.words


def _packed(value: Any) -> Any:
    """Arrays as type, shape and bytes, in tables of any depth."""
    if isinstance(value, Mapping):
        return {name: _packed(inner) for name, inner in value.items()}
    array = np.asarray(value)
    return [array.dtype.str, array.shape, base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()]


def _unpacked(value: Any) -> Any:
    """The arrays that ``_packed`` wrote."""
    if isinstance(value, Mapping):
        return {name: _unpacked(inner) for name, inner in value.items()}
    kind, shape, text = value
    return np.frombuffer(base64.b64decode(text), np.dtype(kind)).reshape(shape).copy()
