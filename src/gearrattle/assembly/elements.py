"""The elements of a model in their one order, and the law of each.

Takes a Model; gives its couplings, then its meshes, and their piecewise-linear laws.
"""

from __future__ import annotations

from gearrattle.assembly.friction import is_parted
from gearrattle.model import Coupling, Mesh, Model
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
