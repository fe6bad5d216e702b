"""Distributions of uncertain model values, and space-filling samples of them.

    normal       mean, deviation; cut at three deviations unless ``cut`` says otherwise
    uniform      from, to
    log-normal   median, factor: the logarithm is normal, with the deviation log(factor); cut likewise
    triangular   from, to, likely

``{ factor = { distribution = ... } }`` scatters the factor of what the model says. At a pattern all that match have one
value, or one factor.

Points of the unit cube (``designs``), scrambled by the seed, are carried over by the inverse distribution functions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.path_values import Varied
from gearrattle.model.table import did_you_mean, shown
from gearrattle.model.value_kinds import AnyTable, Plain, checked
from gearrattle.studies.designs import DESIGNS
from gearrattle.studies.study_axes import without_factor

Array = NDArray[np.float64]

CUT = 3.0
KINDS: Mapping[str, tuple[str, ...]] = {
    "normal": ("mean", "deviation"),
    "uniform": ("from", "to"),
    "log-normal": ("median", "factor"),
    "triangular": ("from", "to", "likely"),
}


@dataclass(frozen=True)
class Distribution:
    """Distribution of one model value.

    Attributes
    ----------
    parameters
        by name, SI; ``factor`` and ``cut`` are plain.
    by_factor
        whether it is of a factor of what the model says; then all are plain.
    """

    path: str
    kind: str
    parameters: Mapping[str, float]
    by_factor: bool = False

    @property
    def varied(self) -> Varied:
        """What scatters."""
        return Varied(self.path, self.by_factor)

    def quantile(self, share: Array) -> Array:
        """Return (n,) the values below which these shares (n,) of all lie."""
        from scipy import stats

        p = self.parameters
        if self.kind == "uniform":
            return np.asarray(p["from"] + (p["to"] - p["from"]) * share)
        if self.kind == "triangular":
            width = p["to"] - p["from"]
            return np.asarray(stats.triang((p["likely"] - p["from"]) / width, p["from"], width).ppf(share))
        standard = stats.truncnorm(-p["cut"], p["cut"]).ppf(share)
        if self.kind == "normal":
            return np.asarray(p["mean"] + p["deviation"] * standard)
        return np.asarray(p["median"] * np.exp(np.log(p["factor"]) * standard))


def distributions_of(tables: Mapping[str, Any], model: Model) -> tuple[Distribution, ...]:
    """Read distributions; a ModelError has everything that is wrong with them.

    By path or pattern each is a mapping with ``distribution`` and its parameters, or ``{"factor": ...}`` about it.
    """
    problems: list[Problem] = []
    distributions = []
    for path, table in checked(AnyTable(), tables, "vary").items():
        try:
            distributions.append(_distribution(path, table, model))
        except ModelError as error:
            problems += [Problem(f"vary {path}: {p.place}", p.value, p.rule, p.remedy) for p in error.problems]
    if problems:
        raise ModelError(problems)
    return tuple(distributions)


def _distribution(path: str, entry: Any, model: Model) -> Distribution:
    # kind of distribution
    table, by_factor = without_factor(path, entry)
    varied = Varied(path, by_factor)
    kind = table.get("distribution") if isinstance(table, Mapping) else table
    if not isinstance(table, Mapping) or not isinstance(kind, str) or kind not in KINDS:
        rule = f"distribution must be one of {', '.join(KINDS)}"
        raise ModelError(Problem("distribution", shown(kind), rule, did_you_mean(str(kind), tuple(KINDS))))
    # parameters of this kind
    allowed = (*KINDS[kind], *(("cut",) if kind in ("normal", "log-normal") else ()), "distribution")
    problems = [
        Problem(key, "", f"is no parameter of {kind}; it has {', '.join(KINDS[kind])}", did_you_mean(key, allowed))
        for key in table
        if key not in allowed
    ]
    problems += [
        Problem(key, "missing", f"{kind} needs {', '.join(KINDS[kind])}") for key in KINDS[kind] if key not in table
    ]
    if problems:
        raise ModelError(problems)
    # read parameters, with the default cut
    p = {key: table[key] if key == "factor" else _read(varied, key, table[key], model) for key in KINDS[kind]}
    if kind in ("normal", "log-normal"):
        p["cut"] = table.get("cut", CUT)
    numbers = {key: checked(Plain(), value, key) for key, value in p.items()}
    _check(kind, numbers)
    distribution = Distribution(path, kind, numbers, by_factor)
    # both ends of the range are values of the model
    for end in distribution.quantile(np.array([0.0, 1.0])).tolist():
        varied.read(end, model)
    return distribution


def _read(varied: Varied, key: str, value: Any, model: Model) -> Any:
    """A deviation is a difference: it has the unit of the value, but need not be one."""
    return varied.read_change(value, model, key) if key == "deviation" else varied.read(value, model)


def _check(kind: str, p: Mapping[str, float]) -> None:
    problems = []
    if "from" in p and not p["from"] < p["to"]:
        problems.append(Problem("from", f"{p['from']:g}", f"must lie below to, {p['to']:g}"))
    if kind == "triangular" and not p["from"] <= p["likely"] <= p["to"]:
        problems.append(Problem("likely", f"{p['likely']:g}", "must lie between from and to"))
    if kind == "log-normal" and not p["factor"] > 1.0:
        problems.append(Problem("factor", f"{p['factor']:g}", "must be above 1: 1.1 scatters by some ten per cent"))
    if "cut" in p and not 0.0 < p["cut"] < np.inf:
        problems.append(Problem("cut", f"{p['cut']:g}", "must be positive: deviations beyond which nothing lies"))
    if problems:
        raise ModelError(problems)


def sampled(
    distributions: tuple[Distribution, ...], count: int, method: str, seed: int, base: Array | None = None
) -> Array:
    """Return (cases, d) points, a column a distribution; the same for the same arguments everywhere.

    ``base`` (d,) are the model's own values, for methods that go out from them.
    """
    shares = DESIGNS[method].shares(len(distributions), count, seed)
    columns = [distribution.quantile(column) for distribution, column in zip(distributions, shares.T, strict=True)]
    points = np.column_stack(columns)
    return points if base is None else np.where(np.isnan(shares), base, points)
