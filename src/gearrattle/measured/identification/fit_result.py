"""Result of a fit: the model, its parameters with errors, every datum's residual, other minima, open combinations."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from gearrattle.json_types import Json, json_value
from gearrattle.measured.identification.data_problem import Residual
from gearrattle.measured.identification.identifiability import Combination
from gearrattle.model import Model
from gearrattle.result import Result

if TYPE_CHECKING:
    from gearrattle.measured.order_over_speed import Track

Array = NDArray[np.float64]

UNLIKELY = 0.01
"""A probability of chi-square below this means that the model does not explain the data."""
FAR = 5.0
"""A residual larger than so many assumed standard errors means the same."""


@dataclass(frozen=True)
class FittedParameter:
    """One free parameter; values in SI.

    Attributes
    ----------
    path
        as ``Model.with_`` takes it.
    start
        value in the model given.
    value
        fitted value.
    standard_error
        of the value, to first order; inf if the data leave it open, NaN on a bound.
    lower, upper
        bounds.
    at_bound
        "lower", "upper" or empty.
    interval
        95 % profile-likelihood interval, ends beyond the bounds infinite (0 below); None unless asked for.
    """

    path: str
    start: float
    value: float
    standard_error: float
    lower: float
    upper: float
    at_bound: str
    interval: tuple[float, float] | None = None

    @property
    def relative_error(self) -> float:
        """Standard error over value: that of the logarithm."""
        return self.standard_error / self.value


@dataclass(frozen=True)
class LocalMinimum:
    """One set of parameters from which every small change fits worse.

    Attributes
    ----------
    chi_square
        sum of squares of the residuals in standard errors.
    values
        by path [SI].
    times
        from how many starts it was reached.
    """

    chi_square: float
    values: Mapping[str, float]
    times: int


@dataclass(frozen=True)
class Fit(Result):
    """A fitted model and what the data say about it.

    Attributes
    ----------
    model
        the model with the fitted values; it can be saved (``to_toml``) and simulated like any other.
    parameters
        the free ones.
    residuals
        every datum.
    chi_square
        sum of squares of the residuals of the data.
    degrees_of_freedom
        data, less one for each shape's scale, less parameters determined and not on a bound.
    covariance
        (P, P) of the logarithms of the parameters; inf on the diagonal of those left open, NaN on a bound.
    minima
        all distinct local minima found, the best first.
    starts
        number of starts.
    undetermined
        combinations of parameters that the data leave open.
    notes
        sentences that the user must know.
    chance
        probability of a chi-square this large or larger, if the model were right; None where standard errors were
        assumed, or no degree of freedom is left.
    tracks
        of a run-up every channel and order over speed, measured and fitted; none of other data.

    Examples
    --------
    >>> model = gr.example("case3")
    >>> second = gr.modes(model).frequencies[1] / (2.0 * np.pi)
    >>> start = model.with_({"coupling.clutch.stiffness": 1.2 * model.couplings[0].stiffness})
    >>> data = {"mode": [{"number": 2, "frequency": f"{second} Hz"}]}
    >>> fit = gr.identification.fit(start, data, ["coupling.clutch.stiffness"], starts=1)
    >>> [parameter.path for parameter in fit.parameters]
    ['coupling.clutch.stiffness']
    """

    kind: ClassVar[str] = "fit"
    model: Model
    parameters: tuple[FittedParameter, ...]
    residuals: tuple[Residual, ...]
    chi_square: float
    degrees_of_freedom: int
    covariance: Array
    minima: tuple[LocalMinimum, ...]
    starts: int
    undetermined: tuple[Combination, ...]
    notes: tuple[str, ...]
    chance: float | None = None
    tracks: tuple[Track, ...] = ()

    @property
    def rms_residual(self) -> float:
        """Root mean square of the residuals in standard errors, per degree of freedom; 0 without any."""
        return math.sqrt(self.chi_square / self.degrees_of_freedom) if self.degrees_of_freedom > 0 else 0.0

    @property
    def explains(self) -> bool:
        """Whether the model can be right: residuals as the standard errors allow, of assumed ones not far larger."""
        if self.chance is None:
            return self.rms_residual < FAR
        return self.chance >= UNLIKELY

    def to_dict(self) -> dict[str, Json]:
        """Return the record in JSON types; numbers that are not finite are null."""
        return {
            "name": self.model.name,
            "parameters": json_value(self.parameters),
            "residuals": json_value(self.residuals),
            "chi_square": self.chi_square,
            "degrees_of_freedom": self.degrees_of_freedom,
            "covariance": json_value(self.covariance),
            "minima": json_value(self.minima),
            "starts": self.starts,
            "undetermined": json_value(self.undetermined),
            "notes": list(self.notes),
            "chance": self.chance,
            "explains": self.explains,
            "tracks": [track.to_dict() for track in self.tracks],
        }
