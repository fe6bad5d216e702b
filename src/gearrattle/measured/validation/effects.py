"""Records of uncertain parameters in a validation: their effects on levels, and their shifts by the levels."""

from __future__ import annotations

from dataclasses import dataclass

from gearrattle.comparison.comparison_record import Record


@dataclass(frozen=True)
class Effect(Record):
    """Effect of one parameter on one level.

    Attributes
    ----------
    channel
        name of the measured channel.
    measure
        "rms" or "peak-to-peak".
    value
        change of the simulated level by one standard error of the parameter [% of the measured level].
    error
        standard error of ``value``, from the scatter of the runs [%].
    needed
        error of the parameter, in its standard errors, that alone would explain the whole difference; NaN if the
        effect is less than twice its own standard error.
    """

    channel: str
    measure: str
    value: float
    error: float
    needed: float


@dataclass(frozen=True)
class Parameter(Record):
    """One uncertain parameter.

    Attributes
    ----------
    path
        path in the model.
    value, standard_error
        stated value and standard error [SI].
    shift
        most probable error of the parameter, given the levels, in its standard errors [1].
    left
        standard error given the levels, as a share of the stated standard error [1].
    effects
        effects on every level.
    """

    path: str
    value: float
    standard_error: float
    shift: float
    left: float
    effects: tuple[Effect, ...]


@dataclass(frozen=True)
class Explained(Record):
    """The differences that uncertain parameters explain, together and each alone.

    Attributes
    ----------
    parameters
        P uncertain parameters.
    stated
        (P, P) stated correlations of the parameters.
    estimated
        (P, P) correlations of the parameters given the levels.
    channels
        names of the C channels whose rms was used.
    before
        (C,) 100 ln(measured / simulated) of the rms [%].
    after
        (C,) the same after the parameters are shifted [%].
    chi_square
        (2,) sum of squares of ``before`` and of ``after``, in standard errors from all sources but the parameters.
    runs
        number of runs with drawn parameters.
    """

    parameters: tuple[Parameter, ...]
    stated: tuple[tuple[float, ...], ...]
    estimated: tuple[tuple[float, ...], ...]
    channels: tuple[str, ...]
    before: tuple[float, ...]
    after: tuple[float, ...]
    chi_square: tuple[float, float]
    runs: int
