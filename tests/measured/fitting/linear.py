"""Coverage over many records at little cost: choice, weights and errors are the package's, the motion is linear.

The simulated lines are those of the true model and their derivatives by the free logarithms and the delay. So a fit is
one solution of a linear problem: ``python -m tests.measured.fitting.linear [RECORDS]``.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

from gearrattle.measured.fitting.covariance import spread
from gearrattle.measured.fitting.line_choice import Chosen, of_both
from gearrattle.measured.fitting.recorded import Motion, Recorded, in_band
from gearrattle.measured.fitting.simulated_cycles import Simulator
from gearrattle.measured.validation import level_agreement, order_agreement
from gearrattle.measured.validation.block_bootstrap import draws
from gearrattle.measured.validation.cycles import Cycles
from gearrattle.recording import Channel
from gearrattle.signals.conditioning import PASSED
from tests.measured.fitting.coverage import KINDS, SEED, Kind, noise, truth, value_of

_STEP = 1e-3


@dataclass(frozen=True)
class Linear:
    """The true mean cycle (S, C), its motion, and (K, C, P + 1) derivatives of the lines, the delay's last."""

    cycle: np.ndarray
    motion: Motion
    slopes: np.ndarray
    period: float


def linear(kind: Kind) -> Linear:
    """Of the true model of a kind."""
    model = truth(kind)
    names = tuple(f"{kind.quantity}.{name}" for name in kind.names)
    simulator = Simulator({}, names, (0.0, 1e9), int(PASSED * kind.samples), "mean")
    slopes = []
    for path in kind.free:
        ahead, behind = (
            simulator.motion(model.with_({path: value_of(model, path) * np.exp(way * _STEP)})).lines for way in (1, -1)
        )
        slopes.append((ahead - behind) / (2.0 * _STEP))
    cycles = simulator.samples(model)
    motion = simulator.motion_of(cycles)
    slopes.append(1j * np.arange(1, len(motion.lines) + 1)[:, None] * motion.lines)
    return Linear(cycles.values.mean(axis=0), motion, np.stack(slopes, axis=-1), cycles.period)


def record(kind: Kind, known: Linear, seed: int) -> Recorded:
    """One record of a kind, with the lines that a search has."""
    random = np.random.default_rng([SEED, seed])
    shape = kind.cycles * kind.samples, len(kind.names)
    size = 1.0 + kind.scatter * random.standard_normal((kind.cycles, 1, 1))
    rms = kind.size * known.cycle.std(axis=0)
    disturbed = noise(kind.noise, shape, kind.samples, random).reshape(kind.cycles, kind.samples, -1)
    clean = known.cycle - known.cycle.mean(axis=0)
    values = size * clean + rms * disturbed
    values = values - values.mean(axis=(0, 1))
    cycles = Cycles(values, values, 0.0, known.period)
    how = draws(level_agreement.mean_squares(cycles), np.random.default_rng(0), lines=order_agreement.strong(cycles))
    line, channel = of_both(order_agreement.lines_of(cycles, how), known.motion.lines, in_band(cycles, 0.0))
    none = np.zeros(0, dtype=np.int64)
    channels = tuple(Channel(name, kind.quantity, name, "1", np.zeros(1)) for name in kind.names)
    chosen = Chosen(line, channel, none, phases=True, delay=None)
    return Recorded(channels, cycles, 0.0, known.period, 1.0, chosen, how, np.zeros(0), np.zeros(len(channels)))


def solved(recorded: Recorded, known: Linear) -> tuple[np.ndarray, np.ndarray]:
    """(P + 1,) logarithms with the least sum of squares, and their standard errors."""
    at = recorded.chosen.line, recorded.chosen.channel
    turned = known.slopes[at] * np.conj(recorded.direction)[:, None]
    jacobian = np.concatenate([turned.real, turned.imag]) / recorded.errors[:, None]
    rows = (recorded.values(known.motion, 0.0) - recorded.own_values) / recorded.errors
    matrix = spread(jacobian, recorded.covariance_for_values)
    return -np.linalg.pinv(jacobian) @ rows, np.sqrt(np.diag(matrix))


def deviations(kind: Kind, seeds: range, *, anew: bool = True) -> np.ndarray:
    """(R, P) fitted less true logarithms in standard errors; ``anew``: with the lines of the fitted motion."""
    known = linear(kind)
    rows = []
    for seed in seeds:
        recorded = record(kind, known, seed)
        x, errors = solved(recorded, known)
        if anew:
            fitted = Motion(known.motion.lines + known.slopes[:, :, :-1] @ x[:-1], known.motion.power)
            x, errors = solved(recorded.judged_by(fitted), known)
        rows.append((x / errors)[:-1])
    return np.array(rows)


def main(records: int) -> None:
    """Print how often 1.96 standard errors hold the truth, by kind and parameter."""
    by_key: dict[str, list[np.ndarray]] = {}
    for kind in KINDS:
        print(kind.words, flush=True)
        for path, away in zip(kind.free, deviations(kind, range(records)).T, strict=True):
            by_key.setdefault(path.rsplit(".", 1)[-1], []).append(away)
            shown(f"  {path}", away)
    by_key["all"] = [part for parts in by_key.values() for part in parts]
    for key, away in by_key.items():
        shown(key, np.concatenate(away))


def shown(name: str, away: np.ndarray) -> None:
    """Print one row."""
    inside = 100.0 * np.mean(np.abs(away) < 1.96)
    print(f"{name}: {inside:.1f} % of {away.size}, mean {away.mean():+.2f}, deviation {away.std():.2f}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 300)
