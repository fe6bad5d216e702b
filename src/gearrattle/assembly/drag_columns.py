"""Drag parts of many variants at once: their torques and slopes as columns over oil temperature and speed.

Every variant has the sums of ``assembly.drag_torques`` in the same order: the same bits as if it were assembled by
itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly.drag_torques import drags_of, torques_of
from gearrattle.errors import ModelError
from gearrattle.model import Model
from gearrattle.model.drag_points import damper_slopes, has_drag_parts, points_at

Array = NDArray[np.float64]
OIL_TEMPERATURE = "oil.temperature"
"""Path of the one number of the oil that may be a column."""


@dataclass(frozen=True)
class DragColumns:
    """What the drag parts of V variants have on n inertias.

    Attributes
    ----------
    torques
        (V, n) mean torques against the rotation [N m].
    drags
        (V, n) damping of the fluctuation against the housing [N m s/rad].
    damping
        by name of the element (V,) damping between two bodies [N m s/rad].
    good
        (V,) which variants have the elements of the model, and laws that cover them.
    """

    torques: Array
    drags: Array
    damping: Mapping[str, Array]
    good: NDArray[np.bool_]


def drag_columns(model: Model, temperature: Array | None, omega: float | Array, count: int) -> DragColumns:
    """Return the columns of V variants, whose oil temperature (V,) [degC] and reference speed (V,) [rad/s] may vary."""
    size = len(model.inertias)
    names = [element.name for element in model.elements if element.path not in model.components]
    out = DragColumns(
        np.zeros((count, size)),
        np.zeros((count, size)),
        {name: np.zeros(count) for name in names},
        np.ones(count, dtype=np.bool_),
    )
    if not has_drag_parts(model):
        out.good[:] = temperature is None  # else a variant may have an oil that is none
        return out
    from gearrattle.model.oil import COLDEST, HOTTEST

    # one variant where nothing varies, else each with its own oil and speed
    varies = temperature is not None or not isinstance(omega, float)
    speeds = np.broadcast_to(omega, count).tolist()
    for v in range(count if varies else min(count, 1)):
        rows = slice(v, v + 1) if varies else slice(None)
        oil = model.oil
        if temperature is not None and oil is not None:
            if not COLDEST <= temperature[v] <= HOTTEST:
                out.good[v] = False
                continue
            oil = oil.model_copy(update={"temperature": float(temperature[v])})
        try:
            points = points_at(model.model_copy(update={"oil": oil}), speeds[v])
        except ModelError:
            out.good[rows] = False
            continue
        slopes = damper_slopes(points)
        out.torques[rows] = torques_of(model, points)
        out.drags[rows] = drags_of(model, points)
        out.good[rows] &= list(slopes) == names
        for name, slope in slopes.items():
            if name in out.damping:
                out.damping[name][rows] = slope
    return out
