"""Random drivelines under piecewise polynomials: records and run-ups, with auxiliaries on board or without.

Records are cubic splines, and where they are torques polynomials with jumps as well; their knots lie at random or at
dyadic parts of the period. A run-up is what the program makes of a ramp and its tones; ``off`` holds that against the
sines themselves in many digits, so that the check may take the polynomials as the input.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from mpmath import mp, mpf
from scipy.interpolate import CubicSpline

from gearrattle.engine.system.piecewise_channels import Channel, joined
from gearrattle.engine.system.piecewise_signals import Signals
from gearrattle.engine.system.run_up_phase import Ramp
from gearrattle.engine.system.run_up_signals import Sound, Tone, channels
from tests.dense.auxiliaries import dressed, widths, with_friction, with_limits, with_pairs
from tests.dense.case import Case
from tests.dense.dressed import Dressed
from tests.dense.families import between, random_case, rates, share, uniform

DRIVEN = ("chain", "tree", "loop", "stages", "one-sided", "error", "to-ground", "flight", "parallel")
PROMISED = 1e-12
"""Of the sum of the amplitudes (of the slopes, of the bends): what a run-up's polynomials may leave out."""


@dataclass(frozen=True)
class Target:
    """What a channel acts on, and how strongly it may: a torque on inertia i, or the error of element i."""

    is_error: bool
    index: int
    size: float


def targets(case: Case, rng: random.Random, count: int) -> list[Target]:
    """Choose what channels act on; sizes move deflections by about a corner."""
    _, slowest = rates(case.inertia, case.rows, case.elements)
    width, actual = widths(case), []
    for _ in range(count):
        if share(rng) < 0.4:
            k = rng.randrange(len(case.laws))
            actual.append(Target(True, k, float(width[k]) * between(rng, 0.02, 0.4)))
        else:
            load = float(np.median(width)) * case.inertia.min() * slowest**2 * between(rng, 0.1, 5.0)
            actual.append(Target(False, rng.randrange(case.inertia.size), load))
    return actual


def acting(case: Case, values: Sequence[Target]) -> tuple[np.ndarray, np.ndarray]:
    """(n, C) and (m, C): torques and errors for a unit of every channel."""
    torque, error = np.zeros((case.inertia.size, len(values))), np.zeros((len(case.laws), len(values)))
    for c, target in enumerate(values):
        (error if target.is_error else torque)[target.index, c] = 1.0
    return torque, error


def with_records(case: Case, rng: random.Random) -> Dressed:
    """Add one to three channels of polynomials."""
    end, dyadic = case.length * case.period, share(rng) < 0.4
    if dyadic:
        step = case.period / rng.choice([4, 8, 16, 32])
        knots = step * np.arange(round(end / step) + rng.choice([1, 2]))
    else:
        inner = sorted(uniform(rng, 1e-4, 0.9999) * end for _ in range(rng.randint(2, 25)))
        knots = np.array([0.0, *inner, end * rng.choice([1.0, 1.01, 1.5])])
        knots = knots[np.r_[True, np.diff(knots) > 1e-4 * end]]
    if len(knots) < 3:
        knots = end * np.linspace(0.0, 1.0, 4)
    made, values = [], targets(case, rng, rng.randint(1, 3))
    for target in values:
        jumps = not target.is_error and not dyadic and share(rng) < 0.5
        made.append(Channel(knots, (_leaping if jumps else _smooth)(knots, target.size, rng)))
    return replace(dressed(case), signals=joined(made, *acting(case, values)))


def _smooth(knots: np.ndarray, size: float, rng: random.Random) -> np.ndarray:
    values = [size * uniform(rng, -1, 1) for _ in knots]
    return np.ascontiguousarray(CubicSpline(knots, values).c[::-1].T)


def _leaping(knots: np.ndarray, size: float, rng: random.Random) -> np.ndarray:
    degree, length = rng.randint(0, 7), np.diff(knots)
    values = np.array([[size * uniform(rng, -1, 1) for _ in range(degree + 1)] for _ in length])
    return values / length[:, None] ** np.arange(degree + 1)


