"""The paper's RK2 at its step, the unit of time, and RK4 at a step where it is stable; both compiled, no events."""

from __future__ import annotations

import numba
import numpy as np

import gearrattle as gr
from benchmarks import midpoint
from benchmarks.peers.base import Outcome, Peer, Prepared
from benchmarks.peers.plant import Plant, half_gaps, load
from gearrattle.assembly import assemble


@numba.njit(cache=True)
def _march4(y, h, steps, p):  # type: ignore[no-untyped-def]
    """The classical fourth order over so many steps h, in place."""
    k1, k2, k3, k4, x = np.empty(8), np.empty(8), np.empty(8), np.empty(8), np.empty(8)
    for n in range(steps):
        midpoint._slopes(n * h, y, k1, p)
        for i in range(8):
            x[i] = y[i] + 0.5 * h * k1[i]
        midpoint._slopes((n + 0.5) * h, x, k2, p)
        for i in range(8):
            x[i] = y[i] + 0.5 * h * k2[i]
        midpoint._slopes((n + 0.5) * h, x, k3, p)
        for i in range(8):
            x[i] = y[i] + h * k3[i]
        midpoint._slopes((n + 1.0) * h, x, k4, p)
        for i in range(8):
            y[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i])


def build(plant: Plant, order: int, step: float) -> Prepared:
    """Make a case ready; the step is stretched a little to end on time."""
    model = load(plant.name)
    transmission, system = midpoint.transmission(model), assemble(model)
    start = np.concatenate([gr.equilibrium(model).angle, np.zeros(4)])
    clear, gap, omega = list(plant.clearances), half_gaps(system), model.excitation.omega
    march = midpoint.march if order == 2 else _march4

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
