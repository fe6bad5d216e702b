"""``gearrattle validate``: a simulated motion against a measured one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

import gearrattle
from gearrattle.cli.assignments import numbers, words
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Json, Output, Settings, Whole, Words, number_or_text, typed
from gearrattle.cli.validate_run_up_command import OverSpeed, is_run_up
from gearrattle.errors import ModelError, Problem

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.measured.validation import Validation


_THRESHOLD = (
    "CLEARANCE=VALUE: an impact is counted when the force or deflection of this clearance rises to VALUE [SI]. "
    "May be repeated."
)


@Parameter(name="*")
@dataclass(frozen=True)
class Comparison:
    """Options for comparing a simulated motion with a measured one."""

    match: Annotated[Words, Parameter(help="MEASURED=SIMULATED, e.g. a3=acceleration.hub. May be repeated.")] = ()
    start: Annotated[float | None, Parameter(help="First time used of the measured record [s].")] = None
    end: Annotated[float | None, Parameter(help="Last time used of the measured record [s].")] = None
    lowest: Annotated[float, Parameter(help="Lowest frequency [Hz]; 0: no high pass.")] = 0.0
    highest: Annotated[float | None, Parameter(help="Highest frequency [Hz]; default: limit of both rates.")] = None
    trend: Annotated[str, Parameter(help='Removed from both: "none", "mean" or "linear".')] = "mean"
    clock: Annotated[str, Parameter(help='"cycle", "phase", "none", or seconds added to the measured times.')] = "cycle"
    clock_by: Annotated[str, Parameter(help="Measured channel that sets the clock.")] = ""
    threshold: Annotated[Words, Parameter(help=_THRESHOLD)] = ()
    noise: Annotated[Words, Parameter(help="CHANNEL=RMS [SI] of the measuring noise. May be repeated.")] = ()
    calibration: Annotated[float | None, Parameter(help="Standard uncertainty of all channels [%].")] = None
    uncertain: Annotated[Words, Parameter(help="PATH=STANDARD_ERROR [SI] of a parameter. May be repeated.")] = ()
    draws: Annotated[Whole, Parameter(help="Runs with randomly drawn uncertain parameters.")] = 16
    seed: Annotated[Whole, Parameter(help="Seed of these runs and of the bootstrap.")] = 0

    def arguments(self) -> dict[str, Any]:
        """Return the settings as keyword arguments of ``validate``."""
        renamed = ("lowest", "highest", "threshold", "uncertain")
        return {
            **{name: value for name, value in vars(self).items() if name not in renamed},
            "match": words("--match", self.match),
            "band": (self.lowest, self.highest),
            "clock": number_or_text(self.clock),
            "thresholds": numbers("--threshold", self.threshold),
            "noise": numbers("--noise", self.noise),
            "parameters": numbers("--uncertain", self.uncertain),
        }


_HOW = Comparison()
_OVER_SPEED = OverSpeed()
_SETTINGS = Settings()


def validate(
    model: Path,
    measurement: Path,
    /,
    *,
    output: Output = None,
    how: Comparison = _HOW,
    over_speed: OverSpeed = _OVER_SPEED,
    settings: Settings = _SETTINGS,
    json: Json = False,
) -> None:
    """Compare a simulated motion with a measured one: what agrees within random scatter, what does not, and why.

    Parameters
    ----------
    model
        Model file (TOML), which is simulated; or a saved run (.nc). One with a speed sweep is compared order by order
        over speed.
    measurement
        Measured file, or a mapping file for it (measurement.toml).
    """
    if _checked_run_up(model, how, over_speed):
        from gearrattle.cli.validate_run_up_command import validate_run_up

        files = (model, measurement)
        match = how.arguments()["match"]
        validate_run_up(files, over_speed, match, settings.arguments(), output, json=json)
        return
    arguments = {**how.arguments(), "settings": settings.arguments()}

    def work(watch: Watch) -> Validation:
        return gearrattle.validate(model, gearrattle.read(measurement), **arguments, progress=watch)

    emit("validation", work, output, json=json, inputs=[model, measurement])


def _checked_run_up(model: Path, how: Comparison, over_speed: OverSpeed) -> bool:
    """Return whether the speed changes, after refusing options that apply to the other case only (ModelError)."""
    swept = is_run_up(model)
    wrong = [option for option in typed(how) if option != "--match"] if swept else typed(over_speed)
    if wrong:
        rule = (
            "applies to steady motions, and here the speed changes"
            if swept
            else "applies to run-ups, and here the speed is constant"
        )
        raise ModelError(Problem(", ".join(wrong), str(model), rule, "leave it out"))
    return swept
