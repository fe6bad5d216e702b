"""Records of a validation: levels, orders and bands of every channel, the clock, impact rates, error budgets.

Every sigma has the sign of the paper's Table 5, (measured - simulated) / measured: positive where the simulation reads
low. Intervals are 95 % ones.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, ClassVar

from gearrattle.comparison.comparison_record import Record
from gearrattle.json_types import Json, json_value
from gearrattle.measured.paper_sigma import NEGLIGIBLE
from gearrattle.measured.validation.effects import Explained
from gearrattle.result import Result
from gearrattle.trajectory import Array

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Contribution(Record):
    """One line of an error budget.

    Attributes
    ----------
    source
        what may be wrong.
    value
        its standard uncertainty [% of the measured level]; NaN where it is not known.
    how
        how the value was obtained.
    """

    source: str
    value: float
    how: str


@dataclass(frozen=True)
class Level(Record):
    """One level of a channel, measured and simulated.

    Attributes
    ----------
    measure
        "rms" or "peak-to-peak" (mean over the cycles of the largest less the smallest sample in each).
    measured, simulated
        in the channel's unit.
    sigma
        (measured - simulated) / measured [%].
    low, high
        interval of sigma from the scatter of the cycles on both sides [%].
    standard_error
        of sigma, from the same scatter [%].
    budget
        contributions to the uncertainty of sigma.
    expanded
        root of their sum of squares, times the factor of a 95 % interval [%].
    remainder
        what of sigma exceeds ``expanded``, with its sign; the model is wrong by at least that [%].
    """

    measure: str
    measured: float
    simulated: float
    sigma: float
    low: float
    high: float
    standard_error: float
    budget: tuple[Contribution, ...] = ()
    expanded: float = float("nan")
    remainder: float = float("nan")

    @property
    def by_chance(self) -> bool:
        """Whether the scatter of the cycles, or nothing worth naming, explains the difference."""
        return self.low <= 0.0 <= self.high or abs(self.sigma) < NEGLIGIBLE


@dataclass(frozen=True)
class Order(Record):
    """One line of a channel's mean cycle.

    Attributes
    ----------
    order
        multiple of the reference speed [1].
    frequency
        by the model [Hz].
    measured, simulated
        amplitudes in the channel's unit.
    measured_error, simulated_error
        their standard errors.
    sigma, low, high
        relative error of the amplitude and its interval [%]; NaN where nothing was measured.
    phase
        measured less simulated, on one clock [deg]; NaN where either amplitude is lost in its scatter.
    phase_error
        its standard error, that of the clock included [deg].
    phase_low, phase_high
        its interval [deg].
    """

    order: float
    frequency: float
    measured: float
    measured_error: float
    simulated: float
    simulated_error: float
    sigma: float
    low: float
    high: float
    phase: float
    phase_error: float
    phase_low: float
    phase_high: float

    @property
    def by_chance(self) -> bool:
        """Whether scatter, or nothing worth naming, explains the difference of the amplitudes."""
        return self.low <= 0.0 <= self.high or abs(self.sigma) < NEGLIGIBLE


@dataclass(frozen=True)
class Band(Record):
    """Power in one band of frequencies.

    Attributes
    ----------
    low, high
        its ends [Hz].
    decibels
        10 lg of measured over simulated power.
    least, most
        95 % limits of that by the F distribution [dB].
    averages_measured, averages_simulated
        equivalent numbers of independent averages behind each.
    share
        of the channel's power that lies in the band, measured or simulated, whichever is more.
    """

    low: float
    high: float
    decibels: float
    least: float
    most: float
    averages_measured: float
    averages_simulated: float
    share: float

    @property
    def by_chance(self) -> bool:
        """Whether the limits hold 0 dB, or the difference is not worth naming (0.01 dB)."""
        return self.least <= 0.0 <= self.most or abs(self.decibels) < 0.01


@dataclass(frozen=True)
class Curves:
    """Curves of a channel for figures.

    Attributes
    ----------
    measured, simulated
        (S,) mean cycles on one clock, from the model's time zero on, in the channel's unit.
    measured_scatter, simulated_scatter
        (S,) standard deviations of the cycles about them.
    frequency
        (f,) [Hz].
    measured_density, simulated_density
        (f,) one-sided power spectral densities [unit^2/Hz].
    """

    measured: Array
    simulated: Array
    measured_scatter: Array
    simulated_scatter: Array
    frequency: Array
    measured_density: Array
    simulated_density: Array


@dataclass(frozen=True)
class Pair(Record):
    """One channel, measured and simulated.

    Attributes
    ----------
    name
        of the measured channel.
    partner
        of the simulated one.
    quantity, subject, unit
        what both are; SI.
    levels
        rms, peak-to-peak.
    orders
        ascending.
    bands
        ascending.
    agreement
        correlation of the two mean cycles on one clock [1].
    curves
        for figures.
    """

    name: str
    partner: str
    quantity: str
    subject: str
    unit: str
    levels: tuple[Level, ...]
    orders: tuple[Order, ...]
    bands: tuple[Band, ...]
    agreement: float
    curves: Curves = field(repr=False)

    def level(self, measure: str) -> Level:
        """Return "rms" or "peak-to-peak"."""
        return next(level for level in self.levels if level.measure == measure)

    def to_dict(self) -> dict[str, Json]:
        """Return the fields in JSON types, without the curves."""
        return {field.name: json_value(getattr(self, field.name)) for field in fields(self) if field.name != "curves"}


@dataclass(frozen=True)
class Impacts(Record):
    """Impacts of one clearance.

    Attributes
    ----------
    clearance
        its name.
    exact, exact_error
        rate from the crossings of the run, and its standard error [1/cycle].
    channel
        the measured channel that was counted; empty if none could be.
    threshold
        at which it was counted, in SI; NaN without.
    measured, simulated
        rates of passings of the threshold, counted alike in both channels [1/cycle].
    low, high
        interval of measured less simulated [1/cycle].
    words
        what was done, or why not.
    """

    clearance: str
    exact: float
    exact_error: float
    channel: str
    threshold: float
    measured: float
    simulated: float
    low: float
    high: float
    words: str


@dataclass(frozen=True)
class Clock(Record):
    """How the two clocks were made one.

    Attributes
    ----------
    method
        "cycle", "phase", "given" or "none".
    channel
        by which; empty where it was given.
    delay
        added to the measured times, within half a period either way [s].
    standard_error
        of the delay [s].
    agreement
        correlation at that delay.
    rival
        largest correlation at a delay apart from it.
    period
        of the model [s].
    measured_period
        of the record by its own clock [s].
    """

    method: str
    channel: str
    delay: float
    standard_error: float
    agreement: float
    rival: float
    period: float
    measured_period: float


@dataclass(frozen=True)
class Validation(Result, Record):
    """A simulated motion against a measured one.

    Attributes
    ----------
    model
        its name.
    source
        of the measurement.
    algorithm
        of the simulation.
    measured_cycles, simulated_cycles
        how many were compared.
    measured_block, simulated_block
        cycles in a block of the bootstrap.
    rate
        samples a second of both after resampling [Hz].
    band
        lowest and highest frequency compared [Hz].
    trend
        what was taken away from both: "none", "mean" or "linear".
    clock
        how the clocks were made one.
    pairs
        a channel each.
    impacts
        a clearance each.
    unmatched_measured, unmatched_simulated
        channels without a partner.
    verdict
        in one sentence.
    findings
        in words, a sentence each.
    notes
        what the user must know.
    parameters
        what the uncertain ones could explain; None without any, or of too few runs.

    Examples
    --------
    >>> run = gr.simulate(gr.example("case3"), cycles=40, discard=20)
    >>> speed = run.data["velocity"].sel(inertia="output_gear")
    >>> speed = speed[speed.time >= 20.0 * run.data.attrs["period"]]
    >>> channel = gr.measured.Channel("n", "velocity", "output_gear", "rad/s", 1.02 * speed.values)
    >>> rig = gr.measured.Recording(speed.time.values, (channel,), "rig")
    >>> len(gr.validate(run, rig).pairs)
    1
    """

    kind: ClassVar[str] = "validation"
    model: str
    source: str
    algorithm: str
    measured_cycles: int
    simulated_cycles: int
    measured_block: int
    simulated_block: int
    rate: float
    band: tuple[float, float]
    trend: str
    clock: Clock
    pairs: tuple[Pair, ...]
    impacts: tuple[Impacts, ...]
    unmatched_measured: tuple[str, ...]
    unmatched_simulated: tuple[str, ...]
    verdict: str
    findings: tuple[str, ...]
    notes: tuple[str, ...]
    parameters: Explained | None = None

    def __getitem__(self, name: str) -> Pair:
        """Return the channel of a measured or a simulated name."""
        return next(pair for pair in self.pairs if name in (pair.name, pair.partner))

    def to_dict(self) -> dict[str, Json]:
        """Return everything but the curves in JSON types."""
        content = {field.name: json_value(getattr(self, field.name)) for field in fields(self) if field.name != "pairs"}
        return {**content, "pairs": [pair.to_dict() for pair in self.pairs]}

    def to_dataframe(self) -> pd.DataFrame:
        """Return the paper's Table 5: one row per channel and level, sigma with its interval [%]."""
        import pandas as pd

        columns = ("measure", "measured", "simulated", "sigma", "low", "high", "expanded", "remainder")
        rows = [
            {"channel": pair.name, "unit": pair.unit, **{name: getattr(level, name) for name in columns}}
            for pair in self.pairs
            for level in pair.levels
        ]
        return pd.DataFrame(rows)
