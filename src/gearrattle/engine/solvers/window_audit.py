"""The energy audit of a sweep (``system.energy_audit`` says what is audited), in slices."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels import march_arrays
from gearrattle.engine.kernels._jit import vectorised
from gearrattle.engine.kernels.network_series import Driveline
from gearrattle.engine.kernels.variant_arrays import Crossings
from gearrattle.engine.kernels.window_works import Intervals, WorkBuffers, Works, integrate_works
from gearrattle.engine.system.energy_audit import EnergyAudit, stored_energy
from gearrattle.engine.system.flow import Flow

Array = NDArray[np.float64]

NODES = 7
"""Nodes that integrate a quadratic power over the finest step to rounding: with n of them the error is about
(n!)^4 / ((2n)!^3 (2n + 1)) (2 a)^2n of the power (M. Abramowitz, I. A. Stegun, Handbook of Mathematical Functions,
25.4.30), a = |(h A)^20|^(1/20) <= 1.17 there (``finest_level``)."""

_COLUMNS = 200_000  # of the table, over all windows of a slice: some tenths of a second


class SweepAuditor:
    """An audit under way."""

    def __init__(self, flow: Flow, driveline: Driveline, samples: march_arrays.Samples, crossings: Crossings) -> None:
        """Prepare the audit of a motion.

        samples: columns of the sweep's table, and the pieces.
        """
        self.flow = flow
        self.driveline = driveline
        self.samples = samples
        grid = np.arange(1, len(samples.states)) / samples.per_cycle
        at = np.concatenate([grid, crossings.time / flow.system.inputs.period])
        order = np.argsort(at, kind="stable")
        event = order - len(grid)
        crossed = event >= 0
        begins = np.concatenate([[0], np.where(crossed, -1, order + 1)[:-1]])  # a sample's own interval follows it
        self.path = Intervals(
            np.diff(at[order], prepend=0.0) * driveline.windows,
            begins.astype(np.int64),
            np.where(crossed, np.append(crossings.clearance, -1)[np.where(crossed, event, -1)], -1).astype(np.int64),
            np.where(crossed, np.append(crossings.to_piece, -1)[np.where(crossed, event, -1)], -1).astype(np.int64),
        )
        self.buffers, self.works = _buffers(flow, driveline, samples)
        x, w = np.polynomial.legendre.leggauss(NODES)
        self.nodes = np.array([0.5 * (x + 1.0), 0.5 * w])
        self.done = 0
        self._work = np.cumsum(np.ceil(self.path.duration) * samples.states.shape[1])

    def advance(self, columns: float = _COLUMNS) -> bool:
        """Integrate over the next intervals, of about so many columns of windows; whether they were the last."""
        spent = self._work[self.done - 1] if self.done else 0.0
        last = max(self.done + 1, int(np.searchsorted(self._work, spent + columns)))
        last = min(last, len(self.path.duration))
        vectorised(integrate_works)(
            self.driveline, self.path, self.done, last, self.samples, self.buffers, self.works, self.nodes
        )
        self.done = last
        return self.done == len(self.path.duration)

    def fraction(self) -> float:
        """Part of the audit that is done, 0 ... 1."""
        return self.done / max(1, len(self.path.duration))

    def result(self) -> EnergyAudit:
        """The audit, once ``advance`` has answered True."""
        m = len(self.flow.system.laws)
        n = self.flow.system.size
        ends = []
        for i in (0, -1):
            columns = self.samples.states[i]
            cycle, part = divmod(i % len(self.samples.states), self.samples.per_cycle)
            u = self.flow.inputs_at(np.array([float(cycle)]), np.array([part / self.samples.per_cycle]))[0]
            x = columns[list(self.flow.coordinates.elements)] * self.flow.scaling.deflection
            z = np.concatenate([x, columns[m : m + n] * self.flow.scaling.velocity, u])
            ends.append(stored_energy(self.flow, self.flow.deflection @ z, columns[m : m + n]))
        works = self.works
        return EnergyAudit(works.torque, works.error, works.drag, works.element, (ends[0], ends[1]))


def _buffers(flow: Flow, driveline: Driveline, samples: march_arrays.Samples) -> tuple[Any, Any]:
    """Buffers of the quadrature in the region the motion starts in; and the sums."""
    # pieces at the start, and the laws there
    network: Any = driveline.network
    system = flow.system
    orders = march_arrays.ORDER + 1
    columns = samples.states.shape[1]
    pieces = np.zeros(len(system.laws), dtype=np.int64)
    pieces[network.clearances] = samples.pieces[0]
    laws = [(law.stiffness[p], law.damping[p], law.offset[p]) for law, p in zip(system.laws, pieces, strict=True)]
    present = np.array(laws, dtype=float).reshape(-1, 3).T
    # sizes
    m = len(system.laws)
    n = system.size
    count = system.inputs.count
    errors = network.erring.size
    # room for the Taylor series and for the powers
    buffers = WorkBuffers(
        now=np.zeros(2),
        table=np.zeros((orders, columns)),
        waves=np.zeros((orders + 1, 2 * count)),
        errors=np.zeros((orders + 1, errors)),
        stiffness=present[0].copy(),
        damping=present[1].copy(),
        offset=present[2].copy(),
        u=np.zeros(1 + 2 * count),
        y=np.zeros(columns),
        wave=np.zeros(2 * count),
        slip=np.zeros((2, errors)),
        torque=np.zeros(m + n),
        load=np.zeros(network.driven.size),
        force=np.zeros(m),
        pull=np.zeros(m + n),
        reach=np.zeros(m),
        turn=np.zeros(count),
    )
    return buffers, Works(np.zeros(n), np.zeros(n), np.zeros(m), np.zeros(m))
