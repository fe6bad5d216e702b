"""Result of an optimisation: the front of designs that none beats, its growth, and model files of its members.

A design is feasible if it violates no constraint. On the front stands a feasible design that no other feasible one
beats: nowhere worse, somewhere better. How much the front covers is its hypervolume, here as a share of the box between
the best value of every objective (``ideal``) and the worst on the front and a tenth more (``reference``). Every member
of the front is computed again by itself, exactly, its energy audited: it is certified if that gives the same values
within a part in a million, within all limits, and no energy is unaccounted for.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import GearRattleError
from gearrattle.formats import format_name
from gearrattle.model import Model
from gearrattle.result import KIND
from gearrattle.results import Run
from gearrattle.simulation.simulate import simulate
from gearrattle.studies.goals import SENSES, Constraint, Objective
from gearrattle.studies.nsga2 import front_of, hypervolume
from gearrattle.studies.outputs import Outputs
from gearrattle.studies.plan import SAMPLE
from gearrattle.studies.ranges import Range
from gearrattle.studies.storage import Storage
from gearrattle.studies.stored_studies import RESULTS
from gearrattle.wording import counted
from gearrattle.writing import staged

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
Goals = tuple[tuple[Objective, ...], tuple[Constraint, ...]]
_WORDS = np.dtypes.StringDType()
DESIGN = "design"
_SAME = 1e-6
_ENERGY = 1e-6

VARIABLES = (
    "value",
    "violation",
    "front",
    "exact",
    "certified",
    "born",
    "best",
    "hypervolume",
    "design",
    "objective",
    "generation",
)
"""Names in the Dataset of an optimisation besides outputs and design variables."""


def valued(data: xr.Dataset, goals: Goals, models: Callable[[int], Model]) -> tuple[Array, Array]:
    """Return objectives of designs, (n, objectives), all to be small, and (n,) the sum of their violations."""
    objectives, constraints = goals
    columns = [SENSES[objective.sense] * objective.quantity.values(data, models) for objective in objectives]
    violation = np.zeros(data["outcome"].size)
    for constraint in constraints:
        violation = violation + constraint.violation(constraint.quantity.values(data, models))
    return np.column_stack(columns), violation


def finished(
    parts: list[xr.Dataset],
    goals: Goals,
    ranges: tuple[Range, ...],
    of: tuple[Model, Outputs],
    settings: Mapping[str, Any],
) -> xr.Dataset:
    """Return all designs in one Dataset, with the front and its growth.

    ``of`` is the model with everything that is fixed, and the outputs that were kept.
    """
    import xarray as xr

    model, outputs = of
    # all designs of all generations
    joined = xr.concat(parts, SAMPLE, coords="minimal", compat="override", join="override").rename({SAMPLE: DESIGN})
    paths = [variable.path for variable in ranges]
    born = np.repeat(np.arange(len(parts)), [part.sizes[SAMPLE] for part in parts])
    at = np.column_stack([joined[path].values for path in paths])

    def designed(i: int) -> Model:
        return model.with_(_changes(ranges, at[i].tolist()))

    # objectives, violations and front
    values, violation = valued(joined, goals, designed)
    feasible = (violation == 0.0) & np.isfinite(values).all(axis=1)
    on = _front(values, feasible)
    # growth of the front: best values and hypervolume
    grown, best, (ideal, reference) = _growth(values, feasible, on, born)
    signs = np.array([SENSES[goal.sense] for goal in goals[0]])
    # exact runs of the front, energy audited
    exact, certified = _certified(
        np.flatnonzero(on), designed, goals, lambda run: _alone(parts[0], outputs, run), values
    )
    chosen = _nearest(values, on, ideal, reference)
    # Dataset along designs and generations
    data = joined.assign(
        value=((DESIGN, "objective"), values * signs),
        violation=(DESIGN, violation),
        front=(DESIGN, on.astype(np.int8)),
        exact=((DESIGN, "objective"), exact * signs),
        certified=(DESIGN, certified),
        best=(("generation", "objective"), best * signs),
        hypervolume=("generation", grown),
    ).assign_coords(
        {
            "born": (DESIGN, born),
            "objective": [goal.quantity.label for goal in goals[0]],
            **{path: (DESIGN, joined[path].values, joined[path].attrs) for path in paths},
        }
    )
    # ranges, goals and reference point
    attributes = {
        KIND: "study",
        "kind": "optimization",
        "variables": paths,
        "low": [variable.low for variable in ranges],
        "high": [variable.high for variable in ranges],
        "log": [int(variable.log) for variable in ranges],
        "senses": [goal.sense for goal in goals[0]],
        "units": [goal.quantity.unit for goal in goals[0]],
        "constraints": [goal.words for goal in goals[1]],
        "best": chosen,
        "ideal": (ideal * signs).tolist(),
        "reference": (reference * signs).tolist(),
        **settings,
    }
    own = [variable.varied.own(model) for variable in ranges]
    attributes["own"] = int(own == at[0].tolist())
    kept = {name: joined.attrs[name] for name in ("source", "model") if name in joined.attrs}
    data.attrs = {**kept, **attributes}
    return data


def _front(values: Array, feasible: NDArray[np.bool_]) -> NDArray[np.bool_]:
    on = np.zeros(len(values), dtype=bool)
    on[feasible] = front_of(values[feasible])
    return on


def _growth(
    values: Array, feasible: NDArray[np.bool_], on: NDArray[np.bool_], born: NDArray[np.int_]
) -> tuple[Array, Array, tuple[Array, Array]]:
    """Hypervolume (g,) and best values (g, m) up to every generation; ideal and reference point."""
    count = int(born[-1]) + 1
    grown = np.zeros(count)
    best = np.full((count, values.shape[1]), np.nan)
    if not on.any():
        nothing = np.full(values.shape[1], np.nan)
        return grown, best, (nothing, nothing)
    ideal = values[on].min(axis=0)
    worst = values[on].max(axis=0)
    width = np.where(worst > ideal, worst - ideal, np.maximum(np.abs(ideal), 1.0) * 1e-3)
    reference = ideal + 1.1 * width
    for g in range(count):
        upto = feasible & (born <= g)
        if upto.any():
            best[g] = values[upto].min(axis=0)
            scaled = (values[_front(values, upto)] - ideal) / (reference - ideal)
            grown[g] = hypervolume(scaled, np.ones(values.shape[1]))
    return grown, best, (ideal, reference)


def _nearest(values: Array, on: NDArray[np.bool_], ideal: Array, reference: Array) -> int:
    """The member of the front that comes nearest to the ideal, in shares of the box; -1 for an empty front."""
    members = np.flatnonzero(on)
    if not len(members):
        return -1
    away = np.linalg.norm((values[members] - ideal) / (reference - ideal), axis=1)
    return int(members[int(np.argmin(away))])


def _certified(
    members: NDArray[np.intp],
    designed: Callable[[int], Model],
    goals: Goals,
    like: Callable[[Run], xr.Dataset],
    values: Array,
) -> tuple[Array, NDArray[np.int8]]:
    """Values of the front by runs of their own, and whether they agree; -1 where nothing was asked."""
    exact = np.full(values.shape, np.nan)
    stands = np.full(len(values), -1, dtype=np.int8)
    for i in members.tolist():
        stands[i] = 0
        try:
            model = designed(i)
            run = simulate(model, algorithm="exact", audit=True)
            confirmed = like(run)
        except GearRattleError:
            continue
        alone, violation = valued(confirmed, goals, lambda _, model=model: model)  # type: ignore[misc]
        exact[i] = alone[0]
        residual = run.cost.energy_residual
        same = np.abs(exact[i] - values[i]) <= _SAME * np.maximum(np.abs(values[i]), 1e-300)
        stands[i] = bool(same.all() and violation[0] == 0.0 and residual is not None and residual < _ENERGY)
    return exact, stands


def _alone(like: xr.Dataset, outputs: Outputs, run: Run) -> xr.Dataset:
    """Outputs of one run, as a Dataset like that of a generation, of one design."""
    dataset = like.isel({SAMPLE: [0]}).copy(deep=True)
    for name, value in outputs.of(run).items():
        dataset[name].values[0] = value
    return dataset


def _changes(ranges: tuple[Range, ...], values: Sequence[float]) -> dict[str, Any]:
    """Return the changes of the model that make a design."""
    return {variable.path: variable.varied.change(value) for variable, value in zip(ranges, values, strict=True)}


def written(data: xr.Dataset, model: Model, ranges: tuple[Range, ...], storage: Storage) -> None:
    """Write the result of an optimisation in place of the one before; on a folder all or nothing.

    All designs go to results.zarr, as ``open_study`` reads it, the best to best.toml, and the front, by its first
    objective, to front/001.toml and so on.
    """
    names = [str(name) for name in data.coords if name not in data.dims]
    words = {str(name): coord for name, coord in data.coords.items() if coord.dtype.kind in "OUT"}
    texts = {name: (variable.dims, variable.values.astype(_WORDS)) for name, variable in words.items()}
    order = [str(name) for name in data]
    whole = (
        data.drop_encoding()
        .assign_coords(texts)
        .assign_attrs(format=format_name("optimization"), other_coordinates=names, order=order)
    )

    def text(i: int) -> bytes:
        values = [float(data[variable.path][i]) for variable in ranges]
        return model.with_(_changes(ranges, values)).to_toml().encode()

    members = in_order(data)
    with staged(storage.local, partial(_sent, storage, len(members))) as folder:
        whole.to_zarr(str(folder / RESULTS), mode="w", consolidated=False)
        (folder / "front").mkdir()
        for rank, i in enumerate(members):
            (folder / "front" / f"{rank + 1:03d}.toml").write_bytes(text(i))
        if members:
            (folder / "best.toml").write_bytes(text(int(data.attrs["best"])))


def _sent(storage: Storage, members: int, folder: Path) -> None:
    """Send the files of a folder to an address; the result can be opened only when all of them are there."""
    storage.remove(f"{RESULTS}/zarr.json")
    for name in storage.names("front"):  # of an earlier, larger front
        if name.endswith(".toml") and name[:-5].isdigit() and int(name[:-5]) > members:
            storage.remove(f"front/{name}")
    storage.take(folder)


def in_order(data: xr.Dataset) -> list[int]:
    """The front's designs by their first objective, the better first."""
    members = np.flatnonzero(data["front"].values == 1)
    sign = SENSES[str(data.attrs["senses"][0])]
    return [int(i) for i in members[np.argsort(sign * data["value"].values[members, 0], kind="stable")]]


def certificate_of(data: xr.Dataset) -> str:
    """The certificate of the front, in a line."""
    count = data.sizes[DESIGN]
    front = int((data["front"] == 1).sum())
    feasible = int((data["violation"] == 0.0).sum())
    if not front:
        return f"{counted(count, 'design')}, none of them feasible"
    sure = int((data["certified"] == 1).sum())
    return f"{counted(count, 'design')}, {feasible} feasible, {front} on the front, {sure} of them certified"
