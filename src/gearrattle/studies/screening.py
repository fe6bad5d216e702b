"""``screen``: map of the loose gears of a gearbox that rattle, over speed and load, by the classical threshold.

At every speed and load the driveline is linearised where it rests: loose gears lie on the flank their drag presses
them to. In the steady response of that linear driveline

    separation ratio = J (R_d/R_l) peak |theta_d''| / T,      margin = 20 log10 of it,
    lift ratio = reach of the mesh's deflection towards its gap / its static depth in contact

The first is of the engine's orders and takes the mesh for rigid (Singh, Xie, Comparin 1989, J. Sound Vib. 131,
177-196); the second is of all orders and knows the mesh's stiffness, damping and transmission error. While no clearance
of the driveline leaves its piece, and nothing rubs, the linear motion is an exact motion of the driveline, and the lift
ratio exact with it; ``inside`` says so. Everywhere else it is one linear forecast of many: friction that sticks, a
clutch that swings beyond its stage, gears that have left their flanks make other linear drivelines
(``screening_models``). ``lift_low`` and ``lift_high`` are the least and the largest lift ratio of all of them, and the
forecast is quiet only where none of them lifts the gear off. No linear driveline describes impacts of rattling gears,
motions that pass between stages, or the choice among several motions by the start.

Nothing is integrated: a map takes milliseconds per case. With ``check`` cases near the border are also run and judged,
with ``simulate`` all of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.linear.response import steady_angles, steady_extremes, turning_rates
from gearrattle.analysis.statics import named_equilibrium
from gearrattle.assembly import (
    assemble,
    left_out,
    motion_amplitudes,
    refuse_recorded_motions,
    refuse_unsteady,
    with_prescribed,
)
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model, check_model
from gearrattle.model.factors import FACTOR
from gearrattle.model.path_labels import path_label
from gearrattle.model.paths import value_at
from gearrattle.model.value_kinds import CALLBACK, FLAG, Count, check_arguments
from gearrattle.quantities.chunk_sums import orders_of
from gearrattle.result import KIND
from gearrattle.signals import LooseGear, loose_gears, torque_ratio
from gearrattle.studies.output import REGIME, SEVERITY
from gearrattle.studies.screening_check import CHECKED, FORECASTS, forecasts_of, near_border
from gearrattle.studies.screening_models import at_rest, is_inside, lift_range, lift_ratios, reach_of
from gearrattle.studies.study import study
from gearrattle.studies.study_axes import Axis, axes_of
from gearrattle.trajectory import Array, Layout

if TYPE_CHECKING:
    import xarray as xr

SPEED = "speed"
LOAD = "load"
GEAR = "gear"
_PATH = "excitation.speed"
_AMPLITUDES = "torque.*.harmonics.*.amplitude"
_FLAGS = {
    "flag_values": list(range(len(FORECASTS))),
    "flag_meanings": " ".join(word.replace(" ", "_") for word in FORECASTS),
}
_SHARE = 0.02  # of the work, that thresholds are where cases are simulated
BY_FACTOR = "factor on the amplitudes of the torques"
BY_PATH = "number of the load"
"""What the coordinate "load" holds, as its ``long_name`` says."""
Progress = Callable[[float], None]
Loads = Sequence[float] | Mapping[str, object]


def screen(
    model: Model,
    speeds: Sequence[float | str] | Mapping[str, object],
    loads: Loads | None = None,
    *,
    simulate: bool = False,
    check: bool | int = False,
    workers: int | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Map which loose gear rattles at which speed and load, by the threshold and, if asked, by simulation.

    The threshold is a linear forecast. Where the driveline has friction, or a clearance leaves the stage it rests in,
    it is a range over the linear drivelines that may stand for it.

    Parameters
    ----------
    model
        the driveline, with one loose gear at least: a drag torque on a body whose only stiffness is its mesh.
    speeds
        of the reference shaft, as in a model file or as a range ``{"from": ..., "to": ..., "count": ...}``.
    loads
        factors on the amplitudes of all torque harmonics; or by path or pattern of the model file equally many values
        or factors, as in ``study``, which vary together; None: the model's own.
    simulate
        also run every case, by the model's settings, and keep severity and regime of every loose gear's mesh.
    check
        also run the cases nearest to the border, by the model's settings: how many, or 8 with True.
    workers
        of the simulations, as in ``study``.
    progress
        called with the finished share, of the thresholds, then of the simulations; what it raises ends the
        work.

    Returns
    -------
    xr.Dataset
        A Dataset with the dimensions "speed" [rad/s], "load" (factor, or number) and "gear" (by its mesh, with its
        loose and driver). separation_ratio [1], margin [dB] and lift_ratio [1] are of every gear, with friction
        released in the stages of rest; lift_low and lift_high are the range over all linear models, and forecast is
        what it says, codes of ``flag_meanings``. inside tells whether the linear motion is an exact one. With
        ``simulate`` or ``check`` there are severity and regime, codes of ``flag_meanings``, -1 where nothing was
        simulated.

    Raises
    ------
    ModelError
        no loose gear, a value or path that is not valid, records instead of harmonics; ``check`` with ``simulate``.
    ConvergenceError
        not even one case could be simulated.

    Examples
    --------
    >>> margins = gr.screen(gr.example("manual_transmission"), ["700 rpm", "900 rpm"])
    >>> dict(margins["margin"].sizes)
    {'speed': 2, 'load': 1, 'gear': 2}
    """
    # check the arguments
    check_model(model)
    check_arguments(simulate=(FLAG, simulate), progress=(CALLBACK, progress))
    most = _points(check, simulate=simulate)
    import xarray as xr

    refuse_recorded_motions(model, "a screening")
    # axes, and the loose gears of the driveline
    by_path = isinstance(loads, Mapping)
    speed, load, factors = _axes(model, speeds, loads)
    base = model.with_(speed.at(0))
    refuse_unsteady(base, "a screening")
    layout = assemble(base).layout
    gears = loose_gears(layout)
    if not gears:
        rule = "a screening needs a loose gear: a drag torque on a body whose only stiffness is its mesh"
        raise ModelError(Problem("inertia", ", ".join(layout.inertia_names), rule, "give drag_torque to a loose gear"))
    # thresholds by linear response
    simulates = simulate or most > 0
    expect = getattr(progress, "expect", None)
    if simulates and expect is not None:
        expect(math.nan)  # how long simulations take is known when they begin
    done = _thresholds(model, speed, load, gears, _part(progress, 0.0, _SHARE if simulates else 1.0))
    # Dataset of margins and lift ratios
    positions = _positions(model, speed, load, factors, BY_PATH if by_path else BY_FACTOR)
    screening = xr.Dataset(
        _variables(done),
        {**_coordinates(layout, gears), **positions},
        {KIND: "screening", "title": f"screening of {model.name}", "units": model.units},
    )
    if notes := _notes(base, done):
        screening.attrs["notes"] = "\n".join(notes)
    if not simulates:
        return screening
    # simulate all cases, or those near the border
    if simulate:
        cases = np.argwhere(np.ones(screening["inside"].shape, dtype=np.bool_))
    else:
        cases = near_border(done.low, done.high, most)
    return _simulated(screening, model, _cases(speed, load, cases), workers, _part(progress, _SHARE, 1.0))


