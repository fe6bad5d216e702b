"""Export of a driveline as an FMU for co-simulation (Functional Mock-up Interface 2.0 or 3.0).

The FMU holds the model, its ports and a few lines of Python; it runs in the Python of the host, where gearrattle must
be installed. Libraries: pythonfmu3 (FMI 3.0) and pythonfmu (FMI 2.0), the extra ``fmu``. They put their own code and
their shared library for Linux and Windows on x86-64 into the FMU.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from importlib import import_module
from keyword import iskeyword
from pathlib import Path
from typing import Any, get_args

from gearrattle.assembly import free_names
from gearrattle.errors import ModelError, NotInstalled, Problem
from gearrattle.exchange.fmu_slave import MODEL, PORTS
from gearrattle.exchange.fmu_variables import Causality, Variable, variables_of
from gearrattle.formats import format_name, version_of
from gearrattle.model import Model, check_model, units
from gearrattle.model.paths import expanded
from gearrattle.model.value_kinds import FLAG, Choice, Quantity, Texts, argument_problems
from gearrattle.simulation.co_simulation import CoSimulation
from gearrattle.simulation.co_simulation_ports import Ports
from gearrattle.writing import Staging, temporary_folder

VERSIONS = ("3.0", "2.0")
_LIBRARIES = {"3.0": "pythonfmu3", "2.0": "pythonfmu"}
_ALL_TORQUES = 8
"""Up to so many free inertias, every one takes a torque by default."""
_USUAL = ("torque.*.mean", "inertia.*.drag_torque", "mesh.*.backlash", "coupling.*.clearance")
"""Values that may change by default."""
_STEP = Quantity(units.TIME, "positive")
_DIGITS = 12  # of the digest in the name of the script
_FIRST_STEPS = 3  # taken while exporting, so that what they need is compiled
_SCRIPT = '''"""{title}: a driveline for co-simulation, written by gearrattle {release}."""

from {library} import {slave}

try:
    from gearrattle.exchange.fmu_slave import DrivelineSlave
except ImportError as error:
    raise ImportError(
        "this FMU needs gearrattle {release} in the Python of the host: pip install gearrattle"
    ) from error


class {identifier}(DrivelineSlave, {slave}):
    """The driveline as a slave."""

    interface = "{version}"

    def __init__(self, **arguments):
        super().__init__(**arguments)

    def do_step(self, current_time, step_size):
        return super().do_step(current_time, step_size)
'''
"""The script of an FMU.

