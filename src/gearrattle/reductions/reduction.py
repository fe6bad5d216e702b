"""Result of a reduction: the smaller model, the groups of bodies, the reasons, and the error against the full model."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gearrattle.json_types import Json, json_value
from gearrattle.model import Model
from gearrattle.reductions import Accuracy
from gearrattle.result import Result

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ReductionError:
    """Errors of the reduced model against the full one, inside the band.

    ``float()`` of it gives ``frequency``.

    Attributes
    ----------
    frequency
        the largest relative error of a natural frequency over all contact states compared.
    at
        that frequency of the full model [rad/s]; NaN if no elastic mode lies in the band.
    state
        factors on the last slopes of clearances there, by name; empty: all in contact.
    states
        number of contact states compared.
    limit
        what was allowed.
    frequencies
        elastic modes of the full model in the band, all in contact [rad/s].
    reduced_frequencies
        those of the same rank of the reduced one; inf where it has none left.
    mac
        their modal assurance, mass as weight; 1 is the same shape.
    response_db
        largest error of level where a response is above 1 % of its peak [dB]; NaN if nothing is driven.
    response_peak
        largest error of a response over its peak in the band; NaN likewise.
    """

    frequency: float
    at: float
    state: Mapping[str, float]
    states: int
    limit: float
    frequencies: Array
    reduced_frequencies: Array
    mac: Array
    response_db: float
    response_peak: float

    def __float__(self) -> float:
        """Return the largest relative error of a frequency in the band."""
        return self.frequency


def stated(achieved: Accuracy, names: Sequence[str], limit: float) -> ReductionError:
    """Return the errors with the names of the elements, and the limit that was allowed."""
    return ReductionError(
        frequency=achieved.frequency_error,
        at=achieved.worst,
        state={names[k]: factor for k, factor in achieved.worst_state},
        states=achieved.states,
        limit=limit,
        frequencies=achieved.frequencies,
        reduced_frequencies=achieved.reduced_frequencies,
        mac=achieved.mac,
        response_db=achieved.response_error_db,
        response_peak=achieved.response_error_peak,
    )


@dataclass(frozen=True)
class ElementFate:
    """What became of one element, and why.

    Attributes
    ----------
    merged
        whether its two bodies turn as one now.
    reason
        in words.
    share
        largest share of strain energy it holds in a mode that matters; NaN if no such mode.
    at
        frequency of that mode [rad/s].
    """

    merged: bool
    reason: str
    share: float
    at: float


@dataclass(frozen=True)
class Compared:
    """One entry of the verdicts on both motions, as in ``Verdict.entries``, with its value for either model."""

    criterion: str
    subject: str
    quantity: str
    unit: str
    full: float | str
    reduced: float | str

    def differs(self, above: float) -> bool:
        """Return whether texts differ, or numbers by more than a part of the larger."""
        if isinstance(self.full, str) or isinstance(self.reduced, str):
            return self.full != self.reduced
        if math.isnan(self.full) or math.isnan(self.reduced):
            return math.isnan(self.full) != math.isnan(self.reduced)
        return abs(self.full - self.reduced) > above * max(abs(self.full), abs(self.reduced))

    @property
    def change(self) -> str:
        """The change from full to reduced, in dB or per cent; empty for texts and where the full model has zero."""
        if isinstance(self.full, str) or isinstance(self.reduced, str) or not math.isfinite(self.full) or not self.full:
            return ""
        if self.unit == "dB":
            return f"{self.reduced - self.full:+.3g} dB"
        return f"{100 * (self.reduced / self.full - 1):+.3g} %"


@dataclass(frozen=True)
class Simulated:
    """Both models simulated with the settings of the file.

    Attributes
    ----------
    full
        the verdict on the full model in a sentence.
    reduced
        that on the reduced one.
    entries
        every entry that both verdicts have.
    """

    full: str
    reduced: str
    entries: tuple[Compared, ...]

    def differences(self, above: float = 0.01) -> list[Compared]:
        """Return the entries that differ, numbers by more than a relative difference."""
        return [entry for entry in self.entries if entry.differs(above)]


@dataclass(frozen=True)
class Reduction(Result):
    """A reduced model and its record.

    Attributes
    ----------
    model
        the reduced model; it can be saved (``to_toml``) and simulated like any other.
    up_to
        end of the band [rad/s].
    groups
        by body kept: the bodies lumped into it, each with its angle over the kept body's.
    elements
        every element's fate, by name.
    error
        how far from the full model.
    notes
        what the user must know.
    simulated
        both motions judged; None unless asked for.

    Examples
    --------
    >>> [inertia.name for inertia in gr.reduce(gr.example("eight_dof"), "60 Hz").model.inertias][:2]
    ['flywheel', 'hub']
    """

    kind: ClassVar[str] = "reduction"
    model: Model
    up_to: float
    groups: Mapping[str, Mapping[str, float]]
    elements: Mapping[str, ElementFate]
    error: ReductionError
    notes: tuple[str, ...]
    simulated: Simulated | None = None

    def to_dict(self) -> dict[str, Json]:
        """Return the record in JSON types; numbers that are not finite are null."""
        record: dict[str, Any] = json_value(
            {
                "name": self.model.name,
                "up_to": self.up_to,
                "inertias": [body.name for body in self.model.inertias],
                "groups": self.groups,
                "elements": self.elements,
                "error": self.error,
                "notes": self.notes,
                "simulated": self.simulated,
            }
        )
        return record


def frequency_text(omega: float, units: str) -> str:
    """Return an angular frequency in words: in Hz, or as a plain number for a dimensionless model."""
    return f"{omega / math.tau:.6g} Hz" if units == "SI" else f"{omega:.6g}"
