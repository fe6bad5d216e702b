"""Torques of Hooke joints on their driving shafts: the mean load times the slope of the joint's error.

A joint passes a load T on and takes T (1 - de/dphi), so -T de/dphi is taken from the driving shaft beside T: with the
mean load for T it is a sum of sines. The mean load is that of the static equilibrium; along a sweep, that of the
first speed.

Takes a Model; gives sines of torque by body.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gearrattle.assembly.elements import inertia_of, law_of, rows_of
from gearrattle.assembly.means import mean_torques
from gearrattle.assembly.period import period_of
from gearrattle.assembly.prescribed import free_of
from gearrattle.engine.system.equilibrium import Runaway, equilibrium
from gearrattle.engine.system.piecewise import Harmonics, PiecewiseSystem
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Harmonic, Model
from gearrattle.remember import kept


@kept
def load_ripples(model: Model) -> Mapping[str, tuple[Harmonic, ...]]:
    """Return the torques on the driving shafts, amplitude sin(order Omega t + phase) [N m], by body.

    Raises
    ------
    ModelError
        no static equilibrium, so that a joint has no mean load.
    """
    joints = [k for k, element in enumerate(model.elements) if element.load_ripple]
    if not joints:
        return {}
    system = _at_rest(model)
    try:
        rest = equilibrium(system)
    except Runaway:
        joint = model.elements[joints[0]]
        rule = "a Hooke joint acts back with its mean load, and there is no static equilibrium"
        remedy = "balance the mean torques, or give every last stage a stiffness"
        raise ModelError(Problem(f"{joint.path}.hooke", "", rule, remedy)) from None
    ripples: dict[str, tuple[Harmonic, ...]] = {}
    for k in joints:
        element, load = model.elements[k], system.laws[k].elastic(float(rest.deflection[k]))
        sines = (h.model_copy(update={"amplitude": load * h.amplitude}) for h in element.load_ripple)
        ripples[element.between[0]] = (*ripples.get(element.between[0], ()), *sines)
    return ripples


def _at_rest(model: Model) -> PiecewiseSystem:
    """The driveline under its mean loads alone."""
    free, rows = free_of(model), rows_of(model)
    none = np.zeros((len(free), 0)), np.zeros((len(free), 0)), np.zeros((len(rows), 0)), np.zeros((len(rows), 0))
    return PiecewiseSystem(
        inertia=inertia_of(model)[free],
        drag=np.array([model.inertias[i].drag for i in free]),
        rows=rows[:, free],
        laws=tuple(law_of(element) for element in model.elements),
        inputs=Harmonics(period_of(model).period, np.zeros(0), mean_torques(model)[free], *none),
    )
