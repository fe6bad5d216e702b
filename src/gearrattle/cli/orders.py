"""``gearrattle orders``: orders and spectra along a change of speed, of a saved run or a measured file."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from gearrattle.cli.options import Json, Whole
from gearrattle.cli.sources import heard
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

    from gearrattle.plots.chart import Chart
    from gearrattle.recording import Recording
    from gearrattle.results import Run

_ENDINGS = (".svg", ".nc")
_MOST = 8
_LEAST = 0.01


def orders(
    source: Path,
    channel: str,
    /,
    *,
    speed: str | None = None,
    order: Annotated[Sequence[float], Parameter(negative="")] = (),
    turns: Whole = 8,
    highest: float | None = None,
    spectra: Annotated[bool, Parameter(negative="")] = False,
    resolution: str | None = None,
    speed_step: str | None = None,
    model: Path | None = None,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    json: Json = False,
) -> None:
    """Print the strongest orders of a signal, or chosen ones; with -o draw or save their map.

    Parameters
    ----------
    source
        Saved motion (.nc), measured file, or measurement.toml.
    channel
        What to look at: "acceleration.hub", or a channel's name.
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
        File for the map: .svg (drawn) or .nc (its numbers).
    """
    unfit = {"--order": bool(order), "--highest": highest is not None, "--speed-step": speed_step is not None}
    _check({name for name, given in unfit.items() if given}, spectra, output)
    signal = heard(source)
    if spectra:
        told = _of_spectra(signal, channel, model, output, speed=speed, resolution=resolution, speed_step=speed_step)
    elif order:
        told = _of_cuts(signal, channel, order, output, speed=speed, turns=turns)
    else:
        asked = {"speed": speed, "turns": turns, "highest": highest, "speed_step": speed_step}
        told = _of_map(signal, channel, model, output, **asked)
    _tell({**told, "output": None if output is None else str(output)}, si=_si(signal), json=json)


def _check(given: set[str], spectra: bool, output: Path | None) -> None:
    """Refuse options that do not go together, and a file of another kind."""
    from gearrattle.errors import ModelError, Problem

    if output is not None and (output.suffix not in _ENDINGS or output.is_dir()):
        raise ModelError(Problem("-o", f'"{output}"', "must be a file that ends in .svg or .nc"))
    first = "--spectra" if spectra else "--order" if "--order" in given else ""
    clash = sorted(given & ({"--order", "--highest"} if spectra else {"--highest", "--speed-step"} if first else set()))
    if clash:
        raise ModelError(Problem(first, ", ".join(clash), "belongs to maps of orders", "leave one of them out"))


def _of_map(
    signal: Run | Recording, channel: str, model: Path | None, output: Path | None, **asked: Any
) -> dict[str, Any]:
    """Tell the strongest orders of a map: those that stand above their neighbours."""
    import gearrattle
    from gearrattle.plots.order_maps import map_chart

    found = gearrattle.order_map(signal, channel, **asked)
    amplitude = found.amplitude
    amplitude.attrs |= found.attrs
    peak = amplitude.values.max(axis=0)
    inner = (peak[1:-1] >= peak[:-2]) & (peak[1:-1] > peak[2:]) & (peak[1:-1] >= _LEAST * peak[1:].max())
    places = sorted((inner.nonzero()[0] + 1).tolist(), key=lambda k: -peak[k])[:_MOST]
    lines = _lines(signal, model)
    if output is not None:
        _write(found.assign_attrs(_kept(lines)), map_chart(amplitude, si=_si(signal), **lines), output)
    return _content(found, sorted(places))


def _of_cuts(
    signal: Run | Recording, channel: str, order: Sequence[float], output: Path | None, *, speed: str | None, turns: int
) -> dict[str, Any]:
    """Tell the largest amplitudes of chosen orders."""
    import gearrattle
    from gearrattle.plots.order_maps import cuts_chart

    found = gearrattle.order_cuts(signal, channel, order, speed=speed, turns=turns)
    if output is not None:
        _write(found, cuts_chart(found, si=_si(signal)), output)
    return _content(found, range(found.sizes["order"]))


def _of_spectra(
    signal: Run | Recording, channel: str, model: Path | None, output: Path | None, **asked: Any
) -> dict[str, Any]:
    """Tell what a waterfall is of, and where it is largest."""
    import gearrattle
    from gearrattle.plots.order_maps import map_chart

    found, lines = gearrattle.waterfall(signal, channel, **asked), _lines(signal, model)
    if output is not None:
        chart = map_chart(found, si=_si(signal), **lines)
        _write(found.assign_attrs(_kept(lines)).to_dataset(), chart, output)
    row, column = divmod(int(found.values.argmax()), found.shape[1])
    peak = {"frequency": float(found.frequency[column]), "amplitude": float(found.values[row, column])}
    peak |= {name: float(found[name][row]) for name in ("time", "speed") if name in found.coords}
    return {**_attributes(found.attrs), "rows": found.shape[0], "bins": found.shape[1], "largest": peak}


def _lines(signal: Run | Recording, model: Path | None) -> dict[str, list[float]]:
    """Return orders and natural frequencies [rad/s] of a model or of the run's own; nothing of a recording alone."""
    import gearrattle
    from gearrattle.recording import Recording

    driveline = None if model is None else gearrattle.load(model)
    if driveline is None:
        if isinstance(signal, Recording):
            return {}
        driveline = signal.model
    natural = gearrattle.modes(driveline).frequencies
    drawn = [line.order for line in gearrattle.campbell(driveline).orders]
    return {"orders": drawn, "natural": natural[natural > 0.0].tolist()}


