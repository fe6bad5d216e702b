"""Fig. 4: the stiffness contact ratio Gamma_g over the amplitude, single- and double-sided.

Closed forms: delta = m + A sin phi in the free gap of Table 2 (alpha = 0). Double-sided motion has m = 0; single-sided
motion has a mean load, and m follows from A by mean force = load (``contact_ratios.describing``). The paper uses Gamma
for two quantities, and both are drawn: the mean slope, which is the share of time in contact, and the equivalent gain
(the describing function, and H1 from spectra). For a sine without mean, with h = b/A <= 1,

    mean slope 1 - (2/pi) asin h,    gain 1 - (2/pi) (asin h + h sqrt(1 - h^2)):

for large A they approach one as 1 - 2 h/pi and 1 - 4 h/pi.

Points: exact motions of the mesh alone (``load_sweep``), without an assumption about their shape.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearrattle.analysis.contact_ratios.describing import Describing, under_sine
from gearrattle.engine.system.law import Stage, staged
from gearrattle.model import Model
from gearrattle.report.plots.chart import Chart, Key, Line, Panel
from gearrattle.report.plots.palette import COLOURS
from gearrattle.reproduction.load_sweep import Stop, Tick, mesh_alone, sweep
from gearrattle.reproduction.measurements import Scope
from gearrattle.reproduction.number_formats import figure
from gearrattle.reproduction.reproduction_record import DIFFERS, LOST, REPRODUCED, Row, Section, row
from gearrattle.signals.regions import Regime
from gearrattle.trajectory import Array

LOAD = 0.1
"""Mean load of the single-sided motions, in units of K b."""
SINGLE = ((0.8, 0.02, 1.0), (2.0, 0.2, 8.0))
DOUBLE = ((1.5, 1.0, 60.0), (2.0, 2.0, 60.0))
"""Frequencies over the resonance in contact, with lowest and highest amplitude [K b]. Some of these loads lead to the
other regime; those motions are left out."""
NEAR = 0.05
MOST = 0.9
_SIDE = (Stage(0.0, 0.0, 1.0), Stage(1.0, 0.0, None))
GAP = staged(_SIDE, _SIDE)
"""A free gap of half-width 1 and slope 1."""
_DIGITS = 60


def under_load(amplitude: float, load: float) -> Describing:
    """Contact ratios of the gap under a sine [half-gaps] about the mean that carries a load [K b, not negative], by
    bisection.
    """
    low = 0.0  # the mean force grows with the mean
    high = 1.0 + load + amplitude  # there it is at least the load
    for _ in range(_DIGITS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if under_sine(GAP, amplitude, middle).mean_force < load else (low, middle)
    return under_sine(GAP, amplitude, high)


def widest(load: float) -> float:
    """The amplitude at which a sine under a load first reaches the other side, by bisection."""
    low = load
    high = 2.0 + load
    for _ in range(_DIGITS):
        middle = 0.5 * (low + high)
        reached = under_sine(GAP, middle, middle - 1.0).mean_force > load  # lowest point at -1
        low, high = (low, middle) if reached else (middle, high)
    return high


def section(scope: Scope, tick: Tick) -> Section:
    """Compare closed forms and exact motions."""
    single = _motions(scope, SINGLE, LOAD, "single-sided", tick)
    double = _motions(scope, DOUBLE, 0.0, "double-sided", tick)
    words = (
        f"Curves: a sine in a free gap, single-sided under a mean load of {LOAD:g} K b. Points: exact motions of the "
        f"mesh of Table 1 alone, {len(single)} single-sided ({_frequencies(SINGLE)} of its resonance in contact) and "
        f"{len(double)} double-sided without mean ({_frequencies(DOUBLE)}). Mean slope and equivalent gain are two "
        "quantities; the paper has one name for both."
    )
    rows = (
        _falls(single),
        _saturates(double),
        *_known_amplitude("single-sided", single, LOAD),
        *_known_amplitude("double-sided", double, 0.0),
        _two_quantities(single, double),
        _uncoupled(),
        _values(),
    )
    return Section("figure-4", "Figure 4: contact ratio over amplitude", words, rows, charts=(_chart(single, double),))


def _frequencies(plan: Sequence[tuple[float, float, float]]) -> str:
    return " and ".join(f"{frequency:g}" for frequency, _, _ in plan)


def runs(scope: Scope) -> int:
    """How many runs the figure takes."""
    return 2 * _loads(scope) * len(SINGLE + DOUBLE)


def _loads(scope: Scope) -> int:
    return 8 if scope.quick else 24


def _motions(
    scope: Scope, plan: Sequence[tuple[float, float, float]], mean: float, kind: Regime, tick: Tick
) -> tuple[Stop, ...]:
    """Motions of one regime, both ways."""
    stops: list[Stop] = []
    for frequency, low, high in plan:
        loads = np.geomspace(low, high, _loads(scope)).tolist()

        def model_of(amplitude: float, frequency: float = frequency) -> Model:
            return mesh_alone(frequency, mean, amplitude)

        stops += sweep(model_of, loads, 60 if scope.quick else 150, tick)
    return tuple(stop for stop in stops if stop.regime == kind)


def _rank(stops: Sequence[Stop], values: Sequence[float]) -> float:
    """Spearman's rank correlation of values with the amplitude."""
    from scipy.stats import spearmanr

    return float(spearmanr([stop.amplitude for stop in stops], values).statistic)