def _points(check: bool | int, *, simulate: bool) -> int:
    """Read how many cases are checked."""
    if isinstance(check, bool):
        most = CHECKED if check else 0
    else:
        check_arguments(check=(Count(1), check))
        most = int(check)
    if most and simulate:
        rule = "simulate runs every case, those near the border too"
        raise ModelError(Problem("check", f"{check}", rule, "leave one of them out"))
    return most


def _variables(done: _Thresholds) -> dict[str, Any]:
    """Return the variables of a screening."""
    dims = (SPEED, LOAD, GEAR)
    with np.errstate(divide="ignore"):
        margin = 20.0 * np.log10(done.ratio)
    return {
        "separation_ratio": (dims, done.ratio, {"units": "1"}),
        "margin": (dims, margin, {"units": "dB"}),
        "lift_ratio": (dims, done.lift, {"units": "1"}),
        "lift_low": (dims, done.low, {"units": "1"}),
        "lift_high": (dims, done.high, {"units": "1"}),
        "forecast": (dims, forecasts_of(done.low, done.high), _FLAGS),
        "inside": (dims[:2], done.inside, {"units": "1"}),
    }


def _notes(model: Model, done: _Thresholds) -> list[str]:
    """Say what the forecast leaves out; nothing where it is exact everywhere."""
    notes = list(left_out(model))
    if any(element.rubs for element in model.elements):
        notes.append("the range of the lift ratio has that friction stuck as well.")
    if not done.inside.all():
        notes.append(
            "this is a linear forecast: impacts of rattling gears, friction that sticks and slips, and motions that "
            "pass between stages are left out. To simulate the cases near the border: --check, or check=True in Python."
        )
    return notes


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
        _check_amplitudes(model)
        axis_values[LOAD] = {_AMPLITUDES: {FACTOR: factors}}
    axes = axes_of(axis_values, model)
    load = axes[1] if len(axes) > 1 else None
    numbered = isinstance(loads, Mapping) and load is not None
    return axes[0], load, tuple(float(i) for i in range(len(load))) if numbered and load else factors


def _check_amplitudes(model: Model) -> None:
    """Refuse torques whose amplitudes are no numbers that factors scale, and a model without any."""
    amplitudes = model.paths(_AMPLITUDES)
    unscaled = [*model.paths("torque.*.engine.*"), *(path for path in amplitudes if not _is_number(model, path))]
    if unscaled:
        torque = ".".join(unscaled[0].split(".")[:2])
        rule = "factors scale amplitudes that are plain numbers"
        remedy = 'give loads by path, for example {"torque.0.mean": [5.0, 10.0]}'
        raise ModelError(Problem(torque, "an engine, or amplitudes over speed", rule, remedy))
    if not amplitudes:
        rule = "factors need torque harmonics to scale"
        raise ModelError(Problem("loads", "given", rule, "leave them out, or give loads by path"))


