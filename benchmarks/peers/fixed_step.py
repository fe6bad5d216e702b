"""The paper's RK2 at its step, and RK4 at a step where it is stable; both compiled, no events."""

from __future__ import annotations

import numpy as np

import gearrattle as gr
from benchmarks import midpoint
from benchmarks.peers.base import Outcome, Peer, Prepared
from benchmarks.peers.plant import Plant, half_gaps, load
from gearrattle.assembly import assemble


def build(plant: Plant, order: int, step: float) -> Prepared:
    """Make a case ready; the step is stretched a little to end on time."""
    model = load(plant.name)
    transmission, system = midpoint.transmission(model), assemble(model).system
    start = np.concatenate([gr.equilibrium(model).angle, np.zeros(4)])
    clear = list(plant.clearances)
    gap = half_gaps(system)
    omega = model.excitation.omega
    march = midpoint.march if order == 2 else midpoint.march_4

    def run(cycles: float) -> Outcome:
        state, duration = start.copy(), 2.0 * np.pi * cycles / omega
        steps = round(duration * omega / step)
        march(state, duration / steps, steps, transmission)
        wave = np.sin(plant.orders * omega * duration)
        deflection = system.rows @ state[:4] / gap - plant.error @ wave
        return Outcome(deflection[clear], -1)

    return Prepared(run)


RK2 = Peer("RK2", "numba", "compiled, fixed step 0.001/150 s", (("0.001/150 s", {"order": 2, "step": 0.001}),), build)
RK4 = Peer("RK4", "numba", "compiled, fixed step 0.002/150 s", (("0.002/150 s", {"order": 4, "step": 0.002}),), build)
