"""Screening of a study file: the same speeds and loads, by the threshold instead of by simulation.

A grid with one axis that is ``excitation.speed`` alone, and at most one other, the load; ``fixed`` values hold for all
cases. Outputs concern the simulations alone and are ignored.
"""

from __future__ import annotations

from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.table import listed
from gearrattle.studies.screening import LOAD
from gearrattle.studies.study_axes import axes_of
from gearrattle.studies.study_file import StudyFile

_SPEED = "excitation.speed"
_REMEDY = "give speeds and loads beside the model file instead"


def screening_of(asked: StudyFile, location: str) -> tuple[Model, list[float], dict[str, list[Any]] | None]:
    """Return the model with its fixed values, the speeds [rad/s], and the loads by path; None without a load.

    ModelError: another kind of study, values that scatter, no axis of the speed alone, more than two axes; or what the
    model refuses.
    """
    if asked.spec.kind != "grid":
        rule = f'a screening takes a study of the kind "grid", and this one is "{asked.spec.kind}"'
        raise ModelError(Problem(f"{location}: kind", asked.spec.kind, rule, _REMEDY))
    arguments = asked.arguments
    if arguments["vary"]:
        rule = "a screening has speeds and loads, and nothing that scatters"
        raise ModelError(Problem(f"{location}: vary", listed(list(arguments["vary"])), rule, "leave vary out"))
    model = arguments["model"].with_(dict(arguments["fixed"])) if arguments["fixed"] else arguments["model"]
    axes = axes_of(arguments["axes"], model)
    speeds = [axis for axis in axes if list(axis.values) == [_SPEED]]
    others = [axis for axis in axes if axis not in speeds]
    if len(speeds) != 1:
        names = listed([axis.name for axis in axes]) or "none"
        rule = f"a screening needs an axis of {_SPEED} alone"
        raise ModelError(Problem(f"{location}: axis", names, rule, f'"{_SPEED}" = ["800 rpm", "1200 rpm"]'))
    if len(others) > 1:
        rule = "a screening has one axis of loads beside the speed"
        remedy = f"name their paths in one axis, [axis.{LOAD}]"
        raise ModelError(Problem(f"{location}: axis", listed([axis.name for axis in others]), rule, remedy))
    loads = others[0].requested() if others else None
    return model, list(speeds[0].values[_SPEED]), loads
