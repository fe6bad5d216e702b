"""The arguments of a validation, and the checks of them that need no data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from gearrattle.errors import Problem
from gearrattle.measured.identification.fit_result import Fit
from gearrattle.model.table import listed, shown
from gearrattle.model.value_kinds import SEED, Count, argument_problems

TRENDS = ("none", "mean", "linear")
CLOCKS = ("cycle", "phase", "none")


@dataclass(frozen=True)
class Wanted:
    """Arguments of a comparison; attributes as those of ``validate``."""

    match: Mapping[str, str] = field(default_factory=dict)
    start: float | None = None
    end: float | None = None
    band: tuple[float, float | None] = (0.0, None)
    trend: str = "mean"
    clock: str | float = "cycle"
    clock_by: str = ""
    thresholds: Mapping[str, float] = field(default_factory=dict)
    noise: Mapping[str, float] = field(default_factory=dict)
    calibration: Mapping[str, float] | float | None = None
    parameters: Mapping[str, float] | Fit = field(default_factory=dict)
    draws: int = 16
    seed: int = 0


def problems_of(wanted: Wanted) -> list[Problem]:
    """Return the problems of the arguments that need no data."""
    problems = []
    if wanted.trend not in TRENDS:
        problems.append(Problem("trend", shown(wanted.trend), f"must be one of {listed(TRENDS)}"))
    if isinstance(wanted.clock, str) and wanted.clock not in CLOCKS:
        problems.append(Problem("clock", shown(wanted.clock), f"must be one of {listed(CLOCKS)}, or a delay in s"))
    low, high = wanted.band
    if not low >= 0.0 or (high is not None and not low < high < float("inf")):
        problems.append(Problem("band", f"{low} to {high} Hz", "must ascend from 0 or more"))
    if wanted.start is not None and wanted.end is not None and not wanted.start < wanted.end:
        problems.append(Problem("start, end", f"{wanted.start} s, {wanted.end} s", "must ascend"))
    problems += argument_problems({"draws": (Count(2), wanted.draws), "seed": (SEED, wanted.seed)})
    stated = dict(wanted.noise)
    if isinstance(wanted.calibration, Mapping):
        stated |= {f"calibration of {name}": value for name, value in wanted.calibration.items()}
    elif wanted.calibration is not None:
        stated["calibration"] = wanted.calibration
    for name, value in stated.items():
        if not 0.0 <= value < float("inf"):
            problems.append(Problem(f"noise, calibration: {name}", f"{value}", "must be a finite number, 0 or more"))
    return problems
