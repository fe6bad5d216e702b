"""How often 1.96 standard errors hold the truth of run-ups: ``python -m tests.measured.fitting.run_ups [RECORDS]``.

A driveline with two stages is swept through the resonance that moves with its amplitude. As in ``linear``, standard
errors and weights are the package's, and the simulated orders are those of the true model with their derivatives.
"""

from __future__ import annotations

import functools
import sys
from dataclasses import dataclass

import numpy as np

import gearrattle as gr
from gearrattle.measured.fitting.covariance import spread
from gearrattle.measured.fitting.fit import recording_of
from gearrattle.measured.fitting.run_up_motion import RunUpSimulator, run_up_motion
from gearrattle.measured.fitting.run_up_residuals import MeasuredRunUp
from gearrattle.measured.validation.pairing import paired
from gearrattle.measured.validation.simulated_recording import to_be_recorded
from gearrattle.recording import Channel, Recording
from tests.measured.fitting.coverage import noise

TEXT = """
schema = 1
name = "two stages, run-up"
inertia = [{ name = "engine", J = 0.2, drag = 2.0 }, { name = "gear", J = 0.05, drag = 0.5 }]
[[coupling]]
name = "damper"
between = ["engine", "gear"]
stages = [{ stiffness = 400.0, until = 0.02, damping = 0.8 }, { stiffness = 900.0, damping = 0.8 }]
[excitation]
sweep = { from = "300 rpm", to = "1500 rpm", over = "10 s" }
[[torque]]
on = "engine"
harmonics = [ { order = 1, amplitude = 40.0 }, { order = 2, amplitude = 15.0, phase = 0.7 } ]
[simulation]
cycles = 55
discard = 5
samples_per_cycle = 64
"""
FREE = (
    "coupling.damper.stages.1.stiffness",
    "coupling.damper.stages.0.until",
    "inertia.gear.J",
    "coupling.damper.stages.1.damping",
)
NAMES = ("engine", "gear")
SEED = 57
_STEP = 1e-3


@dataclass(frozen=True)
class Kind:
    """Run-ups of one kind: how large and of what colour the noise is, what scatters from run to run."""

    words: str
    size: float
    colour: str = "white"
    records: int = 1
    gain: float = 0.0
    """Standard deviation of the gain of both channels from run to run."""
    table: tuple[tuple[str, object], ...] = ()


KINDS = (
    Kind("white noise 5 %", 0.05),
    Kind("white noise 50 %", 0.5),
    Kind("pink noise 10 %", 0.1, "pink"),
    Kind("white noise 20 %, amplitudes alone", 0.2, table=(("phases", False),)),
    Kind("white noise 20 %, blocks of 20 turns", 0.2, table=(("turns", 20.0),)),
    Kind("three run-ups, white noise 5 %, gains that scatter by 3 %", 0.05, records=3, gain=0.03),
)


@functools.cache
def truth() -> tuple[gr.Model, gr.Run]:
    model = gr.loads(TEXT)
    return model, gr.simulate(model, audit=False)


def recordings(kind: Kind, seed: int) -> list[Recording]:
    """Run-ups of a kind; the zero of the rig's shaft is where each record begins."""
    _, run = truth()
    time = run.trajectory.time[700:]
    speed = Channel("n", "speed", "", "rad/s", np.asarray(run.speed)[700:])
    clean = run.data["velocity"].sel(inertia=list(NAMES)).values[700:]
    made = []
    for repeat in range(kind.records):
        random = np.random.default_rng([SEED, seed, repeat])
        disturbed = kind.size * clean.std(axis=0) * noise(kind.colour, clean.shape, 64, random)
        values = (1.0 + kind.gain * random.standard_normal()) * clean + disturbed
        channels = [
            Channel(f"v_{name}", "velocity", name, "rad/s", column)
            for name, column in zip(NAMES, values.T, strict=True)
        ]
        made.append(Recording(time, (*channels, speed), f"rig {repeat}"))
    return made


def measured(kind: Kind, seed: int) -> tuple[MeasuredRunUp, RunUpSimulator]:
    """What is fitted of one measurement."""
    model, run = truth()
    records = recordings(kind, seed)
    named = recording_of({"recording": {"file": records, **dict(kind.table)}})
    assert named is not None
    pairings = [paired(record, to_be_recorded(model), {}) for record in records]
    made, simulator, _ = run_up_motion(run, records, (pairings, named[1].wanted(0)), named[1], lambda _share: None)
    return made, simulator


@functools.cache
def slopes(turns: float, size: int) -> np.ndarray:
    """(P, B, m) derivatives of the true amplitudes by the free logarithms, of blocks of so many turns."""
    kind = Kind("", 0.0, table=(("turns", turns),))
    model, _ = truth()
    _, simulator = measured(kind, 0)
    by_path = []
    for path in FREE:
        ahead, behind = (simulator.samples(model.with_({path: model[path] * np.exp(way * _STEP)})) for way in (1, -1))
        by_path.append((ahead - behind) / (2.0 * _STEP))
    actual = np.stack(by_path)
    assert actual.shape[1] == size
    return actual


def solved(one: MeasuredRunUp, motion: np.ndarray, by_path: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(P,) logarithms with the least sum of squares, and their standard errors."""
    rows = one.rows(motion)
    ahead = np.stack([one.rows(motion + _STEP * slope) for slope in by_path], axis=1)
    behind = np.stack([one.rows(motion - _STEP * slope) for slope in by_path], axis=1)
    jacobian = (ahead - behind) / (2.0 * _STEP)
    return -np.linalg.pinv(jacobian) @ rows, np.sqrt(np.diag(spread(jacobian, one.covariance_for_values)))


def deviations(kind: Kind, seeds: range) -> np.ndarray:
    """(R, P) fitted less true logarithms, in standard errors."""
    rows = []
    _, run = truth()
    for seed in seeds:
        one, simulator = measured(kind, seed)
        motion = simulator.amplitudes(run)
        turns = float(dict(kind.table).get("turns", 8.0))  # type: ignore[arg-type]
        by_path = np.concatenate([slopes(turns, len(motion) // kind.records)] * kind.records, axis=1)
        x, _ = solved(one, motion, by_path)
        judged = one.judged_by(motion + np.tensordot(x, by_path, 1))
        rows.append(np.divide(*solved(judged, motion, by_path)))
    return np.array(rows)


def main(records: int) -> None:
    """Print coverage, bias and spread of every parameter of every kind."""
    for kind in KINDS:
        print(kind.words, flush=True)
        for path, away in zip(FREE, deviations(kind, range(records)).T, strict=True):
            inside = 100.0 * np.mean(np.abs(away) < 1.96)
            print(f"  {path}: {inside:.1f} %, mean {away.mean():+.2f}, deviation {away.std():.2f}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
