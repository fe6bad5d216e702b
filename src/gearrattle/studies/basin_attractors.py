"""Attractors of a basin study: the settled motions, and the one that every initial state leads to.

Periodic motions are distinguished by their orbits (``signals.strobe``): orbits nearer than ``same`` are one motion. The
exact periodic motion of each group is found by shooting from the end of one of its cases: period, verdict and
multipliers are those of that motion, not of the cases, which only come near to it. Groups from which shooting leads to
the same motion are one attractor. Where it leads to none that is stable and near, period and verdict are those of the
cases, and the attractor is not ``verified``.

Motions that are not periodic are not forced into classes: all chaotic motions are one class, because points cannot
distinguish two of them, and undecided motions are reported as such. A body that floats within its gap may do so
anywhere: such motions have neighbours that repeat as well, and those of one period and verdict are one *family*,
reported as one attractor.

The share of an attractor is that of all initial states whose case was computed, undecided ones among them. For drawn
points Wilson's interval is given with it (``signals.wilson_interval``); a grid is no sample and has none.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.multipliers import multipliers_of
from gearrattle.orbits.attractors import motion_names
from gearrattle.signals import SEVERITIES
from gearrattle.signals.strobe import Groups, grouped, room
from gearrattle.signals.wilson_interval import wilson
from gearrattle.studies.case_runs import DONE
from gearrattle.studies.dataset_layout import rattling_from
from gearrattle.studies.output import REGIMES, VERDICT, VERDICT_SEVERITY
from gearrattle.studies.plan import SAMPLE
from gearrattle.studies.poincare_sections import CHAOTIC, PERIODIC

if TYPE_CHECKING:
    import xarray as xr

    from gearrattle.orbits.attractors import Attractor

Array = NDArray[np.float64]

ATTRACTOR = "attractor"
CHAOS = 0
UNSETTLED = -1
NOTHING = -2
MOST = 300  # groups whose distances are looked at
EXACT = 1e-6
"""Motions found by shooting that are nearer than this, in units of their size, are one."""
FAR = 1e300
"""``between`` where there is one attractor, or none."""
_MEANING = "1, 2, ...: the attractor of that number; 0: chaotic; -1: undecided; -2: no result"


@dataclass(frozen=True)
class Motion:
    """Settled motion of a group of cases; verdict and severity are the codes of the worst.

    Attributes
    ----------
    cycles
        periods after which it repeats.
    multiplier
        largest modulus of a Floquet multiplier, the turning of whole trains left out; NaN where shooting led to no
        such motion.
    is_family
        whether its neighbours repeat as well.
    number
        of the attractor; groups of one number are one attractor.
    """

    verdict: int
    severity: int
    cycles: int
    multiplier: float
    is_family: bool
    number: int


def attractors_of(
    data: xr.Dataset, same: float, settled: Callable[[tuple[int, ...], int], Attractor | None] = lambda _at, _n: None
) -> xr.Dataset:
    """Find the attractors among the settled motions.

    Parameters
    ----------
    data
        of all cases: section, motion, period, verdict, outcome.
    same
        distance below which two orbits are one, in the units of the section.
    settled
        gives the periodic motion in which the case at a place of the grid, of a period number, has settled; None where
        there is none.

    Returns
    -------
    xr.Dataset
        ``basin`` over the grid: the number of the attractor, from 1, the largest share first; 0 chaotic, -1 undecided,
        -2 no result. Along "attractor": ``attractor name``, ``cases``, ``share``, ``low``, ``high``, ``attractor
        period`` [T], ``attractor verdict`` and ``attractor severity`` (codes), ``attractor multiplier``, the largest
        modulus, ``verified``, 1 where shooting led to the motion, and ``family``, 1 for one. Attributes ``within`` and
        ``between``: the largest distance inside an attractor, the smallest between two (``FAR`` for one alone);
        ``quiet_share`` of all that do not rattle, with ``quiet_low`` and ``quiet_high`` for drawn states.
    """
    import xarray as xr

    # groups of near orbits, and their motions
    grid = data["outcome"]
    orbits = _orbits(data)
    groups = grouped(orbits, same)
    standing = [orbit for i in groups.first if (orbit := orbits[i]) is not None]
    motions = _motions(data, groups, settled)
    # attractors by falling number of cases
    sizes = Counter[int]()
    for g, motion in enumerate(motions):
        sizes[motion.number] += int(np.count_nonzero(groups.label == g))
    ordered = sorted(sizes, key=lambda number: -sizes[number])
    attractor = [ordered.index(motion.number) + 1 for motion in motions]
    # basin of every case: attractor, chaos, undecided, no result
    basin = np.array([*attractor, UNSETTLED], dtype=np.int64)[groups.label]
    basin[data["motion"].values.ravel() == CHAOTIC] = CHAOS
    basin[grid.values.ravel() != DONE] = NOTHING
    # shares with Wilson's interval for samples
    among = int(np.count_nonzero(grid == DONE))
    cases = np.array([sizes[n] for n in ordered], dtype=np.int64)
    low, high = wilson(cases, np.full(len(cases), among)) if SAMPLE in grid.dims else (cases * np.nan, cases * np.nan)
    shares = {"cases": cases, "share": cases / max(among, 1), "low": low, "high": high}
    columns = {name: (ATTRACTOR, values, {"units": "1"}) for name, values in shares.items()}
    columns |= _described(data, [motions[attractor.index(n)] for n in range(1, len(cases) + 1)])
    described = {"units": "1", "meaning": _MEANING}
    # Dataset with the distances within and between attractors
    dataset = xr.Dataset(
        {"basin": (grid.dims, basin.reshape(grid.shape).astype(np.int16), described), **columns},
        {ATTRACTOR: np.arange(1, len(cases) + 1)},
        {"same": float(same), "within": groups.within, "between": min(room(standing[:MOST], attractor[:MOST]), FAR)},
    )
    quiet = quiet_share(dataset)
    return dataset.assign_attrs(
        {f"quiet_{key}": quiet[key] for key in ("share", "low", "high") if np.isfinite(quiet[key])}
    )


def _motions(
    data: xr.Dataset, groups: Groups, settled: Callable[[tuple[int, ...], int], Attractor | None]
) -> list[Motion]:
    """Settled motion of every group."""
    # verdict and period of every case
    verdicts, severities = (data[name].values.ravel().astype(np.int64) for name in (VERDICT, VERDICT_SEVERITY))
    shape = data["outcome"].shape
    period = np.nan_to_num(data["period"].values.ravel()).astype(np.int64)
    known: list[tuple[Attractor, int]] = []
    families = dict[tuple[int, int, int], int]()
    motions = []
    # periodic motion of each group, by shooting
    for g, i in enumerate(groups.first):
        at = tuple(int(k) for k in np.unravel_index(i, shape))
        cycles = int(period[i])
        attractor = settled(at, cycles)
        if attractor is None:
            # without one: verdict of most cases of the group
            mine = groups.label == g
            verdict, severity = (int(np.bincount(codes[mine]).argmax()) for codes in (verdicts, severities))
            motions.append(Motion(verdict, severity, cycles, float("nan"), False, g))
            continue
        # families by verdict and period, isolated motions by their orbit
        orbit = attractor.orbit
        verdict = REGIMES.index(orbit.verdict.verdict)
        severity = SEVERITIES.index(orbit.verdict.severity)
        if is_family := attractor.moves_deflections:
            number = families.setdefault((verdict, severity, orbit.cycles), g)
        else:
            number = next((n for other, n in known if other.is_near(orbit.motion.start, EXACT)), g)
            known.append((attractor, number))
        # largest Floquet multiplier
        multiplier = float(np.abs(multipliers_of(orbit.motion.gradient)[0]))
        motions.append(Motion(verdict, severity, orbit.cycles, multiplier, is_family, number))
    return motions


def _described(data: xr.Dataset, motions: Sequence[Motion]) -> dict[str, tuple[str, Any, dict[str, Any]]]:
    """Variables of every attractor besides its share."""
    flags, severity_flags = (
        {key: data[name].attrs[key] for key in ("flag_values", "flag_meanings")} for name in (VERDICT, VERDICT_SEVERITY)
    )
    kinds = [(_headline(m), m.cycles) for m in motions]
    families = [m.is_family for m in motions]
    multiplier = np.array([m.multiplier for m in motions], dtype=np.float64)
    return {
        "attractor name": (ATTRACTOR, np.array(motion_names(kinds, families), dtype=np.str_), {}),
        "attractor period": (ATTRACTOR, np.array([m.cycles for m in motions], dtype=np.int64), {"units": "cycles"}),
        "attractor verdict": (ATTRACTOR, np.array([m.verdict for m in motions], dtype=np.int8), flags),
        "attractor severity": (ATTRACTOR, np.array([m.severity for m in motions], dtype=np.int8), severity_flags),
        "attractor multiplier": (ATTRACTOR, multiplier, {"units": "1"}),
        "verified": (ATTRACTOR, np.isfinite(multiplier).astype(np.int8), {"units": "1"}),
        "family": (ATTRACTOR, np.array(families, dtype=np.int8), {"units": "1"}),
    }


def _headline(motion: Motion) -> str:
    """A motion in one word: its regime if it rattles, else its severity."""
    severity = SEVERITIES[motion.severity]
    return REGIMES[motion.verdict] if severity == "rattles" else severity


def _orbits(data: xr.Dataset) -> list[Array | None]:
    """The orbit of every case in order, in the units of the section; None where the motion is not periodic."""
    names = [str(name) for name in np.atleast_1d(data.attrs["section"])]
    scale = np.atleast_1d(np.asarray(data.attrs["scale"], dtype=np.float64))
    points = np.stack([data[name].values / size for name, size in zip(names, scale, strict=True)], axis=-1)
    points = points.reshape(-1, *points.shape[-2:])
    motion = data["motion"].values.ravel()
    period = np.nan_to_num(data["period"].values.ravel()).astype(np.int64)
    return [
        row[-n:] if kind == PERIODIC and n > 0 else None for row, kind, n in zip(points, motion, period, strict=True)
    ]


def orbit_of(data: xr.Dataset, number: int, name: str) -> Array:
    """Return (n,) values of one quantity along an attractor's orbit, from one of its cases."""
    index = np.argwhere(data["basin"].values == number)[0]
    one = data[name].values[tuple(index)]
    return np.asarray(one[-int(data["attractor period"].values[number - 1]) :])


def attractors_that_rattle(data: xr.Dataset) -> NDArray[np.bool_]:
    """Return (attractors,) whether each rattles: quiet ones and those that touch do not."""
    codes = data["attractor severity"] if "attractor severity" in data else data["attractor verdict"]
    rattles: NDArray[np.bool_] = codes.values >= rattling_from(codes)
    return rattles


def quiet_share(data: xr.Dataset) -> dict[str, float]:
    """Return the share of initial states that lead to an attractor without rattle.

    By name: ``cases`` of ``among``; ``share``; Wilson's 95 % interval ``low`` to ``high``, NaN for a grid; ``open``:
    the share of cases that are undecided, which may yet become quiet.
    """
    quiet = 1 + np.flatnonzero(~attractors_that_rattle(data))
    basin = data["basin"].values
    count = int(np.isin(basin, quiet).sum())
    among = int(np.count_nonzero(basin != NOTHING))
    low, high = wilson(count, among) if SAMPLE in data["basin"].dims else (np.nan, np.nan)
    return {
        "cases": count,
        "among": among,
        "share": count / max(among, 1),
        "low": float(low),
        "high": float(high),
        "open": int(np.count_nonzero(basin == UNSETTLED)) / max(among, 1),
    }
