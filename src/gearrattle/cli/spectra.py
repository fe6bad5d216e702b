"""``gearrattle spectra``: density of a signal; cross density, transfer function and coherence of two, with limits."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from gearrattle.cli.options import Json, Settings

if TYPE_CHECKING:
    import xarray as xr

    from gearrattle.cli.background import Watch
    from gearrattle.model import Model
    from gearrattle.recording import Recording
    from gearrattle.results import Run

_MOST = 8


@Parameter(name="*")
@dataclass(frozen=True)
class Averaging:
    """How densities are averaged."""

    resolution: Annotated[str | None, Parameter(help='Width of a bin, "2 Hz"; default: an eighth a segment.')] = None
    overlap: Annotated[float, Parameter(help="Share of a segment that the next has as well.")] = 0.5
    window: Annotated[str, Parameter(help='"hann", "flattop" or "boxcar".')] = "hann"
    level: Annotated[float, Parameter(help="Probability that the limits enclose what they are of.")] = 0.95


_HOW, _SETTINGS = Averaging(), Settings()


def spectra(
    source: Path,
    /,
    *,
    channel: str,
    against: str | None = None,
    model: Path | None = None,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    how: Averaging = _HOW,
    settings: Settings = _SETTINGS,
    json: Json = False,
) -> None:
    """Print where a signal's power is, and with --against how far another one explains it, with confidence limits.

    With -o, writes results.nc, results.csv, summary.json and figures/ into a folder, all or nothing.

    Parameters
    ----------
    source
        Saved motion (.nc), measured file or measurement.toml; or a model file, which is simulated.
    channel
        What to look at: "acceleration.hub", or a channel's name.
    against
        The signal taken as its cause: cross density, transfer function and coherence as well.
    model
        Model file (TOML) whose natural frequencies are marked; a run knows its own.
    output
        Folder for the numbers and figures; default: the table on the terminal only.
    """
    from dataclasses import asdict

    import gearrattle
    from gearrattle.report.staging import Staging

    driveline = None if model is None else gearrattle.load(model)
    signal = _signal(source, settings, [channel] if against is None else [channel, against])
    found = gearrattle.spectra(signal, channel, against, **asdict(how))
    content = _content(found)
    if output is not None:
        with Staging(output) as staging:
            _fill(found, content, staging.path, _natural(signal, driveline), si=_si(signal))
            staging.commit()
    _tell({**content, "output": None if output is None else str(output)}, json=json)


def _signal(source: Path, settings: Settings, channels: list[str]) -> Run | Recording:
    """Open a source, or simulate a model, if its run will have the channels.

    Raises:
        ModelError: settings for what is not simulated; a channel that a run does not have.
    """
    import gearrattle
    from gearrattle.assembly import assemble, name_plate
    from gearrattle.calls.sampled import column_of
    from gearrattle.cli.background import watched
    from gearrattle.cli.sources import heard, is_model
    from gearrattle.errors import ModelError, Problem

    arguments = settings.arguments()
    if is_model(source):
        driveline = gearrattle.load(source)
        layout = name_plate(driveline, assemble(driveline))
        for channel in channels:
            column_of(layout, channel)

        def work(watch: Watch) -> Run:
            return gearrattle.simulate(driveline, **arguments, progress=watch)

        return watched(work)
    given = [f"--{key.replace('_', '-')}" for key, value in arguments.items() if value is not None]
    if given:
        rule = "is of a simulation, and this has been simulated or measured"
        raise ModelError(Problem(", ".join(given), str(source), rule, "leave it out, or give a model file"))
    return heard(source)


def _natural(signal: Run | Recording, driveline: Model | None) -> list[float]:
    """Return natural frequencies [rad/s] of a model, or of the run's own; none of a recording alone."""
    import gearrattle
    from gearrattle.recording import Recording

    if driveline is None:
        if isinstance(signal, Recording):
            return []
        driveline = signal.model
    found = gearrattle.modes(driveline).frequencies
    return [float(value) for value in found if value > 0.0]


def _si(signal: Run | Recording) -> bool:
    from gearrattle.recording import Recording

    return isinstance(signal, Recording) or signal.model.units == "SI"


