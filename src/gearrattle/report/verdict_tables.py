"""The verdict as tiles and tables: the worst part, a row for every part, and all criteria."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from itertools import groupby

from markupsafe import Markup

from gearrattle.pipeline import Findings
from gearrattle.quantities.quantity import Row
from gearrattle.quantities.quantity_table import CRITERIA
from gearrattle.quantities.verdict import Verdict
from gearrattle.quantities.verdict_parts import Part
from gearrattle.report.event_tables import event_parts, event_tiles
from gearrattle.report.plots.numerals import engineering, numeral, quantity
from gearrattle.report.tables import Table, Tile
from gearrattle.signals import RANKS, centre, parts_of, region_shares, steady

_MOST_COLUMNS = 9
_SLIGHT = 1e-3  # of a value: smaller errors of sampling are not shown


def tiles(findings: Findings) -> list[Tile]:
    """Return the numbers an engineer asks for first, about the worst part; of a transient about the event."""
    if findings.verdict.event is not None:
        return event_tiles(findings.verdict.event)
    # impact rate of the worst part
    parts = findings.verdict.parts
    made: list[Tile] = []
    if parts:
        worst = parts[0]
        rate = f"{numeral(worst.impacts_per_cycle, 3)} per cycle"
        per_second = numeral(worst.impacts_per_second, 3)
        si = findings.model.units == "SI"
        made.append(
            Tile("Impacts", f"{per_second} /s", f"{worst.name} · {rate}")
            if si
            else Tile("Impacts", numeral(worst.impacts_per_cycle, 3), f"{worst.name} · per cycle")
        )
        # the hardest impact of all parts
        hardest = max(parts, key=lambda part: (RANKS[part.severity], part.max_impact_energy or 0.0))
        if hardest.max_impact_energy is not None and hardest.max_approach_speed is not None:
            energy = engineering(hardest.max_impact_energy, hardest.energy_unit)
            speed = engineering(hardest.max_approach_speed, hardest.speed_unit)
            made.append(Tile("Hardest impact", energy, f"{hardest.name} · energy m v²/2"))
            made.append(Tile("Approach speed", speed, f"{hardest.name} · of the hardest impact"))
        made.append(Tile("In contact", percent(worst.contact_share), f"{worst.name} · share of time"))
    return made


def percent(share: float) -> str:
    """Write a share of one as per cent."""
    return f"{numeral(100.0 * share, 3)} %"


def parts_table(findings: Findings) -> Table:
    """Return one row for every mesh and clearance, worst first: its hardest impact, and where it spends its time."""
    if findings.verdict.event is not None:
        return event_parts(findings.verdict)
    head = ["part", "severity", "regime", "impacts per cycle", "per second"]
    head += ["approach speed", "impact energy", "exchanged momentum"]
    if findings.model.units != "SI":
        head[4] = "per unit time"
    head.append("coast · centre · drive")
    rows = tuple(
        (
            part.name,
            Markup(f'<span class="pill {_pill(part)}">{part.severity}</span>{_changes(part)}'),
            part.regime,
            numeral(part.impacts_per_cycle, 3),
            numeral(part.impacts_per_second, 3),
            engineering(part.max_approach_speed, part.speed_unit),
            engineering(part.max_impact_energy, part.energy_unit),
            engineering(part.max_exchanged_momentum, part.impulse_unit),
            _share_bar(findings, part),
        )
        for part in findings.verdict.parts
    )
    return Table(tuple(head), rows, words=frozenset({0, 1, 2, 8}))


def _pill(part: Part) -> str:
    """Return the class of a part's colour: that of its regime if it rattles, else of its severity."""
    return part.regime if part.rattles else part.severity


def _changes(part: Part) -> str:
    return "" if part.separates or part.regime == "quiet" else " <small>changes stage</small>"


def side_shares(findings: Findings, part: Part) -> dict[str, float]:
    """Return the shares of time on the coast side, in the centre and on the drive side; nothing without corners."""
    trajectory = findings.motion.trajectory
    layout = parts_of(trajectory.layout)
    if part.name not in layout.clearance_names:
        return {}
    k = layout.clearance_names.index(part.name)
    inner = centre(layout, k)
    shares = {"coast": 0.0, "centre": 0.0, "drive": 0.0}
    for region, share in region_shares(trajectory, k, steady(trajectory)).items():
        side = "centre" if region in inner else "drive" if region > max(inner) else "coast"
        shares[side] += share
    return shares


