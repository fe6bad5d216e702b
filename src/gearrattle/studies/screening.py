"""``screen``: which loose gear rattles at which speed and load, for a whole gearbox, by the threshold.

At every speed and load the driveline is linearised where it rests: loose gears lie on the flank their drag presses
them to. In the steady response of that linear driveline

    separation ratio = J (R_d/R_l) peak |theta_d''| / T,      margin = 20 log10 of it,
    lift ratio = reach of the mesh's deflection towards its gap / its static depth in contact

The first is of the engine's orders and takes the mesh for rigid (Singh, Xie, Comparin 1989, J. Sound Vib. 131,
177-196); the second is of all orders and knows the mesh's stiffness, damping and transmission error. While no clearance
of the driveline leaves its piece, the linear motion is an exact motion of the driveline, and the lift ratio exact with
it. Where others do, a clutch between its stages, a spline in its lash, both are estimates, and ``inside`` says so.
Nothing is integrated: a map takes milliseconds a case. With ``simulate`` every case is also run and judged, as a study.

Takes a Model, speeds and loads; gives an xarray Dataset.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.linear.response import steady_angles, steady_deflections, steady_extremes, turning_rates
from gearrattle.analysis.statics import named_equilibrium
from gearrattle.assembly import assemble, motion_amplitudes, refuse_recorded_motions, refuse_unsteady, whole
from gearrattle.engine.system.equilibrium import Equilibrium
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model, check_model
from gearrattle.model.path_labels import path_label
from gearrattle.model.quantity import CALLBACK, FLAG, check_arguments
from gearrattle.quantities.chunks import orders_of
from gearrattle.result import KIND
from gearrattle.signals import LooseGear, loose_gears, torque_ratio
from gearrattle.studies.axes import Axis, axes_of
from gearrattle.studies.study import study
from gearrattle.trajectory import Array, Layout

if TYPE_CHECKING:
    import xarray as xr

SPEED = "speed"
LOAD = "load"
GEAR = "gear"
_PATH = "excitation.speed"
_SHARE = 0.02  # of the work, that thresholds are where cases are simulated
BY_FACTOR, BY_PATH = "factor on the amplitudes of the torques", "number of the load"
"""What the coordinate "load" holds, as its ``long_name`` says."""
Progress = Callable[[float], None]
Loads = Sequence[float] | Mapping[str, Sequence[float | str]]


def screen(
    model: Model,
    speeds: Sequence[float | str] | Mapping[str, object],
    loads: Loads | None = None,
    *,
    simulate: bool = False,
    workers: int | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Map which loose gear rattles at which speed and load, by the threshold and, if asked, by simulation.

    Parameters
    ----------
    model
        the driveline, with one loose gear at least: a drag torque on a body whose only stiffness is its mesh.
    speeds
        of the reference shaft, as in a model file or as a range ``{"from": ..., "to": ..., "count": ...}``.
    loads
        factors on the amplitudes of all torque harmonics; or by path of the model file equally many values,
        which vary together; None: the model's own.
    simulate
        also run every case, by the model's settings, and keep the regime of every loose gear's mesh.
    workers
        of the simulations, as in ``study``.
    progress
        called with the finished share, of the thresholds, then of the simulations; what it raises ends the
        work.

    Returns
    -------
    xr.Dataset
        A Dataset with the dimensions "speed" [rad/s], "load" (factor, or number) and "gear" (by its mesh, with its
        loose and driver). separation_ratio [1], margin [dB] and lift_ratio [1] are of every gear; inside tells whether
        the linear motion is an exact one; with ``simulate`` there is regime, codes of ``flag_meanings``.

    Raises
    ------
    ModelError
        no loose gear, a value or path that is none, records instead of harmonics.
    ConvergenceError
        not even one case could be simulated.

    Examples
    --------
    >>> margins = gr.screen(gr.example("manual_transmission"), ["700 rpm", "900 rpm"])
    >>> dict(margins["margin"].sizes)
    {'speed': 2, 'load': 1, 'gear': 2}
    """
    check_model(model)
    check_arguments(simulate=(FLAG, simulate), progress=(CALLBACK, progress))
    import xarray as xr

    refuse_recorded_motions(model, "a screening")
    by_path = isinstance(loads, Mapping)
    speed, load, factors = _axes(model, speeds, loads)
    base = model.with_(speed.at(0))
    refuse_unsteady(base, "a screening")
    layout = assemble(base).layout
    gears = loose_gears(layout)
    if not gears:
        rule = "a screening needs a loose gear: a drag torque on a body whose only stiffness is its mesh"
        raise ModelError(Problem("inertia", ", ".join(layout.inertia_names), rule, "give drag_torque to a loose gear"))
    ratio, lift, inside = _thresholds(model, speed, load, gears, _part(progress, 0.0, _SHARE if simulate else 1.0))
    dims = (SPEED, LOAD, GEAR)
    with np.errstate(divide="ignore"):
        margin = 20.0 * np.log10(ratio)
    screening = xr.Dataset(
        {
            "separation_ratio": (dims, ratio, {"units": "1"}),
            "margin": (dims, margin, {"units": "dB"}),
            "lift_ratio": (dims, lift, {"units": "1"}),
            "inside": (dims[:2], inside, {"units": "1"}),
        },
        {**_coordinates(layout, gears), **_positions(model, speed, load, factors, BY_PATH if by_path else BY_FACTOR)},
        {KIND: "screening", "title": f"screening of {model.name}", "units": model.units},
    )
    return _simulated(screening, model, (speed, load), workers, progress) if simulate else screening


