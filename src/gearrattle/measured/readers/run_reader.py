"""A saved run, as a recording of it: every inertia and element is a channel, at the samples of the output grid.

Angles and speeds of a run are fluctuations about uniform rotation; the file is that of ``Run.save`` (netCDF-4).
Names are those of its CSV: ``velocity.flywheel``.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np

from gearrattle.files import opened_hdf5
from gearrattle.formats import check_format
from gearrattle.measured.readers.reader import HDF5_SIGNATURE, Column, Raw, Request

NAME = "run"
SUFFIXES = (".nc",)
_OF_INERTIAS = {"angle": "rad", "velocity": "rad/s", "acceleration": "rad/s^2"}


def knows(path: Path, head: bytes) -> bool:
    """Return whether the root group names the format of a run."""
    if head[:8] != HDF5_SIGNATURE:
        return False
    try:
        with opened_hdf5(path) as file:
            return str(file.attrs.get("format", "")).startswith("gearrattle run ")
    except Exception:  # damaged: the reader of HDF5 will say so
        return False


def read(path: Path, request: Request) -> Raw:
    """Return its motions, deflections, forces and torques."""
    columns = []
    with opened_hdf5(path) as file:
        check_format(file.attrs["format"], path, "run")
        # variables of a run, by the axis they lie along, with their units
        time = np.array(file["time"][...])
        tables = tomllib.loads(str(file.attrs["model"]))
        meshes = {row["name"] for row in tables.get("mesh", ())}
        plain = tables.get("units") == "dimensionless"
        kept = {
            **{name: ("inertia", unit, unit) for name, unit in _OF_INERTIAS.items()},
            "deflection": ("clearance", "rad", "m"),
            "force": ("clearance", "N*m", "N"),
            "element_torque": ("element", "N*m", "N*m"),
        }
        # a column for every wanted inertia and element
        for variable, (axis, torsional, linear) in kept.items():
            quantity = "torque" if variable == "element_torque" else variable
            for k, subject in enumerate(file[axis].asstr()[...]):
                name = f"{variable}.{subject}"
                if request.wants(name):
                    unit = "" if plain else linear if subject in meshes else torsional
                    columns.append(Column(name, unit, np.array(file[variable][:, k]), time, quantity, subject))
        # the speed of a sweep
        if "speed" in file:
            columns.append(Column("speed", "" if plain else "rad/s", np.array(file["speed"][...]), time, "speed"))
        title = str(file.attrs.get("title", ""))
    note = f"simulated: {title}" if title else "simulated"
    return Raw(tuple(columns), str(path), NAME, (note,))
