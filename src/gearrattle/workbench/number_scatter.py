"""Statistical scatter of the numbers of a run, from equal parts of its steady part.

A rattling driveline is mostly chaotic, so a number of a run is one sample of a random variable. The steady part is
divided into ``PARTS`` parts of whole cycles. A rate is the mean of the rates of the parts; its standard error is their
standard deviation over the square root of their number. The largest value of a run scatters about as much as the
largest values of the parts: the largest of many independent values has a Gumbel distribution, whose standard deviation
does not depend on their number.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from gearrattle.trajectory import Array, IntArray
from gearrattle.workbench.kept_results import impacts_of, source_of
from gearrattle.workbench.traces import Hits

Errors = Mapping[str, Mapping[str, float]]
"""Standard errors by the name of the clearance and the name of the number."""
PARTS = 8
_SURE = 2.0
"""Number of standard errors by which two numbers must differ; by chance they differ by less in 19 of 20 cases."""


def standard_errors(folder: Path) -> Errors:
    """Return the standard errors of a run's numbers by clearance; none where fewer than ``PARTS`` cycles are judged."""
    source = source_of(folder)
    assert source.period is not None  # a run has one
    cycles = round(source.step * (source.count - 1) / source.period)
    if cycles - source.discard < PARTS:
        return {}
    bounds = source.period * np.linspace(source.discard, cycles, PARTS + 1).round()
    return errors_of(impacts_of(folder), bounds)


def errors_of(impacts: Hits, bounds: Array) -> Errors:
    """Return the standard errors of the numbers of every clearance, by its name and theirs (``impacts_per_second``,
    ``max_approach_speed``, ``max_impact_energy``), from parts with (``PARTS`` + 1,) ascending bounds [s].
    """
    errors: dict[str, Mapping[str, float]] = {}
    for number, clearance in enumerate(impacts.clearances):
        own = (impacts.clearance == number) & (impacts.time >= bounds[0])
        part = np.minimum(np.searchsorted(bounds, impacts.time[own], side="right") - 1, PARTS - 1)
        rates = np.bincount(part, minlength=PARTS) / np.diff(bounds)
        errors[clearance["name"]] = {
            "impacts_per_second": _deviation(rates) / float(np.sqrt(PARTS)),
            "max_approach_speed": _deviation(_largest(part, np.abs(impacts.velocity[own]))),
            "max_impact_energy": _deviation(_largest(part, impacts.energy[own])),
        }
    return errors


def best_of(values: Sequence[float | None], errors: Sequence[float | None]) -> tuple[int | None, bool]:
    """Return the index of the smallest number if it is the smallest beyond doubt, else None, and whether the smallest
    two may differ by chance; with an unknown standard error there is no best.
    """
    there = [number for number, value in enumerate(values) if value is not None]
    known = [
        (value, error) for value, error in zip(values, errors, strict=True) if value is not None and error is not None
    ]
    if len(there) < 2 or len(known) < len(there):
        return None, False
    (least, own), *others = sorted(known)
    is_sure = all(value - least > _SURE * np.hypot(own, error) for value, error in others)
    return (there[known.index((least, own))], False) if is_sure else (None, others[-1][0] > least)


def _deviation(values: Array) -> float:
    """Return the standard deviation of a sample."""
    return float(np.std(values, ddof=1))


def _largest(part: IntArray, sizes: Array) -> Array:
    """Return the largest of every part; 0 where there is none."""
    largest = np.zeros(PARTS)
    np.maximum.at(largest, part, sizes)
    return largest