def _axes(model: Model, speeds: Any, loads: Loads | None) -> tuple[Axis, Axis | None, tuple[float, ...]]:
    """Read speeds and loads; the factors, or the numbers of the loads."""
    axis_values: dict[str, Any] = {SPEED: {_PATH: speeds}}
    factors: tuple[float, ...] = (1.0,)
    if isinstance(loads, Mapping):
        axis_values[LOAD] = dict(loads)
    elif loads is not None:
        factors = tuple(float(factor) for factor in loads)
        wrong = [factor for factor in factors if not 0.0 <= factor < np.inf]
        if wrong or not factors:
            listed_factors = ", ".join(map(str, wrong)) or "none"
            raise ModelError(
                Problem("loads", listed_factors, "must be factors of zero or more", "for example [0.5, 1.0, 1.5]")
            )
        axis_values[LOAD] = {path: [value * factor for factor in factors] for path, value in _amplitudes(model).items()}
    axes = axes_of(axis_values, model)
    load = axes[1] if len(axes) > 1 else None
    numbered = isinstance(loads, Mapping) and load is not None
    return axes[0], load, tuple(float(i) for i in range(len(load))) if numbered and load else factors


def _amplitudes(model: Model) -> dict[str, float]:
    """Every amplitude of a torque's harmonics, by path [N m]."""
    amplitudes: dict[str, float] = {}
    for i, table in enumerate(model.to_tables().get("torque", ())):
        plain = [h.get("amplitude") for h in table.get("harmonics", ())]
        if "engine" in table or any(not isinstance(amplitude, int | float) for amplitude in plain):
            rule = "factors scale amplitudes that are plain numbers"
            what = "an engine, or amplitudes over speed"
            remedy = 'give loads by path, for example {"torque.0.mean": [5.0, 10.0]}'
            raise ModelError(Problem(f"torque.{i}", what, rule, remedy))
        amplitudes |= {f"torque.{i}.harmonics.{j}.amplitude": float(amplitude) for j, amplitude in enumerate(plain)}
    if not amplitudes:
        rule = "factors need torque harmonics to scale"
        raise ModelError(Problem("loads", "given", rule, "leave them out, or give loads by path"))
    return amplitudes


def _part(progress: Progress | None, begin: float, end: float) -> Progress | None:
    """Return what takes the shares of a part of the work and tells those of the whole."""
    return None if progress is None else lambda share: progress(begin + (end - begin) * share)


