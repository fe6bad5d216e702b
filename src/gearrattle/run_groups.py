"""Groups in the file of a saved run: points of records, and states of auxiliaries (sliders, limiters of damping)."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from gearrattle.engine.system.crossings_in_order import Auxiliaries, Passages
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Points
from gearrattle.trajectory import Layout

AUXILIARY_VALUES = {"slider_stretch": ("memory", "rad"), "slider_force": ("force", "N m, or N for a mesh")}
"""Variables with samples of auxiliaries: the field of ``Auxiliaries`` with the values, and the unit."""
_PASSAGES = {"time": ("time", "f8"), "watch": ("watch", "i2"), "upward": ("upward", "i1"), "velocity": ("rate", "f8")}
"""Variables with crossings of auxiliaries: the field of ``Auxiliaries`` and the type in the file."""
_EARLIER_GROUP = "companions"  # name of the group "auxiliaries" in the format "gearrattle run 1"


def write_points(file: Any, stored: Points) -> None:
    """Write the points of the model's signals, one group per signal, named by the digest of its points."""
    for digest, points in stored.items():
        group = file.create_group(f"signals/{digest}")
        group.dimensions = {"point": points[0].size}
        for name, values in zip(("time", "value"), points, strict=True):
            group.create_variable(name, ("point",), "f8", data=values)


def read_points(file: Any) -> Points:
    """Read the points of the model's signals by their digest."""
    if "signals" not in file.groups:
        return {}
    groups = file.groups["signals"].groups.items()
    return {digest: (np.array(group["time"][...]), np.array(group["value"][...])) for digest, group in groups}


def write_auxiliaries(file: Any, auxiliaries: Auxiliaries) -> None:
    """Write pieces and crossings of auxiliaries as a group; their forces and memories are samples."""
    group = file.create_group("auxiliaries")
    log = auxiliaries.passages
    count, memories = log.memory.shape
    samples, sliders = auxiliaries.piece.shape
    group.dimensions = {"sample": samples, "slider": sliders, "event": count, "memory": memories}
    group.create_variable("state", ("sample", "slider"), "i1", data=auxiliaries.piece.astype("i1"))
    group.create_variable("initial", ("slider",), "i1", data=auxiliaries.initial.astype("i1"))
    for field, (name, kind) in _PASSAGES.items():
        group.create_variable(name, ("event",), kind, data=getattr(log, field).astype(kind))
    group.create_variable("stretched", ("event", "memory"), "f8", data=log.memory)


def has_auxiliaries(file: Any) -> bool:
    """Whether the file has samples and crossings of auxiliaries."""
    return bool({"auxiliaries", _EARLIER_GROUP} & set(file.groups))


def read_auxiliaries(file: Any) -> Auxiliaries:
    """Read pieces and crossings of auxiliaries, and their forces and memories."""
    group = file.groups["auxiliaries" if "auxiliaries" in file.groups else _EARLIER_GROUP]
    log: dict[str, Any] = {
        field: _real(group[name][...]).astype(float if kind == "f8" else np.int64)
        for field, (name, kind) in _PASSAGES.items()
    }
    return Auxiliaries(
        **{name: _real(file[of][...]) for of, (name, _) in AUXILIARY_VALUES.items()},
        piece=np.array(group["state"][...], np.int64),
        initial=np.array(group["initial"][...], np.int64),
        passages=Passages(**log, memory=_real(group["stretched"][...])),
    )


def _real(stored: Any) -> Any:
    """Return real numbers from a file in double precision; raise ``ValueError`` for complex numbers and others."""
    numbers = np.asarray(stored)
    if numbers.dtype.kind not in "fiu":
        raise ValueError(f"{numbers.dtype} where real numbers are needed")
    return numbers.astype(float)


def check_names(file: Any, layout: Layout, path: str | os.PathLike[str]) -> None:
    """Refuse a file whose names of inertias, clearances or elements differ from those of its model (ModelError)."""
    names = {"inertia": layout.inertia_names, "clearance": layout.clearance_names, "element": layout.element_names}
    if layout.direction_names:
        names |= {"body_direction": layout.direction_names, "bearing_direction": layout.bearing_names}
    for axis, own in names.items():
        stored = tuple(name.decode() if isinstance(name, bytes) else str(name) for name in file[axis][...])
        if stored != own:
            value = ", ".join(stored)[:60]
            rule = f"must be the names of the model: {', '.join(own)}"
            remedy = "the file was changed or is damaged: save the run again"
            raise ModelError(Problem(f"{path}: {axis}", value, rule, remedy))