def _content(found: xr.Dataset) -> dict[str, Any]:
    """Say where the power is: the highest peaks of the density, ascending."""
    import numpy as np

    from gearrattle.report.summary import plain

    density = found["psd"].values
    inner = np.flatnonzero((density[1:-1] >= density[:-2]) & (density[1:-1] > density[2:])) + 1
    highest = sorted(sorted(inner.tolist(), key=lambda k: -density[k])[:_MOST])
    names = ["psd", "psd_low", "psd_high"]
    if "coherence" in found:
        names += ["coherence", "coherence_low", "coherence_high", "response_magnitude", "response_radius"]
        names += ["response_phase", "response_phase_limit"]
    rows = [{"frequency": float(found["frequency"][k]), **{n: float(found[n][k]) for n in names}} for k in highest]
    attributes: dict[str, Any] = plain(dict(found.attrs))
    attributes["notes"] = str(found.attrs["notes"]).splitlines()
    units = {name: str(found[name].attrs["units"]) for name in names}
    return {**attributes, "bins": int(found.sizes["frequency"]), "units_of": units, "peaks": plain(rows)}


def _fill(found: xr.Dataset, content: dict[str, Any], folder: Path, natural: list[float], *, si: bool) -> None:
    """Write all files into an existing empty folder."""
    from gearrattle.cli.columns import json_text
    from gearrattle.plots.densities import spectra_charts
    from gearrattle.plots.static import draw

    found.to_netcdf(folder / "results.nc", engine="h5netcdf")
    names = [str(name) for name in found.data_vars]
    head = ["frequency [Hz]" if si else "frequency", *(f"{name} [{found[name].attrs['units']}]" for name in names)]
    with open(folder / "results.csv", "w", encoding="utf-8", newline="\n") as stream:
        stream.write(f"# {found.attrs['channel']} of {' '.join(str(found.attrs['source']).split())}\n")
        stream.write(",".join(head) + "\n")
        for row in zip(found["frequency"].values.tolist(), *(found[n].values.tolist() for n in names), strict=True):
            stream.write(",".join(map(repr, row)) + "\n")
    (folder / "summary.json").write_text(json_text(content) + "\n", encoding="utf-8")
    (folder / "figures").mkdir()
    for chart in spectra_charts(found, si=si, natural=natural):
        (folder / "figures" / f"{chart.key}.svg").write_bytes(draw(chart, legend=True))


def _tell(content: dict[str, Any], *, json: bool) -> None:
    """Print what was found."""
    from gearrattle.cli.columns import columns, json_text

    for note in content["notes"]:
        print(f"note: {note}", file=sys.stderr)
    if json:
        print(json_text(content))
        return
    pair = "reference" in content
    head = ["Hz", f"density [{content['units_of']['psd']}]", "limits"]
    head += ["coherence", "limits", "gain", "phase [deg]"] if pair else []
    print(columns(head, [_row(row, pair=pair) for row in content["peaks"]]))
    unit = content["units"].removesuffix("1")
    rms = f"rms {content['rms']:.5g} {unit}".rstrip()
    print(f"{rms}, {content['averages']:.3g} averages, bins of {content['resolution']:.4g} Hz")
    if pair:
        print(f"coherence of independent signals stays below {content['threshold']:.3g}")
    if content["output"] is not None:
        print(f"saved: {content['output']}")


def _row(row: dict[str, Any], *, pair: bool) -> tuple[str, ...]:
    """Return a peak as text; a dash where there is no number."""
    said = {name: "-" if value is None else f"{value:.4g}" for name, value in row.items()}
    told = (said["frequency"], said["psd"], f"{said['psd_low']} to {said['psd_high']}")
    if not pair:
        return told
    phase = "-"
    if row["response_phase"] is not None and row["response_phase_limit"] is not None:
        turn = 57.29577951308232
        phase = f"{turn * row['response_phase']:.4g} ± {turn * row['response_phase_limit']:.2g}"
    limits = f"{said['coherence_low']} to {said['coherence_high']}"
    return (*told, said["coherence"], limits, f"{said['response_magnitude']} ± {said['response_radius']}", phase)
