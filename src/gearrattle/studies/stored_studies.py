"""Stored studies: their progress and their results.

    results.zarr/        one array per output over the whole grid, with names and coordinates: any xarray opens it
    study.json           what is computed: format, fingerprint, versions, outputs
    done/0000012.json    chunk 12 is whole: checksums of what it wrote, messages of its failed cases

Only chunks with a marker count. Results without a marker, or with other checksums than it holds, are shown as missing:
a power cut may have destroyed some of them.
"""

from __future__ import annotations

import json
import os
import stat
import zlib
from collections.abc import Iterable, Mapping
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem, check_installed
from gearrattle.files import Refused, reachable, within_limit
from gearrattle.formats import check_format
from gearrattle.result import KIND
from gearrattle.studies.case_runs import MISSING
from gearrattle.studies.storage import Address, Storage, storage_of
from gearrattle.studies.storage_claim import ABOUT, about_in
from gearrattle.wording import counted
from gearrattle.writing import sweep

if TYPE_CHECKING:
    import xarray as xr

OUTCOME = "outcome"
OF = "cases and model"
"""Key of the fingerprint of what a study computes, in its file and among the attributes of its results."""
RESULTS = "results.zarr"
DONE_FOLDER = "done"
_REMEDY = "resume the study, or give another folder"


def check_zarr(subject: str = "study") -> None:
    """Refuse a study where Zarr, which keeps its results, is not installed (NotInstalled)."""
    check_installed("zarr", "studies", subject, "", "results of studies need Zarr, which is not installed")


def markers_in(storage: Storage) -> set[int]:
    """Return the chunks that have a marker in a storage location."""
    stems = (name.removesuffix(".json") for name in storage.names(DONE_FOLDER) if name.endswith(".json"))
    return {int(stem) for stem in stems if stem.isdigit()}


def marker_in(storage: Storage, chunk: int) -> dict[str, Any]:
    """Return what a chunk's marker in a storage location says; empty if it cannot be read."""
    try:
        said = json.loads(storage.read(marker_name(chunk)))
    except (OSError, ValueError):
        return {}
    return said if isinstance(said, dict) else {}


