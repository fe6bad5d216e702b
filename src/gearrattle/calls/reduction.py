"""What a reduction did: the smaller model, what was lumped into what, why, and how far it is from the full one.

Takes findings of ``reduce``; gives words and JSON types.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.json_types import json_value
from gearrattle.model import Model
from gearrattle.reductions import Accuracy
from gearrattle.wording import counted

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ReductionError:
    """Errors of the reduced model against the full one, inside the band.

    ``float()`` of it is ``frequency``.

    Attributes:
        frequency: the largest relative error of a natural frequency over all contact states compared.
        at: that frequency of the full model [rad/s]; NaN if no elastic mode lies in the band.
        state: factors on the last slopes of clearances there, by name; empty: all in contact.
        states: number of contact states compared.
        limit: what was allowed.
        frequencies: elastic modes of the full model in the band, all in contact [rad/s].
        reduced_frequencies: those of the same rank of the reduced one; inf where it has none left.
        mac: their modal assurance, mass as weight; 1 is the same shape.
        response_db: largest error of level where a response is above 1 % of its peak [dB]; NaN if nothing is driven.
        response_peak: largest error of a response over its peak in the band; NaN likewise.
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

    def lines(self, units: str) -> list[str]:
        """Return the errors in words, for a model of these units, "SI" or "dimensionless"."""
        if math.isnan(self.at):
            lines = ["no elastic mode lies in the band"]
        else:
            state = ", ".join(f"{name} at {factor:g} of its last slope" for name, factor in self.state.items())
            lines = [
                f"frequencies in the band: at most {100 * self.frequency:.2g} % off over {self.states} contact states "
                f"(allowed {100 * self.limit:g} %), at {frequency_text(self.at, units)}, {state or 'all in contact'}"
            ]
        for full, reduced, mac in zip(self.frequencies, self.reduced_frequencies, self.mac, strict=True):
            pair = f"{frequency_text(full, units)} becomes {frequency_text(reduced, units)}"
            lines.append(f"  {pair}, MAC {mac:.6f}")
        if not math.isnan(self.response_db):
            lines.append(
                f"responses in the band, all in contact: at most {self.response_db:.2g} dB and "
                f"{100 * self.response_peak:.2g} % of their peak off"
            )
        return lines

    def to_dict(self) -> dict[str, Any]:
        """Return the errors in JSON types; numbers that are not finite are null."""
        return {key: json_value(value) for key, value in vars(self).items()}


def stated(found: Accuracy, names: Sequence[str], limit: float) -> ReductionError:
    """Put names to errors.

    Args:
        found: as the mathematics has them.
        names: of the elements.
        limit: what was allowed.
    """
    return ReductionError(
        frequency=found.frequency_error,
        at=found.worst,
        state={names[k]: factor for k, factor in found.worst_state},
        states=found.states,
        limit=limit,
        frequencies=found.frequencies,
        reduced_frequencies=found.reduced_frequencies,
        mac=found.mac,
        response_db=found.response_error_db,
        response_peak=found.response_error_peak,
    )


@dataclass(frozen=True)
class ElementFate:
    """What became of one element, and why.

    Attributes:
        merged: whether its two bodies turn as one now.
        reason: in words.
        share: largest share of strain energy it holds in a mode that matters; NaN if no such mode.
        at: frequency of that mode [rad/s].
    """

    merged: bool
    reason: str
    share: float
    at: float


