"""Sentence of the verdict: the parts that rattle or touch, their regimes, and the hardness of their impacts.

A gap that separates *rattles*, or *touches* if all its impacts are negligible. A staged spring that crosses its
corners, or a gap that crosses only outer corners, changes *stage*, which is not rattle. Only the worst parts are
described; the others are only named.
"""

from __future__ import annotations

from collections.abc import Sequence

from gearrattle.quantities.verdict_parts import Part
from gearrattle.wording import counted, engineering

SPELT_OUT = 3


def sentence(parts: Sequence[Part], cycles: int) -> str:
    """Return the verdict's sentence."""
    span = f"over the {cycles} cycles judged" if cycles != 1 else "over the one cycle judged"
    if not parts:
        return "There is no mesh and no clearance: nothing can rattle."
    rattling = [part for part in parts if part.rattles]
    touching = [part for part in parts if part.severity == "touches"]
    changing = [part for part in parts if _changes_stage(part)]
    quiet = [part for part in parts if part not in rattling and part not in touching and part not in changing]
    words = []
    if rattling:
        words.append(f"Rattle {span}: " + _listed([_impacts(part) for part in rattling]) + ".")
    elif touching or changing:
        words.append(f"No gap rattles {span}.")
    if touching:
        words.append("Negligible touches: " + _listed([_impacts(part) for part in touching]) + ".")
    if changing:
        words.append(_capital(_listed([_stage_changes(part) for part in changing])) + ".")
    if quiet:
        lead = "Quiet" if words else f"Quiet {span}"
        words.append(f"{lead}: " + "; ".join(_at_rest(part) for part in quiet) + ".")
    return " ".join(words)


def _impacts(part: Part) -> str:
    verb = "hits" if part.rattles else "touches"
    side = "flank" if part.kind == "mesh" else "side"
    if part.kind == "bearing" and part.coast_impacts_per_cycle == 0.0:
        where = f"{part.name} {verb} {'opposite sides' if part.regime == 'double-sided' else 'one side only'}"
    elif part.regime == "double-sided":
        where = f"{part.name} {verb} both {side}s"
    else:
        where = f"{part.name} {verb} its {_side(part)}{side} only"
    if part.impacts_per_cycle == 0.0:
        return f"{part.name} leaves contact and does not hit again"
    hardness = [f"{counted(float(part.impacts_per_cycle), 'impact')} per cycle"]
    if part.max_approach_speed is not None:
        hardness.append(f"approach speed up to {engineering(part.max_approach_speed, part.speed_unit)}")
    if part.max_impact_energy is not None:
        hardness.append(f"impact energy up to {engineering(part.max_impact_energy, part.energy_unit)}")
    hardness.append(f"in contact {_percent(part.contact_share)} of the time")
    return f"{where}, " + ", ".join(hardness)


def _changes_stage(part: Part) -> bool:
    return not part.separates and (part.regime != "quiet" or part.impacts_per_cycle > 0.0)


def _stage_changes(part: Part) -> str:
    both = part.drive_impacts_per_cycle > 0.0 and part.coast_impacts_per_cycle > 0.0
    where = "on both sides" if both or part.regime == "double-sided" else f"on its {_side(part)}side only"
    rate = f"entering an outer stage {counted(float(part.impacts_per_cycle), 'time')} per cycle"
    return f"{part.name} changes stage {where}, {rate}"


def _at_rest(part: Part) -> str:
    if part.contact_share >= 1.0:
        state = "stays in contact" if part.gap or part.kind == "mesh" else "stays in an outer stage"
    elif part.contact_share <= 0.0:
        state = "floats free in its gap" if part.gap else "stays in its first stage"
    else:
        state = "crosses no corner"
    return f"{part.name} {state}"


def _side(part: Part) -> str:
    if part.drive_impacts_per_cycle > 0.0:
        return "drive "
    return "coast " if part.coast_impacts_per_cycle > 0.0 else ""


def _percent(share: float) -> str:
    """Return a share in per cent; only exact shares 0 and 1 are shown as 0 % and 100 %."""
    percent = 100.0 * share
    if 0.0 < percent < 0.1:
        return "less than 0.1 %"
    if 99.9 < percent < 100.0:
        return "more than 99.9 %"
    return f"{percent:.3g} %"


def _listed(items: list[str]) -> str:
    more = len(items) - SPELT_OUT
    shown = "; ".join(items[:SPELT_OUT])
    return shown if more <= 0 else f"{shown}; and {more} more"


def _capital(words: str) -> str:
    return words[:1].upper() + words[1:]
