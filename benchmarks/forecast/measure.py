"""Forecasts beside exact motions: errors of both contact ratios, by clearance, before and after the motions are sought.

*Linearised*: the fixed point most searches ended at, as equivalent linearisation leaves it. *Told*: what
``gr.contact_ratio`` returns. The truth is one exact run from static equilibrium; where several motions exist, another
start may lead to another truth.

Takes models; gives plain data.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any

import numpy as np

import gearrattle as gr
from benchmarks.forecast.models import KINDS, SEEDS, model
from gearrattle.model import Model

CYCLES = 300
DISCARD = 100
SAMPLES = 256
WITHIN = 0.1
QUANTITIES = {"mean_slope": "mean-slope", "gain": "describing"}


def measure_one(kind: str, seed: int, driveline: Model) -> dict[str, Any]:
    """One model: errors by quantity and clearance; NaN where no fixed point was found."""
    begin = time.perf_counter()
    run = gr.simulate(driveline, cycles=CYCLES, discard=DISCARD, samples_per_cycle=SAMPLES, audit=False)
    true = {key: gr.contact_ratio(run, method).to_numpy() for key, method in QUANTITIES.items()}
    middle = time.perf_counter()
    try:
        points = gr.contact_ratio(driveline, "describing").attrs["fixed_points"]
    except gr.ConvergenceError:
        points = []
    end = time.perf_counter()
    row: dict[str, Any] = {"kind": kind, "seed": seed, "run_s": middle - begin, "forecast_s": end - middle}
    row["motion"] = points[0]["motion"] if points else "no fixed point"
    row["stable"] = sum(point["motion"] == "stable" for point in points)
    for key, value in true.items():
        row[key] = value.tolist()
        for name in ("linearised", "told"):
            row[f"{name}_{key}"] = _error(points, name, key, value)
    return row


def _error(points: list[dict[str, Any]], name: str, key: str, true: np.ndarray) -> list[float]:
    if not points:
        return [float("nan")] * true.size
    if name == "linearised":
        value = max(points, key=lambda point: point["starts"])[key]
    else:
        stable = points[0]["motion"] == "stable"
        value = points[0][f"motion_{key}" if stable else key]
    return [float(x) for x in np.abs(np.array(list(value.values())) - true)]


def score(rows: Iterable[dict[str, Any]], name: str, key: str) -> dict[str, float]:
    """Median and largest error over all clearances that do not stay in contact, and the share within a tenth.

    A clearance without a forecast counts as one that is off by one.

    Parameters
    ----------
    rows
        of ``measure_one``.
    name
        "linearised" or "told".
    key
        "mean_slope" or "gain".
    """
    errors = [
        1.0 if np.isnan(error) else error
        for row in rows
        for error, slope in zip(row[f"{name}_{key}"], row["mean_slope"], strict=True)
        if slope < 1.0 - 1e-9
    ]
    if not errors:
        return {"clearances": 0.0, "median": float("nan"), "largest": float("nan"), "within": float("nan")}
    return {
        "clearances": float(len(errors)),
        "median": float(np.median(errors)),
        "largest": float(np.max(errors)),
        "within": float(np.mean(np.array(errors) <= WITHIN)),
    }


def measure(say: Any = print) -> dict[str, Any]:
    """Measure everything."""
    rows = []
    for kind in KINDS:
        for seed in SEEDS:
            rows.append(measure_one(kind, seed, model(kind, seed)))
            say(kind, seed, rows[-1]["motion"], f"{rows[-1]['forecast_s']:.1f} s")
    return {"cycles": CYCLES, "discard": DISCARD, "rows": rows}
