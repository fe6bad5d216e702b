"""``order_map``, ``order_cuts``: orders of a shaft whose speed changes, of runs and recordings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.model import units
from gearrattle.model.table import did_you_mean, listed, shown
from gearrattle.model.value_kinds import Count, argument_problems
from gearrattle.result import KIND
from gearrattle.signals.conditioning import PASSED
from gearrattle.signals.cross_spectra import WINDOWS
from gearrattle.signals.order_tracking import TURN, Array, Orders, fitted_orders, order_spectra, turned
from gearrattle.signals.spectra_over_speed import Waterfall, by_steps
from gearrattle.signals.spectral.sampled import Sampled, Shaft, Source, quantity, required, sampled
from gearrattle.wording import counted, noun_of

if TYPE_CHECKING:
    import xarray as xr

TURNS = 8
_USUAL = 100.0  # orders that a map shows where no number is given
_FEWEST_PER_TURN = 16
_MOST = 50_000_000  # values of a map
_OVER = ("time", "speed")


def order_map(
    source: Source,
    channel: str,
    *,
    speed: str | float | None = None,
    highest: float | None = None,
    turns: int = TURNS,
    overlap: float = 0.5,
    window: str = "hann",
    over: str = "time",
    speed_step: str | float | None = None,
) -> xr.Dataset:
    """Amplitudes of all orders along a change of speed, by resampling over the shaft's angle.

    Parameters
    ----------
    source
        a run, from the end of its discarded cycles on, or a recording of uniform samples.
    channel
        "acceleration.hub", or the name of a recording's channel.
    speed
        the recording's channel of the shaft's speed or angle, or a constant speed, "1500 rpm" or a plain number
        [rad/s]; None: a run's reference shaft, a recording's shaft angle or speed.
    highest
        order up to which they are shown; None: 100, or as far as the samples show them at the highest speed.
    turns
        in a block; orders are resolved if 1 / turns apart, and multiples of it fall on bins.
    overlap
        share of a block that the next has as well, 0 to below 1.
    window
        "hann", "flattop" or "boxcar".
    over
        "time", rows as they come; "speed", rows by speed, which must rise or fall throughout.
    speed_step
        rows whose speed rounds to the same step, "25 rpm" or a plain number [rad/s], are gathered: the root
        of the mean of their squared amplitudes, over speed.

    Returns
    -------
    xr.Dataset
        amplitude, of each order's sine [unit], and phase [rad], of a sine of the shaft's angle, over time or speed and
        order; with speed_step instead of phase the number of blocks. Both time [s] and speed [rad/s] of rows are there.

    Raises
    ------
    ModelError
        no shaft, one that stands or turns back, fewer turns than a block, an order that the samples do not
        show, a speed that does not rise or fall throughout.

    Examples
    --------
    >>> time = np.arange(0.0, 4.0, 1e-3)
    >>> turns = 10.0 * time + 2.5 * time**2
    >>> speed = gr.measured.Channel("n", "speed", "", "rad/s", 2.0 * np.pi * (10.0 + 5.0 * time))
    >>> load = gr.measured.Channel("load", "torque", "", "N m", 3.0 * np.cos(2.0 * np.pi * 2.0 * turns))
    >>> record = gr.measured.Recording(time, (speed, load), "rig")
    >>> orders = gr.spectral.order_map(record, "load", speed="n", highest=4.0)
    >>> strongest = np.abs(orders["amplitude"]).mean("time").values.argmax()
    >>> float(orders["order"][strongest])
    2.0
    """
    # the signal and its shaft, and checks of the arguments
    signal = sampled(source, channel)
    shaft = required(source, signal, speed)
    _choices(over, window, overlap)
    if problems := argument_problems({"turns": (Count(1), turns)}):
        raise ModelError(problems)
    _long_enough(signal, shaft, turns)
    # samples per turn for the highest order; the map must not become too large
    shown_orders = _highest(signal, shaft, highest)
    per_turn = max(_FEWEST_PER_TURN, int(np.ceil(shown_orders / PASSED - 1e-9)))
    per_turn += per_turn % 2
    blocks = float(shaft.angle[-1] - shaft.angle[0]) / TURN / (turns * (1.0 - overlap))
    if blocks * turns * shown_orders > _MOST:
        rule = f"{blocks:.3g} blocks of {turns * shown_orders:.3g} orders make a map larger than {_MOST:.3g} values"
        raise ModelError(
            Problem(signal.place, f"overlap {overlap:g}, {counted(turns, 'turn')}", rule, "lower the overlap")
        )
    # resample over the angle, then spectra of blocks
    read = turned(signal.values, signal.interval, shaft.angle, shaft.speed, per_turn)
    if read.values.size < turns * per_turn:
        _long_enough(signal, shaft, turns + 2.0 / per_turn)
    estimate = order_spectra(read, turns, overlap, window, shown_orders)
    # labelled data, over time or gathered by speed
    attributes = {
        KIND: "order map",
        **_attributes(signal, shaft, estimate),
        "window": window,
        "overlap": overlap,
        "samples_per_turn": per_turn,
    }
    if speed_step is not None:
        step = quantity("speed_step", speed_step, units.ANGULAR_VELOCITY, signal.dimensionless)
        return _gathered(signal, estimate, step, attributes)
    return _labelled(signal, estimate, over, attributes)


def order_cuts(
    source: Source,
    channel: str,
    orders: Sequence[float],
    *,
    speed: str | float | None = None,
    turns: float = TURNS,
    overlap: float = 0.5,
    over: str = "time",
) -> xr.Dataset:
    """Amplitudes of chosen orders along a change of speed, by least squares over blocks, without resampling.

    All orders are fitted at once, so that two close ones do not disturb each other; what else is in the signal does,
    as far as it is no multiple of 1 / turns away.

    Parameters
    ----------
    source, channel, speed
        as in ``order_map``.
    orders
        multiples of the shaft's speed, positive, half of 1 / turns apart or more.
    turns
        in a block.
    overlap
        share of a block that the next has as well, 0 to below 1.
    over
        "time" or "speed", as in ``order_map``.

    Returns
    -------
    xr.Dataset
        amplitude [unit] and phase [rad] over time or speed and order.

    Raises
    ------
    ModelError
        as ``order_map``; orders that a block cannot separate.

    Examples
    --------
    >>> time = np.arange(0.0, 4.0, 1e-3)
    >>> turns = 10.0 * time + 2.5 * time**2
    >>> speed = gr.measured.Channel("n", "speed", "", "rad/s", 2.0 * np.pi * (10.0 + 5.0 * time))
    >>> load = gr.measured.Channel("load", "torque", "", "N m", 3.0 * np.cos(2.0 * np.pi * 2.0 * turns))
    >>> record = gr.measured.Recording(time, (speed, load), "rig")
    >>> cuts = gr.spectral.order_cuts(record, "load", [2.0], speed="n")
    >>> round(float(np.median(np.abs(cuts["amplitude"]))), 2)
    3.0
    """
    # the signal and its shaft, and checks of the arguments
    signal = sampled(source, channel)
    shaft = required(source, signal, speed)
    _choices(over, "hann", overlap)
    wanted = np.unique(np.asarray(orders, dtype=np.float64))
    if not wanted.size or not np.all(np.isfinite(wanted) & (wanted > 0.0)):
        raise ModelError(Problem("orders", shown(list(orders)), "must be positive numbers, one at least"))
    if not turns > 0.0:
        raise ModelError(Problem("turns", shown(turns), "must be positive"))
    # orders that a block cannot separate
    apart = float(np.diff(wanted, prepend=0.0).min())
    if apart * turns < 0.5:
        rule = (
            f"orders {apart:.6g} apart, or from zero, cannot be separated from each other within {turns:g} "
            f"{noun_of(turns, 'turn')}"
        )
        remedy = f"take turns={np.ceil(1.0 / apart - 1e-6):.0f} or more"
        raise ModelError(Problem("orders", shown(wanted.tolist()), rule, remedy))
    # least squares of all orders in every block
    _long_enough(signal, shaft, turns)
    _highest(signal, shaft, float(wanted[-1]))
    estimate = fitted_orders(
        signal.values, signal.interval, shaft.angle, shaft.speed, orders=wanted, turns=turns, overlap=overlap
    )
    return _labelled(
        signal, estimate, over, {KIND: "order cuts", **_attributes(signal, shaft, estimate), "overlap": overlap}
    )


def _choices(over: str, window: str, overlap: float) -> None:
    """Refuse words and shares out of range."""
    for argument, value, options in (("over", over, _OVER), ("window", window, WINDOWS)):
        if value not in options:
            rule = f"must be one of {listed(options)}"
            raise ModelError(Problem(argument, shown(value), rule, did_you_mean(value, options)))
    if not 0.0 <= overlap < 1.0:
        raise ModelError(Problem("overlap", shown(overlap), "must lie from 0 to below 1", "0.5 suits a Hann window"))


def _long_enough(signal: Sampled, shaft: Shaft, turns: float) -> None:
    """Refuse a record of fewer turns than a block."""
    there = float(shaft.angle[-1] - shaft.angle[0]) / TURN
    if there < turns * (1.0 - 1e-12):
        rule = f"a block takes {turns:g} {noun_of(turns, 'turn')} of the shaft"
        remedy = "take fewer with turns=..., or a longer record"
        raise ModelError(Problem(signal.place, f"{there:.6g} turns", rule, remedy))


def _highest(signal: Sampled, shaft: Shaft, wanted: float | None) -> float:
    """Return the highest order to be shown, or refuse one that the samples do not show at the highest speed."""
    fastest = float(shaft.speed.max()) / TURN
    most = PASSED * signal.rate / fastest
    if wanted is None:
        return min(_USUAL, most)
    if not 0.0 < wanted <= most * (1.0 + 1e-9):
        at = f"at {fastest * 60.0:.6g} rpm" if not signal.dimensionless else f"at a speed of {fastest * TURN:.6g}"
        rule = f"must be positive and at most {most:.6g}: {PASSED:g} of the sampling rate, {signal.rate:.6g} Hz, {at}"
        remedy = "take fewer orders, or sample faster (a run: samples_per_cycle)"
        raise ModelError(Problem(f"{signal.place}: highest order", f"{wanted:g}", rule, remedy))
    return wanted


def _attributes(signal: Sampled, shaft: Shaft, orders: Orders) -> dict[str, Any]:
    """Return the attributes that orders have."""
    return {
        "source": signal.source,
        "channel": signal.name,
        "units": signal.unit,
        "shaft": shaft.name,
        "turns": orders.turns,
        "resolution": 1.0 / orders.turns,
        "notes": "\n".join(signal.notes),
    }


def _labelled(signal: Sampled, orders: Orders, over: str, attributes: dict[str, Any]) -> xr.Dataset:
    """Return amplitudes and phases with their coordinates."""
    import xarray as xr

    rows = np.arange(orders.speed.size)
    if over == "speed":
        rows = _by_speed(signal, orders.speed, orders.time)
    variables = {
        "amplitude": ((over, "order"), np.abs(orders.amplitude[rows]), {"units": signal.unit}),
        "phase": ((over, "order"), np.angle(orders.amplitude[rows]), {"units": "rad"}),
    }
    coordinates = {**row_coordinates(signal, over, orders.time[rows], orders.speed[rows]), "order": orders.order}
    return xr.Dataset(variables, coordinates, attributes)


def row_coordinates(signal: Sampled, over: str, time: Array, speed: Array) -> dict[str, Any]:
    """Return time [s] and speed [rad/s] of rows along the dimension ``over``; "1" of a dimensionless model."""
    return {
        "time": (over, signal.start + time, {"units": "1" if signal.dimensionless else "s"}),
        "speed": (over, speed, {"units": "1" if signal.dimensionless else "rad/s"}),
    }


def _by_speed(signal: Sampled, speed: Array, time: Array) -> Any:
    """Return the order of rows by rising speed, or refuse a speed that comes back."""
    steps = np.diff(speed)
    if np.all(steps > 0.0):
        return np.arange(speed.size)
    if np.all(steps < 0.0):
        return np.arange(speed.size)[::-1]
    rising = bool(speed[-1] > speed[0])
    at = int(np.argmax(steps <= 0.0 if rising else steps >= 0.0))
    rule = "the speed must rise or fall throughout, to be an axis"
    remedy = 'speed_step="25 rpm" gathers what comes back to a speed; over="time" keeps the order in time'
    value = f"{speed[at]:.6g} then {speed[at + 1]:.6g} rad/s at {signal.start + time[at + 1]:.6g} s"
    raise ModelError(Problem(f"{signal.source}: speed", value, rule, remedy))


def _gathered(signal: Sampled, orders: Orders, step: float, attributes: dict[str, Any]) -> xr.Dataset:
    """Return amplitudes over steps of the speed."""
    import xarray as xr

    count = np.ones(orders.speed.size, np.int64)
    rows = by_steps(Waterfall(orders.order, np.abs(orders.amplitude), orders.time, orders.speed, count), step, False)
    variables = {
        "amplitude": (("speed", "order"), rows.values, {"units": signal.unit}),
        "blocks": ("speed", rows.counts, {"units": "1"}),
    }
    coordinates = {"speed": row_coordinates(signal, "speed", rows.time, rows.speed)["speed"], "order": rows.axis}
    return xr.Dataset(variables, coordinates, {**attributes, "speed_step": step})
