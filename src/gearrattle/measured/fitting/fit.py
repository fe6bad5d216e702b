"""``fit``: the parameters of a rough model that agree best with data, and combinations that the data leave open."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from gearrattle.errors import ModelError, Problem
from gearrattle.measured.fitting.motion_fit import fit_motion
from gearrattle.measured.fitting.recording_table import RecordingTable, RecordingTables
from gearrattle.measured.identification.data_file import Data
from gearrattle.measured.identification.drag_data import has_drags
from gearrattle.measured.identification.drags_fit import fit_drags
from gearrattle.measured.identification.estimates import Progress, Settings
from gearrattle.measured.identification.fit_result import Fit
from gearrattle.measured.identification.modes_fit import fit_modes
from gearrattle.measured.read import read
from gearrattle.model import Model, check_model
from gearrattle.model.model_file import check_reachable, kind_of, read_tables, read_text
from gearrattle.model.pydantic_problems import Positions, model_error
from gearrattle.model.value_kinds import CALLBACK, FLAG, check_arguments
from gearrattle.recording import Recording

KIND = "data file"


def fit(
    model: Model,
    data: Data | Recording | Sequence[Recording],
    free: Sequence[str],
    *,
    bounds: Mapping[str, tuple[float | str, float | str]] | None = None,
    factor: float = 3.0,
    contact_ratio: Mapping[str, float] | None = None,
    region: Mapping[str, int] | None = None,
    starts: int = 16,
    seed: int = 0,
    prior: float | None = None,
    profile: bool = False,
    progress: Progress | None = None,
) -> Fit:
    """Find the parameters of a model that fit measured data best: modes and responses, drags, or a recorded motion.

    One function for all: what is asked, and the answer, do not depend on what was measured.

    Parameters
    ----------
    model
        the rough start; what is not free keeps its value.
    data
        path of a data file (TOML), or its tables: ``{"mode": [{"number": 2, "frequency": "55 Hz"}]}`` or
        ``{"drag": [{"of": "gear5", "file": "gear5.csv"}]}``, drag torques over speed and temperature, or
        ``{"recording": {"file": "rig.csv", "start": "2 s"}}``; or a recorded motion as ``validate`` takes it: a
        Recording, a measured file, a mapping for one. With a model whose speed changes it is a run-up, compared
        order by order over speed; a list of Recordings is one run-up and its repeats.
    free
        paths of the parameters to find, as ``Model.with_`` takes them; ``"inertia.*.J"`` frees all that match.
    bounds
        lowest and highest value by path, as in a model file.
    factor
        bounds of the others: start / factor and start * factor.
    contact_ratio
        as of ``modes``, for modes and responses that do not name their own state; every clearance is closed
        otherwise.
    region
        as of ``modes``, likewise.
    starts
        number of starts: the model itself, then a Latin hypercube in the bounds. Of a motion one is simulated at
        every start, and those that fit best are followed.
    seed
        of the hypercube and of the bootstrap over measured cycles; the same seed gives the same answer.
    prior
        standard deviation of every ln(parameter / start), as if the start had been measured; None: no prior.
    profile
        also find 95 % profile-likelihood intervals; takes some tens of local searches per parameter. Of a recorded
        motion that does not repeat itself there are none.
    progress
        called with the finished share; what it raises ends the fit.

    Returns
    -------
    Fit
        The fitted model, standard errors, residuals, all distinct minima, and what the data do not determine.

    Raises
    ------
    ModelError
        an unknown path or name, a value without unit, a mode the model does not have, bounds without the
        start, no free parameter; of a motion what ``validate`` refuses, and parameters that set the period.
    ConvergenceError
        no start converged.

    Examples
    --------
    >>> model = gr.example("case3")
    >>> second = gr.modes(model).frequencies[1] / (2.0 * np.pi)
    >>> start = model.with_({"coupling.clutch.stiffness": 1.2 * model.couplings[0].stiffness})
    >>> data = {"mode": [{"number": 2, "frequency": f"{second} Hz"}]}
    >>> fit = gr.identification.fit(start, data, ["coupling.clutch.stiffness"], starts=1)
    >>> round(fit.parameters[0].value / model.couplings[0].stiffness, 4)
    1.0

    A recorded motion, here of the model itself:

    >>> model = gr.example("backlash_oscillator")
    >>> speed = gr.simulate(model, samples_per_cycle=64).data["velocity"].sel(inertia="gear")[150 * 64 :]
    >>> channel = gr.measured.Channel("v", "velocity", "gear", "1", speed.values)
    >>> rig = gr.measured.Recording(speed.time.values, (channel,), "rig")
    >>> start = model.with_({"coupling.mesh.damping": 0.11, "simulation.samples_per_cycle": 64})
    >>> fit = gr.identification.fit(start, rig, ["coupling.mesh.damping"], starts=1)
    >>> round(fit.parameters[0].value, 4)
    0.1
    """
    check_model(model)
    check_arguments(profile=(FLAG, profile), progress=(CALLBACK, progress))
    states = {"contact_ratio": contact_ratio, "region": region}
    recorded = recording_of(data)
    settings = Settings(
        bounds=bounds or {},
        factor=factor,
        starts=starts,
        seed=seed,
        prior=prior,
        profile=profile,
        progress=progress,
    )
    if recorded is None:
        assert isinstance(data, str | os.PathLike | Mapping)
        if not has_drags(data):
            return fit_modes(model, data, free, settings, contact_ratio=contact_ratio, region=region)
        _refuse(states, "a drag torque has none")
        return fit_drags(model, data, free, settings)
    _refuse(states, "a recorded motion passes through its own")
    recordings, table = recorded
    return fit_motion(model, recordings, table, free, settings)


def _refuse(states: Mapping[str, Any], reason: str) -> None:
    """Refuse states of modes and responses for other data."""
    rule = f"is a state of modes and responses; {reason}"
    problems = [Problem(name, "", rule, "leave it out") for name, state in states.items() if state]
    if problems:
        raise ModelError(problems)


Recorded = tuple[Sequence[Recording], RecordingTable]


def recording_of(data: Data | Recording | Sequence[Recording]) -> Recorded | None:
    """Return the recorded motion, with repeats, and how it is compared; None where data are modes and responses.

    A ModelError says what is wrong with the file or the tables, and where.
    """
    if isinstance(data, Mapping) and "recording" not in data and "channel" in data:
        data = read(data)
    if isinstance(data, Mapping):
        return _named(data, Positions(), Path()) if "recording" in data else None
    if not isinstance(data, str | os.PathLike):
        recordings = [data] if isinstance(data, Recording) else list(data)
        return _named({"recording": {"file": recordings}}, Positions(), Path())
    name = os.fspath(data)
    if Path(name).suffix.lower() != ".toml" or kind_of(name) == "mapping file":
        return [read(name)], RecordingTable(file=name)
    tables, positions = read_tables(read_text(name, KIND), name, KIND)
    if "recording" in tables:
        return _named(tables, positions, Path(name).parent)
    return None


def _named(tables: Mapping[str, Any], positions: Positions, folder: Path) -> Recorded:
    """Read the recordings that a data file names."""
    try:
        table = RecordingTables.model_validate(tables).recording
    except ValidationError as error:
        raise model_error(error, tables, positions) from None
    recordings = []
    for file in table.file:
        if isinstance(file, Recording):
            recordings.append(file)
            continue
        if positions.name:  # tables from Python may name any file that their author may read
            check_reachable(file, folder)
        recordings.append(read(folder / file))
    return recordings, table