def _ranks(stops: Sequence[Stop]) -> tuple[float, float]:
    return _rank(stops, [stop.mean_slope for stop in stops]), _rank(stops, [stop.gain for stop in stops])


def curve(amplitudes: Array, load: float) -> tuple[Array, Array]:
    """(N,) mean slope and gain of the closed forms at amplitudes [half-gaps], under a mean load [K b]."""
    results = [under_load(amplitude, load) if load else under_sine(GAP, amplitude) for amplitude in amplitudes.tolist()]
    return np.array([result.mean_slope for result in results]), np.array([result.gain for result in results])


def _falls(single: Sequence[Stop]) -> Row:
    slope, gain = curve(np.linspace(LOAD, widest(LOAD), 60), LOAD)
    forms = bool(np.all(np.diff(slope) < 0.0) and np.all(np.diff(gain) < 0.0))
    ranks = _ranks(single)
    good = forms and max(ranks) < -0.5
    summary = (
        f"closed forms fall from 1 to {slope[-1]:.2f} (mean slope) and {gain[-1]:.2f} (gain) where a sine reaches the "
        f"other side, A = {widest(LOAD):.2f} half-gaps; exact motions: rank correlation with A {ranks[0]:.2f} and "
        f"{ranks[1]:.2f}"
    )
    return row(
        "Fig. 4(a), Gamma_g falls with single-sided amplitude",
        "more time in the backlash",
        summary,
        REPRODUCED if good else DIFFERS,
        "" if good else "the motions are not ordered by their amplitude",
        slope=slope[-1],
        gain=gain[-1],
        rank_slope=ranks[0],
        rank_gain=ranks[1],
    )


def _saturates(double: Sequence[Stop]) -> Row:
    largest = max(double, key=lambda stop: stop.amplitude)
    ranks = _ranks(double)
    h = 1.0 / largest.amplitude
    good = min(ranks) > 0.5 and min(largest.mean_slope, largest.gain) > 0.9
    summary = (
        f"exact at A = {largest.amplitude:.1f} half-gaps: mean slope {largest.mean_slope:.3f}, gain {largest.gain:.3f} "
        f"(1 - 2h/pi and 1 - 4h/pi: {1 - 2 * h / np.pi:.3f}, {1 - 4 * h / np.pi:.3f}); rank correlation with A "
        f"{ranks[0]:.2f} and {ranks[1]:.2f}"
    )
    return row(
        "Fig. 4(b), Gamma_g goes to one with double-sided amplitude",
        "a saturation effect",
        summary,
        REPRODUCED if good else DIFFERS,
        "" if good else "the amplitudes reached are too small",
        amplitude=largest.amplitude,
        slope=largest.mean_slope,
        gain=largest.gain,
    )


def distances(stops: Sequence[Stop], load: float) -> tuple[Array, Array]:
    """How far mean slopes and gains of exact motions lie from the closed forms at the same amplitude."""
    slope, gain = curve(np.array([stop.amplitude for stop in stops]), load)
    return (
        np.abs(slope - [stop.mean_slope for stop in stops]),
        np.abs(gain - [stop.gain for stop in stops]),
    )


