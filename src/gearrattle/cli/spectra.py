"""``gearrattle spectra``: density of a signal; cross density, transfer function and coherence of two, with limits."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from gearrattle.cli.options import Json, Settings

if TYPE_CHECKING:
    import xarray as xr

    from gearrattle.cli.background import Watch
    from gearrattle.model import Model
    from gearrattle.recording import Recording
    from gearrattle.results import Run


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

    With -o, writes report.html, results.nc, results.csv, summary.json and figures/ into a folder, all or nothing.

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
        Folder for the page, numbers and figures; default: the table on the terminal only.
    """
    from dataclasses import asdict

    import gearrattle
    from gearrattle.cli.page_folder import page_folder

    driveline = None if model is None else gearrattle.load(model)
    if output is not None:
        with page_folder(output):  # refuses a place that cannot be written, before anything is simulated
            pass
    signal = _signal(source, settings, [channel] if against is None else [channel, against])
    found = gearrattle.spectra(signal, channel, against, **asdict(how))
    si = _si(signal)
    if output is not None:
        from gearrattle.report.spectra import fill_spectra

        with page_folder(output) as staging:
            fill_spectra(found, staging.path, si=si, natural=_natural(signal, driveline))
            staging.commit()
    _tell(found, output, si=si, json=json)


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


def _tell(found: xr.Dataset, output: Path | None, *, si: bool, json: bool) -> None:
    """Print what was found."""
    from gearrattle.cli.columns import columns
    from gearrattle.json_types import json_text
    from gearrattle.report.spectra import spectra_content
    from gearrattle.report.spectra_tables import peaks_table

    content = {**spectra_content(found), "output": None if output is None else str(output)}
    for note in content["notes"]:
        print(f"note: {note}", file=sys.stderr)
    if json:
        print(json_text(content))
        return
    table = peaks_table(content, si=si)
    print(columns(table.head, table.rows))
    unit = content["units"].removesuffix("1")
    rms = f"rms {content['rms']:.5g} {unit}".rstrip()
    print(f"{rms}, {content['averages']:.3g} averages, bins of {content['resolution']:.4g} Hz")
    if "reference" in content:
        print(f"coherence of independent signals stays below {content['threshold']:.3g}")
    if output is not None:
        print(f"saved: {output}")
        print(f"page: {output / 'report.html'}")
