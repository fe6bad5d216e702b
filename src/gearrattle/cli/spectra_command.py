"""``gearrattle spectra``: density of a signal; cross density, transfer function and coherence of two, with limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

import gearrattle
from gearrattle.cli.command_inputs import channels_of, is_model, motion_or_recording, no_channel
from gearrattle.cli.emit import emit_each
from gearrattle.cli.shared_options import Json, Output, Settings, typed
from gearrattle.errors import ModelError, Problem

if TYPE_CHECKING:
    import xarray as xr

    from gearrattle.cli.background import Watch
    from gearrattle.model import Model
    from gearrattle.recording import Recording
    from gearrattle.results import Run


@Parameter(name="*")
@dataclass(frozen=True)
class Averaging:
    """Options for averaging densities."""

    resolution: Annotated[str | None, Parameter(help='Width of a bin, "2 Hz"; default: an eighth a segment.')] = None
    overlap: Annotated[float, Parameter(help="Share of a segment that the next has as well.")] = 0.5
    window: Annotated[str, Parameter(help='"hann", "flattop" or "boxcar".')] = "hann"
    level: Annotated[float, Parameter(help="Probability that the limits enclose what they are of.")] = 0.95


_HOW = Averaging()
_SETTINGS = Settings()


def spectra(
    source: Path,
    /,
    *,
    channel: str | None = None,
    against: str | None = None,
    model: Path | None = None,
    output: Output = None,
    how: Averaging = _HOW,
    settings: Settings = _SETTINGS,
    json: Json = False,
) -> None:
    """Print where a signal's power is, and with --against how far another one explains it, with confidence limits.

    Parameters
    ----------
    source
        Saved motion (.nc), measured file or measurement.toml; or a model file, which is simulated.
    channel
        What to look at: "acceleration.hub", or a channel's name. Default: every channel of a recording in turn, in a
        folder of its own with -o.
    against
        The signal taken as its cause: cross density, transfer function and coherence as well.
    model
        Model file (TOML) whose natural frequencies are marked; a run knows its own.
    """
    from dataclasses import asdict

    driveline = None if model is None else gearrattle.load(model)
    signal, channels = _signal(source, settings, channel, against)

    def work(channel: str, watch: Watch) -> xr.Dataset:
        source = signal(watch)
        result = gearrattle.spectra(source, channel, against, **asdict(how))
        natural = _natural(source, driveline)
        return result.assign_attrs(natural_frequencies=natural) if natural else result

    works = {name: partial(work, name) for name in channels if name != against}
    emit_each("spectra", works, output, json=json, inputs=[source])


def _signal(
    source: Path, settings: Settings, channel: str | None, against: str | None
) -> tuple[Callable[[Watch], Run | Recording], tuple[str, ...]]:
    """Return a function that opens the source or simulates the model, and the names of the channels.

    Raises
    ------
    ModelError
        settings for a source that is not simulated; a channel that a run does not have.
    """
    from gearrattle.assembly import assemble
    from gearrattle.signals.spectral.sampled import column_of

    if is_model(source):
        driveline = gearrattle.load(source)
        layout = assemble(driveline).layout
        if channel is None:
            raise no_channel("--channel")
        for name in (channel, against):
            if name is not None:
                column_of(layout, name)
        return lambda watch: gearrattle.simulate(driveline, **settings.arguments(), progress=watch), (channel,)
    if options := typed(settings):
        rule = "is of a simulation, and this has been simulated or measured"
        raise ModelError(Problem(", ".join(options), str(source), rule, "leave it out, or give a model file"))
    signal = motion_or_recording(source)
    return lambda _: signal, channels_of(signal, channel, "--channel")


def _natural(signal: Run | Recording, driveline: Model | None) -> list[float]:
    """Return natural frequencies [rad/s] of a model, or of the run's own; none of a recording alone."""
    from gearrattle.recording import Recording

    if driveline is None:
        if isinstance(signal, Recording):
            return []
        driveline = signal.model
    frequencies = gearrattle.modes(driveline).frequencies
    return [float(value) for value in frequencies if value > 0.0]