def _share_bar(findings: Findings, part: Part) -> str:
    """Draw the shares of time on the coast side, in the centre and on the drive side."""
    shares = side_shares(findings, part)
    if not shares:
        return "always in contact"
    words = " · ".join(percent(share) for share in shares.values())
    bars = "".join(f'<i class="{side}" style="width:{100.0 * share:.2f}%"></i>' for side, share in shares.items())
    description = escape(", ".join(f"{side} {percent(share)}" for side, share in shares.items()))
    return Markup(f'<span class="share" role="img" aria-label="{description}">{bars}</span><small>{words}</small>')


def verdict_table(verdict: Verdict) -> Table:
    """Return one row for every mesh and clearance in plain text, worst first."""
    if verdict.event is not None:
        return event_parts(verdict)
    head = ("part", "severity", "regime", "impacts/cycle", "approach speed", "impact energy", "in contact")
    rows = tuple(
        (
            part.name,
            part.severity,
            part.regime,
            f"{part.impacts_per_cycle:.4g}",
            engineering(part.max_approach_speed, part.speed_unit),
            engineering(part.max_impact_energy, part.energy_unit),
            percent(part.contact_share),
        )
        for part in verdict.parts
    )
    return Table(head, rows, frozenset({0, 1, 2}))


def criteria_tables(verdict: Verdict) -> list[Table]:
    """Return one table a criterion, every entry in it: subjects down and quantities across, or turned if too wide."""
    criteria = {criterion.name: criterion for criterion in CRITERIA}
    made = []
    for name, group in groupby(verdict.entries, key=lambda entry: entry.name):
        entries = list(group)
        criterion = criteria[name]
        note = f"Definition: {criterion.formula}. Source: {criterion.source}.{errors_note(entries)}"
        made.append(grid(entries, criterion.title, note))
    return made


def errors_note(entries: Sequence[Row]) -> str:
    """Say what stands behind ±, or that nothing is known of it; empty where all values are exact."""
    note = ""
    if any(entry.error > 0.0 for entry in entries):
        note = f" ± is the estimated error of sampling, left out below {100.0 * _SLIGHT:g} %."
    unknown = dict.fromkeys(e.quantity for e in entries if math.isnan(e.error) and not _is_nothing(e))
    return f"{note} Of samples, without an estimate of their error: {', '.join(unknown)}." if unknown else note


def _is_nothing(entry: Row) -> bool:
    return isinstance(entry.value, float) and math.isnan(entry.value)


def grid(entries: Sequence[Row], title: str, note: str) -> Table:
    """Return entries as a grid; a unit stands in the title of its quantity, or in the cells where it varies."""
    units: dict[str, set[str]] = {}
    for entry in entries:
        units.setdefault(entry.quantity, set()).add(entry.unit)
    subjects = list(dict.fromkeys(entry.subject for entry in entries))
    titles = {what: _titled(what, next(iter(of)) if len(of) == 1 else "") for what, of in units.items()}
    cells = {
        (entry.subject, entry.quantity): _value(entry, with_unit=len(units[entry.quantity]) > 1) for entry in entries
    }
    if len(units) > _MOST_COLUMNS:
        rows = [(title, *(cells.get((subject, what), "–") for subject in subjects)) for what, title in titles.items()]
        return Table(("", *subjects), tuple(rows), title=title, note=note)
    rows = [(subject, *(cells.get((subject, what), "–") for what in titles)) for subject in subjects]
    return Table(("", *titles.values()), tuple(rows), title=title, note=note)


def _titled(what: str, unit: str) -> str:
    """Return a column title with its unit, unless the quantity names it."""
    shown = _shown(unit)
    return f"{what} [{shown}]" if shown and unit not in ("1/cycle", "1/s") else what


def _shown(unit: str) -> str:
    return "" if unit == "1" else unit.replace("^2", "²")


def _value(entry: Row, *, with_unit: bool) -> str:
    """Return a value as text, with the estimated error of its samples where that counts."""
    if isinstance(entry.value, str):
        return entry.value
    unit = _shown(entry.unit) if with_unit else ""
    if not entry.error > _SLIGHT * abs(entry.value):
        return quantity(entry.value, unit)
    return f"{quantity(entry.value, '')} ± {quantity(float(f'{entry.error:.2g}'), unit)}"
