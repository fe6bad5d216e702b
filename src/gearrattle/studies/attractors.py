"""Attractors of a basin study: which settled motion every initial state leads to, distinguished by their sections.

Periodic motions are distinguished by their orbits (``signals.strobe``): if these are nearer than ``same``, it is one
motion. Motions that are not periodic are not forced into classes: all chaotic motions are one class, because points
cannot distinguish two of them, and undecided motions are reported as such. A body that floats within its gap may do so
anywhere: such motions have neighbours that are settled as well (``sections.is_isolated``), and those of one period and
verdict are one *family*, reported as one attractor.

The share of an attractor is that of all initial states whose case was computed, undecided ones among them. For drawn
points Wilson's interval is given with it (``probability``); a grid is no sample and has none.

Takes the Dataset of the cases; gives what is made of it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.signals.strobe import grouped, room
from gearrattle.studies.cases import DONE
from gearrattle.studies.layout import words_of
from gearrattle.studies.plan import SAMPLE
from gearrattle.studies.probability import wilson
from gearrattle.studies.sections import CHAOTIC, PERIODIC

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

ATTRACTOR = "attractor"
CHAOS = 0
UNSETTLED = -1
NOTHING = -2
MOST = 300  # groups whose distances are looked at
FAR = 1e300
"""``between`` where there is one attractor, or none."""
_MEANING = "1, 2, ...: the attractor of that number; 0: chaotic; -1: undecided; -2: no result"


def attractors_of(
    data: xr.Dataset, same: float, isolated: Callable[[tuple[int, ...], int], bool] = lambda _at, _n: True
) -> xr.Dataset:
    """Tell attractors apart.

    Parameters
    ----------
    data
        of all cases: section, motion, period, verdict, outcome.
    same
        distance below which two orbits are one, in the units of the section.
    isolated
        whether the settled motion of the case at a place of the grid, of a period number, has none of its
        like about it.

    Returns
    -------
    xr.Dataset
        ``basin`` over the grid: the number of the attractor, from 1, the largest share first; 0 chaotic, -1 undecided,
        -2 no result. Along "attractor": ``cases``, ``share``, ``low``, ``high``, ``attractor period`` [T], ``attractor
        verdict`` (codes), ``agreeing``, the share of its cases with that verdict, and ``family``, 1 for one. Attributes
        ``within`` and ``between``: the largest distance inside an attractor, the smallest between two (``FAR`` for one
        alone); ``quiet_share`` of all quiet ones, with ``quiet_low`` and ``quiet_high`` for drawn states.
    """
    import xarray as xr

    grid, orbits = data["outcome"], _orbits(data)
    groups = grouped(orbits, same)
    standing = [orbit for i in groups.first if (orbit := orbits[i]) is not None]
    verdicts, outcome = data["verdict"].values.ravel().astype(np.int64), grid.values.ravel()
    keys: list[tuple[int, ...]] = []
    for g, (i, orbit) in enumerate(zip(groups.first, standing, strict=True)):
        at = tuple(int(k) for k in np.unravel_index(i, grid.shape))
        keys.append((g,) if isolated(at, len(orbit)) else (-1, len(orbit), int(verdicts[i])))
    sizes = {key: sum(int(np.count_nonzero(groups.label == g)) for g, k in enumerate(keys) if k == key) for key in keys}
    ordered = sorted(sizes, key=lambda key: -sizes[key])
    family = [ordered.index(key) + 1 for key in keys]
    basin = np.array([*family, UNSETTLED], dtype=np.int64)[groups.label]
    basin[data["motion"].values.ravel() == CHAOTIC] = CHAOS
    basin[outcome != DONE] = NOTHING
    among, cases = int(np.count_nonzero(outcome == DONE)), np.array([sizes[key] for key in ordered], dtype=np.int64)
    low, high = wilson(cases, np.full(len(cases), among)) if SAMPLE in grid.dims else (cases * np.nan, cases * np.nan)
    codes = [np.bincount(verdicts[basin == n], minlength=3) for n in range(1, len(cases) + 1)]
    flags = {key: data["verdict"].attrs[key] for key in ("flag_values", "flag_meanings")}
    periods = [len(standing[family.index(n)]) for n in range(1, len(cases) + 1)]
    columns: dict[str, tuple[str, Any, dict[str, Any]]] = {
        "cases": (ATTRACTOR, cases, {"units": "1"}),
        "share": (ATTRACTOR, cases / max(among, 1), {"units": "1"}),
        "low": (ATTRACTOR, low, {"units": "1"}),
        "high": (ATTRACTOR, high, {"units": "1"}),
        "attractor period": (ATTRACTOR, np.array(periods, dtype=np.int64), {"units": "cycles"}),
        "attractor verdict": (ATTRACTOR, np.array([int(code.argmax()) for code in codes], dtype=np.int8), flags),
        "agreeing": (ATTRACTOR, np.array([code.max() / code.sum() for code in codes]), {"units": "1"}),
        "family": (ATTRACTOR, np.array([key[0] < 0 for key in ordered], dtype=np.int8), {"units": "1"}),
    }
    described = {"units": "1", "meaning": _MEANING}
    dataset = xr.Dataset(
        {"basin": (grid.dims, basin.reshape(grid.shape).astype(np.int16), described), **columns},
        {ATTRACTOR: np.arange(1, len(cases) + 1)},
        {"same": float(same), "within": groups.within, "between": min(room(standing[:MOST], family[:MOST]), FAR)},
    )
    quiet = quiet_share(dataset)
    return dataset.assign_attrs(
        {f"quiet_{key}": quiet[key] for key in ("share", "low", "high") if np.isfinite(quiet[key])}
    )


def _orbits(data: xr.Dataset) -> list[Array | None]:
    """The orbit of every case in order, in the units of the section; None where the motion is not periodic."""
    names = [str(name) for name in np.atleast_1d(data.attrs["section"])]
    scale = np.atleast_1d(np.asarray(data.attrs["scale"], dtype=np.float64))
    points = np.stack([data[name].values / size for name, size in zip(names, scale, strict=True)], axis=-1)
    points = points.reshape(-1, *points.shape[-2:])
    motion, period = data["motion"].values.ravel(), np.nan_to_num(data["period"].values.ravel()).astype(np.int64)
    return [
        row[-n:] if kind == PERIODIC and n > 0 else None for row, kind, n in zip(points, motion, period, strict=True)
    ]


def orbit_of(data: xr.Dataset, number: int, name: str) -> Array:
    """Return (n,) values of one quantity along an attractor's orbit, from one of its cases."""
    index = np.argwhere(data["basin"].values == number)[0]
    one = data[name].values[tuple(index)]
    return np.asarray(one[-int(data["attractor period"].values[number - 1]) :])


def quiet_share(data: xr.Dataset) -> dict[str, float]:
    """Return how likely a quiet attractor is.

    Parameters
    ----------
    data
        what ``basins`` returned.

    Returns
    -------
    dict[str, float]
        ``cases`` of ``among``; ``share``; Wilson's 95 % interval ``low`` to ``high``, NaN for a grid; ``open``: the
        share of cases that are undecided, which may yet become quiet.
    """
    words = words_of(data["attractor verdict"])
    quiet = [i + 1 for i, code in enumerate(data["attractor verdict"].values.tolist()) if words[code] == "quiet"]
    basin = data["basin"].values
    count, among = int(np.isin(basin, quiet).sum()), int(np.count_nonzero(basin != NOTHING))
    low, high = wilson(count, among) if SAMPLE in data["basin"].dims else (np.nan, np.nan)
    return {
        "cases": count,
        "among": among,
        "share": count / max(among, 1),
        "low": float(low),
        "high": float(high),
        "open": int(np.count_nonzero(basin == UNSETTLED)) / max(among, 1),
    }
