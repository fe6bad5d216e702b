"""Sentences of a validation: channels that agree within chance, those that do not and by how much, likely causes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from gearrattle.measured.validation.validation_records import Clock, Impacts, Level, Order, Pair
from gearrattle.wording import counted

_LOUD = 1e-3  # share of a channel's power from which on a band is named


def verdict_of(pairs: Sequence[Pair]) -> str:
    """Return one sentence on all channels."""
    apart = [pair for pair in pairs if any(abs(level.remainder) > 0.0 and not level.by_chance for level in pair.levels)]
    agree = len(pairs) - len(apart)
    share = f"{agree} of {counted(len(pairs), 'channel')}"
    within = "in rms and peak to peak within what scatter and stated uncertainties allow"
    if not apart:
        return f"Simulation and measurement agree in {share} {within}."
    worst = max(apart, key=lambda pair: _largest(pair.levels))
    level = max(worst.levels, key=lambda entry: abs(entry.remainder))
    return (
        f"Simulation and measurement agree in {share} {within}; look first at {worst.name}: its {level.measure} is "
        f"simulated {_percent(level.sigma)}, of which at least {abs(level.remainder):.2g} % no known source explains."
    )


def findings_of(pairs: Sequence[Pair], impacts: Sequence[Impacts], clock: Clock) -> tuple[str, ...]:
    """Return sentences on every channel, its orders and bands, on impacts and on the clock."""
    sentences = [sentence for pair in pairs for sentence in _of_pair(pair)]
    sentences += [_of_impacts(impact) for impact in impacts]
    sentences += list(_of_clock(clock))
    intervals = [level.by_chance for pair in pairs for level in pair.levels]
    intervals += [order.by_chance for pair in pairs for order in pair.orders if np.isfinite(order.low)]
    intervals += [band.by_chance for pair in pairs for band in pair.bands]
    outside = intervals.count(False)
    sentences.append(
        f"{outside} of {len(intervals)} intervals of levels, orders and bands leave no room for chance; of a right "
        f"model about {0.05 * len(intervals):.0f} would."
    )
    return tuple(sentences)


def _of_pair(pair: Pair) -> Iterator[str]:
    yield f"{pair.name}: " + "; ".join(_of_level(level) for level in pair.levels) + "."
    worst = [order for order in pair.orders if not order.by_chance and np.isfinite(order.sigma)]
    extra = [order for order in pair.orders if np.isnan(order.sigma)]
    if worst:
        order = max(worst, key=lambda entry: abs(entry.measured - entry.simulated))
        yield f"{pair.name}: order {order.order:g} differs most, {_amplitudes(order, pair.unit)}."
    if extra:
        order = max(extra, key=lambda entry: entry.simulated)
        yield f"{pair.name}: order {order.order:g} is simulated and lost in the measured scatter."
    outside = [band for band in pair.bands if not band.by_chance]
    if outside:
        loud = [band for band in outside if band.share >= _LOUD]
        words = f"{pair.name}: {len(outside)} of {len(pair.bands)} bands lie outside their limits"
        if not loud:
            yield f"{words}, none of them with {100.0 * _LOUD:g} % of its power."
            return
        band = max(loud, key=lambda entry: abs(entry.decibels))
        yield (
            f"{words}, {len(loud)} of them with {100.0 * _LOUD:g} % of its power or more, most "
            f"{band.low:.4g} to {band.high:.4g} Hz: {band.decibels:+.2g} dB measured over simulated."
        )


def _of_level(level: Level) -> str:
    if not np.isfinite(level.sigma):
        return f"{level.measure}: nothing was measured"
    span = f"sigma {level.sigma:.3g} % (95 %: {level.low:.3g} to {level.high:.3g})"
    if level.by_chance:
        return f"{level.measure} agrees within chance, {span}"
    beyond = f"at least {abs(level.remainder):.2g} % unexplained" if level.remainder else "within its error budget"
    return f"{level.measure} is simulated {_percent(level.sigma)}, {span}, {beyond}"


def _amplitudes(order: Order, unit: str) -> str:
    return (
        f"{order.measured:.4g} measured, {order.simulated:.4g} {unit} simulated, sigma {order.sigma:.3g} % "
        f"(95 %: {order.low:.3g} to {order.high:.3g})"
    )


def _of_impacts(impacts: Impacts) -> str:
    exact = (
        f"{impacts.clearance}: {impacts.exact:.4g} impacts per cycle, exact (standard error {impacts.exact_error:.2g})"
    )
    if not impacts.channel:
        return f"{exact}; {impacts.words}."
    verdict = "within chance" if impacts.low <= 0.0 <= impacts.high else "more than chance"
    return (
        f"{exact}; {impacts.words}: {impacts.measured:.4g} measured, {impacts.simulated:.4g} simulated, "
        f"difference {verdict} "
        f"(95 %: {impacts.low:.3g} to {impacts.high:.3g})."
    )


def _of_clock(clock: Clock) -> Iterator[str]:
    off = clock.measured_period / clock.period - 1.0
    if off:
        yield f"The measured cycle is {100.0 * abs(off):.3g} % {'longer' if off > 0.0 else 'shorter'} than the model's."
    if clock.method in ("none", "given"):
        yield f"Clocks: {clock.delay:.9g} s added to the measured times, as {'stated' if clock.delay else 'they are'}."
        return
    words = (
        f"Clocks: {clock.delay:.9g} s (standard error {clock.standard_error:.2g} s) added to the measured times, by "
    )
    yield f"{words}{clock.channel}, correlation {clock.agreement:.4g}; a whole number of cycles cannot be determined."


def _percent(sigma: float) -> str:
    return f"{abs(sigma):.3g} % {'low' if sigma > 0.0 else 'high'}"


def _largest(levels: Sequence[Level]) -> float:
    return max(abs(level.remainder) for level in levels if np.isfinite(level.remainder))
