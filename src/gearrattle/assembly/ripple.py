"""Torques of Hooke joints on their driving shafts: the mean load times the slope of the joint's error.

A joint that transmits a load T takes the torque T (1 - de/dphi) from its driving shaft: T and the further torque
-T de/dphi. With the mean load for T, this is a sum of sines. The mean load is the load in the static equilibrium; along
a sweep, at the first speed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from gearrattle.assembly.means import mean_loads
from gearrattle.assembly.prescribed_motion import columns_of
from gearrattle.assembly.unloaded import unloaded
from gearrattle.derived_values import kept
from gearrattle.engine.system.equilibrium import Runaway, equilibrium
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Harmonic, Model


@kept
def load_ripples(model: Model) -> Mapping[str, tuple[Harmonic, ...]]:
    """Return the torques on the driving shafts, amplitude sin(order Omega t + phase) [N m], by body.

    ModelError for a model without static equilibrium, which determines the mean loads of the joints.
    """
    joints = [k for k, element in enumerate(model.elements) if element.load_ripple]
    if not joints:
        return {}
    system = unloaded(model)
    loaded = replace(system.inputs, mean=mean_loads(model)[columns_of(model)])
    try:
        rest = equilibrium(replace(system, inputs=loaded))
    except Runaway:
        joint = model.elements[joints[0]]
        rule = "a Hooke joint acts back with its mean load, and there is no static equilibrium"
        remedy = 'balance the mean torques (mean = "balance"), or give every last stage a stiffness'
        raise ModelError(Problem(f"{joint.path}.hooke", "", rule, remedy)) from None
    ripples: dict[str, tuple[Harmonic, ...]] = {}
    for k in joints:
        element = model.elements[k]
        load = system.laws[k].elastic(float(rest.deflection[k]))
        sines = (h.model_copy(update={"amplitude": load * h.amplitude}) for h in element.load_ripple)
        ripples[element.between[0]] = (*ripples.get(element.between[0], ()), *sines)
    return ripples
