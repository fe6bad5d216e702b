"""The verdict on one motion: its parts from the worst to the best, every value of every criterion, and a sentence."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal, get_args

from gearrattle.errors import ModelError, Problem
from gearrattle.json_types import Json, json_value
from gearrattle.model.table import did_you_mean, listed, shown
from gearrattle.quantities.event import Event, PeakTorque
from gearrattle.quantities.quantity import Row
from gearrattle.quantities.verdict_parts import Headline, Part, headline_of
from gearrattle.quantities.verdict_wording import sentence
from gearrattle.result import Result
from gearrattle.signals import Regime, Severity, Spectrum, Window
from gearrattle.trajectory import NegligibleImpacts

if TYPE_CHECKING:
    import pandas as pd


Kind = Literal["steady", "transient"]
KINDS: tuple[Kind, ...] = get_args(Kind)
TRANSIENT: Kind = "transient"


@dataclass(frozen=True)
class Verdict(Result):
    """What the criteria say of one motion.

    ``verdict`` and ``headline`` can differ. ``verdict`` is the worst regime of all parts that separate, those with
    negligible impacts included (``verdict_parts.regime_of_all``); ``headline`` is the worst regime of the parts that
    rattle (``verdict_parts.headline_of``). Example: the gear separates on both sides, but all its impacts are
    negligible; the clutch separates on the drive side only, and one of its impacts is not negligible. Then ``verdict``
    is "double-sided" and ``headline`` is "single-sided". If the gear alone separates, ``headline`` is "touches". The
    regime of one part comes from ``signals.regions.regime_of``.

    Attributes
    ----------
    verdict
        "quiet", "single-sided" or "double-sided": the worst regime of the parts that separate.
    severity
        "quiet", "touches" or "rattles": the worst severity of the parts.
    rule
        the rule of the verdict in words, with its thresholds.
    parts
        every mesh and clearance, worst first.
    entries
        every value of every criterion.
    notes
        what the user must know about these values.
    window
        the steady part that was judged.
    negligible
        the sizes below which an impact is a touch.
    spectra
        power spectral density of the accelerations, density (f, n inertias); None for too few samples.
    kind
        "steady", or "transient" for a motion that does not repeat.
    event
        what happens in a transient; None for a steady motion.

    Examples
    --------
    >>> verdict = gr.criteria(gr.simulate(gr.example("case3"), cycles=20, discard=10))
    >>> [part.name for part in verdict.parts], verdict["gear"].regime
    (['gear', 'spline', 'clutch'], 'double-sided')
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

    kind: Kind = "steady"  # type: ignore[misc]
    event: Event | None = None

    shown_as: ClassVar[str] = "verdict"

    @property
    def headline(self) -> Headline:
        """The verdict in one word: the worst regime of the parts that rattle; "touches" or "quiet" if none rattles."""
        return headline_of(self.parts)

    @property
    def sentence(self) -> str:
        """The verdict in words: what rattles, where, how badly; for a transient, when the impacts are and how hard."""
        return sentence(self.parts, self.window.cycles) if self.event is None else self.event.sentence

    @property
    def first_impact(self) -> float | None:
        """Time at which the first gap closes in a transient [s]; None if no gap closes, and for a steady motion."""
        return None if self.event is None else self.event.first_impact

    @property
    def peak_torque(self) -> Mapping[str, PeakTorque]:
        """Largest torque [N m] of every element in a transient, and its time [s]; empty for a steady motion."""
        return {} if self.event is None else self.event.peak_torque

    def __str__(self) -> str:
        """Return the headline and the sentence."""
        return f"{self.headline}: {self.sentence}"

    def __getitem__(self, name: str) -> Part:
        """Return a part by the name of its mesh or coupling.

        Raises
        ------
        ModelError
            no part has this name.

        Examples
        --------
        >>> gr.criteria(gr.simulate(gr.example("case3"), cycles=20, discard=10))["spline"].kind
        'coupling'
        """
        parts = {part.name: part for part in self.parts}
        if name not in parts:
            rule = f"no mesh and no clearance has this name; there are {listed(parts)}"
            raise ModelError(Problem("part", shown(name), rule, did_you_mean(name, parts)))
        return parts[name]

    def to_dataframe(self) -> pd.DataFrame:
        """Return the parts as a table: one row per part, worst first, by name; one column per attribute of ``Part``.

        Returns
        -------
        pandas.DataFrame
            A new table [SI]; NaN where a number does not exist.

        Examples
        --------
        >>> table = gr.criteria(gr.simulate(gr.example("case3"), cycles=20, discard=10)).to_dataframe()
        >>> table["regime"].to_dict()
        {'gear': 'double-sided', 'spline': 'single-sided', 'clutch': 'single-sided'}
        """
        import pandas as pd

        rows = [{**dataclasses.asdict(part), "rattles": part.rattles} for part in self.parts]
        numbers = [field.name for field in dataclasses.fields(Part) if "float" in str(field.type)]
        columns = [*(field.name for field in dataclasses.fields(Part)), "rattles"]
        return pd.DataFrame(rows, columns=columns).set_index("name").astype(dict.fromkeys(numbers, float))

    def of(self, criterion: str, subject: str | None = None) -> tuple[Row, ...]:
        """Return the entries of one criterion; with ``subject``, only those of this inertia, mesh or coupling."""
        return tuple(e for e in self.entries if e.name == criterion and subject in (None, e.subject))

    def to_dict(self) -> dict[str, Json]:
        """Return the verdict in JSON types; numbers that do not exist or are not finite become None."""
        names = ("verdict", "severity", "headline", "sentence", "rule", "negligible", "parts", "entries", "notes")
        window = {"start": self.window.start, "end": self.window.end, "cycles": self.window.cycles}
        entries = [row.table_row("criterion") for row in self.entries]
        shown = {name: getattr(self, name) for name in names} | {"entries": entries, "window": window}
        if self.event is not None:
            shown |= {"kind": self.kind, "event": self.event.to_dict()}
        converted: dict[str, Any] = json_value(shown)
        return converted
