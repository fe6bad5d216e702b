"""A run-up and a run-down at a rate beside the branches: where the motion jumps, and how far behind the fold.

A slowly changed speed takes a stable motion past the fold in which it ends. It does not jump there at once: near a
smooth fold it moves away so slowly that the jump comes late, by a delay that grows with the rate r as r^(2/3) while r
is small.

The jump is where the peak-to-peak deflection over a period passes the middle between that of the motion which has
ended, at its fold, and that of the stable motion which goes on, at the speed of the run.

P. Jung, G. Gray, R. Roy, P. Mandel, "Scaling law for dynamical hysteresis", Physical Review Letters 65 (1990)
1873-1876.

Takes a Branch over the speed and a rate; gives RunUpJumps.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import groupby, pairwise
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import assemble, period_of
from gearrattle.engine.periodic.events import FOLD
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model, units
from gearrattle.model.path_labels import path_label
from gearrattle.model.quantity import Plain, checked
from gearrattle.model.table import shown
from gearrattle.orbits.followed import Followed
from gearrattle.orbits.orbit import Orbit
from gearrattle.orbits.stable_ranges import nodes_of, stability_of_steps
from gearrattle.result import Result
from gearrattle.simulation.simulate import simulate

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

PATHS = ("excitation.speed", "excitation.frequency")
"""What a run-up changes."""
_SAMPLES = 64  # of the shortest period


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
class Jump:
    """A fold that a run passes.

    Attributes
    ----------
    upward
        whether the speed grows.
    fold
        value at the fold [SI].
    value
        value at which the run jumps [SI]; NaN where it does not.
    delay
        the speed that the run passes in between [rad/s].
    periods
        the number of periods T in between.
    clearance
        whose deflection tells the two motions apart most.
    words
        why there is no jump; empty where there is one.
    """

    upward: bool
    fold: float
    value: float
    delay: float
    periods: float
    clearance: str
    words: str = ""


@dataclass(frozen=True)
class RunUpJumps(Result):
    """Jumps of a run-up and of a run-down beside the folds of a branch.

    Attributes
    ----------
    branch
        of motions over the speed.
    rate
        by which the speed changes [rad/s^2].
    envelopes
        of the run-up and the run-down.
    jumps
        every fold that they pass.
    notes
        what the user must know.

    Examples
    --------
    >>> model = gr.example("backlash_oscillator")
    >>> up, down = gr.continuation(model, "excitation.speed", (0.6, 0.9)).run_up(1e-3).jumps
    >>> up.value > up.fold > down.fold > down.value
    True
    """

    kind: ClassVar[str] = "jumps of run-ups"
    branch: Followed = field(repr=False, compare=False)
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
        """A Dataset: fold, value, delay and periods over "jump"; speed and peak-to-peak over the periods of a run."""
        import xarray as xr

        unit = {"units": path_label(self.branch.path, self.model).unit or "1"}
        speed_unit = {"units": "rad/s" if self.model.units == "SI" else "1"}
        attributes = {"fold": unit, "value": unit, "delay": speed_unit}
        variables = {
            name: (
                "jump",
                np.array([getattr(jump, name) for jump in self.jumps], dtype=np.float64),
                attributes.get(name, {}),
            )
            for name in ("fold", "value", "delay", "periods")
        }
        words = {
            "direction": ["up" if jump.upward else "down" for jump in self.jumps],
            "decided_by": [jump.clearance for jump in self.jumps],
        }
        texts = {name: ("jump", np.array(column, dtype=np.str_)) for name, column in words.items()}
        runs: dict[str, Any] = {}
        for run in self.envelopes:
            way = "up" if run.upward else "down"
            runs[f"{way}_value"] = (f"{way}_period", run.value, unit)
            runs[f"{way}_peak_to_peak"] = ((f"{way}_period", "clearance"), run.peak_to_peak)
        names = list(assemble(self.model).layout.clearance_names)
        about = {"result": self.kind, "path": self.branch.path, "rate": self.rate, "title": self.model.name}
        return xr.Dataset({**variables, **texts, **runs}, {"clearance": names}, about)


@dataclass(frozen=True)
class _Stretch:
    """A part of a branch on which motions are stable: (N,) values ascending, (N, K) peak-to-peak deflections."""

    value: Array
    peak_to_peak: Array
    folds: tuple[float, ...]

    def at(self, value: float) -> Array:
        """(K,) peak-to-peak deflections; those of the end beyond it."""
        return np.array([np.interp(value, self.value, column) for column in self.peak_to_peak.T])


def run_up_of(branch: Followed, rate: float | str, progress: Callable[[float], None] | None) -> RunUpJumps:
    """Return the jumps of a run-up and a run-down; see ``Branch.run_up``.

    Raises
    ------
    ModelError
        a branch over something else than the speed, a rate without sense.
    """
    if branch.path not in PATHS:
        raise ModelError(Problem("path", branch.path, f"a run-up changes {' or '.join(PATHS)}", "follow that"))
    speed_rate = _rate(branch.model, rate)
    low, high = sorted(branch.range)
    stretches = list(_stretches(branch))
    envelopes, jumps, notes = list[Envelope](), list[Jump](), list[str]()
    for upward in (True, False):
        begin, end = (low, high) if upward else (high, low)
        start = _start(branch, begin)
        if start is None:
            notes.append(f"No stable motion is known at {branch.path} = {begin:.6g}: no run begins there.")
            continue
        share = None if progress is None else _half(progress, upward)
        run = _run(branch, start, (begin, end), speed_rate, share)
        envelopes.append(run)
        jumps += _jumps(branch, run, stretches, speed_rate)
    return RunUpJumps(branch, speed_rate, tuple(envelopes), tuple(jumps), tuple(notes))


def _half(progress: Callable[[float], None], upward: bool) -> Callable[[float], None]:
    """Progress of one of the two runs."""
    return lambda share: progress(0.5 * share + (0.0 if upward else 0.5))


def _rate(model: Model, rate: float | str) -> float:
    """The rate [rad/s^2]."""
    if isinstance(rate, str) and model.units == "SI":
        try:
            rate = units.convert(rate, units.ANGULAR_ACCELERATION)
        except units.UnitError as error:
            raise ModelError(Problem("rate", shown(rate), error.rule, error.remedy)) from None
    return float(checked(Plain("positive", "the run goes up and down by itself"), rate, "rate"))


def _start(branch: Followed, value: float) -> Orbit | None:
    """The stable motion at an end of the range: of the first branch that has one."""
    data = branch.data
    chosen = np.flatnonzero((data["value"].values == value) & data["stable"].values)
    return branch.orbit(int(chosen[0])) if chosen.size else None


def _speed_of(branch: Followed, value: float) -> float:
    """The speed at a value [rad/s]."""
    return branch.model.with_({branch.path: value}).excitation.omega


def _run(
    branch: Followed,
    start: Orbit,
    ends: tuple[float, float],
    rate: float,
    progress: Callable[[float], None] | None,
) -> Envelope:
    """Simulate the run, and reduce every period of it to its peak-to-peak deflections."""
    first, last = (_speed_of(branch, value) for value in ends)
    over = abs(last - first) / rate
    turns = period_of(start.model).period * first / (2.0 * np.pi)
    cycles = int(np.ceil(over * first / (2.0 * np.pi * turns)))
    sweep = {"from": first, "to": last, "over": over}
    samples = int(np.ceil(_SAMPLES * max(1.0, last / first)))
    run = simulate(
        branch.model.with_({"excitation.sweep": sweep}),
        "exact",
        cycles=cycles,
        discard=0,
        samples_per_cycle=samples,
        initial=start.state,
        audit=False,
        progress=progress,
    )
    time, deflection = run.trajectory.time, run.trajectory.deflection
    during = time <= over
    time, deflection = time[during], deflection[during]
    signed = rate if last > first else -rate
    period = (first * time + 0.5 * signed * time**2) / (2.0 * np.pi * turns)
    begins = np.searchsorted(period, np.arange(int(period[-1]) + 1))
    high, low = (reduced.reduceat(deflection, begins[:-1], axis=0) for reduced in (np.maximum, np.minimum))
    middle = 0.5 * (time[begins[:-1]] + time[begins[1:]])
    to_value = ends[0] / first
    return Envelope(last > first, (first + signed * middle) * to_value, high - low)


def _stretches(branch: Followed) -> Sequence[_Stretch]:
    """The parts of all branches on which motions are stable, ends at events included."""
    values, swings = branch.data["value"].values, branch.data["peak_to_peak"].values
    event_values, kinds = branch.events["value"].to_numpy(np.float64), branch.events["kind"].tolist()
    event_swings = branch.event_levels[:, 1] - branch.event_levels[:, 0]
    stretches = []
    for number in range(len(branch.curves)):
        nodes = list(nodes_of(branch, number))
        steps = zip(stability_of_steps(branch, nodes), pairwise(nodes), strict=True)
        for is_stable, group in groupby(steps, key=lambda step: step[0]):
            if not is_stable:
                continue
            pairs = [pair for _, pair in group]
            passed = [pairs[0][0], *(after for _, after in pairs)]
            value = np.array([values[i] if e < 0 else event_values[e] for i, e in passed])
            swing = np.array([swings[i] if e < 0 else event_swings[e] for i, e in passed])
            order = np.argsort(value, kind="stable")
            folds = tuple(float(event_values[e]) for _, e in (passed[0], passed[-1]) if e >= 0 and kinds[e] == FOLD)
            stretches.append(_Stretch(value[order], swing[order], folds))
    return stretches


def _jumps(branch: Followed, run: Envelope, stretches: Sequence[_Stretch], rate: float) -> list[Jump]:
    """The folds that a run passes, in its order."""
    ended = [
        (fold, own)
        for own in stretches
        for fold in own.folds
        if fold == (own.value[-1] if run.upward else own.value[0])
    ]
    ordered = sorted(ended, key=lambda pair: pair[0], reverse=not run.upward)
    return [_jump(branch, run, fold, (own, stretches), rate) for fold, own in ordered]


def _jump(
    branch: Followed, run: Envelope, fold: float, motions: tuple[_Stretch, Sequence[_Stretch]], rate: float
) -> Jump:
    """Where a run jumps after a fold."""
    own, stretches = motions
    names = assemble(branch.model).layout.clearance_names

    def without(words: str, clearance: str = "") -> Jump:
        return Jump(run.upward, fold, np.nan, np.nan, np.nan, clearance, words)

    others = [one for one in stretches if one is not own and one.value[0] <= fold <= one.value[-1]]
    if not others:
        return without("no other stable motion is known at the fold")
    ended = own.at(fold)
    apart = [np.abs(one.at(fold) - ended) / np.maximum(np.maximum(one.at(fold), ended), 1e-300) for one in others]
    nearest = int(np.argmin([changes.max() for changes in apart]))
    clearance = int(np.argmax(apart[nearest]))
    other = np.interp(run.value, *_ascending(others[nearest], clearance))
    sign = np.sign(others[nearest].at(fold)[clearance] - ended[clearance])
    beyond = sign * (run.peak_to_peak[:, clearance] - 0.5 * (other + ended[clearance]))
    after = (run.value > fold) if run.upward else (run.value < fold)
    first = int(np.argmax(after)) if after.any() else len(after)
    if first == 0 or beyond[first - 1] > 0.0:
        return without("the run was not on the motion that ends there", names[clearance])
    crossed = np.flatnonzero(beyond[first:] > 0.0)
    if not crossed.size:
        return without("the run ends before it jumps", names[clearance])
    k = first + int(crossed[0])
    share = beyond[k - 1] / (beyond[k - 1] - beyond[k])
    value = float(run.value[k - 1] + share * (run.value[k] - run.value[k - 1]))
    speeds = _speed_of(branch, value), _speed_of(branch, fold)
    delay = abs(speeds[0] - speeds[1])
    turns = period_of(branch.model).period * branch.model.excitation.omega
    periods = delay / rate * 0.5 * (speeds[0] + speeds[1]) / turns
    return Jump(run.upward, fold, value, delay, periods, names[clearance])


def _ascending(stretch: _Stretch, clearance: int) -> tuple[Array, Array]:
    return stretch.value, stretch.peak_to_peak[:, clearance]
