"""Forecasts, and their comparison with the run.

A forecast is a number or a word for one quantity, made by one method before the run with which it is compared. The
quantity alone decides when a forecast counts as right: a regime must be the same, ratios may differ by 0.1, counts and
times by a factor of two.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from gearrattle.analysis.contact_ratios import ROUTES
from gearrattle.results import Run
from gearrattle.signals import parts_of, regime, rings, steady

RATIO_WITHIN = 0.1
FACTOR = 2.0
CROSSED = ("not crossed", "crossed")


@dataclass(frozen=True)
class Forecast:
    """One forecast.

    Attributes
    ----------
    quantity
        a key of ``QUANTITIES``.
    subject
        name of the clearance; empty for the whole run.
    by
        the method, in words.
    value
        number [unit] or word.
    unit
        unit of the number.
    """

    quantity: str
    subject: str
    by: str
    value: float | str
    unit: str = ""


@dataclass(frozen=True)
class Score:
    """A forecast and the value of the same quantity in the run.

    Attributes
    ----------
    forecast
        the forecast.
    happened
        value in the run.
    right
        whether the forecast counts as right.
    rule
        the rule for that, in words.
    """

    forecast: Forecast
    happened: float | str
    right: bool
    rule: str


def _regimes(run: Run) -> dict[str, float | str]:
    t = run.trajectory
    window = steady(t)
    return {name: regime(t, k, window) for k, name in enumerate(parts_of(t.layout).clearance_names)}


def _crossed(run: Run) -> dict[str, float | str]:
    return {name: CROSSED[word != "quiet"] for name, word in _regimes(run).items()}


def _ratios(run: Run) -> dict[str, float | str]:
    ratios = ROUTES["mean-slope"](run.trajectory).value
    layout = run.trajectory.layout
    faces = {layout.clearance_names[k] for ring in rings(layout) for k in ring.clearances}
    known = zip(layout.clearance_names, ratios.tolist(), strict=True)
    return {name: ratio for name, ratio in known if name not in faces}


def _crossings(run: Run) -> dict[str, float | str]:
    t = run.trajectory
    window = steady(t)
    return {"": float((t.events.time >= window.start).sum()) / window.cycles}


def _calls(run: Run) -> dict[str, float | str]:
    return {"": float(run.cost.function_calls)} if run.cost.algorithm == "exact" else {}


def _wall_time(run: Run) -> dict[str, float | str]:
    return {"": run.cost.wall_time} if run.cost.algorithm == "exact" else {}


def _horizon(run: Run) -> dict[str, float | str]:
    t = run.trajectory
    until = float(run.predictability_horizon)
    return {"": until / t.layout.period if until < t.end else math.inf}


def _same(predicted: Any, happened: Any) -> bool:
    return bool(predicted == happened)


def _near(predicted: Any, happened: Any) -> bool:
    return abs(predicted - happened) <= RATIO_WITHIN or (math.isnan(predicted) and math.isnan(happened))


def _within_factor(predicted: Any, happened: Any) -> bool:
    if predicted == happened:
        return True
    least, most = sorted((float(predicted), float(happened)))
    return least > 0.0 and most <= FACTOR * least


_TWICE = f"within a factor of {FACTOR:g}"
QUANTITIES: Mapping[str, tuple[Callable[[Run], Mapping[str, float | str]], Callable[[Any, Any], bool], str]] = {
    "regime": (_regimes, _same, "the same"),
    "corners": (_crossed, _same, "the same"),
    "mean slope": (_ratios, _near, f"within {RATIO_WITHIN:g}"),
    "crossings a cycle": (_crossings, _within_factor, _TWICE),
    "function calls": (_calls, _within_factor, _TWICE),
    "computing time": (_wall_time, _within_factor, _TWICE),
    "predictable cycles": (_horizon, _within_factor, _TWICE + ", or both to the end"),
}
"""Quantities that can be forecast: function that returns the values in a run by subject; rule; the rule in words."""


def scored(forecasts: Iterable[Forecast], run: Run) -> tuple[Score, ...]:
    """Return the forecasts that a run decides, each with the value in the run.

    A run of another algorithm does not decide the costs of ``exact``.

    ModelError: the run has no cycle after the discarded cycles.
    """
    happened: dict[str, Mapping[str, float | str]] = {}
    scores = []
    for forecast in forecasts:
        values_in, is_right, rule = QUANTITIES[forecast.quantity]
        if forecast.quantity not in happened:
            happened[forecast.quantity] = values_in(run)
        if forecast.subject in happened[forecast.quantity]:
            value = happened[forecast.quantity][forecast.subject]
            scores.append(Score(forecast, value, is_right(forecast.value, value), rule))
    return tuple(scores)
