"""What a study file asks of a screening: the same speeds and loads, by the threshold instead of by simulation.

A grid with one axis that is ``excitation.speed`` alone, and at most one other, the load; ``fixed`` values hold for all
cases. Outputs and their number are a matter of the simulations and left aside.

Takes a StudyFile; gives a Model, speeds and loads for ``screen``.
"""

from __future__ import annotations

from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.table import listed
from gearrattle.studies.axes import axes_of
from gearrattle.studies.file import StudyFile
from gearrattle.studies.screening import LOAD

_SPEED = "excitation.speed"
_REMEDY = "give speeds and loads beside the model file instead"


def screening_of(asked: StudyFile, place: str) -> tuple[Model, list[float], dict[str, list[Any]] | None]:
    """Return the model with its fixed values, the speeds [rad/s], and the loads by path; None without a load.

    Args:
        asked: from ``read_study``.
        place: of the file, for messages.

    Raises:
        ModelError: another kind of study, values that scatter, no axis of the speed alone, more than two axes; or
            what the model refuses.
    """
    if asked.spec.kind != "grid":
        rule = f'a screening takes a study of the kind "grid", and this one is "{asked.spec.kind}"'
        raise ModelError(Problem(f"{place}: kind", asked.spec.kind, rule, _REMEDY))
    given = asked.arguments
    if given["vary"]:
        rule = "a screening has speeds and loads, and nothing that scatters"
        raise ModelError(Problem(f"{place}: vary", listed(list(given["vary"])), rule, "leave vary out"))
    model = given["model"].with_(dict(given["fixed"])) if given["fixed"] else given["model"]
    axes = axes_of(given["axes"], model)
    speeds = [axis for axis in axes if list(axis.values) == [_SPEED]]
    others = [axis for axis in axes if axis not in speeds]
    if len(speeds) != 1:
        found = listed([axis.name for axis in axes]) or "none"
        rule = f"a screening needs an axis of {_SPEED} alone"
        raise ModelError(Problem(f"{place}: axis", found, rule, f'"{_SPEED}" = ["800 rpm", "1200 rpm"]'))
    if len(others) > 1:
        rule = "a screening has one axis of loads beside the speed"
        remedy = f"name their paths in one axis, [axis.{LOAD}]"
        raise ModelError(Problem(f"{place}: axis", listed([axis.name for axis in others]), rule, remedy))
    loads = {path: list(values) for path, values in others[0].values.items()} if others else None
    return model, list(speeds[0].values[_SPEED]), loads
