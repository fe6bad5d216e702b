"""Provenance of results: versions of the software, and the time."""

from __future__ import annotations

import platform
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError

from gearrattle.formats import version_of

_PACKAGES = ("gearrattle", "numpy", "scipy", "numba", "pydantic", "xarray", "h5netcdf")


def versions() -> dict[str, str]:
    """Return the versions of Python and of every package that takes part in the numbers, by name."""
    versions = {"python": platform.python_version()}
    for package in _PACKAGES:
        try:
            versions[package] = version_of(package)
        except PackageNotFoundError:
            continue
    return versions


def now() -> str:
    """Return the time of writing, UTC, to the second, in ISO 8601."""
    return datetime.now(UTC).isoformat(timespec="seconds").replace("+00:00", "Z")
