"""heyoka: Taylor series of high order with event detection on the series itself.

The strongest formulation found:

- the region's stiffness, damping and offset are run-time parameters, so that a crossing recompiles nothing;
- sines of the torque and of the transmission error are 2 states a harmonic (s' = k c, c' = -k s): all equations are
  linear, a Taylor coefficient costs a few products and no convolution. 5 to 15 % cheaper than sines of time;
- one terminal event u^2 - 1 an element in place of two, u - 1 and u + 1: 10 to 15 % cheaper;
- ``fast_math``: some 10 % cheaper, same errors; ``compact_mode`` off: up to 40 % cheaper than on;
  ``high_accuracy`` and vectorization within one trajectory cost time and gain nothing here;
- an explicit ``cooldown`` of 1e-9. By itself heyoka deduces one from the tolerance: at a loose tolerance it outlasts
  the next crossing, which is then lost without a word (the page shows it). None at all (0) makes it try to isolate the
  root it stands on, and the next crossing of that corner is lost as well.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.peers.base import Outcome, Peer, Prepared, tolerances
from benchmarks.peers.plant import Plant

COOLDOWN = 1e-9
AUTOMATIC = -1.0


def _equations(plant: Plant) -> tuple[list[Any], list[float], list[Any]]:
    """Return the equations, the start, and the deflections as heyoka knows them."""
    import heyoka as hy

    m, n = plant.gain.shape
    u = hy.make_vars(*(f"u{k}" for k in range(m)))
    w = hy.make_vars(*(f"w{i}" for i in range(n)))
    used = [j for j in range(plant.orders.size) if plant.torque[:, j].any() or plant.error[:, j].any()]
    sine = {j: hy.make_vars(f"s{j}") for j in used}
    cosine = {j: hy.make_vars(f"c{j}") for j in used}
    rate, force = [], []
    for k in range(m):
        terms = [plant.gain[k, i] * w[i] for i in range(n) if plant.gain[k, i]]
        terms += [-plant.error[k, j] * plant.orders[j] * cosine[j] for j in used if plant.error[k, j]]
        rate.append(hy.sum(terms))
        stiffness, damping, offset = (
            (hy.par[3 * plant.clearances.index(k) + i] for i in range(3))
            if k in plant.clearances
            else plant.region[k][0, :3]
        )
        force.append(stiffness * u[k] + damping * rate[k] + offset)
    equations = list(zip(u, rate, strict=True))
    for i in range(n):
        terms = [hy.expression(float(plant.mean[i])), -plant.drag[i] * w[i]]
        terms += [plant.torque[i, j] * sine[j] for j in used if plant.torque[i, j]]
        terms += [-plant.share[i, k] * force[k] for k in range(m) if plant.share[i, k]]
        equations.append((w[i], hy.sum(terms)))
    start = list(plant.start)
    for j in used:
        order = float(plant.orders[j])
        equations += [(sine[j], order * cosine[j]), (cosine[j], -order * sine[j])]
        start += [0.0, 1.0]
    return equations, start, list(u)


class _Crossings:
    """Region of every element, rewritten by the events' callbacks."""

    def __init__(self, plant: Plant) -> None:
        self.plant = plant
        self.region = list(plant.first)
        self.count = 0
        self.parameters: Any = None
        self.initial = np.concatenate([plant.region[k][plant.first[k], :3] for k in plant.clearances])

    def reset(self) -> None:
        """Go back to the start."""
        self.region[:] = self.plant.first
        self.count = 0
        self.parameters[:] = self.initial

    def callback(self, clearance: int, element: int) -> Callable[[Any, int], bool]:
        """Return what happens at u^2 = 1 of an element: a plain function, since heyoka copies objects."""
        laws = self.plant.region[element][:, :3]
        region = self.region
        a = 3 * clearance
        b = 3 * clearance + 3

        def crossed(integrator: Any, sign: int) -> bool:
            outer = 2 if integrator.state[element] > 0.0 else 0
            new = outer if sign > 0 else 1
            if new != region[element]:
                region[element] = new
                self.count += 1
                self.parameters[a:b] = laws[new]
            return True

        return crossed


def build(plant: Plant, tolerance: float, cooldown: float = COOLDOWN) -> Prepared:
    """Compile a case."""
    import heyoka as hy

    equations, start, u = _equations(plant)
    crossings = _Crossings(plant)
    events = [
        hy.t_event(u[k] * u[k] - 1.0, callback=crossings.callback(clearance, k), cooldown=cooldown)
        for clearance, k in enumerate(plant.clearances)
    ]
    hy.llvm_state.set_diskcache_enabled(False)  # so that what compiling takes is seen
    hy.llvm_state.clear_memcache()
    integrator = hy.taylor_adaptive(
        equations, start, t_events=events, pars=list(crossings.initial), tol=tolerance, fast_math=True
    )
    crossings.parameters = integrator.pars
    clear = list(plant.clearances)

    def run(cycles: float) -> Outcome:
        integrator.time = 0.0
        integrator.state[:] = start
        integrator.reset_cooldowns()
        crossings.reset()
        end = integrator.propagate_until(2.0 * np.pi * cycles)[0]
        if end != hy.taylor_outcome.time_limit:
            raise ArithmeticError(f"heyoka stopped: {end}")
        return Outcome(integrator.state[clear].copy(), crossings.count)

    return Prepared(run)


HEYOKA = Peer(
    "heyoka",
    "heyoka",
    "Taylor, terminal events, explicit cooldown",
    tolerances(*range(4, 17)),
    build,
)
