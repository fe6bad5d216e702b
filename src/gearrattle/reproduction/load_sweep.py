"""Sweeps of a load up and down, for Figs. 3 and 4: every run starts from the last state of the run before.

Two systems. *Case 1* rattling, over the drag torque D of its loose output gear: the mean load of the input gear is
reduced by D, so that the load of the clutch does not change. The *mesh alone*: input and output gear of Table 1 with
their backlash, a mean and one harmonic in units of K b, the mesh force at a deflection of half the gap,

    m x'' + c g(x) x' + K f(x) = K b (mean + amplitude sin(w t)),    m = (R^2/J_3 + R^2/J_4)^-1,

x the deflection, w in units of sqrt(K/m).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearrattle.analysis.contact_ratios import ROUTES
from gearrattle.model import Model
from gearrattle.reproduction.paper_cases import (
    DAMPING,
    HALF_GAP,
    HUB_SHARE,
    LARGEST_HARMONIC,
    RADIUS,
    STIFFNESS,
    J,
    load_case,
)
from gearrattle.results import Run
from gearrattle.signals import regime, steady
from gearrattle.signals.regions import Regime
from gearrattle.simulation.simulate import simulate
from gearrattle.trajectory import Trajectory

GEAR = "gear"
MASS = 1.0 / (RADIUS**2 / J["input_gear"] + RADIUS**2 / J["output_gear"])  # kg, on the line of action
RESONANCE = float(np.sqrt(STIFFNESS[GEAR] / MASS))  # rad/s, in contact, without damping
FORCE = STIFFNESS[GEAR] * HALF_GAP  # N
SAMPLES = 64
Tick = Callable[[], None]


@dataclass(frozen=True)
class Stop:
    """The steady motion under one load.

    Attributes
    ----------
    load
        in the unit of the sweep.
    amplitude
        half the peak-to-peak deflection of the mesh [half-gaps].
    start
        initial state, in the form that ``simulate`` takes; None: static equilibrium.
    """

    load: float
    rising: bool
    regime: Regime
    amplitude: float
    mean_slope: float
    gain: float
    start: dict[str, list[float]] | None


def loose_gear(drag: float) -> Model:
    """Case 1 with a drag torque [N m] on its loose output gear."""
    mean = 0.05 * LARGEST_HARMONIC
    return load_case(1).with_(
        {"inertia.output_gear.drag_torque": drag, "torque.1.mean": drag - (1.0 - HUB_SHARE) * mean}
    )


def mesh_alone(frequency: float, mean: float, amplitude: float) -> Model:
    """The paper's gear pair without the rest of the driveline: the load has a frequency in units of the resonance in
    contact, mean and amplitude on the deflection in units of K b.
    """
    # load on the deflection as a torque on the input gear
    torque = FORCE * RADIUS
    share = J["input_gear"] / (MASS * RADIUS**2)
    mesh: dict[str, Any] = {
        "name": GEAR,
        "between": ["input_gear", "output_gear"],
        "radii": [RADIUS, RADIUS],
        "stiffness": STIFFNESS[GEAR],
        "damping": DAMPING[GEAR],
        "backlash": 2.0 * HALF_GAP,
    }
    # gear pair as a model
    return Model.from_tables(
        {
            "schema": 1,
            "name": "The mesh of Table 1, alone",
            "inertia": [{"name": name, "J": J[name]} for name in mesh["between"]],
            "mesh": [mesh],
            "excitation": {"speed": frequency * RESONANCE},
            "torque": [
                {
                    "on": "input_gear",
                    "mean": mean * torque,
                    "harmonics": [{"order": 1, "amplitude": amplitude * share * torque}],
                },
                {"on": "output_gear", "mean": -mean * torque},
            ],
        }
    )


def sweep(model_of: Callable[[float], Model], loads: Sequence[float], cycles: int, tick: Tick) -> tuple[Stop, ...]:
    """Simulate up to the steady motion under every load, upward and then downward.

    The first run starts at static equilibrium, every other at the last state of the run before. Runs last whole
    periods, so that the phase of the load is continuous as well.

    Parameters
    ----------
    model_of
        returns the driveline under a load; all its gear ratios must be one.
    cycles
        per load; the first two thirds are discarded, the rest is evaluated.
    """
    stops = []
    start = None
    for rising in (True, False):
        for load in loads if rising else loads[::-1]:
            tick()
            run = _run(model_of(load), cycles, SAMPLES, start)
            stops.append(_stop(run.trajectory, load, rising, start))
            start = _end(run.trajectory)
    return tuple(stops)


def history(stop: Stop, model_of: Callable[[float], Model], cycles: int, samples: int) -> Run:
    """Repeat the run of a stop with another number of samples per cycle."""
    return _run(model_of(stop.load), cycles, samples, stop.start)


def _run(model: Model, cycles: int, samples: int, start: dict[str, list[float]] | None) -> Run:
    return simulate(
        model, cycles=cycles, discard=2 * cycles // 3, samples_per_cycle=samples, audit=False, initial=start or "static"
    )


def _end(t: Trajectory) -> dict[str, list[float]]:
    """The last state, all angles relative to the first inertia, so that they do not grow from load to load."""
    return {"angle": (t.angle[-1] - t.angle[-1, 0]).tolist(), "velocity": t.velocity[-1].tolist()}


def _stop(t: Trajectory, load: float, rising: bool, start: dict[str, list[float]] | None) -> Stop:
    gear = t.layout.clearance_names.index(GEAR)
    window = steady(t)
    amplitude = float(np.ptp(window.periodic(t.deflection[:, gear]))) / (2.0 * HALF_GAP)
    ratios = {name: float(ROUTES[name](t).value[gear]) for name in ("mean-slope", "spectral")}
    return Stop(load, rising, regime(t, gear, window), amplitude, ratios["mean-slope"], ratios["spectral"], start)
