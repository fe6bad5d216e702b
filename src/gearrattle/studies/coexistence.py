"""Evaluation of a bifurcation diagram: values at which two motions coexist, and stretches of one kind of motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.signals.strobe import apart
from gearrattle.studies.case_runs import DONE
from gearrattle.studies.dataset_layout import headlines_in, words_of

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

SAME = 1e-3
MOTIONS = ("one", "two")
_PERIODIC = 0


def swept(data: xr.Dataset) -> str:
    """Name of the swept axis."""
    return str(data["outcome"].dims[-1])


def swept_values(data: xr.Dataset) -> Array:
    """Return (N,) swept values; of several paths swept together those of the first by name, as in figures."""
    axis = swept(data)
    together = sorted(str(name) for name, coord in data.coords.items() if coord.dims == (axis,) and name != axis)
    values = np.asarray(data[together[0] if together else axis].values)
    return np.asarray(values if values.dtype.kind in "iuf" else data[axis].values, dtype=np.float64)


def orbit_at(data: xr.Dataset) -> Array:
    """Return (n, q) the orbit of one n-periodic case, in the units of the section."""
    names = [str(name) for name in np.atleast_1d(data.attrs["section"])]
    scale = np.atleast_1d(np.asarray(data.attrs["scale"], dtype=np.float64))
    n = int(data["period"])
    return np.column_stack([data[name].values[-n:] / size for name, size in zip(names, scale, strict=True)])


def hysteresis(data: xr.Dataset) -> xr.DataArray | None:
    """Tell at which values both directions end in different motions; None for one direction alone.

    Two motions: periodic ones whose orbits are farther apart than 1e-3 in the units of the section, or one periodic and
    one chaotic. Two chaotic ones cannot be told apart by points, and what is undecided is not judged. The codes over
    all but "direction" are 0 one, 1 two, -1 undecided.
    """
    import xarray as xr

    if data.sizes["direction"] < 2:
        return None
    grid = data["outcome"].isel(direction=0)
    differs = np.full(grid.shape, -1, dtype=np.int8)
    for at in np.ndindex(grid.shape):
        here = data.isel(dict(zip(map(str, grid.dims), at, strict=True)))
        up, down = (here.isel(direction=i) for i in range(2))
        kinds = {int(one["motion"]) for one in (up, down)}
        if any(int(one["outcome"]) != DONE for one in (up, down)):
            continue
        if kinds == {_PERIODIC}:
            differs[at] = apart(orbit_at(up), orbit_at(down)) > SAME
        elif kinds == {_PERIODIC, 1}:
            differs[at] = 1
    flags = {"flag_values": list(range(len(MOTIONS))), "flag_meanings": " ".join(MOTIONS), "units": ""}
    return xr.DataArray(differs, dims=grid.dims, attrs=flags)


@dataclass(frozen=True)
class Stretch:
    """Neighbouring values along which the motion keeps its kind.

    Attributes
    ----------
    motion
        "periodic", "chaotic", "undecided"; or what became of the case.
    period
        number of T; 0 without one.
    verdict
        the worst regime of any part if the driveline rattles, else its severity; empty if none was kept.
    """

    low: float
    high: float
    motion: str
    period: int
    verdict: str
    count: int

    @property
    def words(self) -> str:
        """Say it in a few words."""
        kind = f"period {self.period} T" if self.period else self.motion
        return f"{self.verdict}, {kind}" if self.verdict else kind


def _values_in_words(data: xr.Dataset, name: str) -> str:
    """One value of a further axis, in SI."""
    values = data[name]
    attributes = data[name].attrs
    words = attributes.get("long_name", name)
    return (
        f"{words} = {values.values:g} {attributes.get('units', '')}".strip()
        if values.dtype.kind in "iuf"
        else f"{values.values}"
    )


def stretches(data: xr.Dataset) -> list[Stretch]:
    """Return the stretches of one sweep, by ascending value."""
    values = swept_values(data)
    motions = words_of(data["motion"])
    verdicts = headlines_in(data)
    outcomes = words_of(data["outcome"])
    collected: list[Stretch] = []
    for i, value in enumerate(values.tolist()):
        outcome = int(data["outcome"].values[i])
        if outcome == DONE:
            code = int(data["motion"].values[i])
            number = float(data["period"].values[i])
            period = int(number) if np.isfinite(number) else 0
            description = (motions[code], period, str(verdicts[i]))
        else:
            description = (outcomes[outcome].replace("_", " "), 0, "")
        last = collected[-1] if collected else None
        if last is not None and (last.motion, last.period, last.verdict) == description:
            collected[-1] = Stretch(last.low, value, *description, last.count + 1)
        else:
            collected.append(Stretch(value, value, *description, 1))
    return collected


def sweeps_of(data: xr.Dataset) -> list[tuple[str, xr.Dataset]]:
    """Return every sweep with its name: the values of further axes, and the direction last."""
    import itertools

    others = [str(name) for name in data["outcome"].dims[1:-1]]
    sweeps = []
    for at in itertools.product(*(range(data.sizes[name]) for name in others)):
        here = data.isel(dict(zip(others, at, strict=True)))
        held = [_values_in_words(here, name) for name in others]
        for i, way in enumerate(data["direction"].values):
            sweeps.append((", ".join([*held, str(way)]), here.isel(direction=i)))
    return sweeps
