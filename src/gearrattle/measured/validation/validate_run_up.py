"""``validate_run_up``: a simulated run-up against measured ones, order by order over speed.

A change of speed has no period, so there are no cycles to average over. Two run-ups have in common the amplitude of
every order at every speed. Orders are fitted over blocks of as many turns in both (``order_cuts``), read at the same
speeds by straight lines between blocks, and compared there,

    sigma(n) = (measured - simulated) / measured,        over the run-up by the rms of the amplitudes over speed.

Random scatter shows only in repeated run-ups: with two or more the measured amplitude is their mean, its interval
Student's. Phases are not compared, as each shaft has a zero of its own; nor is the signal between orders.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.measured.order_over_speed import Track
from gearrattle.measured.read import read
from gearrattle.measured.validation.block_bootstrap import CONFIDENCE
from gearrattle.measured.validation.pairing import Pairing, paired
from gearrattle.measured.validation.run_up_record import RunUp
from gearrattle.measured.validation.simulated_recording import recorded
from gearrattle.measured.validation.validate import run_of
from gearrattle.model import Model
from gearrattle.model.table import listed
from gearrattle.model.value_kinds import CALLBACK, check_arguments
from gearrattle.recording import Channel, Recording
from gearrattle.results import Run
from gearrattle.signals.conditioning import PASSED
from gearrattle.signals.spectral.order_maps_of_signals import TURNS, order_cuts
from gearrattle.trajectory import Array
from gearrattle.wording import counted

Measured = Recording | str | os.PathLike[str] | Mapping[str, object]
MOST = 200
"""Speeds at which orders are compared, at most."""
_FEWEST = 3
_STILL = 1e-9  # of the speed, from block to block: rounding


def validate_run_up(
    model: Model | Run | str | os.PathLike[str],
    measurement: Measured | Sequence[Measured],
    orders: Sequence[float] | None = None,
    *,
    match: Mapping[str, str] | None = None,
    speed: str | None = None,
    turns: float = TURNS,
    settings: Mapping[str, object] | None = None,
    progress: Callable[[float], None] | None = None,
) -> RunUp:
    """Compare a simulated run-up with measured ones, order by order over speed.

    Parameters
    ----------
    model
        a model with a sweep, simulated for it; a run of one; or the file of either (.toml, .nc).
    measurement
        a recording, or whatever ``read`` takes; or a list of them, run-ups repeated.
    orders
        compared; None: those of the excitation that all samples show.
    match
        simulated channels by measured ones; others go by quantity and subject.
    speed
        measured channel of the shaft's speed or angle; None: the recording's own.
    turns
        in a block.
    settings
        keyword arguments of ``simulate``, for a model.
    progress
        called with the fraction done of the simulation; what it raises ends the comparison.

    Raises
    ------
    ModelError
        no channel in common, a speed that comes back, no speeds in common, or what ``order_cuts`` refuses.
    ConvergenceError
        the simulation failed.

    Examples
    --------
    >>> run = gr.simulate(gr.example("run_up"), samples_per_cycle=64, audit=False)
    >>> data = run.data["velocity"]
    >>> shaft = 1.1 * data.sel(inertia="input_shaft").values
    >>> gear = gr.measured.Channel("gear", "velocity", "input_shaft", "rad/s", shaft)
    >>> speed = gr.measured.Channel("n", "speed", "", "rad/s", run.data["speed"].values)
    >>> rig = gr.measured.Recording(data.time.values, (gear, speed), "rig")
    >>> answer = gr.validate_run_up(run, rig, [2.0], speed="n")
    >>> round(answer.tracks[0].sigma, 1)
    9.1
    """
    check_arguments(progress=(CALLBACK, progress))
    # the recordings
    several = not isinstance(measurement, str | os.PathLike | Mapping | Recording)
    measurements: list[Measured] = list(measurement) if several else [measurement]  # type: ignore[arg-type, list-item]
    if not measurements:
        raise ModelError(Problem("measurement", "none", "needs one run-up at least", "give a file or a recording"))
    recordings = [entry if isinstance(entry, Recording) else read(entry) for entry in measurements]
    # the simulated run-up, and pairs of channels
    run = run_of(model, settings or {}, progress)
    simulation = recorded(run)
    pairings = [paired(recording, simulation, match or {}) for recording in recordings]
    names = [channel.name for channel in pairings[0].measured]
    check_repeats(recordings, pairings)
    # amplitudes over speed of every pair
    chosen = orders_in_common(run, recordings, orders, speed, names[0])
    tracks = []
    notes = dict.fromkeys(pairings[0].notes)
    for one, other in zip(pairings[0].measured, pairings[0].simulated, strict=True):
        made = _tracks(run, recordings, (one, other), chosen, speed=speed, turns=turns)
        tracks += made[0]
        notes |= dict.fromkeys(made[1])
    return RunUp(
        run.model.name or "driveline",
        tuple(recording.source for recording in recordings),
        run.cost.algorithm,
        turns,
        run.model.units,
        tuple(tracks),
        (*notes, *run.notes),
    )


def check_repeats(recordings: Sequence[Recording], pairings: Sequence[Pairing]) -> None:
    """Refuse repeats with other channels than the first (ModelError, with the record and its channels)."""
    first = [channel.name for channel in pairings[0].measured]
    for recording, pairing in zip(recordings, pairings, strict=True):
        names = [channel.name for channel in pairing.measured]
        if names != first:
            rule = f"the first has the channels {listed(first)}"
            raise ModelError(Problem(recording.source, listed(names), rule, "repeat one measurement"))


def orders_in_common(
    run: Run, recordings: Sequence[Recording], orders: Sequence[float] | None, speed: str | None, name: str
) -> list[float]:
    """Return the orders to be compared: as given, or those of the excitation that all samples show."""
    if orders is not None:
        return [float(order) for order in orders]
    excited = run.trajectory.layout.orders
    fastest = [float(np.max(run.speed)) if run.speed is not None else run.model.excitation.omega]
    rates = [(run.trajectory.time.size - 1) / float(run.trajectory.time[-1] - run.trajectory.time[0])]
    for recording in recordings:
        lowest = order_cuts(recording, name, [1.0], speed=speed, turns=1.0)
        fastest.append(1.05 * float(lowest["speed"].max()))  # of means over turns
        rates.append(1.0 / float(recording.interval or np.inf))
    most = min(PASSED * rate * 2.0 * np.pi / omega for rate, omega in zip(rates, fastest, strict=True))
    shown = [float(order) for order in excited if 0.0 < order <= most]
    if not shown:
        rule = f"the samples show orders up to {most:.4g}, and the excitation has none of these"
        raise ModelError(Problem("orders", "none given", rule, "name the orders, or sample faster"))
    return shown


def _tracks(
    run: Run,
    recordings: Sequence[Recording],
    pair: tuple[Channel, Channel],
    orders: Sequence[float],
    *,
    speed: str | None,
    turns: float,
) -> tuple[list[Track], list[str]]:
    """Compare the orders of one channel; with the notes of its signals."""
    # orders of every record and of the simulation, where the speed rises or falls steadily
    one, other = pair
    cuts = [order_cuts(recording, one.name, orders, speed=speed, turns=turns) for recording in recordings]
    cuts.append(order_cuts(run, f"{other.quantity}.{other.subject}", orders, turns=turns))
    parts = [longest_stretch(cut["speed"].values, str(cut.attrs["source"])) for cut in cuts]
    rising = [rows for rows, _ in parts]
    speeds = [cut["speed"].values[rows] for cut, rows in zip(cuts, rising, strict=True)]
    # amplitudes at the same speeds
    grid = _grid(speeds, one.name)
    read_at = np.array(
        [
            [np.interp(grid, at, cut["amplitude"].values[rows, k]) for k in range(cut.sizes["order"])]
            for cut, at, rows in zip(cuts, speeds, rising, strict=True)
        ]
    )
    measured = read_at[:-1]
    simulated = read_at[-1]
    # scatter of the repeats, and the tracks
    error, reach = _scatter(measured)
    tracks = [
        Track(
            channel=one.name,
            partner=other.name,
            unit=one.unit,
            order=float(order),
            speed=grid,
            measured=measured[:, k].mean(axis=0),
            simulated=simulated[k],
            error=error[k],
            reach=reach * error[k],
        )
        for k, order in enumerate(cuts[-1]["order"].values)
    ]
    # notes on stretches and cuts
    notes = [note for _, note in parts if note]
    return tracks, [*notes, *(note for cut in cuts for note in str(cut.attrs["notes"]).splitlines())]


def _scatter(measured: Array) -> tuple[Array, float]:
    """(K, n) standard errors of the means of (R, K, n) repeats, NaN of one, and the factor of their interval."""
    from scipy.stats import t

    count = len(measured)
    if count < 2:
        return np.full(measured.shape[1:], np.nan), float("nan")
    reach = float(t.ppf(0.5 + 0.5 * CONFIDENCE, count - 1))
    return np.asarray(measured.std(axis=0, ddof=1) / np.sqrt(count)), reach


def longest_stretch(speed: Array, source: str) -> tuple[Any, str]:
    """Return the blocks of the longest stretch in which the speed rises or falls, by rising speed; and a note.

    A ModelError refuses one of too few blocks, or of less than half of the speeds.
    """
    # from block to block the speed rises (1), falls (-1) or stays (0)
    changes = np.diff(speed)
    sense = np.where(np.abs(changes) > _STILL * float(speed.max()), np.sign(changes), 0.0)
    # stretches of one sense, as number of changes and first block; the longest that does not stay
    ends = np.concatenate([[0], np.flatnonzero(np.diff(sense)) + 1, [sense.size]]).astype(int)
    stretches = [(end - begin, begin) for begin, end in pairwise(ends.tolist()) if end > begin and sense[begin] != 0.0]
    count, first = max(stretches, key=lambda stretch: stretch[0], default=(0, 0))
    rows = np.arange(first, first + count + 1)
    span = f"{speed.min():.6g} to {speed.max():.6g} rad/s, {counted(speed.size, 'block')}"
    if rows.size < _FEWEST or np.ptp(speed[rows]) < 0.5 * np.ptp(speed):
        rule = (
            f"orders over speed need a speed that rises or falls for {_FEWEST} blocks, over half of its range at least"
        )
        remedy = "cut the record to one run-up (start, end in a mapping), filter the speed, or take more turns"
        raise ModelError(Problem(source, span, rule, f"{remedy}; at one speed use validate"))
    left = speed.size - rows.size
    ends_at = f"{speed[rows].min():.5g} to {speed[rows].max():.5g} rad/s"
    note = (
        f"{source}: of {counted(speed.size, 'block')} those of its longest rise or fall count, {ends_at}"
        if left
        else ""
    )
    return (rows if sense[first] > 0.0 else rows[::-1]), note


def _grid(speeds: Sequence[Array], name: str) -> Array:
    """Return the speeds that all have, as many as the one with fewest blocks has between their ends."""
    low = max(float(speed[0]) for speed in speeds)
    high = min(float(speed[-1]) for speed in speeds)
    count = min(int(np.count_nonzero((speed >= low) & (speed <= high))) for speed in speeds)
    if not low < high or count < _FEWEST:
        spans = listed([f"{speed[0]:.5g} to {speed[-1]:.5g} rad/s" for speed in speeds])
        rule = f"measured and simulated speeds have fewer than {_FEWEST} blocks in common"
        raise ModelError(Problem(f"{name}: speed", spans, rule, "simulate the sweep that was measured"))
    return np.linspace(low, high, min(count, MOST))
