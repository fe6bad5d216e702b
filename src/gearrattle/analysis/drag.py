"""The drag of a model by its parts, at its operating point: the public call."""

from __future__ import annotations

from gearrattle.model import Model, check_model
from gearrattle.model.drag_points import DragPoint
from gearrattle.model.drag_points import drag_points as points_of


def drag_points(model: Model) -> tuple[DragPoint, ...]:
    """Return every part of the drag of a model at its operating point.

    Parameters
    ----------
    model
        of any kind; without ``drag_parts`` there are none.

    Returns
    -------
    tuple[DragPoint, ...]
        In the order of the file, each with ``body``, ``on``, ``path``, relative mean ``speed`` [rad/s], ``torque``
        [N m] and ``slope`` [N m s/rad], at the reference speed of the model; along a sweep, at the middle of it.

    Raises
    ------
    ModelError
        nothing settles the mean speed of a body, or a measured table does not cover the speed or the temperature.

    Examples
    --------
    >>> import gearrattle as gr
    >>> model = gr.example("idle_rattle_oil")
    >>> needle = gr.drag_points(model)[3]
    >>> needle.path, round(needle.torque, 4)
    ('inertia.second_gear.drag_parts.0', 0.0498)
    """
    check_model(model)
    return points_of(model)
