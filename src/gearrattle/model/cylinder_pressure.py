"""Pressure of a cylinder over 720 degrees: the periodic cubic spline, or straight lines, through a trace."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from gearrattle.model.signal import Signal

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from scipy.interpolate import CubicSpline

    Array = NDArray[np.float64]

_CYCLE = 4.0 * math.pi
_SAME = 1e-6  # relative difference of two angles that count as equal


def missing(signal: Signal) -> str:
    """Return the reason why a trace is not a whole cycle; empty if it is one."""
    import numpy as np

    span = float(signal.time[-1] - signal.time[0])
    step = float(np.diff(signal.time).max())
    if span > _CYCLE * (1.0 + _SAME):
        return f"must cover one cycle, 720 deg; it covers {math.degrees(span):.6g}"
    if span + step < _CYCLE * (1.0 - _SAME):
        return f"must cover one cycle, 720 deg; it covers {math.degrees(span):.6g}"
    return ""


def pressure_at(signal: Signal, angle: Array) -> Array:
    """Pressure at crank angles [Pa, rad]; if the trace has both ends of the cycle, the value at its begin is used."""
    import numpy as np

    along, value = _closed(signal)
    at = along[0] + np.remainder(angle - along[0], _CYCLE)
    pressure = np.interp(at, along, value) if signal.interpolation == "linear" else periodic_spline(signal)(at)
    return np.asarray(signal.scale * pressure)


def periodic_spline(signal: Signal) -> CubicSpline:
    """The periodic spline through a trace over one cycle, without its scale."""
    from scipy.interpolate import CubicSpline

    return CubicSpline(*_closed(signal), bc_type="periodic")


def _closed(signal: Signal) -> tuple[Array, Array]:
    """Angles [rad] and values of one cycle, both ends included and with equal values."""
    import numpy as np

    inside = signal.time < signal.time[0] + _CYCLE * (1.0 - _SAME)
    along = np.append(signal.time[inside], signal.time[0] + _CYCLE)
    return along, np.append(signal.value[inside], signal.value[0])
