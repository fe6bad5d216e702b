"""Steady model for linear analyses and forecasts: its only inputs are means and harmonics of one speed.

A sweep is replaced by its first speed, a recorded torque by its mean, a torque with ramps by its value before them; an
inertia with a recorded motion is held at rest. ``unsteady_inputs`` lists the inputs that are removed. Harmonics of a
prescribed motion remain: they are errors of the elements at the inertia.
"""

from __future__ import annotations

from typing import Any

from gearrattle.assembly.means import mean_torque
from gearrattle.derived_values import kept
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.balance import BALANCE


def unsteady_inputs(model: Model) -> tuple[str, ...]:
    """Return the inputs that ``steady`` removes, one phrase for every input; none if all are harmonics of one speed."""
    notes = [f"the torque record on {torque.on} counts as its mean" for torque in model.torques if torque.signal]
    notes += [f"the ramps of the torque on {torque.on} are left out" for torque in model.torques if torque.ramps]
    notes += [f"{motion.on} is held fast" for motion in model.motions if motion.signal is not None]
    if model.excitation.sweep is not None:
        notes.append("the sweep counts as its first speed")
    return tuple(notes)


def is_driven_over_time(model: Model) -> bool:
    """Whether a torque has ramps or is a record: then the motion is an event, and averages have little meaning."""
    return any(torque.ramps or torque.signal is not None for torque in model.torques)


@kept
def steady(model: Model) -> Model:
    """The model at one speed under harmonics and means; the same object if it is steady already."""
    changes: dict[str, Any] = {}
    if model.excitation.sweep is not None:
        changes["excitation.speed"] = model.excitation.omega
    for index, torque in enumerate(model.torques):
        if torque.ramps:
            changes[f"torque.{index}.ramps"] = None
        if torque.signal is not None:
            changes[f"torque.{index}.signal"] = None
            if torque.mean != BALANCE:  # "balance" also works without the record
                changes[f"torque.{index}.mean"] = mean_torque(model, index)
    return model.with_(changes) if changes else model


def refuse_motions(model: Model, what: str) -> None:
    """Refuse a model with a prescribed motion; the ModelError says that ``what`` needs every inertia free."""
    if model.motions:
        rule = f"{what} needs every inertia free"
        raise ModelError(
            Problem("motion.0", f"a prescribed motion of {model.motions[0].on}", rule, "remove [[motion]]")
        )


def refuse_recorded_motions(model: Model, what: str) -> None:
    """Refuse a model with a recorded motion; the ModelError says that ``what`` needs harmonics."""
    recorded = [(i, motion) for i, motion in enumerate(model.motions) if motion.signal is not None]
    for i, motion in recorded:
        rule = f"{what} needs every inertia free, or its motion by harmonics"
        remedy = "remove [[motion]], or give harmonics"
        raise ModelError(Problem(f"motion.{i}", f"a record of the motion of {motion.on}", rule, remedy))


def refuse_unsteady(model: Model, what: str) -> None:
    """Refuse a model with inputs other than harmonics of one speed; the ModelError says that ``what`` needs inputs that
    repeat.
    """
    rule = f"{what} needs inputs that repeat every period"
    remedy = "give harmonics of one speed"
    if problems := unsteady_problems(model, rule, remedy):
        raise ModelError(problems)


def refuse_but_events(model: Model, what: str) -> None:
    """Refuse a model with inputs other than harmonics of one speed and torques over time; the ModelError says that
    ``what`` needs one speed.
    """
    events = {f"torque.{i}.ramps": None for i, torque in enumerate(model.torques) if torque.ramps}
    events |= {f"torque.{i}.signal": None for i, torque in enumerate(model.torques) if torque.signal is not None}
    refuse_unsteady(model.with_(events) if events else model, what)


def unsteady_problems(model: Model, rule: str, remedy: str) -> list[Problem]:
    """Return the inputs of a model other than harmonics of one speed as problems."""
    torques = [(f"torque.{i}", torque.on) for i, torque in enumerate(model.torques) if torque.signal is not None]
    ramps = [(f"torque.{i}.ramps", torque.on) for i, torque in enumerate(model.torques) if torque.ramps]
    motions = [(f"motion.{i}", motion.on) for i, motion in enumerate(model.motions) if motion.signal is not None]
    problems = [Problem(f"{path}.signal", f"a record on {on}", rule, remedy) for path, on in (*torques, *motions)]
    problems += [Problem(path, f"ramps of the torque on {on}", rule, remedy) for path, on in ramps]
    if model.excitation.sweep is not None:
        problems.append(Problem("excitation.sweep", "a sweep of the speed", rule, remedy))
    return problems