def messages_in(storage: Storage, shape: tuple[int, ...], box: tuple[int, ...]) -> dict[tuple[int, ...], str]:
    """Return why cases failed, by their place in a grid of this shape whose chunks have the shape ``box``."""
    messages = {}
    along = [-(-length // taken) for length, taken in zip(shape, box, strict=True)]
    for chunk in sorted(markers_in(storage)):
        begin = [int(i) * taken for i, taken in zip(np.unravel_index(chunk, along), box, strict=True)]
        for at, text in marker_in(storage, chunk).get("messages", {}).items():
            inside = [int(i) for i in at.split(",")] if at else []
            messages[tuple(i + b for i, b in zip(inside, begin, strict=True))] = text
    return messages


def failures_of(messages: Mapping[tuple[int, ...], str]) -> list[str]:
    """Return why cases failed as the attribute ``failures`` has it, the indices of each case first."""
    return [f"{at}: {text}" for at, text in messages.items()]


def messages_of(failures: Iterable[str]) -> dict[tuple[int, ...], str]:
    """Return why cases failed by their indices, from the attribute ``failures``."""
    parted = [failure.partition("): ") for failure in failures]
    places = [tuple(int(index) for index in at.strip("(").split(",") if index.strip()) for at, _, _ in parted]
    return {index: text for index, (_, _, text) in zip(places, parted, strict=True)}


def is_whole(storage: Storage) -> bool:
    """Return whether a storage location holds a study all of whose chunks are done."""
    try:
        return bool(len(markers_in(storage)) == json.loads(storage.read(ABOUT))["chunks"])
    except (OSError, ValueError, KeyError):
        return False


def kept_in(folder: Address) -> str:
    """Return in words how much of a study a storage location holds; empty if it holds none."""
    storage = storage_of(folder)
    try:
        chunks = json.loads(storage.read(ABOUT))["chunks"]
        return f"{len(markers_in(storage))} of {counted(chunks, 'chunk')} are kept in {storage.address}"
    except (OSError, ValueError, KeyError):
        return ""


def open_study(folder: Address) -> xr.Dataset:
    """Return the results in a study's folder, in memory; plain ``xarray.open_zarr`` on results.zarr does as well.

    Parameters
    ----------
    folder
        or address that a study was written to, whole or not.

    Returns
    -------
    xr.Dataset
        The Dataset that ``study`` gives; cases not computed yet, and those whose results are damaged, have the outcome
        0, "missing". ``attrs["failures"]`` says why cases failed.

    Raises
    ------
    ModelError
        there is no study, or it cannot be read, or is larger than what may be read.
    NotInstalled
        Zarr, of the extra ``studies``, is not installed.

    Examples
    --------
    >>> axes = {"mesh.gear.backlash": ["0.05 mm", "0.1 mm"]}
    >>> _ = gr.study(gr.example("case3"), axes, outputs=["verdict"], workers=1, output="map")
    >>> dict(gr.open_study("map").sizes)
    {'mesh.gear.backlash': 2}
    """
    storage = storage_of(folder)
    if storage.local is not None:
        sweep(storage.local)  # an optimisation may have been killed while it replaced its results
    if not storage.exists(f"{RESULTS}/zarr.json"):
        raise ModelError(Problem(storage.address, "", "holds no study", "give the folder that a study was written to"))
    check_zarr(storage.address)
    try:
        check_regular_files(storage)
        return loaded_from(storage, limited=True)
    except Refused as error:
        raise ModelError(Problem(storage.address, "", error.rule, error.remedy)) from None
    except (ModelError, MemoryError, PermissionError):
        raise
    except Exception as error:  # what reads the parts of a damaged study complains as it likes
        words = " ".join(str(error).split())[:120] or type(error).__name__
        rule = "must be the folder of a study: it is damaged, or something else"
        raise ModelError(Problem(storage.address, words, rule, _REMEDY)) from None


def check_regular_files(storage: Storage) -> None:
    """Refuse a study whose results are not regular files within its folder: Zarr opens whatever is there.

    Refused: a pipe, a device, a socket, or a link to something outside.
    """
    home = storage.local
    for root, folders, names in os.walk(home / RESULTS) if home is not None else ():
        assert home is not None
        for path in (Path(root) / name for name in (*folders, *names)):
            mode = path.stat().st_mode if reachable(path, home) else 0
            if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
                raise Refused(f"{path.relative_to(home)} is no regular file", _REMEDY)


def loaded_from(storage: Storage, *, limited: bool = False) -> xr.Dataset:
    """Return the results in a storage location; ``limited``: refuse more than the limit for reading."""
    import xarray as xr
    import zarr

    # size, before anything is read
    if limited:  # before xarray reads coordinates
        group = zarr.open_group(storage.zarr(RESULTS), mode="r")
        within_limit(sum(array.nbytes for _, array in group.arrays()))
    # arrays, and the format they are in
    with xr.open_zarr(storage.zarr(RESULTS), consolidated=False, chunks=None) as opened:
        loaded = opened.load()
    if name := loaded.attrs.pop("format", ""):  # earlier versions named it in study.json alone
        check_format(name, storage.address, "study", "optimization")
    # the study that study.json names
    about = about_in(storage) if storage.exists(ABOUT) else {}
    if about.get("owner", {}).get(OF) != loaded.attrs.pop(OF, about.get("owner", {}).get(OF)):
        rule = f"{RESULTS} holds another study than {ABOUT} says"
        raise ModelError(Problem(storage.address, "", rule, "put the results of this study back"))
    if "order" not in loaded.attrs:
        raise ModelError(Problem(storage.address, "", "holds a study that was stopped before it computed", "resume it"))
    # chunks without a marker are missing
    grid = loaded[OUTCOME].shape
    box = loaded[OUTCOME].encoding.get("chunks") or grid
    if "chunks" in about:
        _hide_unfinished(loaded, zarr.open_group(storage.zarr(RESULTS), mode="r"), storage, grid, box)
    # names and order of variables
    loaded.attrs.setdefault(KIND, "study")  # earlier versions did not name it
    loaded.attrs.setdefault("failures", failures_of(messages_in(storage, grid, box)))
    extra = [name for name in loaded.attrs.pop("other_coordinates", []) if name in loaded]
    order = list(loaded.attrs.pop("order"))
    ordered: xr.Dataset = loaded.set_coords(extra)[order]
    return ordered.drop_encoding()  # that of zarr: netCDF would take it for its own, and may not have it


def _hide_unfinished(
    loaded: xr.Dataset, group: Any, storage: Storage, grid: tuple[int, ...], box: tuple[int, ...]
) -> None:
    """Remove the results of chunks without a marker, or with other checksums than it holds."""
    along = [-(-length // taken) for length, taken in zip(grid, box, strict=True)]
    names = [str(name) for name, variable in loaded.data_vars.items() if variable.shape[: len(grid)] == grid]
    arrays = dict(group.arrays())  # once: each look-up in the group reads its metadata again
    for chunk in range(prod(along)):
        at = np.unravel_index(chunk, along)
        where = tuple(slice(int(i) * taken, (int(i) + 1) * taken) for i, taken in zip(at, box, strict=True))
        sums = marker_in(storage, chunk).get("checksums") or {}
        stored = {
            name: loaded[name].values[where] if loaded[name].dtype == arrays[name].dtype else arrays[name][where]
            for name in sums
            if name in arrays
        }
        if not sums or any(name not in stored or checksum(stored[name]) != crc for name, crc in sums.items()):
            for name in names:
                loaded[name].values[where] = MISSING if name == OUTCOME else arrays[name].fill_value


def checksum(values: NDArray[Any]) -> int:
    """Return the CRC-32 of an array's bytes."""
    return zlib.crc32(np.ascontiguousarray(values).tobytes())


def marker_name(chunk: int) -> str:
    """Return the name of a chunk's marker."""
    return f"{DONE_FOLDER}/{chunk:07d}.json"
