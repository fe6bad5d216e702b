"""``gearrattle validate``: a simulated motion against a measured one."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from gearrattle.cli.options import Json, Settings, Whole, number_or_text
from gearrattle.cli.validate_run_up import OverSpeed

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.validation import Explained, Validation

_Words = Annotated[Sequence[str], Parameter(negative="")]


@Parameter(name="*")
@dataclass(frozen=True)
class Comparison:
    """How the two are compared."""

    match: Annotated[_Words, Parameter(help="MEASURED=SIMULATED, e.g. a3=acceleration.hub. May be repeated.")] = ()
    start: Annotated[float | None, Parameter(help="Of the measured record, by its clock [s].")] = None
    end: Annotated[float | None, Parameter(help="Of the measured record, by its clock [s].")] = None
    lowest: Annotated[float, Parameter(help="Lowest frequency [Hz]; 0: no high pass.")] = 0.0
    highest: Annotated[float | None, Parameter(help="Highest frequency [Hz]; default: what both rates allow.")] = None
    trend: Annotated[str, Parameter(help='Taken away from both: "none", "mean" or "linear".')] = "mean"
    clock: Annotated[str, Parameter(help='"cycle", "phase", "none", or seconds added to the measured times.')] = "cycle"
    clock_by: Annotated[str, Parameter(help="Measured channel that sets the clock.")] = ""
    threshold: Annotated[_Words, Parameter(help="CLEARANCE=VALUE [SI] where impacts count. May be repeated.")] = ()
    noise: Annotated[_Words, Parameter(help="CHANNEL=RMS [SI] of the measuring noise. May be repeated.")] = ()
    calibration: Annotated[float | None, Parameter(help="Standard uncertainty of all channels [%].")] = None
    uncertain: Annotated[_Words, Parameter(help="PATH=STANDARD_ERROR [SI] of a parameter. May be repeated.")] = ()
    draws: Annotated[Whole, Parameter(help="Runs with uncertain parameters drawn.")] = 16
    seed: Annotated[Whole, Parameter(help="Of these and of the bootstrap.")] = 0

    def arguments(self) -> dict[str, Any]:
        """Return the settings as keyword arguments of ``validate``."""
        from gearrattle.cli.assignments import numbers, words

        return {
            "match": words("--match", self.match),
            "start": self.start,
            "end": self.end,
            "band": (self.lowest, self.highest),
            "trend": self.trend,
            "clock": number_or_text(self.clock),
            "clock_by": self.clock_by,
            "thresholds": numbers("--threshold", self.threshold),
            "noise": numbers("--noise", self.noise),
            "calibration": self.calibration,
            "parameters": numbers("--uncertain", self.uncertain),
            "draws": self.draws,
            "seed": self.seed,
        }

    def unfit(self) -> list[str]:
        """Return the options given that are of a steady motion alone."""
        steady = (each for each in fields(self) if each.name != "match")
        given = [each.name for each in steady if list(_listed(getattr(self, each.name))) != list(_listed(each.default))]
        return [f"--{name.replace('_', '-')}" for name in given]


def _listed(value: Any) -> Any:
    return value if isinstance(value, list | tuple) else [value]


_HOW, _OVER_SPEED, _SETTINGS = Comparison(), OverSpeed(), Settings()


def validate(
    model: Path,
    measurement: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    how: Comparison = _HOW,
    over_speed: OverSpeed = _OVER_SPEED,
    settings: Settings = _SETTINGS,
    json: Json = False,
) -> None:
    """Compare a simulated motion with a measured one: what agrees within chance, what does not, and why not.

    A model with a sweep, or a run along one, is compared order by order over speed.

    With -o, writes report.html, summary.json and figures/ into a folder, all or nothing.

    Parameters
    ----------
    model
        Model file (TOML), simulated for this; or a saved run (.nc).
    measurement
        Measured file, or a mapping of one (measurement.toml).
    output
        Folder for the page; default: the table on the terminal only.
    """
    from gearrattle.cli.background import watched
    from gearrattle.cli.page_folder import page_folder
    from gearrattle.json_types import json_text

    if _is_run_up(model, how, over_speed):
        from gearrattle.cli.validate_run_up import validate_run_up

        files, match = (model, measurement), how.arguments()["match"]
        validate_run_up(files, over_speed, match, settings.arguments(), output, json=json)
        return
    arguments = how.arguments(), settings.arguments()
    if output is None:
        found = watched(lambda watch: _work(watch, model, measurement, arguments, None))
    else:
        with page_folder(output) as staging:
            found = watched(lambda watch: _work(watch, model, measurement, arguments, staging.path))
            staging.commit()
    for note in found.notes:
        print(f"note: {note}", file=sys.stderr)
    if json:
        from gearrattle.report.validation import validation_content

        print(json_text(validation_content(found)))
    else:
        print(_table(found))
        if found.parameters is not None:
            print(_parameters(found.parameters))
        print(found.verdict)
    if output is not None:
        print(f"page: {output / 'report.html'}", file=sys.stderr if json else sys.stdout)


def _is_run_up(model: Path, how: Comparison, over_speed: OverSpeed) -> bool:
    """Return whether speeds change; refuse options of the other kind."""
    from gearrattle.cli.validate_run_up import is_run_up
    from gearrattle.errors import ModelError, Problem

    swept = is_run_up(model)
    wrong = how.unfit() if swept else over_speed.given()
    if wrong:
        rule = (
            "is of steady motions, and this one's speed changes" if swept else "is of run-ups, and this one's is steady"
        )
        raise ModelError(Problem(", ".join(wrong), str(model), rule, "leave it out"))
    return swept


def _work(
    watch: Watch, model: Path, measurement: Path, arguments: tuple[dict[str, Any], dict[str, Any]], folder: Path | None
) -> Validation:
    """Compare; with a folder to write into, make the page as well."""
    import gearrattle
    from gearrattle.report.validation import fill_validation

    record = gearrattle.read(measurement)
    how, settings = arguments
    found = gearrattle.validate(model, record, **how, settings=settings, progress=watch)
    if folder is not None:
        watch.enter("writing the page")
        fill_validation(found, folder)
    return found


def _parameters(found: Explained) -> str:
    """What each uncertain parameter does to the rms of every channel, and how these pull it."""
    from gearrattle.cli.columns import columns

    head = ("parameter", *(f"{name} rms, %" for name in found.channels), "pulled, s.e.", "error left, %")
    rows = []
    for each in found.parameters:
        of = {effect.channel: effect for effect in each.effects if effect.measure == "rms"}
        told = (f"{of[name].value:.3g} ± {of[name].error:.2g}" for name in found.channels)
        rows.append((each.path, *told, f"{each.shift:.3g}", f"{100.0 * each.left:.3g}"))
    return columns(head, rows)


def _table(found: Validation) -> str:
    from gearrattle.cli.columns import columns

    head = ("channel", "level", "measured", "simulated", "sigma, %", "95 %", "budget, %", "unexplained, %")
    rows = [
        (
            pair.name, level.measure, f"{level.measured:.4g}", f"{level.simulated:.4g} {pair.unit}".removesuffix(" 1"),
            f"{level.sigma:.3g}", f"{level.low:.3g} to {level.high:.3g}", f"{level.expanded:.3g}",
            f"{abs(level.remainder):.3g}",
        )
        for pair in found.pairs
        for level in pair.levels
    ]  # fmt: skip
    return columns(head, rows)
