"""``gearrattle orders``: orders and spectra along a change of speed, of a saved run or a measured file."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gearrattle
from gearrattle.cli.command_inputs import channels_of, motion_or_recording
from gearrattle.cli.emit import emit_each
from gearrattle.cli.shared_options import Json, OutputPath, Whole
from gearrattle.errors import ModelError, Problem

if TYPE_CHECKING:
    import xarray as xr

    from gearrattle.recording import Recording
    from gearrattle.results import Run


def orders(
    source: Path,
    channel: str | None = None,
    /,
    *,
    speed: str | None = None,
    order: Sequence[float] = (),
    turns: Whole = 8,
    highest: float | None = None,
    spectra: bool = False,
    resolution: str | None = None,
    speed_step: str | None = None,
    model: Path | None = None,
    output: OutputPath = None,
    json: Json = False,
) -> None:
    """Print the strongest orders of a signal, or chosen ones; with -o draw or save their map.

    Parameters
    ----------
    source
        Saved motion (.nc), measured file, or measurement.toml.
    channel
        What to look at: "acceleration.hub", or a channel's name. Default: every channel of a recording in turn, in a
        folder of its own with -o.
    speed
        Channel of the shaft's speed or angle, or a constant speed such as "1500 rpm"; default: a run's reference shaft,
        a recording's shaft angle or speed.
    order
        Follow this order, fitted over blocks. May be repeated. Default: a map of all.
    turns
        Turns in a block of a map of orders or a fit.
    highest
        Order up to which the map goes.
    spectra
        A map of frequencies over speed instead of orders.
    resolution
        Width of a bin of --spectra, such as "2 Hz".
    speed_step
        Gather what lies within the same step of the speed, such as "25 rpm".
    model
        Model file (TOML): its orders and natural frequencies are drawn over the map; a run knows its own.
    output
        Folder for the page; or a file: .svg, .pdf, .png and others of figures (the map), .nc or .csv (its numbers).
    """
    unfit = {"--order": bool(order), "--highest": highest is not None, "--speed-step": speed_step is not None}
    _check({name for name, is_set in unfit.items() if is_set}, spectra)
    signal = motion_or_recording(source)
    lines = {}
    if not order:
        lines = _lines(signal, model)

    def work(channel: str, _: object) -> xr.Dataset | xr.DataArray:
        if spectra:
            how: dict[str, Any] = {"speed": speed, "resolution": resolution, "speed_step": speed_step}
            return gearrattle.spectral.waterfall(signal, channel, **how).assign_attrs(lines)
        if order:
            return gearrattle.spectral.order_cuts(signal, channel, order, speed=speed, turns=turns)
        how = {"speed": speed, "turns": turns, "highest": highest, "speed_step": speed_step}
        return gearrattle.spectral.order_map(signal, channel, **how).assign_attrs(lines)

    kind = "waterfall" if spectra else "order cuts" if order else "order map"
    works = {name: partial(work, name) for name in channels_of(signal, channel, "CHANNEL")}
    emit_each(kind, works, output, json=json, inputs=[source])


def _check(options: set[str], spectra: bool) -> None:
    """Refuse options that do not go together."""
    first = "--spectra" if spectra else "--order" if "--order" in options else ""
    clash = sorted(
        options & ({"--order", "--highest"} if spectra else {"--highest", "--speed-step"} if first else set())
    )
    if clash:
        raise ModelError(Problem(first, ", ".join(clash), "belongs to maps of orders", "leave one of them out"))


def _lines(signal: Run | Recording, model: Path | None) -> dict[str, list[float]]:
    """Return orders and natural frequencies [rad/s] to draw over a map; none for a recording alone."""
    from gearrattle.recording import Recording

    driveline = None if model is None else gearrattle.load(model)
    if driveline is None:
        if isinstance(signal, Recording):
            return {}
        driveline = signal.model
    natural = gearrattle.modes(driveline).frequencies
    drawn = [line.order for line in gearrattle.campbell(driveline).orders]
    lines = {"excited_orders": drawn, "natural_frequencies": natural[natural > 0.0].tolist()}
    return {name: values for name, values in lines.items() if values}
