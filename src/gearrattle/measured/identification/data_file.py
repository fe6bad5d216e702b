"""Reading of a data file, or of the same tables from Python, into ``Measurements``.

Checks that need the model are made here too: names of inertias and elements, numbers of modes, the order of
frequencies. Standard errors that were not given are assumed, with a note.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from gearrattle.assembly import coordinate_names
from gearrattle.errors import ModelError, Problem
from gearrattle.measured.identification.data_tables import DataTables, ModeTable, ResponseTable, StateTable
from gearrattle.measured.identification.measured_modes import (
    QUANTITIES,
    MeasuredMode,
    MeasuredResponse,
    Measurements,
    State,
)
from gearrattle.measured.identification.response_file import Samples, read_samples
from gearrattle.model import Model
from gearrattle.model.model_file import check_reachable, read_tables, read_text
from gearrattle.model.pydantic_problems import Positions, model_error, place
from gearrattle.model.table import Breach, did_you_mean, listed, shown
from gearrattle.wording import counted

FREQUENCY_ERROR = 0.01
SHAPE_ERROR = 0.02
RESPONSE_ERROR = 0.05
"""Relative standard errors assumed where none are given."""

Data = str | os.PathLike[str] | Mapping[str, Any]


def read_data(data: Data, model: Model, default: State) -> Measurements:
    """Read data and check them against a model; a ModelError has every problem and its place in the file."""
    tables, positions, folder = tables_of(data)
    dimensionless = model.units == "dimensionless"
    try:
        read = DataTables.model_validate(tables, context={"dimensionless": dimensionless})
    except ValidationError as error:
        raise model_error(error, tables, positions) from None
    breaches = [*_mode_breaches(read.modes, model), *_response_breaches(read.responses, model)]
    if breaches:
        raise ModelError(Problem(place(b.location, {}, positions), _value_shown(b), b.rule, b.remedy) for b in breaches)
    assumed: list[str] = []
    modes = tuple(_mode(index, row, default, assumed) for index, row in enumerate(read.modes))
    responses = tuple(
        _response(index, row, default, (folder, positions, dimensionless), assumed)
        for index, row in enumerate(read.responses)
    )
    return Measurements(modes, responses, tuple(assumed))


def tables_of(data: Data) -> tuple[Mapping[str, Any], Positions, Path]:
    """Return the tables of a data file, with their positions and the folder of the file."""
    if isinstance(data, Mapping):
        return data, Positions(), Path()
    name = os.fspath(data)
    return *read_tables(read_text(name, "data file"), name, "data file"), Path(name).parent


def _value_shown(item: Breach) -> str:
    return "" if item.value is ... else shown(item.value)


def _state_breaches(at: tuple[str | int, ...], row: StateTable, model: Model) -> Iterator[Breach]:
    elements = [element.name for element in model.elements]
    named = {"contact_ratio": row.contact_ratio or {}, "region": row.region or {}, "rigid": row.rigid}
    for key, names in named.items():
        for name in names:
            if name not in elements:
                rule = f"there is no such element; there are {listed(elements)}"
                yield Breach((*at, key), name, rule, did_you_mean(name, elements))
    for name, ratio in (row.contact_ratio or {}).items():
        if not 0 <= ratio <= 1:
            yield Breach((*at, "contact_ratio"), ratio, f"{name}: must lie between 0 and 1")
    for name, region in (row.region or {}).items():
        if region != round(region):
            yield Breach((*at, "region"), region, f"{name}: must be a whole number")


def _mode_breaches(rows: Sequence[ModeTable], model: Model) -> Iterator[Breach]:
    # names and numbers that the model does not have
    names = [inertia.name for inertia in model.inertias]
    numbered: dict[Any, list[tuple[int, float, int]]] = {}
    for index, row in enumerate(rows):
        at = ("mode", index)
        yield from _state_breaches(at, row, model)
        for name in row.shape or {}:
            if name not in names:
                rule = f"no inertia has this name; there are {listed(names)}"
                yield Breach((*at, "shape", name), name, rule, did_you_mean(name, names))
        count = len(coordinate_names(model))
        if row.number is not None and row.number > count:
            of_what = "one for each inertia" + (" and each direction" if count > len(names) else "")
            yield Breach((*at, "number"), row.number, f"the model has {counted(count, 'mode')}, {of_what}")
        omega = _omega(row)
        if row.number is not None and omega is not None:
            numbered.setdefault(_state(row, State()), []).append((row.number, omega, index))
    # frequencies in the order of their numbers
    for group in numbered.values():
        group.sort()
        for (number, omega, _), (next_number, next_omega, index) in pairwise(group):
            if number < next_number and omega > next_omega:
                rule = f"the data are inconsistent: mode {next_number} lies below mode {number} ({omega:.6g} rad/s)"
                yield Breach(("mode", index), f"{next_omega:.6g} rad/s", rule, "modes count upwards in frequency")


def _response_breaches(rows: Sequence[ResponseTable], model: Model) -> Iterator[Breach]:
    names = [inertia.name for inertia in model.inertias]
    for index, row in enumerate(rows):
        at = ("response", index)
        yield from _state_breaches(at, row, model)
        for key in ("at", "torque_on"):
            name = getattr(row, key)
            if name not in names:
                rule = f"no inertia has this name; there are {listed(names)}"
                yield Breach((*at, key), name, rule, did_you_mean(name, names))


def _omega(row: ModeTable) -> float | None:
    return row.omega if row.frequency is None else row.frequency


def _state(row: StateTable, default: State) -> State:
    if row.contact_ratio is None and row.region is None and not row.rigid:
        return default
    region = {name: round(label) for name, label in (row.region or {}).items()}
    return State(
        tuple(sorted((row.contact_ratio or {}).items())), tuple(sorted(region.items())), tuple(sorted(set(row.rigid)))
    )


def _mode(index: int, row: ModeTable, default: State, assumed: list[str]) -> MeasuredMode:
    # the frequency and its standard error, assumed where none is stated
    label = f"mode {row.number}" if row.number is not None else f"mode entry {index + 1}"
    label += f" with rigid {', '.join(row.rigid)}" if row.rigid else ""
    omega = _omega(row)
    shape = row.shape or {}
    error = row.standard_error
    if omega is not None and error is None:
        if row.relative_error is None:
            assumed.append(f"{label}: {100 * FREQUENCY_ERROR:g} % of its frequency")
        error = (row.relative_error or FREQUENCY_ERROR) * omega
    # the shape and its standard error, likewise
    amplitudes = np.array(list(shape.values()), dtype=float)
    if shape and row.shape_error is None:
        assumed.append(f"{label}: {100 * SHAPE_ERROR:g} % of the largest amplitude of its shape")
    spread = (row.shape_error or SHAPE_ERROR) * float(np.abs(amplitudes).max(initial=0.0))
    return MeasuredMode(
        label=label,
        number=row.number,
        omega=omega,
        omega_error=error or 0.0,
        inertias=tuple(shape),
        shape=amplitudes,
        shape_error=np.full(amplitudes.size, spread),
        state=_state(row, default),
    )


def _response(
    index: int, row: ResponseTable, default: State, source: tuple[Path, Positions, bool], assumed: list[str]
) -> MeasuredResponse:
    # samples from the table or from its file
    label = f"response {index + 1}, {row.at} by {row.torque_on}"
    folder, positions, dimensionless = source
    where = place(("response", index), {}, positions)
    if row.file is None:
        samples = Samples(row.omega, row.value.astype(complex), row.error, None)
    else:
        path = folder / row.file
        if positions.name:
            check_reachable(row.file, folder)
        samples = read_samples(read_text(path, "response file"), os.fspath(path), dimensionless)
    # the quantity per torque: as stated, or by the unit of the file
    said = None if row.quantity is None else QUANTITIES.index(row.quantity)
    if said is None and samples.derivatives is None:
        words = ", ".join(f'"{word}"' for word in QUANTITIES)
        raise ModelError(Problem(where, "", f"needs quantity, as the file names no units: {words}"))
    if said is not None and samples.derivatives not in (None, said):
        quantity = QUANTITIES[samples.derivatives or 0]
        raise ModelError(Problem(f"{where}.quantity", shown(row.quantity), f"the file's unit is one of {quantity}"))
    # standard errors, assumed where none are stated
    magnitude = np.abs(samples.value)
    if not magnitude.any():
        raise ModelError(Problem(where, "zeros only", "a response must not vanish everywhere"))
    error = samples.error
    if error is None:
        if row.relative_error is None:
            assumed.append(f"{label}: {100 * RESPONSE_ERROR:g} % of each sample")
        error = np.hypot((row.relative_error or RESPONSE_ERROR) * magnitude, row.floor * magnitude.max())
        if not error.all():
            rule = "a sample of zero needs a standard error: a part of zero is none"
            raise ModelError(Problem(where, f"sample {int(np.argmin(error))}", rule, "such as floor = 0.001"))
    derivatives = samples.derivatives if said is None else said
    return MeasuredResponse(
        label, row.at, row.torque_on, derivatives or 0, samples.omega, samples.value, error, _state(row, default)
    )
