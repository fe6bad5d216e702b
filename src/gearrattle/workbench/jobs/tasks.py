"""Tasks of the workbench: a task is a public function of gearrattle on a model.

The options of a task are the keyword arguments of the function in JSON types; a file is given by its name in the
workspace folder. A new task needs a line in ``TASKS``.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from gearrattle.model import Model
from gearrattle.workbench.job_inputs import moved
from gearrattle.workbench.kept_results import Growing

Progress = Callable[[float], None]


@dataclass(frozen=True)
class Task:
    """A public function that the workbench runs as a job.

    Attributes
    ----------
    files
        options whose value is the name of a file in the workspace folder, or tables with such names.
    fixed
        arguments that the workbench sets, by name.
    fills
        whether ``open_study`` can open the partial result while the task runs.
    grows
        whether the function reports partial results, of the same kind as its result.
    keeps_known
        whether the function returns a partial result if ``progress`` raises ``Cancelled``.
    """

    function: str
    files: tuple[str, ...] = ()
    fixed: Mapping[str, Any] | None = None
    fills: bool = False
    grows: bool = False
    keeps_known: bool = False

    def callable(self) -> Callable[..., Any]:
        """Return the function; it is imported now."""
        module, _, name = self.function.partition(":")
        function: Callable[..., Any] = getattr(import_module(module), name)
        return function

    def options(self) -> list[str]:
        """Return the names of its options."""
        names = list(inspect.signature(self.callable()).parameters)[1:]
        return [name for name in names if name not in _OWN and name not in (self.fixed or {})]


_OWN = (
    "progress",
    "phase",
    "output",
    "resume",
    "retry_failed",
    "scheduler",
    "function",
    "calibration",
    "prior",
    "so_far",
)
_HERE = {"workers": 1}
TASKS: dict[str, Task] = {
    "run": Task("gearrattle.pipeline:run"),
    "simulate": Task("gearrattle.simulation.simulate:simulate"),
    "advise": Task("gearrattle.advice:advise"),
    "modes": Task("gearrattle.analysis.statics:modes"),
    "equilibrium": Task("gearrattle.analysis.statics:equilibrium"),
    "stiffness": Task("gearrattle.analysis.stiffness:stiffness"),
    "reduce": Task("gearrattle.reductions.reduce:reduce"),
    "compare": Task("gearrattle.comparison.compare:compare"),
    "study": Task("gearrattle.studies:study", fixed=_HERE, fills=True),
    "conditions": Task("gearrattle.studies:conditions", fixed=_HERE, fills=True),
    "bifurcation": Task("gearrattle.studies:bifurcation", fixed=_HERE),
    "basins": Task("gearrattle.studies:basins", fixed=_HERE),
    "screen": Task("gearrattle.studies:screen", fixed=_HERE),
    "threshold": Task("gearrattle.design.threshold:threshold", fixed=_HERE, keeps_known=True),
    "remedies": Task("gearrattle.design.remedies:remedies", fixed={**_HERE, "keep": None}, keeps_known=True),
    "periodic": Task("gearrattle.orbits:periodic"),
    "continuation": Task("gearrattle.orbits:continuation", grows=True),
    "validate": Task("gearrattle.measured.validation:validate", files=("measurement",)),
    "fit": Task("gearrattle.identification:fit", files=("data",)),
}
"""Name of a task -> what it calls."""


def carry_out(
    task: str, model: Model, options: Mapping[str, Any], folders: tuple[Path, Path], progress: Progress
) -> Any:
    """Return the result of a task.

    The folders are that of the inputs, in which options name their files, and that in which what is computed is kept
    until all of it is there.
    """
    entry = TASKS[task]
    function = entry.callable()
    arguments = moved(options, entry.files, folders[0])
    arguments |= dict(entry.fixed or {}) | ({"output": folders[1]} if entry.fills else {})
    if entry.grows:
        arguments["so_far"] = Growing(folders[1])
    if "progress" in inspect.signature(function).parameters:
        arguments["progress"] = lambda fraction, *_: progress(float(fraction))
    return function(model, **arguments)
