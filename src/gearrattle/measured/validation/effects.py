"""Records of uncertain parameters in a validation: their effects on levels, and their shifts by the levels."""

from __future__ import annotations

from dataclasses import dataclass

from gearrattle.comparison.comparison_record import Record


@dataclass(frozen=True)
class Effect(Record):
    """What one parameter does to one level.

    Attributes
    ----------
    channel
        measured one.
    measure
        "rms" or "peak-to-peak".
    value
        change of the simulated level by one standard error of the parameter [% of the measured level].
    error
        standard error of that, from the scatter of the runs [%].
    needed
        by how many of its standard errors the parameter alone would have to be off to explain the whole
        difference; NaN where the effect is not seen, less than two of its errors.
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
        in the model.
    value, standard_error
        as stated [SI].
    shift
        by how many standard errors the levels pull it, all parameters together [1].
    left
        standard error after the levels, as a share of the stated one [1].
    effects
        on every level.
    """

    path: str
    value: float
    standard_error: float
    shift: float
    left: float
    effects: tuple[Effect, ...]


@dataclass(frozen=True)
class Explained(Record):
    """What the parameters could explain, together and each alone.

    Attributes
    ----------
    parameters
        each one.
    stated
        (P, P) their correlations as stated.
    estimated
        (P, P) their correlations after the levels have been looked at.
    channels
        whose rms was used.
    before
        (C,) 100 ln(measured / simulated) of these [%].
    after
        (C,) what is left of it at the shifts [%].
    chi_square
        (2,) squares of both in standard errors of all but the parameters, added up.
    runs
        behind the effects.
    """

    parameters: tuple[Parameter, ...]
    stated: tuple[tuple[float, ...], ...]
    estimated: tuple[tuple[float, ...], ...]
    channels: tuple[str, ...]
    before: tuple[float, ...]
    after: tuple[float, ...]
    chi_square: tuple[float, float]
    runs: int