def _known_amplitude(kind: Regime, stops: Sequence[Stop], load: float) -> tuple[Row, ...]:
    rows = []
    for name, off in zip(("equivalent gain", "mean slope"), distances(stops, load)[::-1], strict=True):
        share = float(np.mean(off <= NEAR))
        summary = (
            f"{100 * share:.0f} % of {len(stops)} exact motions within {NEAR:g} of the closed form for a sine, half of "
            f"them within {figure(float(np.median(off)), 2)}, all within {figure(off.max(), 2)}"
        )
        good = share >= MOST
        why = "where impacts ring, and in sub-harmonics and chaos, the motion is not a sine about the mean of one"
        rows.append(
            row(
                f"Sec. 6, the amplitude tells Gamma without simulation, {kind}, {name}",
                "by the describing function",
                summary,
                REPRODUCED if good else DIFFERS,
                "" if good else why,
                share=share,
                median=np.median(off),
                most=off.max(),
            )
        )
    return tuple(rows)


def _two_quantities(single: Sequence[Stop], double: Sequence[Stop]) -> Row:
    twice = under_sine(GAP, 2.0)
    apart = max(abs(stop.mean_slope - stop.gain) for stop in (*single, *double))
    summary = (
        f"a sine of A = 2 half-gaps: mean slope {twice.mean_slope:.3f}, gain {twice.gain:.3f}; exact motions: up to "
        f"{apart:.2f} apart"
    )
    return row(
        "Sec. 6, three routes to one Gamma",
        "spectra, time average of df/d(delta), describing function",
        summary,
        DIFFERS,
        "the time average is the mean slope, the other two are the equivalent gain; they agree for "
        "Gaussian motions only",
        slope=twice.mean_slope,
        gain=twice.gain,
        apart=apart,
    )


def _uncoupled() -> Row:
    return row(
        "Sec. 6, Gamma_g is the share of time uncoupled",
        "the fraction of the time the pair is uncoupled",
        "the share in contact",
        DIFFERS,
        "route 2, Fig. 4 and sec. 7 all make it the mean of df/d(delta), which is one in contact",
    )


def _values() -> Row:
    return row(
        "Fig. 4, its values",
        "two curves",
        "two quantities for each regime, drawn below",
        LOST,
        "neither the curves nor the mean load behind the single-sided one survive in the text",
    )


def _chart(single: Sequence[Stop], double: Sequence[Stop]) -> Chart:
    # loads and amplitudes of both kinds of impact
    panels = []
    reach = max(10.0, 1.1 * max(stop.amplitude for stop in double))
    plans = (
        ("Single-sided", single, LOAD, np.linspace(LOAD, widest(LOAD), 80), (0.0, 1.6)),
        ("Double-sided", double, 0.0, np.geomspace(1.0, reach, 80), (1.0, reach)),
    )
    # closed forms as lines, exact motions as points
    for title, stops, load, amplitudes, x_range in plans:
        lines = []
        at = np.array([stop.amplitude for stop in stops])
        measured = [stop.mean_slope for stop in stops], [stop.gain for stop in stops]
        for name, colour, form, values in zip(
            ("mean slope", "equivalent gain"), COLOURS, curve(amplitudes, load), measured, strict=False
        ):
            lines += [Line(amplitudes, form, name, colour), Line(at, np.array(values), name, colour, "points", 4.0)]
        panels.append(
            Panel(
                title,
                "Gamma_g",
                "amplitude / half-gap",
                tuple(lines),
                x_range=x_range,
                x_log=not load,
                y_range=(0.0, 1.05),
            )
        )
    # caption and legend
    caption = (
        f"Lines: closed forms for a sine, single-sided under a mean load of {LOAD:g} K b until it reaches the other "
        "side. Points: exact motions of the mesh alone."
    )
    legend = tuple(Key(line.name, line.colour) for line in panels[0].lines[::2])
    return Chart("fig-4", "Figure 4", caption, tuple(panels), columns=2, panel_height=240, share_x=False, legend=legend)
