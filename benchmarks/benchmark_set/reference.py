"""The reference of a problem: two methods in many digits that must agree, the growth of errors, long-run statistics."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from mpmath import mp, mpf
from tests.oracles.exact_mp import Solution as Series
from tests.oracles.exact_mp import solve_at
from tests.oracles.fixed_point import fixed, real

import gearrattle as gr
from benchmarks.benchmark_set import modal
from benchmarks.benchmark_set.problems import Problem
from benchmarks.benchmark_set.statements import model_file

ENOUGH = 30
"""Digits to which the two methods must agree."""
GROWTH = 1e6
"""An error made at the start grows this much up to the horizon."""
NUDGE = mpf(10) ** -40
BATCHES = 20
STUDENT = 2.861
"""As in check.py: half width of a 99 % confidence interval from 20 batches."""


def reference(problem: Problem, statement: dict[str, Any]) -> dict[str, Any]:
    """Solve by both methods, compare them, and return what is published."""
    with mp.workdps(modal.DIGITS):
        solver = modal.Solver(statement)
        closed = solver.solve()
        grid = [fixed(x) for x in closed.times]
        series = solve_at(problem.driveline, grid)
        digits = agreement(closed, series)
        if min(digits) < ENOUGH:
            raise ArithmeticError(f"{problem.name}: the methods agree to {digits} digits only")
        growth = _growth(statement, solver, closed)
        inside = np.flatnonzero(np.array(growth) <= GROWTH)
        names = [e["name"] for e in statement["elements"]]
        bodies = [b["name"] for b in statement["bodies"]]
        # an event counts as met within a sample, or the usual distance of events if that is less
        gaps = [float(b - a) for (a, *_), (b, *_) in pairwise(closed.events)]
        return {
            "name": problem.name,
            "digits": {"events": digits[0], "states": digits[1]},
            "horizon": float(closed.times[inside[-1]]),
            "window": float(min(closed.times[1], np.median([gap for gap in gaps if gap] or [np.inf]))),
            "shortest": min(gaps, default=None),
            "statistics": _statistics(problem) if problem.statistics else None,
            "events": [
                [mp.nstr(t, 30, strip_zeros=False), names[k], a, b, mp.nstr(rate, 17)]
                for t, k, a, b, rate in closed.events
            ],
            "columns": [f"{kind}.{name}" for kind in ("angle", "velocity") for name in bodies],
            "times": [_plain(t) for t in closed.times],
            "growth": [float(f"{g:.3g}") for g in growth],
            "states": [[_plain(x) for x in row] for row in closed.states],
        }


def _plain(number: mpf) -> str:
    return mp.nstr(number, 17, strip_zeros=True)


def agreement(closed: modal.Solution, series: Series) -> tuple[int, int]:
    """Return the digits to which events and states agree, relative to the whole time and a column's largest value."""
    ours = [event[1:4] for event in closed.events]
    theirs = [(event.element, event.from_region, event.to_region) for event in series.events]
    if ours != theirs:
        raise ArithmeticError(f"the methods do not meet the same corners: {len(ours)} and {len(theirs)} events")
    off = max((abs(a[0] - real(b.time)) for a, b in zip(closed.events, series.events, strict=True)), default=mpf(0))
    states = [list(map(real, (*q, *v))) for q, v in zip(series.angle, series.velocity, strict=True)]
    worst = mpf(0)
    for mine, other in zip(zip(*closed.states, strict=True), zip(*states, strict=True), strict=True):
        size = max(abs(x) for x in mine) or mpf(1)
        worst = max(worst, max(abs(a - b) for a, b in zip(mine, other, strict=True)) / size)
    return _digits(off / closed.times[-1]), _digits(worst)


def _digits(error: mpf) -> int:
    return modal.DIGITS if error == 0 else int(-mp.log10(error))


def _growth(statement: dict[str, Any], known: modal.Solver, base: modal.Solution) -> list[float]:
    """How far nudges at the start and behind every event have grown, sample by sample.

    A nudge is a share of the body's largest velocity; growth is the largest change of a deflection or its rate, as a
    share of its largest value, over that share.
    """
    n, rows = known.statement.n, known.statement.rows
    nudges = [NUDGE * max(abs(state[n + i]) for state in base.states) for i in range(n)]
    moved = modal.Solver(statement, known, nudges).solve()
    change = np.ones(len(base.times))
    for half in (slice(0, n), slice(n, 2 * n)):
        for row in rows:
            values = [mp.fdot(row, state[half]) for state in base.states]
            others = [mp.fdot(row, state[half]) for state in moved.states]
            size = max(abs(x) for x in values) or mpf(1)
            ratio = [float(abs(a - b) / size / NUDGE) for a, b in zip(values, others, strict=True)]
            change = np.maximum(change, ratio)
    return list(np.maximum.accumulate(change))


def _statistics(problem: Problem) -> dict[str, Any]:
    """Averages of a long run of ``exact``, from batches."""
    assert problem.statistics is not None
    discard, cycles = problem.statistics
    model = gr.loads(model_file(problem))
    settings = {"cycles": cycles, "samples_per_cycle": problem.per_cycle, "discard": 0, "audit": False}
    run = gr.simulate(model, "exact", **settings)
    period = float(run.data.time.values[problem.per_cycle])
    window = (discard * period, cycles * period)
    return {"begin": window[0], "end": window[1], "values": averages(run, *window)}


def averages(run: Any, begin: float, end: float) -> dict[str, list[float]]:
    """Root mean squares of deflections and velocities, impacts a unit of time: mean and half width."""
    edges = np.linspace(begin, end, BATCHES + 1)
    time = run.data.time.values
    parts = [(time >= a) & (time < b) for a, b in pairwise(edges)]
    values = {}
    columns = [(f"rms deflection.{n}", run.data.deflection.sel(clearance=n).values) for n in run.data.clearance.values]
    columns += [(f"rms velocity.{n}", run.data.velocity.sel(inertia=n).values) for n in run.data.inertia.values]
    for name, column in columns:
        squares = np.array([np.mean(column[part] ** 2) for part in parts])
        root = np.sqrt(squares.mean())
        values[name] = [float(root), float(_width(squares) / (2 * root))]
    events = run.events
    outward = events[np.abs(events.to_region) > np.abs(events.from_region)]
    for name in run.data.clearance.values:
        counts = np.histogram(outward.time[outward.clearance == name], edges)[0] / (edges[1] - edges[0])
        values[f"impacts {name}"] = [float(counts.mean()), float(_width(counts))]
    return values


def _width(batches: Any) -> float:
    return float(STUDENT * np.std(batches, ddof=1) / np.sqrt(len(batches)))


def text(data: dict[str, Any]) -> str:
    """JSON: an event a line, a sample a line; numbers of 17 digits as they are, events as strings of 30."""
    return "{\n" + ",\n".join(_lines(data)) + "\n}\n"


def _lines(data: dict[str, Any]) -> Iterator[str]:
    for key, value in data.items():
        if key == "events":
            rows = ",\n".join("  " + json.dumps(row) for row in value)
            yield f' "{key}": [\n{rows}\n ]' if value else f' "{key}": []'
        elif key == "states":
            rows = ",\n".join(f"  [{', '.join(row)}]" for row in value)
            yield f' "{key}": [\n{rows}\n ]'
        elif key == "times":
            yield f' "{key}": [{", ".join(value)}]'
        else:
            yield f' "{key}": {json.dumps(value)}'