def _thresholds(
    model: Model, speed: Axis, load: Axis | None, gears: Sequence[LooseGear], progress: Progress | None
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return (speed, load, gear) both ratios, and (speed, load) whether the linear motion is an exact one."""
    ratio = np.full((len(speed), len(load) if load else 1, len(gears)), np.nan)
    lift, inside = ratio.copy(), np.zeros(ratio.shape[:2], dtype=np.bool_)
    for number, (i, j) in enumerate(np.ndindex(inside.shape), start=1):
        case = model.with_({**speed.at(i), **(load.at(j) if load else {})})
        ratio[i, j], lift[i, j], inside[i, j] = _threshold(case, gears)
        if progress is not None:
            progress(number / inside.size)
    return ratio, lift, inside


def _threshold(model: Model, gears: Sequence[LooseGear]) -> tuple[Array, Array, bool]:
    """Return (gears,) separation and lift ratios of one case, and whether the linear motion is an exact one."""
    driveline = assemble(model)
    system, rest = driveline.system, named_equilibrium(driveline)[1]
    slope, damping = (
        np.array([getattr(law, name)[p] for law, p in zip(system.laws, rest.pieces, strict=True)])
        for name in ("stiffness", "damping")
    )
    rates, angles = turning_rates(system), steady_angles(system, slope, damping)
    angles = whole(model, angles.T, motion_amplitudes(model).T).T  # (inertias, orders)
    orders = rates / model.excitation.omega
    engine = np.isclose(orders[:, None], orders_of(model), rtol=1e-9, atol=0.0).any(axis=1)
    swings = steady_extremes(system, np.where(engine, -(rates**2) * angles, 0.0))
    reach = steady_extremes(system, steady_deflections(system, slope, damping))
    acceleration = whole(model, rest.acceleration, np.zeros(len(model.motions)))
    peak = np.maximum(*(np.abs(acceleration + swing) for swing in swings))
    ratio = [torque_ratio(driveline.layout, gear, float(peak[gear.driver])) for gear in gears]
    lift = [_lift(system, rest, reach, g.mesh) for g in gears]
    return np.array(ratio), np.array(lift), _inside(system, rest, reach)


def _lift(system: PiecewiseSystem, rest: Equilibrium, reach: tuple[Array, Array], mesh: int) -> float:
    """How far a mesh swings towards its gap, over its depth in contact; infinite at rest within its gap."""
    law = system.laws[mesh]
    piece = rest.pieces[mesh]
    at = float(rest.deflection[mesh])
    if not law.corners.size:
        return 0.0
    if law.stiffness[piece] == 0.0:
        return float("inf")
    if piece == law.pieces - 1:
        return float(-reach[0][mesh] / (at - law.corners[-1]))
    return float(reach[1][mesh] / (law.corners[piece] - at))


def _inside(system: PiecewiseSystem, rest: Equilibrium, reach: tuple[Array, Array]) -> bool:
    """Whether every element stays in the piece it rests in."""
    for k, (law, piece) in enumerate(zip(system.laws, rest.pieces, strict=True)):
        edges = np.concatenate([[-np.inf], law.corners, [np.inf]])
        low, high = rest.deflection[k] + reach[0][k], rest.deflection[k] + reach[1][k]
        if not (low > edges[piece] and high < edges[piece + 1]):
            return False
    return True


def _coordinates(layout: Layout, gears: Sequence[LooseGear]) -> dict[str, Any]:
    return {
        GEAR: [layout.element_names[gear.mesh] for gear in gears],
        "loose": (GEAR, [layout.inertia_names[gear.loose] for gear in gears]),
        "driver": (GEAR, [layout.inertia_names[gear.driver] for gear in gears]),
    }


def _positions(model: Model, speed: Axis, load: Axis | None, factors: tuple[float, ...], words: str) -> dict[str, Any]:
    unit = "rad/s" if model.units == "SI" else "1"
    positions: dict[str, Any] = {
        SPEED: (SPEED, np.array(speed.values[_PATH], dtype=np.float64), {"units": unit}),
        LOAD: (LOAD, np.array(factors), {"units": "1", "long_name": words}),
    }
    for path, values in (load.values if load else {}).items():
        label = path_label(path, model)
        positions[path] = (LOAD, list(values), {"long_name": label.words, "units": label.unit})
    return positions


def _simulated(
    screening: xr.Dataset,
    model: Model,
    axes: tuple[Axis, Axis | None],
    workers: int | None,
    progress: Progress | None,
) -> xr.Dataset:
    """Add the regime of every loose gear's mesh, from a study of the same cases."""
    speed, load = axes
    axis_values: dict[str, Any] = {SPEED: {_PATH: list(speed.values[_PATH])}}
    if load is not None:
        axis_values[LOAD] = {path: list(values) for path, values in load.values.items()}
    done = study(model, axis_values, ["regime"], workers=workers, progress=_part(progress, _SHARE, 1.0))
    regime = done["regime"].sel(part=[str(name) for name in screening[GEAR].values])
    codes = np.asarray(regime.values).reshape(screening["margin"].shape)
    return screening.assign(regime=((SPEED, LOAD, GEAR), codes, dict(regime.attrs)))
