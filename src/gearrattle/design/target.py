"""Target of a design: a quiet driveline, or an output of a study below or above a value.

``"quiet"`` holds where no gap rattles. ``"largest impact energy < 1e-4"`` holds where the output of every part is below
the value, ``"m5: largest impact energy < 0.1 mJ"`` where that of one part is; a plain number is in SI.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.table import did_you_mean, shown
from gearrattle.model.units import DIMENSIONS, UnitError, convert
from gearrattle.studies.case_batches import is_of_crossings
from gearrattle.studies.goals import labels_of
from gearrattle.studies.output import ENERGY, EVENT, REGIME, SEVERITY, Output
from gearrattle.studies.outputs import Outputs, outputs_of, short_runs
from gearrattle.wording import listed

QUIET = "quiet"
_COMPARED = re.compile(r"(?P<label>[^<>]+)(?P<sign>[<>])\s*(?P<value>[^<>]+)")
Values = Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class Target:
    """Condition that the motions of a variant shall fulfil.

    Attributes
    ----------
    output, subject
        what is compared; the subject is empty for the worst of all.
    limit
        that it is compared with [SI].
    """

    words: str
    outputs: tuple[Output, ...]
    output: Output
    subject: str
    limit: float
    above: bool

    def output_named(self, name: str) -> Output:
        """Return one of the outputs."""
        return next(output for output in self.outputs if output.name == name)

    @property
    def severity(self) -> Output:
        """The output that gives the severity of every part."""
        return self.output_named(SEVERITY)

    def number(self, values: Values) -> float:
        """Return the number that is compared: of the worst part, if no part is named."""
        numbers = np.atleast_1d(values[self.output.name]).astype(float)
        if self.subject:
            numbers = numbers[list(self.output.subjects).index(self.subject)][None]
        elif self.output.dimension == "part" and self.output.criterion != EVENT:  # springs that change stage: no rattle
            numbers = numbers[np.isin(self.output.subjects, self.severity.gaps)]
        numbers = numbers[np.isfinite(numbers)]
        if not numbers.size:
            return np.inf if self.above else 0.0
        return float(numbers.min() if self.above else numbers.max())

    @property
    def samples(self) -> int | None:
        """Samples a cycle that the outputs need: one where crossings suffice, None for those of the model."""
        return 1 if all(is_of_crossings(output) for output in self.outputs) else None

    def energies(self, values: Values) -> NDArray[np.float64]:
        """Return (parts,) the energy of the hardest impact of every gap; springs that change stage do not rattle."""
        subjects = self.output_named(ENERGY).subjects
        return np.where(np.isin(subjects, self.severity.gaps), np.nan_to_num(values[ENERGY]), 0.0)

    def distance(self, values: Values) -> tuple[float, float]:
        """Return how far a motion is from the target, the larger the worse: the number, then the hardest impact."""
        number = self.number(values)
        return -number if self.above else number, float(self.energies(values).max(initial=0.0))

    def holds(self, values: Values) -> bool:
        """Whether it holds of a motion with these outputs."""
        number = self.number(values)
        return number > self.limit if self.above else number < self.limit


def target_of(model: Model, until: object) -> Target:
    """Read a target; ModelError for what is neither "quiet" nor a comparison of an output with a number."""
    if until == QUIET:
        outputs = _outputs(model, [SEVERITY])
        severity = outputs[0]
        return Target(QUIET, outputs, severity, "", float(severity.words.index("rattles")), above=False)
    match = _COMPARED.fullmatch(until.strip()) if isinstance(until, str) else None
    if match is None:
        remedy = f'"{QUIET}", or such as "{ENERGY} < 0.1 mJ"'
        raise ModelError(Problem("until", shown(until), "must be a target", remedy))
    label = match["label"].strip()
    name = label.rpartition(": ")[2]
    outputs = _outputs(model, [name])
    known = labels_of(Outputs(outputs))
    if label not in known and label != name:
        raise ModelError(Problem("until", shown(label), "there is no such part", did_you_mean(label, tuple(known))))
    output, subject = known.get(label, (outputs[0], ""))
    gaps = next(chosen for chosen in outputs if chosen.name == SEVERITY).gaps
    of_gaps = output.dimension == "part" and output.criterion != EVENT
    compared = [subject] if subject else list(gaps) if of_gaps else []
    limit = _limit(match["value"].strip(), output, compared)
    word = "above" if match["sign"] == ">" else "below"
    return Target(f"{label} {word} {match['value'].strip()}", outputs, output, subject, limit, above=word == "above")


def half_of(target: Target, values: Values) -> Target:
    """Return the target that the hardest impact has at most half the energy that it has in a motion."""
    energy = target.output_named(ENERGY)
    whole = Target("", target.outputs, energy, "", 0.0, above=False).number(values)
    return Target("half as hard", target.outputs, energy, "", 0.5 * whole, above=False)


def _outputs(model: Model, names: list[str]) -> tuple[Output, ...]:
    """Return outputs by name, and those that every answer shows."""
    run = short_runs([model])[0]
    return outputs_of(list(dict.fromkeys([*names, SEVERITY, REGIME, ENERGY])), run).chosen


def _limit(text: str, output: Output, subjects: Collection[str]) -> float:
    """Read a number in the unit of an output of some parts, or with a unit."""
    units = _units(output, subjects)
    if len(units) > 1:
        rule = f"must name one part: that of all is in {listed(units, 'and')}"
        raise ModelError(
            Problem(
                "until",
                output.name,
                rule,
                f'such as "{next(iter(subjects), output.applies_to[0])}: {output.name} < 1e-4"',
            )
        )
    with contextlib.suppress(ValueError):
        return float(text)
    unit = units[0].replace(" ", "*")
    if unit not in DIMENSIONS:
        raise ModelError(Problem("until", shown(text), f"must be a number [{units[0]}]", "such as 1e-4"))
    try:
        return convert(text, DIMENSIONS[unit])
    except UnitError as error:
        raise ModelError(Problem("until", shown(text), error.rule, error.remedy)) from None


def _units(output: Output, subjects: Collection[str]) -> list[str]:
    """Return the units of an output of some parts; of all that it has where none is named."""
    if not output.subjects:
        return [output.unit[0]]
    of_parts = zip(output.applies_to, output.unit, strict=False)
    return sorted({unit for part, unit in of_parts if not subjects or part in subjects})