def _kept(lines: dict[str, list[float]]) -> dict[str, list[float]]:
    """Return what is drawn over a map as attributes of it, so that ``figures`` can draw it as well."""
    names = {"orders": "excited_orders", "natural": "natural_frequencies"}
    return {names[key]: values for key, values in lines.items() if values}


def _content(found: xr.Dataset, places: Sequence[int]) -> dict[str, Any]:
    """Say of some orders how large they become, and where."""
    rows = []
    for k in places:
        at = int(found.amplitude.values[:, k].argmax())
        row = {"order": float(found.order[k]), "amplitude": float(found.amplitude[at, k])}
        rows.append(row | {name: float(found[name][at]) for name in ("speed", "time") if name in found.coords})
    return {**_attributes(found.attrs), "rows": int(found.amplitude.shape[0]), "orders": rows}


def _attributes(attributes: dict[str, Any]) -> dict[str, Any]:
    names = ("source", "channel", "units", "shaft", "resolution", "notes")
    return {name: attributes[name] for name in names}


def _si(signal: Run | Recording) -> bool:
    from gearrattle.recording import Recording

    return isinstance(signal, Recording) or signal.model.units == "SI"


def _write(found: xr.Dataset, chart: Chart, output: Path) -> None:
    """Write a map, whole or not at all."""
    from gearrattle.plots.static import draw
    from gearrattle.report.saved import write_netcdf
    from gearrattle.writing import Staging

    with Staging(output.parent) as staging:
        if output.suffix == ".svg":
            (staging.path / output.name).write_bytes(draw(chart, legend=True))
        else:
            write_netcdf(found, staging.path / output.name, "orders")
        staging.commit()


def _tell(content: dict[str, Any], *, si: bool, json: bool) -> None:
    """Print what was found."""
    import math

    from gearrattle.cli.columns import columns
    from gearrattle.json_types import json_text

    notes, unit = content["notes"].splitlines(), content["units"].removesuffix("1")
    turning = 30.0 / math.pi if si else 1.0
    content["notes"] = notes
    for note in notes:
        print(f"note: {note}", file=sys.stderr)
    if json:
        print(json_text(content))
        return
    if "orders" in content:
        head = ("order", f"largest{f' [{unit}]' if unit else ''}", "at [rpm]" if si else "at speed")
        rows = [(f"{r['order']:g}", f"{r['amplitude']:.5g}", f"{r['speed'] * turning:.5g}") for r in content["orders"]]
        print(columns(head, rows))
    else:
        peak = content["largest"]
        at = f"{peak['speed'] * turning:.5g} {'rpm' if si else 'speed'}" if "speed" in peak else f"{peak['time']:.5g} s"
        print(f"largest: {peak['amplitude']:.5g} {unit} at {peak['frequency']:.5g} Hz, {at}")
    count = counted(content["rows"], "row")
    print(f"{count}, resolution {content['resolution']:.4g}, shaft: {content['shaft'] or 'unknown'}")
    if content["output"] is not None:
        print(f"saved: {content['output']}")
