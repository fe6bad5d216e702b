"""A stable motion at one value of a model, by exact runs: followed from a state until it repeats, and then measured.

The run goes on in blocks of ``BLOCK`` periods. It has settled once its states at the start of the last periods repeat
after n <= ``LONGEST`` of them. A motion that does not within ``BLOCKS`` blocks is measured over the last block all the
same: it settles slowly, or it is irregular. Nothing is lost between two blocks, nor between two values of the model:
deflections, velocities, and the stretches of sliders are carried over at the start of a period.

Motions are compared by the rms of their deflections about the mean, clearance by clearance. That of a motion that
repeats is exact; that of an irregular one scatters from block to block, and the scatter says what a difference means.

Takes a Model and a state; gives an ExactRun.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import assemble, coordinates_of
from gearrattle.engine.periodic.motion import State
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.model import Model
from gearrattle.orbits.attractors import repeats_after
from gearrattle.orbits.settling_limits import BLOCK
from gearrattle.orbits.start_states import plan_from
from gearrattle.quantities.evaluation import add
from gearrattle.quantities.quantity_table import CROSSING_CRITERIA
from gearrattle.quantities.verdict_parts import Headline
from gearrattle.results import Run
from gearrattle.signals import gap_names
from gearrattle.simulation.integrate import integrate
from gearrattle.time_limits import OutOfTime, check_time

Array = NDArray[np.float64]

BLOCKS = 4
"""After how many looks a motion is measured all the same."""
SAMPLES = 32
"""Of a period, from which the rms is taken."""
# of the units of a motion; the second at the last look
_REPEATS = 1e-4
_ABOUT_REPEATS = 1e-2
_PARTS = 4  # of the measured block, whose rms are compared with each other
_SURE = 4.0  # standard errors, beyond which a difference is not chance
# ratio of rms from which motions differ, irregular ones and those that repeat
_IRREGULAR = 1.5
_REGULAR = 1.05
_CLEAR = 2.0  # ratio of rms from which nobody doubts that a difference is not chance
# of scatters that are alike, their ratio; and the largest scatter that counts as none
_ALIKE = 3.0
_EVEN = 0.05
_SMALL = 1e-3  # of the largest corner of a law: an rms below it counts as none, such as that of a contact
_JUDGED = ("regime", "severity", "impacts")
_RANKS = ("quiet", "touches", "single-sided", "double-sided")


@dataclass(frozen=True)
class ExactRun:
    """A motion at one value of the model, as an exact run shows it.

    Attributes
    ----------
    value
        of the model [SI].
    cycles
        n, periods T after which it repeats; 0 where it does not within ``LONGEST``.
    periods
        it was followed for.
    rms, swing
        (K,) of the deflections of the clearances about their means, and peak to peak [rad or m].
    scatter
        (K,) standard error of the logarithm of the rms; about zero of a motion that repeats.
    trend
        (K,) logarithm of the rms at the end of the measured block over that at its begin, where it only grows or only
        falls; else zero.
    scale
        (K,) largest corners of the laws [rad or m].
    regimes, severities
        (K,) words of the verdict.
    impacts
        (K,) a period.
    is_gap
        (K,) whether the clearance separates, and is none of a staged spring.
    end
        the state in which it ends, at the start of a period.
    """

    value: float
    cycles: int
    periods: int
    rms: Array
    swing: Array
    scatter: Array
    trend: Array
    scale: Array
    regimes: tuple[str, ...]
    severities: tuple[str, ...]
    impacts: Array
    is_gap: tuple[bool, ...]
    end: State

    @property
    def headline(self) -> Headline:
        """The verdict in one word, by the parts that separate."""
        words = [
            regime if severity == "rattles" else severity
            for regime, severity, is_gap in zip(self.regimes, self.severities, self.is_gap, strict=True)
            if is_gap
        ]
        return cast(Headline, max(words, key=_RANKS.index, default="quiet"))

    @property
    def is_settling(self) -> bool:
        """Whether it is on the way to another motion."""
        return bool(np.any(np.abs(self.trend) > np.log(_CLEAR)))

    def ratios(self, other: ExactRun) -> Array:
        """Return (K,) the logarithms of the rms over those of another motion; what is small counts as none."""
        least = _SMALL * np.maximum(self.scale, np.finfo(float).tiny)
        return np.asarray(np.log((self.rms + least) / (other.rms + least)))

    def differences(self, other: ExactRun, least: float | None = None) -> Array:
        """Return (K,) by which factor the rms differ, beyond what chance explains; 1 where they do not differ.

        Parameters
        ----------
        least
            factor that counts; None: 1.05 of motions that repeat, else 1.5.
        """
        chance = _SURE * np.hypot(self.scatter, other.scatter)
        if least is None:
            least = _REGULAR if self.cycles and other.cycles else _IRREGULAR
        size = np.abs(self.ratios(other))
        return np.asarray(np.where(size > np.maximum(chance, np.log(least)), np.exp(size), 1.0))

    def differs(self, other: ExactRun) -> bool:
        """Return whether it is another motion."""
        return bool(np.any(self.differences(other) > 1.0))

    def goes_on(self, other: ExactRun) -> bool:
        """Return whether it goes on another irregular motion, and scatters as that does: nothing changes."""
        scatters_alike = np.all(self.scatter <= _ALIKE * other.scatter + _EVEN)
        return not (self.cycles or other.cycles) and bool(scatters_alike) and not self.differs(other)

    def differs_clearly(self, other: ExactRun) -> bool:
        """Return whether it is another motion by so much that no longer run is needed to be sure."""
        return bool(np.any(self.differences(other) > _CLEAR))

    def with_more(self, later: ExactRun) -> ExactRun:
        """Return both as one, this run and the one that goes on from its end."""
        if later.cycles:
            return later
        rms = np.sqrt(0.5 * (self.rms**2 + later.rms**2))
        least = _SMALL * np.maximum(self.scale, np.finfo(float).tiny)
        apart = 0.5 * np.abs(np.log((self.rms + least) / (later.rms + least)))
        scatter = np.maximum(0.5 * np.hypot(self.scatter, later.scatter), apart)
        swing = np.maximum(self.swing, later.swing)
        impacts = 0.5 * (self.impacts + later.impacts)
        return ExactRun(
            value=later.value,
            cycles=0,
            periods=self.periods + later.periods,
            rms=rms,
            swing=swing,
            scatter=scatter,
            trend=later.trend,
            scale=later.scale,
            regimes=later.regimes,
            severities=later.severities,
            impacts=impacts,
            is_gap=later.is_gap,
            end=later.end,
        )


def carried(state: State, before: PeriodMap, after: PeriodMap) -> State:
    """Return a state of one driveline as one of another: same angles, velocities and, where it has them, stretches."""
    task = before.task(state, 1)
    start = after.state_of(task.angle, task.velocity)
    memories = after.flow.memory.size
    if not memories or memories != before.flow.memory.size:
        return start
    return State(np.append(start.y[:-memories], state.y[-memories:]), state.auxiliary_pieces)


def exact_run(
    model: Model,
    period_map: PeriodMap,
    state: State,
    value: float,
    *,
    blocks: int = BLOCKS,
    like: ExactRun | None = None,
) -> ExactRun:
    """Follow a motion until it repeats, or for so many blocks, and measure it.

    Parameters
    ----------
    model
        the driveline at the value.
    value
        of the model [SI].
    blocks
        of periods; twice as many while the motion still goes over into another.
    like
        an irregular motion that it may go on: it ends sooner where the second block or a later one shows no other.

    Raises
    ------
    ConvergenceError
        the motion could not be followed.
    OutOfTime
        the time is over before the first block.
    """
    run = None
    cycles = 0
    done = 0
    most = 2 * blocks
    while done < blocks and not cycles:
        try:
            run = _block(model, period_map, state)
        except OutOfTime:
            if run is None:
                raise
            break
        done += 1
        states = _states(run, period_map)
        state = states[-1]
        cycles = repeats_after(period_map, states, _REPEATS if done < blocks else _ABOUT_REPEATS)
        if done > 1 and not cycles:
            known = _measured(run, state, value=value, cycles=0, periods=done * BLOCK)
            if not known.is_settling:
                if done == blocks or (like is not None and known.goes_on(like)):
                    return known
            elif done == blocks < most:
                blocks += 1
    assert run is not None
    return _measured(run, state, value=value, cycles=cycles, periods=done * BLOCK)


def _block(model: Model, period_map: PeriodMap, state: State) -> Run:
    """The run over a block of periods."""
    grid = {"cycles": BLOCK, "discard": 0, "samples_per_cycle": SAMPLES}
    plan = plan_from(model, (period_map, state), grid)
    return plan.run(integrate(plan.task, plan.layout, "exact", progress=lambda _: check_time()))


def _states(run: Run, period_map: PeriodMap) -> list[State]:
    """The states of a run at the start of every period."""
    motion = run.trajectory
    rows = np.arange(0, len(motion.time), motion.samples_per_cycle)
    deflection = coordinates_of(run.model, motion, 0, rows) @ period_map.flow.coordinates.basis.T
    y = np.hstack([deflection, coordinates_of(run.model, motion, 1, rows)])
    auxiliaries = motion.auxiliaries
    if auxiliaries is None:
        return [State(one) for one in y]
    y = np.hstack([y, auxiliaries.memory[rows][:, list(period_map.system.memories)]])
    pieces = np.asarray(auxiliaries.piece[rows], dtype=np.int64)
    return [State(one, period_map.kept_pieces(own)) for one, own in zip(y, pieces, strict=True)]


def _measured(run: Run, state: State, *, value: float, cycles: int, periods: int) -> ExactRun:
    """What a run shows of its motion."""
    motion = run.trajectory
    layout = run.trajectory.layout
    names = layout.clearance_names
    # rms and swings, and how much they scatter over the parts of the run
    deflection = motion.deflection[:-1]
    parts = deflection.reshape(_PARTS, -1, len(names))
    rms = deflection.std(axis=0)
    scale = np.array([float(np.abs(corners).max(initial=0.0)) for corners in layout.corners])
    least = _SMALL * np.maximum(scale, np.finfo(float).tiny)
    of_parts = np.log(parts.std(axis=1) + least)
    scatter = of_parts.std(axis=0) / np.sqrt(_PARTS)
    steps = np.diff(of_parts, axis=0)
    is_even = np.all(steps > 0.0, axis=0) | np.all(steps < 0.0, axis=0)
    trend = np.where(is_even, of_parts[-1] - of_parts[0], 0.0)
    if cycles and (BLOCK // _PARTS) % cycles:  # the parts are no whole number of its repetitions
        scatter = np.zeros(len(names))
    # the verdict on every clearance
    criteria = [CROSSING_CRITERIA[name] for name in _JUDGED]
    sums = add(motion, None, criteria)
    rows = {(row.quantity, row.subject): row.value for one in criteria for row in one.rows(sums)}
    gaps = gap_names(layout)
    return ExactRun(
        value=value,
        cycles=cycles,
        periods=periods,
        rms=rms,
        swing=np.ptp(deflection, axis=0),
        scatter=scatter,
        trend=trend,
        scale=scale,
        regimes=tuple(str(rows["regime", name]) for name in names),
        severities=tuple(str(rows["severity", name]) for name in names),
        impacts=np.array([float(rows.get(("impacts per cycle", name), 0.0)) for name in names]),
        is_gap=tuple(name in gaps for name in names),
        end=state,
    )


def map_of_one_period(model: Model) -> PeriodMap:
    """Return the period map of a model over one period."""
    return PeriodMap(assemble(model).system, 1)