pythonfmu 0.7.0 runs it once for every instance, and each time releases the dictionary of the module once too often:
with the fifth instance the host crashed. The methods here hold that dictionary, as the class of every instance stays.
"""


@dataclass(frozen=True)
class Fmu:
    """An FMU that was written.

    Attributes
    ----------
    path
        the file.
    version
        of the interface, "3.0" or "2.0".
    step
        communication step that it proposes to its host [s].
    variables
        all variables: inputs, parameters, outputs.

    Examples
    --------
    >>> from gearrattle.exchange.fmu import Fmu
    >>> Fmu("x.fmu", "3.0", 4e-4, ()).names("input")
    ()
    """

    path: Path
    version: str
    step: float
    variables: tuple[Variable, ...]

    def names(self, causality: Causality) -> tuple[str, ...]:
        """Return the names of all inputs, parameters or outputs."""
        return tuple(variable.name for variable in self.variables if variable.causality == causality)

    def to_dict(self) -> dict[str, Any]:
        """Return path, version, step and names, as ``gearrattle fmu --json`` prints them."""
        names = {f"{causality}s": list(self.names(causality)) for causality in get_args(Causality)}
        return {"fmu": str(self.path), "version": self.version, "step": self.step, **names}


def export_fmu(
    model: Model,
    path: str | os.PathLike[str],
    version: str = "3.0",
    *,
    torques: Sequence[str] | None = None,
    speeds: Sequence[str] = (),
    parameters: Sequence[str] | None = None,
    step: float | str | None = None,
    audit: bool = False,
) -> Fmu:
    """Write a driveline as an FMU for co-simulation, with the exact motion inside.

    The FMU runs in the Python of its host, where gearrattle must be installed. Its harmonics stay inside; torques and
    speeds from other models come in step by step.

    Parameters
    ----------
    model
        the driveline; its inputs are harmonics of one speed.
    path
        the file, ending in .fmu; one that exists is replaced.
    version
        of the Functional Mock-up Interface, "3.0" or "2.0".
    torques
        inertias that take a torque from outside, beside those of the model; by default all that are free, of more
        than eight those with a torque in the model and the last one.
    speeds
        inertias whose speed comes from outside: they are no degrees of freedom then.
    parameters
        values that the host may change, by path, with ``*`` for any text; by default mean torques, drag torques,
        backlash and clearances.
    step
        communication step that the FMU proposes: seconds, or a string with a unit; by default a hundredth of the
        period.
    audit
        whether the FMU audits its energy: one more output, the residual of the balance.

    Returns
    -------
    Fmu
        The file, and the names of its variables.

    Raises
    ------
    ModelError
        a model with inputs over time, unknown inertias or paths, no static equilibrium.
    NotInstalled
        the library of this version is not installed.
    OSError
        the machine refused; nothing half-written is left.

    Examples
    --------
    >>> fmu = gr.export_fmu(gr.example("case3"), "case3.fmu", torques=["flywheel"])
    >>> fmu.names("input")
    ('torque.flywheel', 'torque_rate.flywheel')
    """
    # the arguments
    check_model(model)
    is_plain = model.units == "dimensionless"
    arguments: dict[str, tuple[Any, Any]] = {"version": (Choice(VERSIONS), version), "audit": (FLAG, audit)}
    for name, value in (("torques", torques), ("speeds", speeds), ("parameters", parameters)):
        arguments |= {} if value is None else {name: (Texts('["flywheel"]'), value)}
    arguments |= {} if step is None else {"step": (_STEP, step)}
    problems = argument_problems(arguments, dimensionless=is_plain)
    target = Path(path)
    if target.suffix.lower() != ".fmu":
        problems.append(Problem(str(path), target.suffix or "no ending", "an FMU ends in .fmu", "name it so"))
    if target.is_dir():
        problems.append(Problem(str(path), "a folder", "the FMU is a file", "give another name"))
    if problems:
        raise ModelError(problems)
    builder = _builder(version)
    # the driveline under way; its first steps compile what an FMU needs
    ports = Ports(
        _usual_torques(model, speeds) if torques is None else tuple(torques),
        tuple(speeds),
        _paths(model, parameters),
    )
    motion = CoSimulation(model, ports, None if step is None else _STEP.read(step, is_plain), audit=audit)
    for k in range(_FIRST_STEPS):
        motion.step((k + 1) * motion.length)
    # the file
    with Staging(target.parent) as staging, temporary_folder() as folder:
        shutil.move(_built(builder, folder, target.stem, version, motion), staging.path / target.name)
        staging.commit()
    return Fmu(target, version, motion.length, variables_of(motion))


def _builder(version: str) -> Any:
    """The library that builds FMUs of a version; NotInstalled without it."""
    try:
        return import_module(_LIBRARIES[version]).FmuBuilder
    except ImportError:
        rule = f"needs {_LIBRARIES[version]}"
        raise NotInstalled(Problem("FMU", "", rule, "pip install 'gearrattle[fmu]'")) from None


def _usual_torques(model: Model, speeds: Sequence[str]) -> tuple[str, ...]:
    """The inertias that take a torque by default."""
    free = [name for name in free_names(model) if name not in speeds]
    if len(free) <= _ALL_TORQUES:
        return tuple(free)
    driven = {torque.on for torque in model.torques} | {free[-1]}
    return tuple(name for name in free if name in driven)


def _paths(model: Model, patterns: Sequence[str] | None) -> tuple[str, ...]:
    """The paths of the values that may change, each once."""
    if patterns is not None:
        return tuple(expanded(model.to_tables(), patterns))
    usual = [path for pattern in _USUAL for path in model.paths(pattern)]
    return tuple(path for path in usual if isinstance(model[path], float | int))


def _built(builder: Any, folder: Path, name: str, version: str, motion: CoSimulation) -> Path:
    """Build the FMU in a folder.

    name: of the file, from which the identifier of the model is made.
    """
    # resources: the model and its ports
    sources = folder / "sources"
    sources.mkdir()
    model = motion.original.to_toml()
    (sources / MODEL).write_text(model, encoding="utf-8")
    about = {"format": format_name("fmu"), **motion.ports._asdict(), "step": motion.length, "audit": motion.audit}
    settings = json.dumps(about)
    (sources / PORTS).write_text(settings, encoding="utf-8")
    # the script; its name is that of this FMU alone, as a host may load several into one Python
    identifier = _identifier(name)
    library = _LIBRARIES[version]
    text = _SCRIPT.format(
        title=identifier,
        release=version_of("gearrattle"),
        library=library,
        slave=f"Fmi{version[0]}Slave",
        identifier=identifier,
        version=version,
    )
    digest = sha256("\n".join([text, model, settings]).encode()).hexdigest()[:_DIGITS]
    script = folder / f"{identifier}_{digest}.py"
    script.write_text(text, encoding="utf-8")
    # the library imports the script, and leaves that behind
    can = {key: True for state in ("FMUState", "FMUstate") for key in (f"canGetAndSet{state}", f"canSerialize{state}")}
    can["canHandleVariableCommunicationStepSize"] = True  # pythonfmu3 0.3.4 writes false
    before = list(sys.path)
    try:
        return Path(builder.build_FMU(script, folder, [sources / MODEL, sources / PORTS], **can))
    finally:
        sys.path[:] = before
        sys.modules.pop(script.stem, None)


def _identifier(name: str) -> str:
    """A name as an identifier of C and of Python."""
    words = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return words if words[:1].isalpha() and not iskeyword(words) else f"m_{words}"
