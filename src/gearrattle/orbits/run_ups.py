"""A run-up and a run-down at a rate, and the branches: where the motion jumps, and how far behind its end.

A slowly changed speed takes a stable motion past the event in which it ends, or loses its stability. It does not jump
there at once: near a smooth fold it moves away so slowly that the jump comes late, by a delay that grows with the rate
r as r^(2/3) while r is small; from a motion that only has become unstable it moves away as what it is off it grows.

Where a run leaves the motion that has ended is found by the shape of its deflections (``jumps``). A period T may hold
many load cycles, so it is looked at in parts, as many as the fastest input has cycles in T. A run has as many whole
parts as fit between its two speeds; a sample that lies before the begin of a part by rounding alone belongs to it.

P. Jung, G. Gray, R. Roy, P. Mandel, "Scaling law for dynamical hysteresis", Physical Review Letters 65 (1990)
1873-1876.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import assemble, period_of
from gearrattle.engine.periodic.motion import State
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model, units
from gearrattle.model.path_labels import in_shown_unit, path_label, shown_value
from gearrattle.model.table import shown
from gearrattle.model.value_kinds import CALLBACK, Plain, checked
from gearrattle.orbits.branch_parts import branch_parts
from gearrattle.orbits.jumps import NOT_ON, Jump, RunParts, jumps_of, periods_between, speed_of
from gearrattle.orbits.orbit import Orbit
from gearrattle.orbits.progress import Progress, never_falling, part_of
from gearrattle.orbits.start_states import plan_from, state_at
from gearrattle.result import Result
from gearrattle.simulation.integrate import integrate
from gearrattle.simulation.simulate import Plan

if TYPE_CHECKING:
    import xarray as xr

    from gearrattle.orbits.branch import Branch

Array = NDArray[np.float64]
PATHS = ("excitation.speed", "excitation.frequency")
"""What a run-up changes."""
_SAMPLES = 64  # of the shortest period of the inputs
_MOST_SAMPLES = 20_000_000  # of a run; a longer one takes fewer, down to _SAMPLES a period T
_ROUNDING = 1e-9  # of a period
_INSTANTS = 32  # of a load cycle at which a run is compared with motions
_MOST_PARTS = 64  # of a period T in which extrema are taken
_DOWN = 0.995  # a number shown with three digits is not rounded up
_OF_LENGTH = ("simulation.cycles", "cycles")  # settings that the rate decides


@dataclass(frozen=True)
class Envelope:
    """A run at a steadily changing speed, period by period.

    Attributes
    ----------
    upward
        whether the speed grows.
    value
        (P,) speed in the middle of every period, as the branch has it [SI].
    peak_to_peak
        (P, K) deflection of the K clearances [rad or m].
    """

    upward: bool
    value: Array
    peak_to_peak: Array


@dataclass(frozen=True)
class RunUpJumps(Result):
    """Jumps of a run-up and of a run-down, compared with those of a branch.

    Attributes
    ----------
    branch
        of motions over the speed.
    rate
        by which the speed changes [rad/s^2].
    envelopes
        of the run-up and the run-down.
    jumps
        every event that they pass at which a motion ends or loses its stability, but where a stable one leads on.
    notes
        what the user must know.

    Examples
    --------
    >>> model = gr.example("backlash_oscillator")
    >>> up, down = gr.continuation(model, "excitation.speed", (0.6, 0.9)).run_up(1e-3).jumps
    >>> up.value > up.end > down.end > down.value
    True
    """

    kind: ClassVar[str] = "jumps of run-ups"
    branch: Branch = field(repr=False, compare=False)
    rate: float
    envelopes: tuple[Envelope, ...] = field(repr=False, compare=False)
    jumps: tuple[Jump, ...]
    notes: tuple[str, ...] = ()

    @property
    def model(self) -> Model:
        """The driveline."""
        return self.branch.model

    @property
    def data(self) -> xr.Dataset:
        """A Dataset: end, value, delay and periods over "jump"; speed and peak-to-peak over the periods of a run."""
        import xarray as xr

        unit = {"units": path_label(self.branch.path, self.model).unit or "1"}
        speed_unit = {"units": "rad/s" if self.model.units == "SI" else "1"}
        jumps = self.jumps
        variables: dict[str, Any] = {
            "end": ("jump", np.array([jump.end for jump in jumps], dtype=np.float64), unit),
            "value": ("jump", np.array([jump.value for jump in jumps], dtype=np.float64), unit),
            "delay": ("jump", np.array([jump.delay for jump in jumps], dtype=np.float64), speed_unit),
            "periods": ("jump", np.array([jump.periods for jump in jumps], dtype=np.float64)),
            "direction": ("jump", np.array([_way(jump.upward) for jump in jumps], dtype=np.str_)),
            "kind": ("jump", np.array([jump.kind for jump in jumps], dtype=np.str_)),
            "decided_by": ("jump", np.array([jump.clearance for jump in jumps], dtype=np.str_)),
        }
        for run in self.envelopes:
            way = _way(run.upward)
            variables[f"{way}_value"] = (f"{way}_period", run.value, unit)
            variables[f"{way}_peak_to_peak"] = ((f"{way}_period", "clearance"), run.peak_to_peak)
        names = list(assemble(self.model).layout.clearance_names)
        about = {"result": self.kind, "path": self.branch.path, "rate": self.rate, "title": self.model.name}
        return xr.Dataset(variables, {"clearance": names}, about)


def run_up_of(branch: Branch, rate: float | str, progress: Callable[[float], None] | None) -> RunUpJumps:
    """Return the jumps of a run-up and a run-down; see ``Branch.run_up``."""
    checked(CALLBACK, progress, "progress")
    speed_rate = rate_of(branch.model, branch.path, branch.range, rate)
    notes = [*branch.notes]
    # the two runs, each from the stable motion at its end of the range
    plans = list[_RunPlan]()
    low, high = sorted(branch.range)
    for ends in ((low, high), (high, low)):
        start = _start(branch, ends[0])
        if start is None:
            end = _shown(branch, ends[0])
            notes.append(f"No stable motion is known at {branch.path} = {end}: no run begins there.")
        else:
            plans.append(_planned(branch, start, ends, speed_rate))
    # their jumps
    motions = list(branch_parts(branch))
    envelopes = list[Envelope]()
    jumps = list[Jump]()
    work = never_falling(progress)
    for number, plan in enumerate(plans):
        parts, envelope = _run(plan, part_of(work, number, len(plans)))
        envelopes.append(envelope)
        seen = jumps_of(branch, parts, motions, speed_rate)
        notes += _notes_of(branch, envelope, seen)
        jumps += seen
    work(1.0)
    return RunUpJumps(branch, speed_rate, tuple(envelopes), tuple(jumps), tuple(notes))


def _way(upward: bool) -> str:
    """The word for a run-up or a run-down."""
    return "up" if upward else "down"


def _shown(branch: Branch, value: float) -> str:
    """A value of the branch, as notes write it."""
    return shown_value(branch.path, branch.model, value, 6, max(map(abs, branch.range)))


def _notes_of(branch: Branch, envelope: Envelope, jumps: Sequence[Jump]) -> list[str]:
    """What the user must know of a run."""
    going = f"Going {_way(envelope.upward)}, the"
    notes = [f"{going} run lasts no whole period T: its swing is not shown."] if not envelope.value.size else []
    notes += [  # it leaves for a motion that is unstable at first
        f"{going} motion that the run leaves for at {branch.path} = {_shown(branch, jump.value)} is stable "
        f"from {_shown(branch, jump.settles)} on only: before that no branch has the motion of the run."
        for jump in jumps
        if not jump.words and jump.settles != jump.value
    ]
    if jumps and all(jump.words == NOT_ON for jump in jumps):
        notes.append(
            f"{going} run was on none of the motions that end. It may have stayed on one that became unstable at a "
            "period doubling: where it jumps from there is not told, but its swing over the speed shows it."
        )
    return notes


def rate_of(model: Model, path: str, ends: tuple[float, float], rate: float | str) -> float:
    """Return the rate of a run-up over a range of the value of a branch [rad/s^2].

    Raises ModelError: the value is not the speed, a rate without sense or too fast, or a model that cannot follow a
    run-up.
    """
    if path not in PATHS:
        raise ModelError(Problem("path", path, f"a run-up changes {' or '.join(PATHS)}", "follow that"))
    if isinstance(rate, str) and model.units == "SI":
        try:
            rate = units.convert(rate, units.ANGULAR_ACCELERATION)
        except units.UnitError as error:
            raise ModelError(Problem("rate", shown(rate), error.rule, error.remedy)) from None
    speed_rate = float(checked(Plain("positive", "the run goes up and down by itself"), rate, "rate"))
    low, high = (speed_of(model, path, value) for value in sorted(ends))
    _check_part(model, (low, high), speed_rate)
    _swept(model, (low, high), speed_rate)
    return speed_rate


def _start(branch: Branch, value: float) -> Orbit | None:
    """The stable motion at an end of the range: of the first branch that has one."""
    data = branch.data
    chosen = np.flatnonzero((data["value"].values == value) & data["stable"].values)
    return branch.orbit(int(chosen[0])) if chosen.size else None


def _check_part(model: Model, speeds: tuple[float, float], rate: float) -> None:
    """Refuse a rate at which the runs over a range end within the first part of a period: nothing is left of them."""
    periods = periods_between(model, speeds, rate)
    parts = _parts(model)
    if parts * periods >= 1.0:
        return
    shortest = "a period T" if parts == 1 else f"1/{parts} of a period T"
    rule = f"a run must last at least {shortest}, and this one lasts {periods:.3g} T"
    remedy = f"{_rate_words(model, _DOWN * parts * periods * rate, 3)} or less, or a branch over a longer range"
    raise ModelError(Problem("rate", _rate_words(model, rate), rule, remedy))


def _swept(model: Model, speeds: tuple[float, float], rate: float) -> Model:
    """The driveline with a run-up or run-down between two speeds [rad/s]."""
    first, last = speeds
    return model.with_({"excitation.sweep": {"from": first, "to": last, "over": abs(last - first) / rate}})


def _rate_words(model: Model, rate: float, digits: int = 6) -> str:
    """A rate with its unit."""
    factor, unit = in_shown_unit("excitation.speed", "rad/s" if model.units == "SI" else "")
    return f"{rate * factor:.{digits}g}{f' {unit}/s' if unit else ''}"


def _turns(model: Model) -> float:
    """Turns of the reference shaft in a period T."""
    return period_of(model).period * model.excitation.omega / (2.0 * np.pi)


class _RunPlan(NamedTuple):
    """A run that is possible."""

    orbit: Orbit  # the motion on which it begins
    model: Model  # with the run-up
    simulation: Plan  # of the run
    to_value: float  # of the branch, for a unit of the speed
    speeds: tuple[float, float]  # the first one and the last one [rad/s]
    rate: float  # of the speed, with its sign [rad/s^2]

    def periods(self, time: Array) -> Array:
        """Return how many periods T have passed at instants [s]."""
        angle = self.speeds[0] * time + 0.5 * self.rate * time**2
        return np.asarray(angle / (2.0 * np.pi * _turns(self.orbit.model)))

    def start_of(self, period: Array) -> Array:
        """Return the instants at which periods begin, counted from 0 [s]."""
        first = self.speeds[0]
        angle = 2.0 * np.pi * _turns(self.orbit.model) * period
        return np.asarray(2.0 * angle / (first + np.sqrt(first**2 + 2.0 * self.rate * angle)))


def _planned(branch: Branch, orbit: Orbit, ends: tuple[float, float], rate: float) -> _RunPlan:
    """Prepare a run from a motion on. Raises ModelError: the run would be too long."""
    first, last = (speed_of(branch.model, branch.path, value) for value in ends)
    cycles = int(np.ceil(abs(last - first) / rate * first / (2.0 * np.pi * _turns(orbit.model))))
    fastest = max(1.0, last / first)
    affordable = max(_SAMPLES, int(_MOST_SAMPLES / (cycles * fastest)))
    samples = int(np.ceil(min(_SAMPLES * _load_cycles(orbit.model), affordable) * fastest))
    try:
        model = _swept(branch.model, (first, last), rate)
        settings = {"cycles": cycles, "discard": 0, "samples_per_cycle": samples}
        simulation = plan_from(model, (orbit.period_map, orbit.motion.start), settings)
    except ModelError as error:
        if {problem.place for problem in error.problems} - {*_OF_LENGTH}:
            raise
        rule = f"the run would last {cycles:.3g} periods T: {error.problems[0].rule}"
        remedy = "a faster rate, or a branch over a shorter range"
        raise ModelError(Problem("rate", _rate_words(branch.model, rate), rule, remedy)) from None
    return _RunPlan(orbit, model, simulation, ends[0] / first, (first, last), rate if last > first else -rate)


def _load_cycles(model: Model) -> int:
    """Cycles of the fastest input in a period T, at least one."""
    return int(np.ceil(max(period_of(model).cycles, default=1.0))) or 1


def _parts(model: Model) -> int:
    """Parts of a period T in which extrema are taken: cycles of the fastest input, unless these are too many."""
    return min(_load_cycles(model), _MOST_PARTS)


def _run(run: _RunPlan, progress: Progress) -> tuple[RunParts, Envelope]:
    """Simulate the run, and take every part of a period, and the extrema of every period."""
    first, last = run.speeds
    plan = run.simulation
    trajectory = integrate(plan.task, plan.layout, plan.algorithm, plan.discard, progress)
    to_end = slice(int(np.searchsorted(trajectory.time, (last - first) / run.rate)) + 1)
    time = trajectory.time[to_end]
    deflection = trajectory.deflection[to_end]
    # the parts of its periods
    per_period = _parts(run.orbit.model)
    period = run.periods(time)
    part = period * per_period + _ROUNDING
    whole_parts = int(min(part[-1], periods_between(run.orbit.model, run.speeds, run.rate) * per_period + _ROUNDING))
    begins = np.searchsorted(part, np.arange(whole_parts + 1))
    high, low = (
        sign * np.maximum.reduceat(with_peaks(sign * deflection)[: begins[-1]], begins[:-1], axis=0)
        for sign in (1.0, -1.0)
    )
    # deflections at evenly spread instants of every part
    instants = -(-_INSTANTS * _load_cycles(run.orbit.model) // per_period)
    at = np.arange((len(begins) - 1) * instants) / (per_period * instants)
    traced = np.stack([np.interp(at, period, column) for column in deflection.T], axis=-1)
    # values in the middle of the parts, and at the starts of periods
    middle = 0.5 * (time[begins[:-1]] + time[begins[1:]])
    starts = first + run.rate * run.start_of(np.arange(whole_parts // per_period + 1.0))
    low_end, high_end = sorted((first * run.to_value, last * run.to_value))

    def state_before(value: float, period_map: PeriodMap) -> State:
        seconds = np.asarray((value / run.to_value - first) / run.rate)
        start = run.start_of(np.floor(run.periods(seconds) + _ROUNDING))
        return state_at(period_map, run.model, trajectory, float(start))

    parts = RunParts(
        upward=last > first,
        per_period=per_period,
        value=(first + run.rate * middle) * run.to_value,
        deflection=traced.reshape(-1, instants, deflection.shape[1]),
        starts=np.clip(starts * run.to_value, low_end, high_end),
        state_before=state_before,
    )
    return parts, _envelope(parts, high, low)


def with_peaks(sampled: Array) -> Array:
    """Return samples (Nt, K) with those that exceed their neighbours raised to the top of the parabola through three.

    Of a sine sampled 64 times per period the highest sample is up to 1.2e-3 too low, the top of the parabola 2e-6 off.
    """
    before = sampled[:-2]
    top = sampled[1:-1]
    after = sampled[2:]
    bend = 2.0 * top - before - after
    is_peak = (top >= before) & (top >= after) & (bend > 0.0)
    raised = sampled.copy()
    np.divide((after - before) ** 2, 8.0 * bend, out=bend, where=is_peak)
    raised[1:-1] += np.where(is_peak, bend, 0.0)
    return raised


def _envelope(parts: RunParts, high: Array, low: Array) -> Envelope:
    """The run period by period, from its (Q, K) highest and lowest deflections in every part."""
    step = parts.per_period
    highest, lowest = (
        levels[: len(levels) // step * step].reshape(-1, step, levels.shape[1]) for levels in (high, low)
    )
    value = parts.value[: len(highest) * step].reshape(-1, step)
    middle = 0.5 * (value[:, (step - 1) // 2] + value[:, step // 2])
    return Envelope(parts.upward, middle, highest.max(axis=1) - lowest.min(axis=1))
