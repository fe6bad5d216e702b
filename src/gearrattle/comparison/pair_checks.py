"""Checks of two motions for comparison: same driveline, same output grid, and the window that is compared."""

from __future__ import annotations

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.signals import Window, last_cycles, steady
from gearrattle.trajectory import Trajectory
from gearrattle.wording import counted


def same_grid(candidate: Trajectory, reference: Trajectory) -> None:
    """Refuse two motions that are not of one driveline, or not sampled at the same times (ModelError)."""
    mine = candidate.layout
    theirs = reference.layout
    if mine.inertia_names != theirs.inertia_names or mine.element_names != theirs.element_names:
        value = ", ".join(mine.inertia_names + mine.element_names)
        rule = f"both motions must be of the driveline {', '.join(theirs.inertia_names + theirs.element_names)}"
        raise ModelError(Problem("comparison", value, rule, "simulate the same model with both algorithms"))
    if any(a.size != b.size for a, b in zip(mine.corners, theirs.corners, strict=True)):
        rule = "both motions must have the same corners in every clearance"
        raise ModelError(Problem("comparison", "other corners", rule, "simulate the same model with both algorithms"))
    spacing = reference.layout.period / reference.samples_per_cycle
    if candidate.time.size != reference.time.size or np.max(np.abs(candidate.time - reference.time)) > 1e-6 * spacing:
        value = f"{counted(candidate.time.size, 'sample')} from {candidate.time[0]:g} s to {candidate.end:g} s"
        rule = f"the reference has {reference.time.size} from {reference.time[0]:g} s to {reference.end:g} s"
        remedy = "simulate both with the same cycles and samples_per_cycle"
        raise ModelError(Problem("comparison", value, rule, remedy))


def samples_until(reference: Trajectory, horizon: float | None) -> int:
    """Return how many samples lie within [0, horizon] [s], at least the first; all for None or an infinite one."""
    if horizon is None:
        return int(reference.time.size)
    return max(1, int(np.searchsorted(reference.time, horizon * (1.0 + 1e-12), side="right")))


def cycles_beyond(reference: Trajectory, start: float | None) -> Window:
    """Return the whole cycles of the steady part from ``start`` [s] on, all for None; ModelError if none remains."""
    whole = steady(reference)
    if start is None:
        return whole
    period = reference.layout.period
    remaining = int(np.floor((whole.end - start) / period * (1.0 + 1e-12))) if np.isfinite(start) else 0
    if remaining < 1:
        rule = f"a whole cycle must remain before the end at {whole.end:g} s"
        remedy = "simulate more cycles; inside the predictability horizon compare pointwise"
        raise ModelError(Problem("start", f"{start:g} s", rule, remedy))
    return last_cycles(reference, remaining)


def fundamental_order(reference: Trajectory) -> float:
    """Return the lowest order of the excitation; 1 where nothing excites."""
    orders = reference.layout.orders
    return float(np.min(orders)) if orders.size else 1.0
