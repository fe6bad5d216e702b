"""Store of a study's results, in a folder or behind an address (``storage``), from which a stopped study goes on.

    results.zarr/        one array per output over the whole grid, with names and coordinates: any xarray opens it
    study.json           what is computed: format, fingerprint, versions, outputs
    done/0000012.json    chunk 12 is whole: checksums of what it wrote, messages of its failed cases
    done/0000013.part    how far chunk 13 has come, if what computes it keeps that

A chunk's marker appears, whole, after its results. So the markers alone say what is done: a chunk without one is
computed again, and so is one whose results do not match its checksums. A chunk is a box of the grid and one Zarr chunk,
written by one worker alone.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from math import isnan
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.files import Refused
from gearrattle.formats import format_name, version_of
from gearrattle.model.path_labels import path_label
from gearrattle.model.path_values import Varied
from gearrattle.model.table import shown
from gearrattle.result import KIND
from gearrattle.studies.case_runs import DONE, MISSING, OUTCOMES, Computed, compute
from gearrattle.studies.output import Output
from gearrattle.studies.outputs import Outputs
from gearrattle.studies.plan import SAMPLE, Plan
from gearrattle.studies.storage import Address, File, Storage, storage_of
from gearrattle.studies.storage_claim import ABOUT, Claim, check_owner, holds_one
from gearrattle.studies.stored_studies import (
    DONE_FOLDER,
    OF,
    OUTCOME,
    RESULTS,
    check_regular_files,
    checksum,
    loaded_from,
    marker_in,
    marker_name,
    markers_in,
    messages_in,
)
from gearrattle.writing import flush, in_temporary_folder

if TYPE_CHECKING:
    import xarray as xr

_LONGEST_NAME = 200
ProgressCallback = Callable[[float], None]


def case_by_case(store: Store, chunk: int, progress: ProgressCallback | None) -> Computed:
    """Compute a chunk whose cases are independent."""
    return compute(store.plan, store.outputs, chunk, progress)


Work = Callable[["Store", int, ProgressCallback | None], Computed]
"""Computes a chunk, and calls ``progress`` often with the finished share; workers get it by its module and name."""


class Store:
    """Results of a study in its storage location."""

    def __init__(self, storage: Storage, plan: Plan, outputs: Outputs, work: Work = case_by_case) -> None:
        self.storage = storage
        self.plan = plan
        self.outputs = outputs
        self.work = work
        self._opened: dict[str, Any] = {}
        self._claim: Claim | None = None

    def __getstate__(self) -> dict[str, Any]:
        """State without open arrays: workers open them by themselves."""
        return {**self.__dict__, "_opened": {}, "_claim": None}

    @classmethod
    def open(cls, folder: Address, plan: Plan, outputs: Outputs, work: Work = case_by_case, *, resume: bool) -> Store:
        """Open a folder or what lies behind an address, made if it does not exist.

        A ModelError refuses one that holds a study already where ``resume`` is not set, or one of something else;
        NotInstalled where a library for the address is not here, OSError where it cannot be written.
        """
        store = cls(storage_of(folder), plan, outputs, work)
        store._claim = Claim(store.storage, resume=resume)
        try:
            store._begin()
        except BaseException:
            store.release()
            raise
        return store

    def _begin(self) -> None:
        """Begin in a storage location, or go on with what it holds."""
        storage = self.storage
        plan = self.plan
        # go on with the study that is kept there
        if storage.exists(ABOUT):
            size = check_owner(storage, self._owner(), "study").get("chunk_size")
            if isinstance(size, bool) or not isinstance(size, int) or size < 1:
                damaged = f"{storage.address}: {ABOUT}: chunk_size"
                rule = "must be a whole number of cases"
                raise ModelError(Problem(damaged, str(size), rule, "give another folder"))
            self.plan = replace(plan, chunk_size=size)
            if not self._is_laid_out():
                self._lay_out()
            return
        # say which study it is, before any other program does
        about = {
            "owner": self._owner(),
            "model": plan.model.name,
            "cases": plan.count,
            "chunks": plan.chunks,
            "chunk_size": plan.chunk_size,
        }
        try:
            storage.put(ABOUT, json.dumps(about).encode(), new=True)
        except FileExistsError:
            raise holds_one(storage) from None
        # make folders and arrays
        storage.make(DONE_FOLDER)
        self._lay_out()

    def check_claim(self) -> None:
        """Raise ModelError where a later study of this program writes into the storage location."""
        if self._claim is not None:
            self._claim.check()

    def release(self) -> None:
        """Let others write into the storage location."""
        if self._claim is not None:
            self._claim.release()

    def flush(self, folder: str = "") -> None:
        """Have everything in a folder on the disk, unless it is soon removed."""
        if self.storage.local is not None and not in_temporary_folder(self.storage.local):
            flush(self.storage.local / folder)

    def _owner(self) -> dict[str, str]:
        names = [output.name for output in self.outputs.all]
        function = self.outputs.function
        named = f"{function.__module__}.{getattr(function, '__qualname__', '')}" if function is not None else ""
        return {
            "format": format_name("study"),
            OF: self.plan.fingerprint,
            "outputs": json.dumps(names),
            "function": named,
            **{name: version_of(name) for name in ("gearrattle", "numpy", "numba")},
        }

    def _group(self) -> Any:
        return _zarr().open_group(self.storage.zarr(RESULTS), mode="r+")

    def _is_laid_out(self) -> bool:
        """Whether all arrays were made: the program that began the study may have been killed before.

        ModelError: they are of another study, or no regular files.
        """
        try:
            if self.storage.local is not None:
                for name in self.storage.local.rglob("*.partial"):  # Zarr's, of a program that was killed
                    name.unlink(missing_ok=True)
            check_regular_files(self.storage)
            group = self._group()
            kept = group.attrs.get(OF, self.plan.fingerprint)
            whole = "order" in group.attrs and all(name in group for name in self._arrays())
        except Refused as error:
            raise ModelError(Problem(self.storage.address, "", error.rule, error.remedy)) from None
        except Exception:  # Zarr may raise anything over damaged files
            return False
        if kept != self.plan.fingerprint:
            rule = f"{RESULTS} holds another study than {ABOUT} says"
            raise ModelError(Problem(self.storage.address, "", rule, "give another folder"))
        return whole

    def _arrays(self) -> list[str]:
        return [*(output.name for output in self.outputs.all), OUTCOME]

    def _lay_out(self) -> None:
        """Make every array, empty, with its names; and the coordinates."""
        group = _zarr().open_group(self.storage.zarr(RESULTS), mode="w")
        plan = self.plan
        # coordinates of axes and samples
        for axis in plan.axes:
            for path, values in axis.coordinates.items():
                single = len(axis.coordinates) == 1
                described = self._described(Varied(path, path in axis.by_factor))
                _coordinate(group, axis.name if single else path, axis.name, values, described)
            if len(axis.coordinates) > 1:
                _coordinate(group, axis.name, axis.name, axis.coordinate)
        if plan.samples is not None:
            for path, column in zip(plan.samples.paths, plan.samples.points.T, strict=True):
                described = self._described(Varied(path, path in plan.samples.by_factor))
                _coordinate(group, path, SAMPLE, column.tolist(), described)
        # arrays of outputs and outcomes
        for output in self.outputs.all:
            self._lay_out_output(group, output)
        grid = list(plan.dimensions), list(plan.shape), list(plan.chunk_shape)
        outcome = _array(group, OUTCOME, grid, "int8", MISSING)
        outcome.attrs["flag_values"] = list(range(len(OUTCOMES)))
        outcome.attrs["flag_meanings"] = " ".join(word.replace(" ", "_") for word in OUTCOMES)
        # what the study is
        group.attrs["format"] = format_name("study")
        group.attrs["source"] = f"gearrattle {version_of('gearrattle')}"
        group.attrs["model"] = plan.model.to_toml()
        group.attrs.update({KIND: "study", "kind": plan.kind, **plan.attributes})
        group.attrs["other_coordinates"] = sorted(self._extra_coordinates())
        group.attrs[OF] = plan.fingerprint
        # order of the arrays, after all else
        self.flush(RESULTS)  # nothing may be missing of what the order names
        group.attrs["order"] = self._arrays()

    def _lay_out_output(self, group: Any, output: Output) -> None:
        """Make an output's array, empty, and the coordinate of its parts."""
        dimensions = list(self.plan.dimensions)
        shape = list(self.plan.shape)
        chunks = list(self.plan.chunk_shape)
        if output.dimension:
            if output.dimension not in group:
                _coordinate(group, output.dimension, output.dimension, output.subjects)
            dimensions.append(output.dimension)
            shape.append(len(output.subjects))
            chunks.append(len(output.subjects))
        array = _array(group, output.name, (dimensions, shape, chunks), output.dtype, output.nothing)
        array.attrs.update({"units": _unit(output.unit)} | ({"sampling_error": output.error} if output.error else {}))
        if output.dimension == "cycle":  # a quantity of a section
            array.attrs["long_name"] = path_label(output.name, self.plan.model).words
        if len(output.applies_to) < len(output.subjects):
            array.attrs["applies_to"] = " ".join(map(str, output.applies_to))
        if output.lacking:
            array.attrs["lacking"] = output.lacking
            array.attrs["absent"] = "no value" if isnan(output.absent) else output.absent
        if output.words:
            array.attrs["flag_values"] = list(range(len(output.words)))
            array.attrs["flag_meanings"] = " ".join(output.words)
            array.attrs["can_rattle"] = " ".join(output.gaps)

    def _described(self, varied: Varied) -> dict[str, str]:
        """Attributes of a coordinate: name and unit of the varied value."""
        label = varied.label(self.plan.model)
        return {"long_name": label.words, "units": label.unit}

    def _extra_coordinates(self) -> list[str]:
        paths = [path for axis in self.plan.axes if len(axis.coordinates) > 1 for path in axis.coordinates]
        return [*paths, *(self.plan.samples.paths if self.plan.samples is not None else ())]

    def begin(self, chunk: int, attempt: str = "") -> None:
        """Note that a worker has begun a chunk, and by which attempt: if the worker dies, this chunk may be why."""
        self.storage.write(_begun(chunk), attempt.encode())

    def attempt(self, chunk: int) -> str:
        """Return the attempt by which a worker had begun a chunk and not ended it; empty if there is none."""
        try:
            return self.storage.read(_begun(chunk)).decode()
        except FileNotFoundError:
            return ""

    def was_begun(self, chunk: int) -> bool:
        """Return whether a worker had begun a chunk and not ended it, and forget it."""
        begun = self.storage.exists(_begun(chunk))
        self.storage.remove(_begun(chunk))
        return begun

    def compute(self, chunk: int, progress: ProgressCallback | None = None) -> Computed:
        """Compute a chunk; ``progress`` is called often with its finished share, and what it raises ends the work."""
        return self.work(self, chunk, progress)

    def part(self, chunk: int) -> File:
        """Return the file in which the progress of a chunk may be kept; it is removed when the chunk is done."""
        return File(self.storage, f"{DONE_FOLDER}/{chunk:07d}.part")

    def keep(self, chunk: int, computed: Computed) -> None:
        """Write a chunk's results, then its marker."""
        box = self.plan.box(chunk)
        written = {**computed.values, OUTCOME: computed.outcome}
        sums = {}
        if not self._opened.keys() >= written.keys():
            group = self._group()
            self._opened = {name: group[name] for name in written}
        for name, values in written.items():
            self._opened[name][(*box, *([slice(None)] * (values.ndim - len(box))))] = values
            sums[name] = checksum(values)
        messages = {",".join(map(str, at)): text for at, text in computed.messages.items()}
        failed = int(np.count_nonzero(computed.outcome != DONE))
        said = {"checksums": sums, "messages": messages, "failed": failed}
        self.storage.put(marker_name(chunk), json.dumps(said).encode())
        self.clear(chunk)

    def clear(self, chunk: int) -> None:
        """Remove the files that a finished chunk no longer needs: the note of its begin, and its progress."""
        self.storage.remove(_begun(chunk))
        self.part(chunk).unlink(missing_ok=True)

    def done(self) -> set[int]:
        """Return the chunks that have a marker."""
        return markers_in(self.storage)

    def marker(self, chunk: int) -> dict[str, Any]:
        """Return what a chunk's marker says; empty if it cannot be read."""
        return marker_in(self.storage, chunk)

    def damaged(self) -> list[int]:
        """Return the chunks whose results do not match their markers."""
        group = self._group()
        return [chunk for chunk in sorted(self.done()) if not self._holds(group, chunk)]

    def _holds(self, group: Any, chunk: int) -> bool:
        sums = self.marker(chunk).get("checksums")
        box = self.plan.box(chunk)
        if not sums:
            return False
        try:
            return all(checksum(np.asarray(group[name][box])) == crc for name, crc in sums.items())
        except Exception:  # a codec may raise anything over bytes that are not its own
            return False

    def is_done(self, chunk: int) -> bool:
        """Return whether a chunk has a marker."""
        return self.storage.exists(marker_name(chunk))

    def forget(self, chunk: int) -> None:
        """Take a chunk's marker away: it will be computed again."""
        self.storage.remove(marker_name(chunk))

    def failed(self) -> list[int]:
        """Return the chunks with a case that failed."""
        return [chunk for chunk in sorted(self.done()) if self.marker(chunk).get("failed")]

    def messages(self) -> dict[tuple[int, ...], str]:
        """Return why cases failed, by their place in the grid."""
        return messages_in(self.storage, self.plan.shape, self.plan.chunk_shape)

    def add(self, dataset: xr.Dataset) -> None:
        """Write evaluations of the whole with the results; variables of these names are replaced.

        It is announced when all of it is written.
        """
        group = self._group()
        known = [name for name in group.attrs["order"] if name not in dataset]
        group.attrs["order"] = known
        for name in dataset.variables:
            values = np.asarray(dataset[name].values)
            words = values.dtype.kind in "OU"
            data = np.array([str(value) for value in values.ravel()], dtype=object).reshape(values.shape)
            dimensions = [str(dim) for dim in dataset[name].dims]
            kind = str if words else values.dtype
            array = group.create_array(
                str(name),
                shape=values.shape,
                chunks=tuple(max(1, size) for size in values.shape),
                dtype=kind,
                dimension_names=dimensions,
                overwrite=True,
            )
            array[...] = data if words else values
            array.attrs.update(dataset[name].attrs)
        group.attrs.update(dataset.attrs)
        for name in map(str, dataset.variables):
            self.flush(f"{RESULTS}/{name}")
        group.attrs["order"] = [*known, *map(str, dataset.data_vars)]

    def dataset(self) -> xr.Dataset:
        """Return everything, in memory."""
        return loaded_from(self.storage)


