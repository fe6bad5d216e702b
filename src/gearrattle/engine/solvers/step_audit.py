"""The energy audit of a motion in communication steps (see ``system.energy_audit``).

Steps are kept until some hundred of equal length have come, or the balance is asked for; then they are audited as one
motion under signals with their knots. What a changed value of the model adds to the stored energy is no part of the
balance: of every batch the difference of its own ends counts.
"""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels.march_arrays import Log
from gearrattle.engine.system.energy_audit import Auditor, EnergyAudit
from gearrattle.engine.system.flow import Flow, Pieces, flow_of

Array = NDArray[np.float64]

_MOST_STEPS = 256  # audited together
_EQUAL = 1e-9  # part of a step by which its length may differ from that of the first one


class StepAudit:
    """Adds up the audits of batches of steps."""

    def __init__(self, flow: Flow) -> None:
        self.flow = flow
        self.total: EnergyAudit | None = None
        self._clear()

    def _clear(self) -> None:
        self._length = 0.0
        self._states: list[Array] = []
        self._coefficients: list[Array] = []
        self._logs: list[Log] = []
        self._times: list[Array] = []
        self._pieces: Pieces = ()

    def add(self, length: float, begin: Array, coefficients: Array, pieces: Pieces, *, log: Log, time: Array) -> None:
        """Add a step; of the last one ``finish`` needs the state at its end.

        length: in periods.
        begin: (N + U,) states and inputs at its begin, without chains.
        coefficients: (C, D + 1) of its polynomials.
        pieces: of all elements and auxiliaries at its begin.
        log: its crossings.
        time: (E,) of these since its begin, in periods.
        """
        if not self._states:
            self._length = length
            self._pieces = pieces
        self._times.append(len(self._states) * self._length + time)
        self._states.append(begin)
        self._coefficients.append(coefficients)
        self._logs.append(Log._make(column.copy() for column in log))

    def ends_before(self, length: float) -> bool:
        """Whether the batch must be finished before a step of such a length."""
        is_other = abs(length - self._length) > _EQUAL * self._length
        return bool(self._states) and (is_other or len(self._states) >= _MOST_STEPS)

    def finish(self, end: Array) -> None:
        """Audit the batch, which ends in a state: (N + U,) states and inputs."""
        count = len(self._states)
        if count == 0:
            return
        # the system, under signals with a knot at every step
        system = self.flow.system
        assert system.signals is not None
        period = system.inputs.period
        knots = np.arange(count + 1, dtype=np.float64) * (self._length * period)
        flow = flow_of(
            replace(system, signals=replace(system.signals, knots=knots, coefficients=np.array(self._coefficients)))
        )
        last = flow.chains_at(np.zeros(1), np.array([count * self._length]))
        z = np.hstack([np.array([*self._states, end]), np.vstack([flow.chains, last])])
        # one audit of all
        log = Log._make(np.concatenate(columns) for columns in zip(*self._logs, strict=True))
        auditor = Auditor(
            flow,
            self._pieces,
            samples=lambda rows: z[rows],
            count=count + 1,
            per_cycle=1.0 / self._length,
            time=np.concatenate(self._times),
            watch=log.clearance,
            upward=log.upward,
            memory=log.memory,
        )
        while not auditor.advance():
            pass
        self.total = added(self.total, auditor.result())
        self._clear()


def added(one: EnergyAudit | None, other: EnergyAudit | None) -> EnergyAudit | None:
    """The audit of two motions, one after the other; of the second the change of the stored energy counts."""
    if one is None or other is None:
        return one or other
    begin, end = one.stored
    sums = {
        field.name: getattr(one, field.name) + getattr(other, field.name)
        for field in fields(EnergyAudit)
        if field.name != "stored"
    }
    return EnergyAudit(**sums, stored=(begin, end + other.stored[1] - other.stored[0]))
