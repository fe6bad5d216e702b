"""Error budget of a level: the known sources of its difference, and the remainder that none explains.

Sources that are known are taken as independent and their squares add up (ASME V&V 20-2009: the comparison error E is
set against u_val^2 = u_num^2 + u_input^2 + u_D^2): scatter of both records, noise and calibration as stated, sampling,
the certified tolerance, parameters. The interval's factor is Student's t for the two scatters, 1.96 for the others. The
part of sigma beyond that interval is the *remainder*: by at least that the model is wrong, or a source is missing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gearrattle.measured.validation.block_bootstrap import Draws, factor
from gearrattle.measured.validation.cycles import FEWEST_SAMPLES, Cycles, Setting, Source, cut
from gearrattle.measured.validation.level_agreement import levels_of, log_errors
from gearrattle.measured.validation.validation_records import Contribution, Level
from gearrattle.signals.conditioning import resample
from gearrattle.trajectory import Array

NORMAL = 1.959963984540054  # 97.5 % point
_FINER = 4
_CYCLES = 16  # cycles from which the error of sampling is estimated


@dataclass(frozen=True)
class Known:
    """Relative uncertainties of each channel's levels.

    Attributes
    ----------
    scatter
        (2, C) standard errors of the logarithms, measured and simulated.
    between
        (2, C) change of the levels between samples, of both records together.
    grid
        (2, C) change of the simulated levels on an output grid half as fine.
    numerical
        (2, C); NaN where nothing is certified.
    parameters
        (2, C); NaN where no standard errors were handed in.
    """

    scatter: tuple[Array, Array]
    freedoms: tuple[float, float]
    between: Array
    grid: Array
    numerical: Array
    numerical_words: str
    parameters: Array
    parameters_words: str


def known_scatter(cycles: tuple[Cycles, Cycles], draws: tuple[Draws, Draws]) -> tuple[Array, Array]:
    """Return the standard errors of the logarithms of the levels, measured and simulated."""
    return log_errors(cycles[0], draws[0]), log_errors(cycles[1], draws[1])


def between_samples(source: Source, cycles: Cycles, setting: Setting) -> Array:
    """(2, C) relative change of the levels if the band is sampled four times as finely."""
    end = cycles.start + cycles.period * (min(cycles.count, _CYCLES) + 1e-6)
    part = replace(setting, samples=setting.samples * _FINER)
    fine = _finer(source, cycles, part, end)
    coarse = fine.values[:, ::_FINER]
    return _difference(levels_of(fine), levels_of(replace(fine, values=coarse)))


def _finer(source: Source, cycles: Cycles, setting: Setting, end: float) -> Cycles:
    """Cut a record on a finer grid within the band of the coarse one."""
    count = int(np.floor((end - cycles.start) / cycles.period))
    grid = cycles.start + cycles.period * np.arange(count * setting.samples) / setting.samples
    grid = np.clip(grid, source.first, source.last)
    rate = cycles.rate
    resampled = resample(source.values, source.interval, source.first, grid, rate)
    values = (resampled - resampled.mean(axis=0)).reshape(count, setting.samples, -1)
    return Cycles(values, values, cycles.start, cycles.period)


def half_grid(source: Source, cycles: Cycles, setting: Setting, bounds: tuple[float, float]) -> Array:
    """(2, C) relative change of the simulated levels if the run had given half as many samples.

    In the band that the half grid has: what folds back there does so less on the whole grid.
    """
    thin = source.thinned()
    part = replace(setting, samples=min(setting.samples, int(cycles.period / thin.interval + 1e-6)))
    if part.samples < FEWEST_SAMPLES:
        return np.full((2, source.values.shape[1]), np.nan)
    ends = max(bounds[0], cycles.start), bounds[1]
    whole, half = (cut(signal, cycles.period, part, ends, whole_start=True) for signal in (source, thin))
    count = min(whole.count, half.count)
    pair = (replace(member, values=member.values[:count]) for member in (whole, half))
    one, other = (levels_of(member) for member in pair)
    return _difference(one, other)


def _difference(one: Array, other: Array) -> Array:
    """|other / one - 1|; zero where both rest."""
    return np.asarray(np.where(one > 0.0, np.abs(other - one) / np.where(one > 0.0, one, 1.0), 0.0))


def with_budget(level: Level, row: int, channel: int, known: Known, stated: tuple[float, float, int]) -> Level:
    """Return a level with its budget.

    Parameters
    ----------
    row
        0 for peak to peak, 1 for rms.
    stated
        rms of the noise in the channel's unit, standard uncertainty of its calibration [%] (NaN: not stated),
        samples in a cycle.
    """
    # errors of the measured and the simulated level are relative to the measured one
    ratio = level.simulated / level.measured if level.measured > 0.0 else float("nan")
    share = 100.0 * ratio
    noise, calibration, samples = stated
    scatter = [share * float(spread[row, channel]) for spread in known.scatter]
    # the contributions
    rows = [
        Contribution("measured scatter", scatter[0], "cycle to cycle, block bootstrap; unstated noise is in it"),
        Contribution("simulated scatter", scatter[1], "cycle to cycle, block bootstrap"),
        _noise(level, noise, samples),
        Contribution("calibration", calibration * ratio, "as stated" if np.isfinite(calibration) else "not stated"),
        Contribution(
            "sampling",
            share * float(known.between[row, channel]),
            f"both records in the band, {_FINER} times as finely sampled",
        ),
        Contribution(
            "output grid",
            share * float(known.grid[row, channel]),
            "the run at half as many samples: what folds back into the band",
        ),
        Contribution("alignment", 0.0, "levels of whole cycles do not depend on the clock; phases do"),
        Contribution("numerical", share * float(known.numerical[row, channel]), known.numerical_words),
        Contribution("parameters", share * float(known.parameters[row, channel]), known.parameters_words),
    ]
    # expanded uncertainty: Student's factor for the scatters, 1.96 for the others
    others = [row.value for row in rows[2:] if np.isfinite(row.value)]
    relative = [np.asarray(spread[row, channel]) for spread in known.scatter]
    reach = float(factor((relative[0], relative[1]), known.freedoms)) * float(np.hypot(scatter[0], scatter[1]))
    expanded = float(np.hypot(reach, NORMAL * np.sqrt(np.sum(np.square(others)))))
    # the remainder beyond it
    beyond = max(0.0, abs(level.sigma) - expanded) if np.isfinite(level.sigma) else float("nan")
    return replace(
        level, budget=tuple(rows), expanded=expanded, remainder=float(np.copysign(beyond, level.sigma)) + 0.0
    )


def _noise(level: Level, noise: float, samples: int) -> Contribution:
    """Contribution of stated noise to a measured level: not subtracted, but counted as uncertainty."""
    if not np.isfinite(noise):
        return Contribution("stated noise", float("nan"), "not stated")
    if level.measure == "rms":
        clean = np.sqrt(max(level.measured**2 - noise**2, 0.0))
        return Contribution("stated noise", 100.0 * (1.0 - clean / level.measured), "raises the rms by so much")
    value = 100.0 * 2.0 * noise * float(np.sqrt(2.0 * np.log(samples))) / level.measured
    return Contribution("stated noise", value, "bound: 2 n (2 ln S)^(1/2) more between the extremes of S samples")
