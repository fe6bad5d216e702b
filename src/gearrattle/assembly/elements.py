"""The elements of a model in their one order, and the law of each.

A coupling's row of W is (+1, -1), a mesh's (+R_a, -R_b); ground has no column.

Takes a Model; gives its couplings, then its meshes, their rows and their piecewise-linear laws.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly.friction import is_parted
from gearrattle.model import GROUND, Coupling, Mesh, Model
from gearrattle.system.law import PiecewiseLaw, Stage, staged


def elements_of(model: Model) -> tuple[Coupling | Mesh, ...]:
    """All elements in element order."""
    return (*model.couplings, *model.meshes)


def law_of(element: Coupling | Mesh) -> PiecewiseLaw:
    """The element's piecewise-linear law."""
    drive = [Stage(p.stiffness, p.damping, p.until) for p in element.drive_pieces]
    coast = [Stage(p.stiffness, p.damping, p.until) for p in element.coast_pieces]
    preload = element.preload if isinstance(element, Coupling) else 0.0
    return staged(drive, coast, preload, parted=is_parted(element))


def rows_of(model: Model) -> NDArray[np.float64]:
    """(m, n) W over all inertias, those of prescribed motion too."""
    elements, names = elements_of(model), [inertia.name for inertia in model.inertias]
    rows = np.zeros((len(elements), len(names)))
    for k, element in enumerate(elements):
        ratio = element.radii if isinstance(element, Mesh) else (1.0, 1.0)
        for end, factor in zip(element.between, (ratio[0], -ratio[1]), strict=True):
            if end != GROUND:
                rows[k, names.index(end)] += factor
    return rows