def with_run_up(case: Case, rng: random.Random) -> tuple[Dressed, Ramp, tuple[Sound, ...]]:
    """Add one or two tones each to one or two channels, along a ramp; and what they were made of."""
    end = case.length * case.period
    fastest, slowest = rates(case.inertia, case.rows, case.elements)
    first = min(slowest * between(rng, 0.1, 3.0), 0.3 * fastest)
    speeds = [first, first * rng.choice([between(rng, 0.2, 0.9), between(rng, 1.1, 5.0)])]
    ramp = Ramp(*speeds, end * rng.choice([1.0, uniform(rng, 0.3, 1.5)]))
    values = targets(case, rng, rng.randint(1, 2))
    sounds = tuple(Sound(tuple(_tone(rng, t, speeds) for _ in range(rng.randint(1, 2))), t.is_error) for t in values)
    signals = joined(channels(ramp, sounds, end, case.period), *acting(case, values))
    return replace(dressed(case), signals=signals), ramp, sounds


def _tone(rng: random.Random, target: Target, speeds: Sequence[float]) -> Tone:
    """A tone of constant amplitude, or, where no slope matters, of one that follows a table."""
    low, high = min(speeds), max(speeds)
    order = rng.choice([1.0, 2.0, 0.5, uniform(rng, 0.3, 3.0)])
    if target.is_error or share(rng) < 0.5:
        corners, table = np.array([low, high]), np.array([[target.size]])
    else:
        corners = np.array([low, low + (high - low) * uniform(rng, 0.2, 0.8), high])
        values = np.array([target.size * uniform(rng, 0, 1) for _ in corners])
        table = np.column_stack([values[:-1], np.diff(values) / np.diff(corners)])
    return Tone(order, uniform(rng, -3, 3), corners, table)


def off(signals: Signals, ramp: Ramp, sounds: Sequence[Sound], until: float) -> float:
    """Largest error of a run-up's values, of the sum of the amplitudes; at the ends of intervals and between them."""
    worst = 0.0
    with mp.workdps(40):
        for g, begin in enumerate(signals.knots[:-1]):
            length = float(signals.knots[g + 1] - begin)
            for since in (0.0, 0.137 * length, 0.5 * length, 0.871 * length):
                if begin + since > until:
                    continue
                time = mpf(float(begin)) + mpf(since)
                for c, sound in enumerate(sounds):
                    reported = sum(mpf(float(a)) * mpf(since) ** j for j, a in enumerate(signals.coefficients[g, c]))
                    allowed = sum(float(np.abs(tone.amplitudes[:, 0]).max()) for tone in sound.tones)
                    wrong = abs(reported - sum(sounding(tone, ramp, time) for tone in sound.tones))
                    worst = max(worst, float(wrong / allowed))
    return worst


def sounding(tone: Tone, ramp: Ramp, time):
    """a(Omega) sin(n phi + p) in many digits."""
    begin = mpf(ramp.begin)
    end = mpf(ramp.end)
    over = mpf(ramp.over)
    rate, ramped = (end - begin) / over, min(time, over)
    speed = begin + rate * ramped
    angle = begin * ramped + rate * ramped**2 / 2 + end * (time - ramped)
    piece = max(i for i, low in enumerate(tone.speeds[:-1]) if i == 0 or speed >= float(low))
    since = speed - mpf(float(tone.speeds[piece]))
    size = sum(mpf(float(a)) * since**j for j, a in enumerate(tone.amplitudes[piece]))
    return size * mp.sin(mpf(tone.order) * angle + mpf(tone.phase))


def records_case(_family: str, rng: random.Random, name: str = "records") -> Dressed:
    """Return a case under records."""
    return with_records(random_case(rng.choice(DRIVEN), rng, name), rng)


def run_up_case(_family: str, rng: random.Random, name: str = "run-up") -> Dressed:
    """Return a case along a run-up."""
    return with_run_up(random_case(rng.choice(DRIVEN), rng, name), rng)[0]


def everything_case(_family: str, rng: random.Random, name: str = "all on board") -> Dressed:
    """Return a case with friction, clipped damping and alternation under records or along a run-up."""
    case = with_limits(random_case(rng.choice(DRIVEN), rng, name), rng)
    case = with_pairs(with_friction(case, rng), rng)
    if share(rng) < 0.5:
        return with_records(case, rng)
    once = [
        replace(pair, instants=tuple(sorted(t * case.length * uniform(rng, 0.5, 1.0) for t in pair.instants)))
        for pair in case.pairs
    ]
    return with_run_up(replace(case, pairs=tuple(once), repeats=False), rng)[0]


SIGNALS = {"records": records_case, "run-up": run_up_case, "all on board": everything_case}
"""How a case of each family is made."""
