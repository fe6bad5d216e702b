"""Motions written by hand, whose every answer is known without a computer.

Omega = 2 pi, so the period is one second. Two bodies, a coupling to ground and a mesh; accelerations are given as
functions of time, crossings as rows (time, clearance, from, to, velocity, force integral).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gearrattle.trajectory import Array, Cost, EventLog, IntArray, Layout, Trajectory

OMEGA = 2.0 * np.pi
Row = tuple[float, int, int, int, float, float]


def layout(**changes: Any) -> Layout:
    """Return a driver on a spring to ground, and a loose gear on it through a mesh with a gap of +-1."""
    plate = Layout(
        inertia_names=("driver", "loose"),
        inertia=np.array([2.0, 0.5]),
        drag_torque=np.array([0.0, 3.0]),
        stiffness=np.array([100.0, 100.0]),
        element_names=("spring", "gear"),
        is_mesh=np.array([False, True]),
        between=np.array([[0, -1], [0, 1]]),
        radii=np.array([[1.0, 1.0], [0.06, 0.02]]),
        rows=np.array([[1.0, 0.0], [0.06, -0.02]]),
        clearance=np.array([1]),
        corners=(np.array([-1.0, 1.0]),),
        region_of_first_piece=np.array([-1]),
        stiffness_of_piece=(np.array([100.0, 0.0, 100.0]),),
        damping_of_piece=(np.array([1.0, 0.0, 1.0]),),
        omega=OMEGA,
        period=1.0,
        orders=np.array([1.0]),
        reference=0,
    )
    plate = replace(plate, **changes)
    if "rows" in changes:
        return plate
    return replace(plate, rows=rows_between(plate.between, plate.radii, len(plate.inertia_names)))


def rows_between(between: IntArray, radii: Array, bodies: int) -> Array:
    """Return W of elements between two bodies: +R_a at the first, -R_b at the second, nothing at ground (-1)."""
    rows = np.zeros((len(between), bodies))
    for row, ends, arms in zip(rows, between.tolist(), radii.tolist(), strict=True):
        for end, arm, sign in zip(ends, arms, (1.0, -1.0), strict=True):
            if end >= 0:
                row[end] = sign * arm
    return rows


def staged(corners: Sequence[float], first: int, stiffness: Sequence[float]) -> Layout:
    """Return the same with the given piecewise-linear law in the coupling, and no gap in the mesh."""
    return layout(
        clearance=np.array([0]),
        corners=(np.array(corners, dtype=np.float64),),
        region_of_first_piece=np.array([first]),
        stiffness_of_piece=(np.array(stiffness, dtype=np.float64),),
        damping_of_piece=(np.zeros(len(stiffness)),),
    )


def two_gaps() -> Layout:
    """Return the same with a gap of +-1 in the coupling as well as in the mesh."""
    return layout(
        clearance=np.array([0, 1]),
        corners=(np.array([-1.0, 1.0]),) * 2,
        region_of_first_piece=np.array([-1, -1]),
        stiffness_of_piece=(np.array([1.0, 0.0, 1.0]),) * 2,
        damping_of_piece=(np.zeros(3),) * 2,
    )


def log(rows: Sequence[Row]) -> EventLog:
    """Return an event log from rows (time, clearance, from, to, velocity, force integral)."""
    columns = list(zip(*rows, strict=True)) if rows else [()] * 6
    kinds = (np.float64, np.int64, np.int64, np.int64, np.float64, np.float64)
    return EventLog(*(np.array(column, dtype=kind) for column, kind in zip(columns, kinds, strict=True)))


def chain(regions: Sequence[int], times: Sequence[float], clearance: int = 0) -> list[Row]:
    """Return rows of one clearance through the regions, at the given times, with velocity +-1 and no integral."""
    steps = zip(times, regions[:-1], regions[1:], strict=True)
    return [(t, clearance, a, b, float(b - a), 0.0) for t, a, b in steps]


def still(time: Array) -> Array:
    """Return no acceleration at all."""
    return np.zeros_like(time)


def trajectory(
    plate: Layout | None = None,
    rows: Sequence[Row] = (),
    accelerations: Sequence[Callable[[Array], Array]] = (still, still),
    *,
    initial: Sequence[int] | None = None,
    final: float = 0.0,
    cycles: int = 4,
    discard: int = 0,
    samples: int = 64,
    **changes: Any,
) -> Trajectory:
    """Return a motion with the given crossings and accelerations; deflections and forces are left at zero."""
    plate = layout() if plate is None else plate
    clearances = plate.clearance.size
    time = np.arange(cycles * samples + 1) * (plate.period / samples)
    none = np.zeros((time.size, 2))
    motion = Trajectory(
        layout=plate,
        time=time,
        angle=none,
        velocity=none,
        acceleration=np.column_stack([f(time) for f in accelerations]),
        deflection=np.zeros((time.size, clearances)),
        force=np.zeros((time.size, clearances)),
        region=np.zeros((time.size, clearances), dtype=np.int64),
        element_torque=np.zeros((time.size, plate.is_mesh.size)),
        events=log(rows),
        initial_region=np.array([0] * clearances if initial is None else initial, dtype=np.int64),
        final_force_integral=np.full(clearances, final),
        samples_per_cycle=samples,
        cycles=cycles,
        discard=discard,
        cost=Cost("by hand", 0, 0, 0, len(rows), 0.0, 0.0, 0.0),
    )
    return replace(motion, **changes)


def sine(amplitude: float, order: float = 1.0, phase: float = 0.0, mean: float = 0.0) -> Callable[[Array], Array]:
    """Return mean + amplitude sin(order Omega t + phase)."""
    return lambda time: mean + amplitude * np.sin(order * OMEGA * time + phase)
