"""The drag parts of a model at their operating points: their relative mean speed, torque and slope.

Mean speeds follow from the reference speed and the radii (``gearrattle.mean_speeds``). A part at rest, such as the
needle bearing of a gear that is coupled to its shaft, has no torque and no slope.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple, Protocol

from gearrattle.derived_values import kept
from gearrattle.errors import ModelError, Problem
from gearrattle.model.components.component import Component, Element, Piece
from gearrattle.model.value_kinds import GROUND

if TYPE_CHECKING:
    from gearrattle.model.drag_parts import Drag, DragPart
    from gearrattle.model.excitation import Excitation, Motion, Torque
    from gearrattle.model.inertia import Inertia
    from gearrattle.model.oil import Oil

_AT_REST = 1e-9  # share of the reference speed, below which a part is at rest


class Dragged(Protocol):
    """The attributes of a model that this module reads."""

    inertias: tuple[Inertia, ...]
    torques: tuple[Torque, ...]
    motions: tuple[Motion, ...]
    excitation: Excitation
    oil: Oil | None

    @property
    def components(self) -> Mapping[str, Component]:
        """All components by their path."""
        ...


class DragPoint(NamedTuple):
    """A drag part at its operating point.

    Attributes
    ----------
    body, on
        names of the two bodies; ``on`` may be "ground".
    path
        of the part in the file.
    speed
        mean speed of ``body`` minus mean speed of ``on`` [rad/s].
    torque
        drag torque against the relative rotation [N m].
    slope
        derivative of the torque by the relative speed [N m s/rad].
    """

    body: str
    on: str
    path: str
    part: DragPart
    speed: float
    torque: float
    slope: float

    @property
    def against(self) -> float:
        """Torque against the rotation of ``body`` [N m]; negative if the part drives it."""
        return math.copysign(self.torque, self.speed)


@kept
def drag_points(model: Dragged) -> tuple[DragPoint, ...]:
    """Return every part of the drag at the reference speed of the model; along a sweep, at its middle."""
    sweep = model.excitation.sweep
    return points_at(model, model.excitation.omega if sweep is None else 0.5 * (sweep.begin + sweep.end))


def has_drag_parts(model: Dragged) -> bool:
    """Whether any body has drag parts."""
    return any(inertia.drag_parts for inertia in model.inertias)


def points_at(model: Dragged, omega: float) -> tuple[DragPoint, ...]:
    """Return every part of the drag at a reference speed [rad/s]; ModelError for a part whose speed nothing settles."""
    if not has_drag_parts(model):
        return ()
    ratios = dict(zip((inertia.name for inertia in model.inertias), _ratios(model), strict=True)) | {GROUND: 0.0}
    points = []
    problems = []
    for inertia in model.inertias:
        for index, part in enumerate(inertia.drag_parts):
            path = f"inertia.{inertia.name}.drag_parts.{index}"
            speed = part.relative_speed
            if speed is None:
                speed = omega * (ratios[inertia.name] - ratios[part.on])
            if math.isnan(speed):
                problems.append(_unsettled(path, inertia.name if math.isnan(ratios[inertia.name]) else part.on))
                continue
            try:
                drag = _drag(model, part.at_reference(omega), speed, omega)
            except ModelError as error:
                problems += [replace(problem, place=f"{path}.{problem.place}") for problem in error.problems]
                continue
            points.append(DragPoint(inertia.name, part.on, path, part, speed, *drag))
    if problems:
        raise ModelError(problems)
    return tuple(points)


def _drag(model: Dragged, part: DragPart, speed: float, omega: float) -> Drag:
    """Return torque and slope of a part at a relative speed; none at rest."""
    from gearrattle.model.drag_parts import Drag

    if abs(speed) <= _AT_REST * omega:
        return Drag(0.0, 0.0)
    return part.at(abs(speed), model.oil)


def _unsettled(path: str, body: str) -> Problem:
    """Return the problem that no element determines the mean speed of a body."""
    rule = f"couplings and meshes do not settle the mean speed of {body}"
    return Problem(f"{path}.on", "", rule, 'give relative_speed, such as relative_speed = "800 rpm"')


def _ratios(model: Dragged) -> list[float]:
    """Mean speeds of all inertias over the reference speed; NaN where no element determines the mean speed."""
    import numpy as np  # imported here: a model without drag parts does not need it

    from gearrattle.mean_speeds import Kinematics, mean_speed_ratios

    names = [inertia.name for inertia in model.inertias]
    index = {**{name: i for i, name in enumerate(names)}, GROUND: -1}
    elements = component_elements(model)
    rows = np.zeros((len(elements), len(names)))
    for row, element in zip(rows, elements, strict=True):
        for body, factor in element.arms:
            row[index[body]] += factor
    kinematics = Kinematics(
        rows,
        np.array([[index[end] for end in e.between] for e in elements], dtype=np.int64).reshape(-1, 2),
        np.array([e.radii for e in elements], dtype=float).reshape(-1, 2),
        np.array([e.along_line for e in elements], dtype=np.bool_),
        np.array([any(piece.stiffness for piece in (*e.drive, *e.coast)) for e in elements], dtype=np.bool_),
    )
    ratios: list[float] = mean_speed_ratios(kinematics, reference_of(model)).tolist()
    return ratios


def reference_of(model: Dragged) -> int:
    """Return the index of the reference inertia: of the first motion, else of the first torque, else index 0."""
    driving = [*(motion.on for motion in model.motions), *(torque.on for torque in model.torques)]
    return [inertia.name for inertia in model.inertias].index(driving[0]) if driving else 0


def component_elements(model: Dragged) -> Sequence[Element]:
    """Return the elements of all components."""
    return [element for component in model.components.values() for element in component.elements()]


def drag_elements(model: Dragged) -> tuple[Element, ...]:
    """Return what drags between two bodies as elements: pure dampers, one for two bodies, named "gear-on-shaft"."""
    points = drag_points(model)
    ends = {damper_name(point.body, point.on): point for point in points}
    return tuple(_damper(ends[name], slope) for name, slope in damper_slopes(points).items())


def damper_name(body: str, on: str) -> str:
    """Name of the element that stands for the drag between two bodies."""
    return f"{body}-on-{on}"


def damper_slopes(points: Sequence[DragPoint]) -> dict[str, float]:
    """Return the damping between two bodies by the name of its element [N m s/rad]; without those that have none."""
    slopes: dict[str, float] = {}
    for point in points:
        if point.on != GROUND:
            name = damper_name(point.body, point.on)
            slopes[name] = slopes.get(name, 0.0) + point.slope
    return {name: slope for name, slope in slopes.items() if slope}


def _damper(point: DragPoint, slope: float) -> Element:
    """Return the damper between the two bodies of a point."""
    side = (Piece(0.0, slope, None),)
    return Element(
        name=damper_name(point.body, point.on),
        path=f"inertia.{point.body}.drag_parts",
        along_line=False,
        arms=((point.body, 1.0), (point.on, -1.0)),
        between=(point.body, point.on),
        radii=(1.0, 1.0),
        drive=side,
        coast=side,
    )
