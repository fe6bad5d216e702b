"""Output of a study: its name, its subjects with their units, and the entries where there is no value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.signals import SEVERITIES

VERDICT = "verdict"
REGIME = "regime"
VERDICT_SEVERITY = "verdict severity"
SEVERITY = "severity"
ENERGY = "largest impact energy"
HARDEST = "hardest impact"
EVENT = "event"
"""Name in place of a criterion for outputs of an event."""
SOUND = "sound"
"""Name in place of a criterion for outputs of the sound."""
Modes = tuple[tuple[float, float, float], ...]
"""Of a transfer path: frequency [Hz], damping ratio and gain [Pa/(N s)]."""
WORST = {VERDICT: REGIME, VERDICT_SEVERITY: SEVERITY, HARDEST: ENERGY}
"""Outputs of the whole driveline: the worst code, or the largest number, of the parts that can separate."""
REGIMES = ("quiet", "single-sided", "double-sided")
WORDS: Mapping[str, tuple[str, ...]] = {REGIME: REGIMES, SEVERITY: SEVERITIES}
"""Meanings of the codes of a quantity, from the mildest on."""
OVER_ALL = " over all stable motions"
"""Ends the name of an output that is the largest value over all stable motions of a case."""


@dataclass(frozen=True)
class Output:
    """One output.

    A case that failed has the value ``nothing``; so has every case for subjects that the output does not apply to. A
    case that ran has the value ``absent`` where its motion lacks the quantity: of a motion without impacts the largest
    impact energy is 0, and the mean one NaN.

    Attributes
    ----------
    dimension
        "part" (clutches, splines, meshes), "inertia", another kind's own; empty for one number per case.
    unit
        SI unit for every subject to which the output applies.
    words
        meanings of the codes; empty for numbers.
    criterion
        the criterion or metric that has the quantity; empty if there is none.
    only
        the subjects to which the output applies; empty for all. It has no value (``nothing``) for the others.
    gaps
        for codes: the subjects that can separate in some case; only these can rattle.
    absent
        value of a case that ran and whose motion lacks the quantity.
    lacking
        words for that lack ("no impact"); empty for a quantity of every motion.
    error
        error by sampling, in words; empty if it is not known.
    over_all
        whether it is the largest value over all stable motions of a case (``stable_motion_outputs``).
    modes
        of a sound level, those of the path; none: the assumed casing.
    stored_as
        type of numbers in its array.
    """

    name: str
    dimension: str
    subjects: tuple[Any, ...]
    unit: tuple[str, ...]
    words: tuple[str, ...] = ()
    criterion: str = ""
    only: tuple[Any, ...] = ()
    gaps: tuple[str, ...] = ()
    absent: float = float("nan")
    lacking: str = ""
    error: str = ""
    over_all: bool = False
    modes: Modes = ()
    stored_as: str = "float64"

    @property
    def applies_to(self) -> tuple[Any, ...]:
        """The subjects that it has a value for."""
        return self.only or self.subjects

    @property
    def dtype(self) -> str:
        """Type of its array: codes are small integers, -1 where there is none."""
        return "int8" if self.words else self.stored_as

    @property
    def base(self) -> str:
        """The output that it is the largest value of, over all stable motions; its own name where it is not."""
        return self.name.removesuffix(OVER_ALL)

    @property
    def quantity(self) -> str:
        """What its criterion calls it."""
        return WORST.get(self.base, self.base)

    @property
    def nothing(self) -> float:
        """Entry where there is no value."""
        return -1 if self.words else float("nan")

    @property
    def can_rank(self) -> bool:
        """Whether it has a value for every motion, so that the smallest can be looked for."""
        return not self.lacking or not np.isnan(self.absent)

    @property
    def before(self) -> NDArray[Any]:
        """Entries of a case that ran before its values are known, (subjects,), () without subjects."""
        absent = self.nothing if np.isnan(self.absent) else self.absent
        if not self.dimension:
            return np.array(absent, dtype=self.dtype)
        applies = np.isin(self.subjects, self.applies_to)
        return np.where(applies, absent, self.nothing).astype(self.dtype)
