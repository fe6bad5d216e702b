"""Notes on the drag parts of a model: laws outside their range, constants without a source, parts at rest."""

from __future__ import annotations

from collections.abc import Iterator

from gearrattle.model import Model
from gearrattle.model.drag_points import DragPoint, drag_points
from gearrattle.wording import quantity


def drag_notes(model: Model) -> tuple[str, ...]:
    """Return the notes without repetitions."""
    points = drag_points(model)
    if not points:
        return ()
    notes = list[str]() if model.oil is None else list(model.oil.notes())
    for point in points:
        notes += _of_point(model, point)
    return tuple(dict.fromkeys(notes))


def _of_point(model: Model, point: DragPoint) -> Iterator[str]:
    """Yield the notes on one part."""
    if not point.part.is_checked:
        yield f"{point.part.noun} is by {point.part.source}: {point.part.law_error}"
    if not point.torque and not point.slope and abs(point.speed) < 1e-6 * model.excitation.omega:
        yield f"{point.part.noun} of {point.body}: it turns with {point.on}, and has no drag there"
        return
    for limit in point.part.limits(abs(point.speed), model.oil):
        yield f"{point.part.noun} of {point.body}: {limit}"
    if point.against < 0.0:
        torque = quantity(point.torque, "N m" if model.units == "SI" else "")
        yield f"{point.part.noun} of {point.body}: {point.on} is faster, and drives it with {torque}"
