"""The law and the row of every element, and the inertia, drag and mass of every body."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly.drag_notes import drag_notes
from gearrattle.assembly.friction_sliders import is_parted
from gearrattle.assembly.sideways import mass_of, push_rows
from gearrattle.engine.system.law import PiecewiseLaw, Stage, staged
from gearrattle.model import Element, Model
from gearrattle.model.drag_points import drag_points


def law_of(element: Element) -> PiecewiseLaw:
    """The element's piecewise-linear law."""
    drive = [Stage(p.stiffness, p.damping, p.until) for p in element.drive]
    coast = [Stage(p.stiffness, p.damping, p.until) for p in element.coast]
    return staged(drive, coast, element.preload, parted=is_parted(element))


def inertia_of(model: Model) -> NDArray[np.float64]:
    """(n,) J of all inertias, with the inertia that components add [kg m^2]."""
    index = {inertia.name: i for i, inertia in enumerate(model.inertias)}
    inertia = np.array([body.J for body in model.inertias])
    for component in model.components.values():
        for body, more in component.added_inertia().items():
            inertia[index[body]] += more
    return inertia


def component_notes(model: Model) -> tuple[str, ...]:
    """Notes for the user on the components and the drag parts."""
    of_components = (note for component in model.components.values() for note in component.notes())
    return (*of_components, *drag_notes(model))


def decay_notes(model: Model) -> tuple[str, ...]:
    """A note that no vibration decays, for a driveline with elements but without damping, drag and friction."""
    pieces = [piece for element in model.elements for piece in (*element.drive, *element.coast)]
    prescribed = {motion.on for motion in model.motions}
    drags = [body.drag for body in model.inertias if body.name not in prescribed]
    drags += [point.slope for point in drag_points(model) if point.body not in prescribed]
    if not pieces or any(drags) or any(piece.damping or piece.hysteresis for piece in pieces):
        return ()
    return (
        "nothing decays: the driveline has no damping, no drag and no friction. What the start sets in motion stays, "
        "so that no steady state is reached, however many cycles are discarded.",
    )


def rows_of(model: Model) -> NDArray[np.float64]:
    """(m, n + p) W over all inertias, those of prescribed motion too, then over all directions."""
    index = {inertia.name: i for i, inertia in enumerate(model.inertias)}
    rows = np.zeros((len(model.elements), len(index)))
    for row, element in zip(rows, model.elements, strict=True):
        for body, factor in element.arms:
            row[index[body]] += factor
    return np.hstack([rows, push_rows(model)])


def system_inertia(model: Model, free: NDArray[np.int64]) -> NDArray[np.float64]:
    """J of the free inertias, then the mass of every direction."""
    return np.concatenate([inertia_of(model)[free], mass_of(model)])