def _is_number(model: Model, path: str) -> bool:
    return isinstance(value_at(model.to_tables(), path), int | float)


def _part(progress: Progress | None, begin: float, end: float) -> Progress | None:
    """Return a callback for a part of the work that reports the share of the whole."""
    return None if progress is None else _Part(progress, begin, end)


class _Part:
    """Callback for the share of a part of the work, and its remaining seconds, that reports those of the whole."""

    def __init__(self, progress: Progress, begin: float, end: float) -> None:
        self._progress = progress
        self._begin = begin
        self._end = end
        if hasattr(progress, "expect"):
            self.expect = progress.expect

    def __call__(self, share: float) -> None:
        self._progress(self._begin + (self._end - self._begin) * share)


@dataclass(frozen=True)
class _Thresholds:
    """Ratios (speed, load, gear), and (speed, load) whether the linear motion is an exact one."""

    ratio: Array
    lift: Array
    low: Array
    high: Array
    inside: NDArray[np.bool_]


def _thresholds(
    model: Model, speed: Axis, load: Axis | None, gears: Sequence[LooseGear], progress: Progress | None
) -> _Thresholds:
    """Return the thresholds of all cases."""
    shape = (len(speed), len(load) if load else 1)
    ratios = np.full((4, *shape, len(gears)), np.nan)
    inside = np.zeros(shape, dtype=np.bool_)
    for number, (i, j) in enumerate(np.ndindex(shape), start=1):
        case = model.with_({**speed.at(i), **(load.at(j) if load else {})})
        ratios[:, i, j], inside[i, j] = _threshold(case, gears)
        if progress is not None:
            progress(number / inside.size)
    ratio, lift, low, high = ratios
    return _Thresholds(ratio, lift, low, high, inside)


def _threshold(model: Model, gears: Sequence[LooseGear]) -> tuple[Array, bool]:
    """Return (4, gears) separation ratio, lift ratio and its range of one case, and whether the motion is exact."""
    driveline = assemble(model)
    system = driveline.system
    rest = named_equilibrium(driveline)[1]
    linear = at_rest(system, rest)
    # the driver's acceleration at the engine's orders, at rest and swinging
    rates = turning_rates(system)
    angles = steady_angles(system, linear.stiffness, linear.damping)
    angles = with_prescribed(model, angles.T, motion_amplitudes(model).T).T  # (inertias, orders)
    orders = rates / model.excitation.omega
    engine = np.isclose(orders[:, None], orders_of(model), rtol=1e-9, atol=0.0).any(axis=1)
    swings = steady_extremes(system, np.where(engine, -(rates**2) * angles, 0.0))
    acceleration = with_prescribed(model, rest.acceleration, np.zeros(len(model.motions)))
    peak = np.maximum(*(np.abs(acceleration + swing) for swing in swings))
    ratio = [torque_ratio(driveline.layout, gear, float(peak[gear.driver])) for gear in gears]
    # the mesh's own deflection, in the driveline at rest and in all that may stand for it
    reach = reach_of(system, linear)
    meshes = [gear.mesh for gear in gears]
    lift = lift_ratios(system, rest, reach, meshes)
    low, high = lift_range(system, rest, meshes)
    return np.array([ratio, lift, low, high]), is_inside(system, rest, reach) and not system.auxiliaries


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
    for path, values in (load.coordinates if load else {}).items():
        label = path_label(path, model, by_factor=load is not None and path in load.by_factor)
        positions[path] = (LOAD, list(values), {"long_name": label.words, "units": label.unit})
    return positions


def _cases(speed: Axis, load: Axis | None, indices: NDArray[np.int64]) -> _Cases:
    """Return the cases of these (M, 2) speeds and loads, as values by path that vary together."""
    numbers = [int(i) for i in indices[:, 0]]
    values = {_PATH: [speed.values[_PATH][i] for i in numbers]}
    for path, of_load in (load.values if load else {}).items():
        values[path] = [of_load[int(j)] for j in indices[:, 1]]
    return _Cases(indices, values)


class _Cases(NamedTuple):
    """Some cases of the map: (M, 2) indices, and values by path."""

    indices: NDArray[np.int64]
    values: dict[str, list[Any]]


def _simulated(
    screening: xr.Dataset, model: Model, cases: _Cases, workers: int | None, progress: Progress | None
) -> xr.Dataset:
    """Add severity and regime of every loose gear's mesh, from a study of these cases; -1 for the others."""
    done = study(model, {"case": cases.values}, [SEVERITY, REGIME], workers=workers, progress=progress)
    added = {}
    for name in (SEVERITY, REGIME):
        judged = done[name].sel(part=[str(mesh) for mesh in screening[GEAR].values])
        codes = np.full(screening["margin"].shape, -1, dtype=np.int64)
        codes[cases.indices[:, 0], cases.indices[:, 1]] = judged.transpose("case", "part").values
        added[name] = ((SPEED, LOAD, GEAR), codes, dict(judged.attrs))
    return screening.assign(added)
