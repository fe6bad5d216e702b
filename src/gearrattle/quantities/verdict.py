"""The verdict on one motion: its parts, worst first, every value of every criterion, and a sentence.

Takes what the criteria measured; gives a Verdict to reports and users.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, ClassVar

from gearrattle.json_types import Json, json_value
from gearrattle.quantities.parts import Headline, Part, headline_of
from gearrattle.quantities.quantity import Row
from gearrattle.quantities.wording import sentence
from gearrattle.result import Result
from gearrattle.signals import Regime, Severity, Spectrum, Window
from gearrattle.trajectory import NegligibleImpacts


@dataclass(frozen=True)
class Verdict(Result):
    """What the criteria say of one motion.

    Attributes
    ----------
    verdict
        "quiet", "single-sided" or "double-sided", the worst regime of the parts that separate, however softly.
    severity
        "quiet", "touches" or "rattles", the worst of the parts.
    rule
        by which rule.
    parts
        every mesh and clearance, worst first.
    entries
        every value of every criterion.
    notes
        what the user must know about these values.
    window
        the steady part that was judged.
    negligible
        which impacts are touches.
    spectra
        power spectral density of the accelerations, density (f, n inertias); None for too few samples.

    Examples
    --------
    >>> [part.name for part in gr.criteria(gr.simulate(gr.example("case3"), cycles=20, discard=10)).parts]
    ['gear', 'spline', 'clutch']
    """

    verdict: Regime
    severity: Severity
    rule: str
    parts: tuple[Part, ...]
    entries: tuple[Row, ...]
    notes: tuple[str, ...]
    window: Window
    negligible: NegligibleImpacts
    spectra: Spectrum | None = dataclasses.field(repr=False, compare=False, default=None)

    kind: ClassVar[str] = "verdict"

    @property
    def headline(self) -> Headline:
        """The verdict in one word: the worst regime of the parts that rattle; "touches" or "quiet" if none does."""
        return headline_of(self.parts)

    @property
    def sentence(self) -> str:
        """The verdict in words: what rattles, where, how badly."""
        return sentence(self.parts, self.window.cycles)

    def __str__(self) -> str:
        """Return the headline and the sentence."""
        return f"{self.headline}: {self.sentence}"

    def of(self, criterion: str, subject: str | None = None) -> tuple[Row, ...]:
        """Return the entries of one criterion, of one inertia, mesh or coupling if it is named."""
        return tuple(e for e in self.entries if e.name == criterion and subject in (None, e.subject))

    def to_dict(self) -> dict[str, Json]:
        """Return the verdict in JSON types; numbers that do not exist or are not finite become None."""
        names = ("verdict", "severity", "headline", "sentence", "rule", "negligible", "parts", "entries", "notes")
        window = {"start": self.window.start, "end": self.window.end, "cycles": self.window.cycles}
        entries = [row.table_row("criterion") for row in self.entries]
        shown = {name: getattr(self, name) for name in names} | {"entries": entries, "window": window}
        converted: dict[str, Any] = json_value(shown)
        return converted
