"""The parts of the verdict: every mesh and clearance with its regime and severity in the steady part.

The verdict on the driveline is the worst of its parts. The rule is stated in words (``rule_of``) wherever the verdict
is shown.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, cast

import numpy as np

from gearrattle.quantities.quantity import Row, Scope, State, deflection_rate_unit, impulse_unit, judged_elements
from gearrattle.signals import (
    RANKS,
    Hardness,
    ImpactSummary,
    Regime,
    Severity,
    is_gap,
    limits_words,
    summarise_impacts,
)
from gearrattle.trajectory import Layout, NegligibleImpacts

RULE = (
    "Each mesh and each clearance is judged over the steady part, from the discarded cycles to the end: quiet if it "
    "crosses no corner there, single-sided if it crosses corners on its drive side only or on its coast side only, "
    "double-sided if it crosses corners on both sides. Of a gap, whose centre has no stiffness, the corners of the "
    "centre count: crossing them it separates. A gap that separates rattles, unless its largest impact is negligible: "
    "then it touches, which is no rattle. A staged spring with stiffness in all its stages changes stage and does not "
    "rattle. The whole is the worst of the parts. Parts that rattle come first, then those that touch, then "
    "double-sided before single-sided, then the larger impact energy m_eff v^2 / 2 of the hardest impact."
)
_OF_BEARINGS = (
    " The faces of a bearing with clearance all around are one part: it separates while none of them is in contact, "
    "its impacts are those that end this, and it is double-sided if contact begins or ends at two faces more than a "
    "quarter of a turn apart."
)

REGIME_RANKS: Mapping[Regime, int] = {"quiet": 0, "single-sided": 1, "double-sided": 2}
Headline = Literal["quiet", "touches", "single-sided", "double-sided"]
"""The verdict in one word: the worst regime of the parts that rattle, otherwise the worst severity."""
ASSUMED = (
    "this energy is assumed, for the model says nothing of it: "
    "[criteria] negligible = { impact_energy = ... } changes it"
)


@dataclass(frozen=True)
class Part:
    """One mesh or clearance in the steady part.

    Attributes
    ----------
    name
        of the mesh, coupling or bearing.
    kind
        "mesh", "coupling" or "bearing".
    gap
        whether its centre has no stiffness, so that it can separate; otherwise it is a staged spring.
    regime
        "quiet", "single-sided" or "double-sided", by the sides on which it crosses corners (of a gap, of its centre).
    severity
        "quiet", "touches" (all its impacts are negligible) or "rattles".
    impacts_per_cycle, impacts_per_second
        rate of impacts.
    drive_impacts_per_cycle, coast_impacts_per_cycle
        rate of impacts on the drive side and on the coast side; of a bearing all around, all are on the drive side.
    max_approach_speed
        ``|v|`` of the fastest impact [m/s or rad/s]; None without impacts.
    max_impact_momentum
        ``m_eff |v|`` of the fastest impact [N s or N m s]; None without impacts, or if no body is free.
    mean_impact_energy, max_impact_energy
        m_eff v^2 / 2 [J]; None as above. The largest one ranks parts.
    mean_exchanged_momentum, max_exchanged_momentum
        ``m_eff (|v| + |v'|)`` [N s or N m s]; None as above.
    mean_contact_impulse, max_contact_impulse
        magnitude of the integral of the force over the contact, static load
        included [N s or N m s]; None without impacts or without a force integral, and for a bearing all around.
    contact_share
        share of time in contact, 0 to 1.
    margin_db
        margin of the loose-gear test [dB]; it describes this motion and is not a design target. None without a loose
        gear.
    impulse_unit, energy_unit, speed_unit
        units of momenta and impulses, energies, and approach speeds.
    """

    name: str
    kind: str
    gap: bool
    regime: Regime
    severity: Severity
    impacts_per_cycle: float
    impacts_per_second: float
    drive_impacts_per_cycle: float
    coast_impacts_per_cycle: float
    max_approach_speed: float | None
    max_impact_momentum: float | None
    mean_impact_energy: float | None
    max_impact_energy: float | None
    mean_exchanged_momentum: float | None
    max_exchanged_momentum: float | None
    mean_contact_impulse: float | None
    max_contact_impulse: float | None
    contact_share: float
    margin_db: float | None
    impulse_unit: str
    energy_unit: str
    speed_unit: str

    @property
    def rattles(self) -> bool:
        """Whether the part separates, and at least one of its impacts is not negligible."""
        return self.severity == "rattles"

    @property
    def separates(self) -> bool:
        """Whether the part separates, that is, whether it is a gap that is not quiet; its impacts may be negligible."""
        return self.gap and self.regime != "quiet"


Key = tuple[str, str, str]
"""Name of the criterion, quantity, and subject."""


def measure_parts(rows: Sequence[Row], scope: Scope, impacts: State) -> list[Part]:
    """Return the part of every mesh and clearance, in element order."""
    values = {(item.name, item.quantity, item.subject): item.value for item in rows}
    margins: dict[str, float] = {}
    for item in rows:
        if (item.name, item.quantity) == ("loose_gear", "margin") and isinstance(item.value, float):
            margins[item.subject] = max(item.value, margins.get(item.subject, item.value))
    return [
        _unbroken(scope.layout, element, margins)
        if clearance is None
        else _part(scope, element, (summarise_impacts(impacts, scope.layout, clearance), values), margins)
        for element, clearance in judged_elements(scope.layout)
    ]


def _part(
    scope: Scope, element: int, judged: tuple[ImpactSummary, Mapping[Key, float | str]], margins: Mapping[str, float]
) -> Part:
    impacts, values = judged
    layout = scope.layout
    window = scope.window
    name = layout.element_names[element]
    clearance = layout.clearance.tolist().index(element)
    return Part(
        name=name,
        kind=_kind(layout, element),
        gap=is_gap(layout, clearance),
        regime=cast(Regime, values["regime", "regime", name]),
        severity=cast(Severity, values["severity", "severity", name]),
        impacts_per_cycle=impacts.count / window.cycles,
        impacts_per_second=impacts.count / window.duration,
        drive_impacts_per_cycle=impacts.drive / window.cycles,
        coast_impacts_per_cycle=(impacts.count - impacts.drive) / window.cycles,
        **_hardness(impacts.hardness),
        contact_share=cast(float, values["contact", "contact share", name]),
        margin_db=margins.get(name),
        impulse_unit=impulse_unit(layout, element),
        energy_unit="J",
        speed_unit=deflection_rate_unit(layout, element),
    )


def _unbroken(layout: Layout, element: int, margins: Mapping[str, float]) -> Part:
    """Return the part for a mesh without a corner, which is always in contact."""
    name = layout.element_names[element]
    return Part(
        name=name,
        kind=_kind(layout, element),
        gap=False,
        regime="quiet",
        severity="quiet",
        impacts_per_cycle=0.0,
        impacts_per_second=0.0,
        drive_impacts_per_cycle=0.0,
        coast_impacts_per_cycle=0.0,
        **_hardness(None),
        contact_share=1.0,
        margin_db=margins.get(name),
        impulse_unit=impulse_unit(layout, element),
        energy_unit="J",
        speed_unit=deflection_rate_unit(layout, element),
    )


def _kind(layout: Layout, element: int) -> str:
    if layout.is_bearing[element]:
        return "bearing"
    return "mesh" if layout.is_mesh[element] else "coupling"


def _hardness(hardness: Hardness | None) -> dict[str, float | None]:
    """Return the hardness of impacts by the names of attributes of ``Part``; None for values that do not exist."""
    names = {
        "max_approach_speed": "largest_speed",
        "max_impact_momentum": "largest_momentum",
        "mean_impact_energy": "mean_energy",
        "max_impact_energy": "largest_energy",
        "mean_exchanged_momentum": "mean_exchanged",
        "max_exchanged_momentum": "largest_exchanged",
        "mean_contact_impulse": "mean_impulse",
        "max_contact_impulse": "largest_impulse",
    }
    values = {} if hardness is None else {name: float(value) for name, value in hardness._asdict().items()}
    return {name: None if np.isnan(values.get(field, np.nan)) else values[field] for name, field in names.items()}


def worst_first(parts: list[Part]) -> tuple[Part, ...]:
    """Return parts by decreasing severity, regime, and largest impact energy; ties in the order of elements."""

    def mildness(part: Part) -> tuple[int, int, float]:
        return (-RANKS[part.severity], -REGIME_RANKS[part.regime], -(part.max_impact_energy or 0.0))

    return tuple(sorted(parts, key=mildness))


def regime_of_all(parts: Sequence[Part]) -> Regime:
    """Return the worst regime of the parts that separate."""
    regimes = [part.regime for part in parts if part.separates]
    return max(regimes, key=REGIME_RANKS.__getitem__, default="quiet")


def severity_of_all(parts: Sequence[Part]) -> Severity:
    """Return the worst severity of the parts."""
    return max((part.severity for part in parts), key=RANKS.__getitem__, default="quiet")


def headline_of(parts: Sequence[Part]) -> Headline:
    """Return the worst regime of the parts that rattle; if none rattles, "touches" or "quiet"."""
    rattling = [part for part in parts if part.rattles]
    if not rattling:
        return "touches" if severity_of_all(parts) == "touches" else "quiet"
    return "double-sided" if regime_of_all(rattling) == "double-sided" else "single-sided"


def rule_of(limits: NegligibleImpacts, *, is_si: bool = True, has_bearings: bool = False) -> str:
    """Return the rule of the verdict in words, with its thresholds, and that of bearings with a clearance."""
    words = limits_words(limits, is_si=is_si)
    assumed = f" ({ASSUMED})" if limits.is_assumed else ""
    bearings = _OF_BEARINGS if has_bearings else ""
    return f"{RULE}{bearings} {words[:1].upper()}{words[1:]}{assumed}."
