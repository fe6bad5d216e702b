"""``validate``: agreement of a model or a run with a measurement, and the causes of disagreement."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.measured.identification.fit_result import Fit
from gearrattle.measured.read import read
from gearrattle.measured.validation.comparing import check_asked, compared
from gearrattle.measured.validation.validation_arguments import Wanted, problems_of
from gearrattle.measured.validation.validation_records import Validation
from gearrattle.model import Model, load
from gearrattle.model.table import listed
from gearrattle.model.value_kinds import CALLBACK, check_arguments
from gearrattle.recording import Recording
from gearrattle.results import Run, open_run
from gearrattle.simulation.simulate import simulate


def validate(
    model: Model | Run | str | os.PathLike[str],
    measurement: Recording | str | os.PathLike[str] | Mapping[str, object],
    *,
    match: Mapping[str, str] | None = None,
    start: float | None = None,
    end: float | None = None,
    band: tuple[float, float | None] = (0.0, None),
    trend: str = "mean",
    clock: str | float = "cycle",
    clock_by: str = "",
    thresholds: Mapping[str, float] | None = None,
    noise: Mapping[str, float] | None = None,
    calibration: Mapping[str, float] | float | None = None,
    parameters: Mapping[str, float] | Fit | None = None,
    draws: int = 16,
    seed: int = 0,
    settings: Mapping[str, object] | None = None,
    progress: Callable[[float], None] | None = None,
) -> Validation:
    """Compare a simulated motion with a measured one: the paper's Table 5 for any pair, with what chance allows.

    Parameters
    ----------
    model
        a model, simulated for it; a run; or the file of either (.toml, .nc).
    measurement
        a recording, or whatever ``read`` takes.
    match
        simulated channels by measured ones, {"a3": "acceleration.hub"}; others go by quantity and subject.
    start, end
        part of the measured record that counts, by its clock [s]; default: all of it.
    band
        lowest and highest frequency [Hz]; 0 and None: no high pass, and up to 0.4 of the coarser rate. The
        highest is rounded up to whole samples per cycle; ``Validation.band`` has it.
    trend
        "mean" or "linear" is taken away from both, "none" from neither.
    clock
        how the clocks are made one: "cycle" (correlation of the mean cycles), "phase" (that of the strongest
        order), "none", or the delay to be added to the measured times [s].
    clock_by
        measured channel that sets the clock; default: of those that agree best the one that scatters least.
    thresholds
        of the force or deflection of clearances, where impacts are counted, by clearance or channel [SI].
    noise
        rms of the measuring noise by measured channel, in its SI unit.
    calibration
        standard uncertainty of the calibration [%], of all or by measured channel.
    parameters
        standard errors by path [SI], or a Fit; the simulation is repeated with values drawn accordingly.
    draws
        number of such repetitions, two or more.
    seed
        of these and of the bootstrap.
    settings
        keyword arguments of ``simulate``, for a model.
    progress
        called with the fraction done of the simulation at hand; what it raises ends the comparison.

    Raises
    ------
    ModelError
        no channel in common, other units, too short a record, no period, bad arguments.
    ConvergenceError
        the simulation failed.

    Examples
    --------
    >>> run = gr.simulate(gr.example("case3"), cycles=40, discard=20)
    >>> speed = run.data["velocity"].sel(inertia="output_gear")
    >>> speed = speed[speed.time >= 20.0 * run.data.attrs["period"]]
    >>> channel = gr.measured.Channel("n", "velocity", "output_gear", "rad/s", 1.02 * speed.values)
    >>> rig = gr.measured.Recording(speed.time.values, (channel,), "rig")
    >>> [(level.measure, round(level.sigma, 1)) for level in gr.validate(run, rig).pairs[0].levels]
    [('peak-to-peak', 2.0), ('rms', 1.9)]
    """
    # check the arguments
    check_arguments(progress=(CALLBACK, progress))
    wanted = Wanted(
        match=match or {},
        start=start,
        end=end,
        band=band,
        trend=trend,
        clock=clock,
        clock_by=clock_by,
        thresholds=thresholds or {},
        noise=noise or {},
        calibration=calibration,
        parameters=parameters or {},
        draws=draws,
        seed=seed,
    )
    problems = list(problems_of(wanted))
    if problems:
        raise ModelError(problems)
    # the recording, and the model or run
    recording = measurement if isinstance(measurement, Recording) else read(measurement)
    driveline = opened(model)
    if isinstance(driveline, Model):
        check_asked(driveline, recording, wanted)
    return compared(run_of(driveline, settings or {}, progress), recording, wanted, progress)


def opened(source: Model | Run | str | os.PathLike[str]) -> Model | Run:
    """Return a model or a run, read where it is a file."""
    if isinstance(source, str | os.PathLike):
        return load(source) if Path(source).suffix.lower() == ".toml" else open_run(source)
    return source


def run_of(source: Model | Run | str | os.PathLike[str], settings: Mapping[str, Any], progress: Any) -> Run:
    """Return the run; a model is simulated first."""
    source = opened(source)
    if isinstance(source, Run):
        unused = [key for key, value in settings.items() if value is not None]
        if unused:
            rule = "settings are for a simulation, and this is a run that has been simulated"
            raise ModelError(Problem("settings", listed(unused), rule, "hand in the model to simulate it anew"))
        return source
    return simulate(source, **settings, progress=progress)
