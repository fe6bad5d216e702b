"""The law and the row of every element.

Takes a Model; gives its elements' rows and piecewise-linear laws.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly.friction import is_parted
from gearrattle.model import Element, Model
from gearrattle.system.law import PiecewiseLaw, Stage, staged


def law_of(element: Element) -> PiecewiseLaw:
    """The element's piecewise-linear law."""
    drive = [Stage(p.stiffness, p.damping, p.until) for p in element.drive]
    coast = [Stage(p.stiffness, p.damping, p.until) for p in element.coast]
    return staged(drive, coast, element.preload, parted=is_parted(element))


def rows_of(model: Model) -> NDArray[np.float64]:
    """(m, n) W over all inertias, those of prescribed motion too."""
    index = {inertia.name: i for i, inertia in enumerate(model.inertias)}
    rows = np.zeros((len(model.elements), len(index)))
    for row, element in zip(rows, model.elements, strict=True):
        for body, factor in element.arms:
            row[index[body]] += factor
    return rows
