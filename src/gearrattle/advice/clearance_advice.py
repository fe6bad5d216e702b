"""Advice on clearances: clearances that open at this load, and the slopes that replace them in a linear model."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping

from gearrattle.advice.advice_record import Line
from gearrattle.advice.forecasts import CROSSED, Forecast
from gearrattle.advice.pilot import Pilot
from gearrattle.advice.steady_linear_check import Excursions
from gearrattle.analysis.contact_ratio import forecast_ratios
from gearrattle.errors import ConvergenceError
from gearrattle.model import Model
from gearrattle.signals import parts_of, rings
from gearrattle.trajectory import Layout

LINEAR = "linear response"
LISTED = 6
"""Largest number of parts that a line names one by one; for more parts it gives counts and ranges."""


def linear_forecasts(layout: Layout, excursions: Excursions) -> list[Forecast]:
    """Forecast for every clearance whether it crosses a corner, by the linear response.

    The side of the corner is not forecast, because the linear response does not predict it reliably.
    """
    return [Forecast("corners", name, LINEAR, CROSSED[used >= 1.0]) for name, used in _used(layout, excursions).items()]


def _used(layout: Layout, excursions: Excursions) -> dict[str, float]:
    """Share of its room that every part takes; of a ring that of the face with the largest."""
    used = dict.fromkeys(parts_of(layout).clearance_names, 0.0)
    of_ring = {k: ring.name for ring in rings(layout) for k in ring.clearances}
    for k, (name, share) in enumerate(zip(layout.clearance_names, excursions.used.tolist(), strict=True)):
        part = of_ring.get(k, name)
        used[part] = max(used[part], share)
    return used


def clearances_line(layout: Layout, excursions: Excursions, pilot: Pilot, notes: tuple[str, ...] = ()) -> Line:
    """Line on clearances: regimes in the pilot run, and the linear response about rest."""
    # regimes of the pilot run
    names = parts_of(layout).clearance_names
    used = _used(layout, excursions)
    shown = pilot.of("regime")
    if not names:
        return Line("clearances", "There are none: the driveline is linear.")
    moving = {name: str(regime) for name, regime in shown.items() if regime != "quiet"}
    quiet = [name for name in names if name not in moving]
    # clearances that open, by name or by number
    if not moving:
        words = "No clearance opens."
    elif len(names) > LISTED:
        words = f"Expect impacts in {len(moving)} of {len(names)} clearances: {_kinds(moving)}."
    else:
        words = ", ".join(f"{name} {regime}" for name, regime in moving.items())
        words = f"Expect impacts: {words}{'; quiet: ' + ', '.join(quiet) if quiet else ''}."
    # evidence of the pilot run
    regimes = {name: str(regime) for name, regime in shown.items()}
    states = _kinds(regimes) if len(names) > LISTED else ", ".join(f"{n} {r}" for n, r in regimes.items())
    evidence = [f"{pilot.name}, its second half: {states}"]
    # evidence of the linear response: exact motion, or corners that it crosses
    if excursions.inside and not notes:
        least = max(used, key=used.__getitem__)
        evidence.append(
            "the steady linear response about rest reaches no corner, so it is an exact motion of the driveline; "
            f"nearest to one: {least}, whose oscillation takes {100.0 * used[least]:.3g} % of its room"
        )
        if moving:
            evidence.append("the pilot moves otherwise: there is more than one motion, or it has not settled yet")
    else:
        over = [name for name, share in used.items() if share >= 1.0]
        evidence.append(f"the steady linear response about rest crosses {_corners(over)}")
    return Line("clearances", words, (*evidence, *notes))


def _corners(over: list[str]) -> str:
    if len(over) > LISTED:
        return f"corners of {len(over)} clearances"
    return f"corners of {', '.join(over)}" if over else "no corner"


def _kinds(regimes: Mapping[str, str]) -> str:
    """Number of clearances with each regime, in words."""
    return ", ".join(f"{count} {regime}" for regime, count in Counter(regimes.values()).most_common())


def contact_ratios_line(model: Model, pilot: Pilot) -> Line:
    """Line on contact ratios: mean slopes of the pilot, and those of equivalent linearisation."""
    slopes = {name: float(value) for name, value in pilot.of("mean slope").items()}
    if not slopes:
        return Line("contact ratios", "There are none.")
    words = _slopes(slopes)
    try:
        linearised, attributes = forecast_ratios(model, "mean-slope", thorough=False)
        count = len(attributes["fixed_points"])
        points = f", the most visited of {count} fixed points" if count > 1 else ""
        ratios_text = _slopes({name: linearised[name] for name in slopes})
        off = max((abs(linearised[n] - v) for n, v in slopes.items() if not math.isnan(v)), default=0.0)
        second = f"equivalent linearisation, without simulating{points}: {ratios_text}; up to {off:.2g} apart"
    except ConvergenceError as error:
        second = f"equivalent linearisation: {error}"
    return Line("contact ratios", f"Mean slopes: {words}.", (f"of the {pilot.name}", second))


def _slopes(values: Mapping[str, float]) -> str:
    """Slopes in words; for more than ``LISTED`` clearances their range."""
    known = [value for value in values.values() if not math.isnan(value)]
    if len(values) > LISTED and known:
        return f"{min(known):.3g} to {max(known):.3g} over {len(values)} clearances"
    return ", ".join(f"{name} {value:.3g}" for name, value in values.items())
