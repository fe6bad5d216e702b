"""``gearrattle fit``: parameters from measured modes, frequency responses, drags, or from a recorded motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

import gearrattle
from gearrattle.cli.assignments import labels, numbers, words
from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Changes, Json, OutputPath, Whole, Words, number_or_text
from gearrattle.cli.validate_run_up_command import OverSpeed
from gearrattle.errors import ModelError, Problem

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.measured.identification.fit_result import Fit


@Parameter(name="*")
@dataclass(frozen=True)
class Search:
    """Options for the fit."""

    bounds: Annotated[Words, Parameter(help="PATH=LOW..HIGH, values as in a model file. May be repeated.")] = ()
    factor: Annotated[float, Parameter(help="Bounds of the others: start divided and multiplied by this.")] = 3.0
    contact_ratio: Annotated[Words, Parameter(help="NAME=RATIO, for data without a state. May be repeated.")] = ()
    region: Annotated[Words, Parameter(help="NAME=LABEL, for data without a state. May be repeated.")] = ()
    starts: Annotated[Whole, Parameter(help="Searches: from the model, then from all over the bounds.")] = 16
    seed: Annotated[Whole, Parameter(help="Of the starts.")] = 0
    prior: Annotated[float | None, Parameter(help="Standard deviation of ln(parameter/start); default: none.")] = None
    profile: Annotated[bool, Parameter(help="Also 95 % profile-likelihood intervals.")] = False

    def arguments(self) -> dict[str, Any]:
        """Return the settings as keyword arguments of ``fit``."""
        return {
            **vars(self),
            "bounds": _bounds(self.bounds),
            "contact_ratio": numbers("--contact-ratio", self.contact_ratio),
            "region": labels("--region", self.region),
        }


@Parameter(name="*")
@dataclass(frozen=True)
class Recorded:
    """Options for comparing a recorded motion, instead of the table [recording] of a data file."""

    match: Annotated[Words, Parameter(help="MEASURED=SIMULATED, e.g. a3=acceleration.hub. May be repeated.")] = ()
    start: Annotated[float | None, Parameter(help="First time used of the measured record [s].")] = None
    end: Annotated[float | None, Parameter(help="Last time used of the measured record [s].")] = None
    cycles: Annotated[Whole | None, Parameter(help="Length of each simulation; default: the model's.")] = None
    discard: Annotated[Whole | None, Parameter(help="Cycles left out at its start; default: the model's.")] = None

    def data(self, data: Path, over_speed: OverSpeed) -> Path | dict[str, Any]:
        """Return the path of a data file, or tables with the path of a measured file and these options."""
        settings = {"cycles": self.cycles, "discard": self.discard}
        table = {
            "match": words("--match", self.match),
            "start": self.start,
            "end": self.end,
            "orders": list(over_speed.order),
            "turns": over_speed.turns,
            "shaft": over_speed.shaft,
            "settings": {name: value for name, value in settings.items() if value is not None},
        }
        table = {name: value for name, value in table.items() if value not in (None, {}, [])}
        files = [str(data), *over_speed.repeat]
        return {"recording": {"file": files, **table}} if table or over_speed.repeat else data


_DEFAULTS = Search()
_RECORDED = Recorded()
_OVER_SPEED = OverSpeed()


def fit(
    model: Path,
    data: Path,
    /,
    *,
    free: Words = (),
    output: OutputPath = None,
    search: Search = _DEFAULTS,
    recorded: Recorded = _RECORDED,
    over_speed: OverSpeed = _OVER_SPEED,
    changes: Changes = (),
    json: Json = False,
) -> None:
    """Fit parameters to measured frequencies, responses, drags or to a recorded motion; say what stays open.

    Parameters
    ----------
    model
        Model file (TOML): the rough start. One with a speed sweep is fitted order by order over speed.
    data
        Data file (TOML) with [[mode]] and [[response]] tables, with [[drag]], or with [recording]; or a measured file,
        or a mapping for it (measurement.toml), as validate takes it.
    free
        Path of a parameter to fit, e.g. coupling.clutch.stiffness; "inertia.*.J" frees all that match. May be repeated.
    output
        File for the fitted model, ending in .toml; or a folder for report.html, summary.json, results.nc and figures/;
        or a file for the numbers, ending in .nc or .csv. Default: the answer on the terminal only.
    """
    start = changed_model(model, changes)
    arguments = search.arguments()
    measured = recorded.data(data, over_speed)

    def work(watch: Watch) -> Fit:
        watch.enter("fitting")
        return gearrattle.identification.fit(start, measured, free, progress=watch, **arguments)

    emit("fit", work, output, json=json, inputs=[model, data, *(Path(path) for path in over_speed.repeat)])


def _bounds(entries: Sequence[str]) -> dict[str, tuple[Any, Any]]:
    """Split words of the form PATH=LOW..HIGH."""
    bounds: dict[str, tuple[Any, Any]] = {}
    for text in entries:
        path, _, ends = text.partition("=")
        low, dots, high = ends.partition("..")
        if not (path and low.strip() and dots and high.strip()):
            raise ModelError(
                Problem("--bounds", f'"{text}"', "must be PATH=LOW..HIGH", 'such as "inertia.hub.J=1e-4..1e-3"')
            )
        bounds[path] = number_or_text(low.strip()), number_or_text(high.strip())
    return bounds
