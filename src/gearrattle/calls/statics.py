"""Static equilibrium and modes of a model, with its names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import assemble, elements_of
from gearrattle.errors import ModelError, Problem
from gearrattle.linear import equilibrium as statics
from gearrattle.linear import modes as modal
from gearrattle.model import Model
from gearrattle.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Equilibrium:
    """Static equilibrium under the mean loads.

    Attributes:
        angle: (n,) [rad]; the last inertia of every free train at zero.
        deflection: by element name [rad or m].
        region: by name of every element with a corner.
        acceleration: (n,) uniform acceleration of trains whose mean torques do not balance [rad/s^2].
        notes: what the user must know.
    """

    angle: Array
    deflection: dict[str, float]
    region: dict[str, int]
    acceleration: Array
    notes: tuple[str, ...]


@dataclass(frozen=True)
class Modes:
    """Natural modes.

    Attributes:
        frequencies: (n,) [rad/s], ascending; 0 for rigid motion.
        damping_ratios: (n,); NaN for rigid motion.
        shapes: (n inertias, n modes), largest entry of each mode 1.
        inertia_names: (n,).
    """

    frequencies: Array
    damping_ratios: Array
    shapes: Array
    inertia_names: tuple[str, ...]


def element_names(model: Model) -> list[str]:
    """Couplings, then meshes."""
    return [element.name for element in elements_of(model)]


def equilibrium(model: Model) -> Equilibrium:
    """Static equilibrium under the mean loads, transmission errors at zero.

    Args:
        model: the driveline.

    Returns:
        Angles, deflections and regions by name, and what must be noted.

    Raises:
        ModelError: an element of zero last slope cannot carry its load; it is named.
    """
    return named_equilibrium(model, assemble(model))[0]


def named_equilibrium(model: Model, system: PiecewiseSystem) -> tuple[Equilibrium, statics.Equilibrium]:
    """The same with names, and as the mathematics has it."""
    names = element_names(model)
    try:
        rest = statics.equilibrium(system)
    except statics.Runaway as runaway:
        which = ", ".join(names[k] for k in runaway.elements)
        problem = Problem(
            f"elements {which}",
            "a mean load",
            "the last stage has no stiffness and cannot carry it: no static equilibrium",
            'balance the mean torques, give the last stage a stiffness, or start from initial = "zero"',
        )
        raise ModelError(problem) from None
    notes = []
    moving = np.flatnonzero(rest.acceleration)
    if moving.size:
        largest = rest.acceleration[moving[np.argmax(np.abs(rest.acceleration[moving]))]]
        notes.append(
            f"the mean torques do not balance: the train with {model.inertias[moving[0]].name} accelerates uniformly "
            f"(up to {largest:.6g} rad/s^2); the equilibrium is that of the accelerated train."
        )
    notes += [f"{names[k]}: the free gap carries no load and is taken at its middle." for k in rest.middled]
    region = {names[k]: rest.pieces[k] + system.laws[k].first_label for k in system.clearances}
    deflection = dict(zip(names, rest.deflection.tolist(), strict=True))
    return Equilibrium(rest.angle, deflection, region, rest.acceleration, tuple(notes)), rest


def modes(
    model: Model, contact_ratio: Mapping[str, float] | None = None, region: Mapping[str, int] | None = None
) -> Modes:
    """Undamped natural frequencies, damping ratios and shapes.

    Args:
        model: the driveline.
        contact_ratio: Gamma by element name: the slope becomes Gamma K, K the slope of the last drive stage (it
            multiplies stiffness only; sec. 6 of Padmanabhan et al. 1995).
        region: region label by element name; elements in neither mapping are in their last drive stage.

    Raises:
        ModelError: a name no element has, a ratio outside 0 ... 1, a region the element does not have.
    """
    system = assemble(model)
    data = modal.modes(system, *slopes(model, system, contact_ratio, region))
    return Modes(data.frequencies, data.damping_ratios, data.shapes, tuple(i.name for i in model.inertias))


def slopes(
    model: Model,
    system: PiecewiseSystem,
    contact_ratio: Mapping[str, float] | None,
    region: Mapping[str, int] | None,
) -> tuple[Array, Array]:
    """(m,) slope and (m,) damping of every element; arguments and errors as of ``modes``."""
    names = element_names(model)
    contact_ratio, region = dict(contact_ratio or {}), dict(region or {})
    problems = [
        Problem(f"{kind}: {name}", name, f"there is no such element; there are {', '.join(names)}")
        for kind, given in (("contact_ratio", contact_ratio), ("region", region))
        for name in given
        if name not in names
    ]
    problems += [
        Problem(f"contact_ratio: {name}", f"{ratio}", "must lie between 0 and 1")
        for name, ratio in contact_ratio.items()
        if not 0 <= ratio <= 1
    ]
    stiffness, damping = np.empty(len(names)), np.empty(len(names))
    for k, (name, law) in enumerate(zip(names, system.laws, strict=True)):
        piece = region[name] - law.first_label if name in region else law.pieces - 1
        if not 0 <= piece < law.pieces:
            labels = f"{law.first_label} ... {law.first_label + law.pieces - 1}"
            problems.append(Problem(f"region: {name}", str(region[name]), f"must be one of {labels}"))
            continue
        stiffness[k], damping[k] = law.stiffness[piece] * contact_ratio.get(name, 1.0), law.damping[piece]
    if problems:
        raise ModelError(problems)
    return stiffness, damping
