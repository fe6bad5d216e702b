"""Advice on lumping: bodies that move as one in the excited band, unless the pilot run of the lumped model differs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gearrattle.advice.advice_record import Line
from gearrattle.advice.clearance_advice import LISTED
from gearrattle.advice.pilot import Pilot, run_pilot
from gearrattle.errors import ModelError
from gearrattle.model import Model
from gearrattle.reductions.reduce import band_end, reduce
from gearrattle.reductions.reduction import Reduction
from gearrattle.wording import counted

TOPIC = "lumping"
_COMPARED = 0.1  # difference of mean slopes from which on two motions differ


def lumping_line(
    model: Model, pilot: Pilot, up_to: float | str | None = None, progress: Callable[[float], None] | None = None
) -> Line:
    """Line on lumping: a reduction for the band, by default that of the torques' orders, and its pilot run."""
    layout = pilot.run.trajectory.layout
    # drivelines that cannot be lumped
    if model.motions:
        reason = f"lumping needs every inertia free, and the motion of {model.motions[0].on} is prescribed"
        return Line(TOPIC, "Keep every body: a driveline with a prescribed motion is not lumped.", (reason,))
    # reduce within the band
    why, end = _band(model, layout.omega) if up_to is None else ((f"the band asked for: {up_to}",), up_to)
    band_end(model, end)
    try:
        reduction = reduce(model, end)
    except ModelError as error:
        return Line(TOPIC, "Keep every body: none can be lumped within the error allowed.", (*why, str(error)))
    if not reduction.groups:
        return Line(TOPIC, "Keep every body: all of them move against their neighbours in the band.", why)
    # groups in words, and the error of the frequencies
    groups = [f"{', '.join(members)} into {kept}" for kept, members in reduction.groups.items()]
    more = f"; and {counted(len(groups) - LISTED, 'group')} more, which gr.reduce lists" if len(groups) > LISTED else ""
    merged = "; ".join(groups[:LISTED]) + more
    bodies = f"{counted(len(layout.inertia_names), 'body', 'bodies')} become {len(reduction.model.inertias)}"
    off = reduction.error
    why = (
        *why,
        f"frequencies in the band at most {100.0 * off.frequency:.2g} % off over {off.states} contact states "
        f"({100.0 * off.limit:g} % allowed)",
    )
    # comparison of the lumped pilot run with the full one
    differences = _differences(reduction, pilot, progress)
    if len(differences) > LISTED:
        differences = (*differences[:LISTED], f"and {len(differences) - LISTED} more differences")
    if differences:
        words = f"Keep every body. Linear modes would allow to lump {merged}, but the lumped model moves otherwise."
        return Line(TOPIC, words, (*why, *differences))
    same = f"a pilot of the lumped model shows the same regimes, and mean slopes within {_COMPARED:g}"
    return Line(TOPIC, f"Lump {merged}: {bodies}.", (*why, same))


def _band(model: Model, omega: float) -> tuple[tuple[str, ...], float]:
    """Reasons for the band that torques excite, and its end in the unit of ``reduce``.

    Transmission errors may excite beyond it.
    """
    torques = [h.order for torque in model.torques for h in torque.harmonics if h.amplitude != 0.0]
    errors = [h.order for element in model.elements for h in element.errors if h.amplitude != 0.0]
    highest = max(torques or errors, default=1.0)
    unit = 1.0 if model.units == "dimensionless" else 1.0 / (2.0 * np.pi)
    end = highest * omega * unit
    name = "torque" if torques else "transmission error" if errors else "speed"
    why = [f"the band reaches to order {highest:g}, the highest of any {name}: {_in_words(end, model)}"]
    if torques and errors and max(errors) > highest:
        why.append(f"transmission errors excite beyond it, up to {_in_words(max(errors) * omega * unit, model)}")
    return tuple(why), end


def _in_words(end: float, model: Model) -> str:
    return f"{end:.4g} Hz" if model.units == "SI" else f"{end:.4g}"


def _differences(reduction: Reduction, pilot: Pilot, progress: Callable[[float], None] | None) -> tuple[str, ...]:
    """Differences between the pilot runs of the lumped and the full model, in words; empty if there are none."""
    t = pilot.run.trajectory
    other = run_pilot(reduction.model, pilot.planned, progress, cycles=t.cycles)
    differences = []
    regimes = other.of("regime")
    slopes = other.of("mean slope")
    for name, regime in pilot.of("regime").items():
        if name in regimes and regimes[name] != regime:
            differences.append(f"{name}: {regime}, but {regimes[name]} in the lumped model's pilot")
    for name, slope in pilot.of("mean slope").items():
        if name in slopes and abs(float(slopes[name]) - float(slope)) > _COMPARED:
            differences.append(f"{name}: mean slope {slope:.3g}, but {slopes[name]:.3g} in the lumped model's pilot")
    return tuple(differences)