def check_array_names(plan: Plan, outputs: Outputs, taken: Collection[str] = ()) -> None:
    """Refuse names under which arrays cannot be stored: each is a folder, and there is one of each name.

    ModelError: names that no file can have, and names of two arrays; all of them.
    """
    axes = {name for axis in plan.axes for name in (axis.name, *axis.coordinates)} | {*plan.dimensions}
    names = [("axis", name) for name in sorted(axes | set(plan.samples.paths if plan.samples else ()))]
    names += [("dimension", name) for name in {output.dimension for output in outputs.all} - {""}]
    names += [("output", output.name) for output in outputs.all]
    used = dict.fromkeys((OUTCOME, *taken), "variable")
    problems = []
    for kind, name in names:
        if rule := _wrong_name(name):
            problems.append(Problem(f"{kind} {name}" if isinstance(name, str) else kind, shown(name), rule))
        elif name in used:
            problems.append(
                Problem(f"{kind} {name}", "", f"this is the name of another {used[name]}", "choose another")
            )
        used.setdefault(name, kind)
    if problems:
        raise ModelError(problems)


def _wrong_name(name: object) -> str:
    """Return the fault of the name of an array; empty if there is none."""
    if not isinstance(name, str) or not name.isprintable() or not name.strip() or set(name) & {"/", "\\"}:
        return "must be a text that can be the name of a file"
    if name.startswith((".", "__")) or name == "zarr.json":
        return "is a name that Zarr keeps for itself"
    if len(name.encode()) > _LONGEST_NAME:
        return f"is too long for the name of a file: {_LONGEST_NAME} bytes at most"
    return ""


def _zarr() -> Any:
    import zarr

    return zarr


def _array(group: Any, name: str, grid: tuple[list[str], list[int], list[int]], dtype: str, fill: float) -> Any:
    """An empty array with the names, lengths and chunks of its dimensions."""
    dimensions, shape, chunks = grid
    return group.create_array(
        name, shape=tuple(shape), chunks=tuple(chunks), dtype=dtype, fill_value=fill, dimension_names=dimensions
    )


def _coordinate(
    group: Any, name: str, dimension: str, values: Any, attributes: Mapping[str, str] | None = None
) -> None:
    data = np.array(values)
    words = data.dtype.kind in "OU"
    array = group.create_array(
        name,
        shape=data.shape,
        chunks=(max(1, data.size),),
        dtype=str if words else data.dtype,
        dimension_names=[dimension],
    )
    array[:] = np.array([str(value) for value in values], dtype=object) if words else data
    array.attrs.update(attributes or {})


def _unit(units: tuple[str, ...]) -> str:
    """One unit, or those of the subjects it applies to in turn."""
    return units[0] if len(set(units)) == 1 else ", ".join(units)


def _begun(chunk: int) -> str:
    return f"{DONE_FOLDER}/{chunk:07d}.begun"