@dataclass(frozen=True)
class Compared:
    """One entry of the verdicts on both motions.

    Attributes:
        criterion: as in ``Verdict.entries``, like the next three.
        subject: the inertia, coupling or mesh.
        quantity: in words.
        unit: SI unit.
        full: value for the full model.
        reduced: value for the reduced one.
    """

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

    Attributes:
        full: the verdict on the full model in a sentence.
        reduced: that on the reduced one.
        entries: every entry that both verdicts have.
    """

    full: str
    reduced: str
    entries: tuple[Compared, ...]

    def differences(self, above: float = 0.01) -> list[str]:
        """Return lines: a head, and a row for each entry that differs; entries of the spectra are only counted.

        Args:
            above: relative difference of numbers from which an entry counts as different.
        """
        different = [entry for entry in self.entries if entry.differs(above)]
        listed = [entry for entry in different if entry.criterion != "spectrum"]
        head = f"{len(different)} of {len(self.entries)} quantities differ, numbers by more than {100 * above:g} %"
        if len(listed) < len(different):
            head += f" ({len(different) - len(listed)} of them in the spectra: --json lists them)"
        if not listed:
            return [head]
        rows = [
            (entry.subject, entry.quantity, _shown(entry.full), _shown(entry.reduced), entry.unit, entry.change)
            for entry in listed
        ]
        table = [("", "quantity", "full", "reduced", "unit", "change"), *rows]
        widths = [max(map(len, column)) for column in zip(*table, strict=True)]
        left_aligned = (0, 1, 4)
        lines = [
            "  ".join(
                cell.ljust(width) if k in left_aligned else cell.rjust(width)
                for k, (cell, width) in enumerate(zip(row, widths, strict=True))
            ).rstrip()
            for row in table
        ]
        return [f"{head}:", *(f"  {line}" for line in lines)]


@dataclass(frozen=True)
class Reduction:
    """A reduced model and its record.

    Attributes:
        model: the reduced model; it can be saved (``to_toml``) and simulated like any other.
        up_to: end of the band [rad/s].
        groups: by body kept: the bodies lumped into it, each with its angle over the kept body's.
        elements: every element's fate, by name.
        error: how far from the full model.
        notes: what the user must know.
        simulated: both motions judged; None unless asked for.
    """

    model: Model
    up_to: float
    groups: Mapping[str, Mapping[str, float]]
    elements: Mapping[str, ElementFate]
    error: ReductionError
    notes: tuple[str, ...]
    simulated: Simulated | None = None

    @property
    def report(self) -> str:
        """The whole in words."""
        lines = [*self._groups(), *self._elements(), *self.error.lines(self.model.units)]
        if self.simulated is not None:
            lines += [f"full model simulated: {self.simulated.full}", f"reduced: {self.simulated.reduced}"]
            lines += self.simulated.differences()
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes)])

    def to_dict(self) -> dict[str, Any]:
        """Return the record in JSON types; numbers that are not finite are null."""
        return {
            "name": self.model.name,
            "up_to": self.up_to,
            "inertias": [body.name for body in self.model.inertias],
            "groups": {kept: dict(members) for kept, members in self.groups.items()},
            "elements": {n: {k: json_value(v) for k, v in vars(fate).items()} for n, fate in self.elements.items()},
            "error": self.error.to_dict(),
            "notes": list(self.notes),
            "simulated": None if self.simulated is None else _simulated(self.simulated),
        }

    def _groups(self) -> list[str]:
        merged = sum(len(members) for members in self.groups.values())
        left = len(self.model.inertias)
        lines = [
            f"{counted(left + merged, 'body', 'bodies')} become {left}, for up to "
            f"{frequency_text(self.up_to, self.model.units)}"
        ]
        for kept, members in self.groups.items():
            words = ", ".join(f"{body} (x {ratio:.6g})" if ratio != 1.0 else body for body, ratio in members.items())
            lines.append(f"  {kept} takes {words}")
        return lines

    def _elements(self) -> list[str]:
        lines = []
        for name, fate in self.elements.items():
            share = ""
            if not math.isnan(fate.share):
                at = frequency_text(fate.at, self.model.units)
                share = f"; at most {100 * fate.share:.3g} % of the strain energy, at {at}"
            lines.append(f"  {name}: {'merged' if fate.merged else 'stays'}, {fate.reason}{share}")
        return lines


def frequency_text(omega: float, units: str) -> str:
    """Return an angular frequency in words: in Hz, or as a plain number for a dimensionless model."""
    return f"{omega / math.tau:.6g} Hz" if units == "SI" else f"{omega:.6g}"


def _shown(value: float | str) -> str:
    """Return a value for the terminal."""
    return value if isinstance(value, str) else f"{value:.4g}"


def _simulated(simulated: Simulated) -> dict[str, Any]:
    entries = [{k: json_value(v) for k, v in vars(entry).items()} for entry in simulated.entries]
    return {"full": simulated.full, "reduced": simulated.reduced, "entries": entries}
