"""Reduction of a model for a band to a smaller driveline, with its error.

The model is assembled as a system, ``reductions`` chooses the bodies that move as one, and the new model is written.
Padmanabhan et al. 1995, sec. 3, did this by eye.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from pydantic_core import PydanticCustomError

from gearrattle.assembly import (
    Driveline,
    assemble,
    free_names,
    left_out,
    lumped_model,
    moving_sideways,
    must_keep_bodies,
    must_stay_level,
    refuse_motions,
)
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model, check_model, units
from gearrattle.model.table import did_you_mean, listed, shown
from gearrattle.model.value_kinds import Quantity
from gearrattle.quantities.criteria import criteria
from gearrattle.reductions import Accuracy, Request, accuracy
from gearrattle.reductions.lumping import LIMIT, REASONS, Lumps, Refused, lump
from gearrattle.reductions.reduction import Compared, ElementFate, Reduction, Simulated, stated
from gearrattle.simulation.simulate import simulate
from gearrattle.wording import counted

MARGIN = 2.0
"""Modes up to this multiple of the band's end decide what is merged."""


def reduce(
    model: Model,
    up_to: str | float,
    *,
    keep: Sequence[str] | None = None,
    merge: Sequence[str] = (),
    limit: float = LIMIT,
    margin: float = MARGIN,
    check: Literal["simulate"] | None = None,
) -> Reduction:
    """Merge bodies that do not move against each other inside a band, through their ratios.

    Parameters
    ----------
    model
        the driveline.
    up_to
        end of the band: "75 Hz", or a plain number of Hz (Omega itself in a dimensionless model).
    keep
        names of the elements that must stay; default: every element with a clearance or dry friction. A
        clearance that is not named in a list given here counts as closed and may be merged: it can then no longer
        rattle.
    merge
        names of the elements to be merged whatever their strain energy.
    limit
        largest relative error of a natural frequency in the band, over all contact states; 0.05 by default.
    margin
        modes up to margin x up_to decide.
    check
        "simulate" also runs both models with the file's settings and compares what the criteria say.

    Raises
    ------
    ModelError
        a name no element has, a merge that is impossible, or one that costs more than the limit.

    Examples
    --------
    >>> smaller = gr.reduce(gr.example("eight_dof"), "60 Hz")
    >>> len(smaller.model.inertias)
    6
    """
    # check names, limits and the excitation
    check_model(model)
    end = band_end(model, up_to)
    names = [element.name for element in model.elements]
    problems = [*unknown("keep", keep or (), names), *unknown("merge", merge, names)]
    both = "is in keep and in merge; an element either stays or is merged"
    problems += [Problem("merge", shown(name), both, "take it out of one") for name in merge if name in (keep or ())]
    if not 0.0 < limit < 1.0:
        problems.append(Problem("limit", f"{limit}", "must lie between 0 and 1", "0.05 allows 5 %"))
    if not 1.0 <= margin < np.inf:
        problems.append(Problem("margin", f"{margin}", "must be a number not below 1"))
    if check not in (None, "simulate"):
        problems.append(Problem("check", shown(check), 'must be "simulate", or left out'))
    refuse_motions(model, "lumping")
    if model.excitation.sweep is not None:
        rule = "a model is reduced at one speed: a band follows no sweep"
        problems.append(Problem("excitation.sweep", "a sweep", rule, "set excitation.speed to the highest one"))
    if problems:
        raise ModelError(problems)
    # choose the bodies to merge
    request = requested(assemble(model), end, margin=margin, keep=keep, merge=merge)
    forced = tuple(dict.fromkeys(names.index(name) for name in merge))
    try:
        lumps = lump(
            request,
            forced=forced,
            level=must_stay_level(model),
            own=must_keep_bodies(model),
            sideways=moving_sideways(model),
            limit=limit,
        )
    except Refused as refused:
        rule = f"cannot be merged: {REASONS[refused.reason]}"
        raise ModelError(Problem("merge", shown(names[refused.element]), rule, "take it out of merge")) from None
    # error in the band over all contact states
    achieved = accuracy(request, lumps.grouping.basis, lumps.grouping.kept, lumps.error)
    if achieved.frequency_error > limit:
        raise ModelError(_too_much(achieved, lumps, names, limit))
    # write the smaller model
    return _reduction(model, request, lumps, achieved, limit=limit, check=check)


def band_end(model: Model, up_to: str | float) -> float:
    """Read the end of a band [rad/s]; ModelError if it is no frequency."""
    dimensionless = model.units == "dimensionless"
    try:
        value = Quantity(units.FREQUENCY, "positive").read(up_to, dimensionless)
    except PydanticCustomError as error:
        context = error.context or {}
        raise ModelError(Problem("up_to", shown(up_to), context["rule"], context["remedy"])) from None
    return float(value if dimensionless else 2.0 * np.pi * value)


def requested(
    driveline: Driveline,
    up_to: float,
    *,
    margin: float,
    keep: Sequence[str] | None,
    merge: Sequence[str] = (),
) -> Request:
    """Request of a reduction by indices from names; ``up_to`` in rad/s; ``merge`` releases elements kept by default."""
    model = driveline.model
    system = driveline.system
    names = driveline.layout.element_names
    own = sorted({*system.clearances, *(auxiliary.element for auxiliary in system.auxiliaries)})
    kept = [names[k] for k in own if names[k] not in merge] if keep is None else keep
    moved = np.any((system.inputs.torque_sine != 0.0) | (system.inputs.torque_cosine != 0.0), axis=1)
    if system.signals is not None:
        moved |= np.any(system.signals.torque != 0.0, axis=1)
    driven = tuple(int(i) for i in np.flatnonzero(moved))
    if not driven and model.torques:
        driven = (free_names(model).index(model.torques[0].on),)
    return Request(system, up_to, margin, tuple(sorted(names.index(name) for name in kept)), driven)


def unknown(key: str, entries: Sequence[str], names: Sequence[str]) -> list[Problem]:
    """Problems of names that no element has."""
    rule = f"there is no such element; there are {', '.join(names) or 'none'}"
    return [Problem(key, shown(name), rule, did_you_mean(name, names)) for name in entries if name not in names]


def _too_much(achieved: Accuracy, lumps: Lumps, names: list[str], limit: float) -> Problem:
    """Say how much the forced merges cost."""
    asked = [(fate, names[k]) for k, fate in enumerate(lumps.fates) if fate.reason == "asked"]
    softest, name = max(asked, key=lambda pair: pair[0].share)
    return Problem(
        "merge",
        ", ".join(words for _, words in asked),
        f"puts a frequency in the band off by {100 * achieved.frequency_error:.3g} %, at {achieved.worst:.4g} rad/s; "
        f"{100 * limit:g} % is allowed",
        f"take {name} out of merge (it holds {100 * softest.share:.3g} % of the strain energy), "
        "narrow the band, or raise the limit",
    )


def _reduction(
    model: Model, request: Request, lumps: Lumps, achieved: Accuracy, *, limit: float, check: str | None
) -> Reduction:
    """Write the new model and its record."""
    names = [element.name for element in model.elements]
    bodies = [body.name for body in model.inertias]
    grouping = lumps.grouping
    owner = grouping.owner[: len(bodies)]  # directions of bodies with a mass follow; they stay
    ratio = grouping.ratio[: len(bodies)]
    size = len(set(owner))
    title = f"{model.name or 'driveline'}: {size} of {counted(len(bodies), 'body', 'bodies')}"
    removed = [k for k, fate in enumerate(lumps.fates) if fate.merged]
    smaller = lumped_model(model, owner, ratio, removed, title)
    groups: dict[str, dict[str, float]] = {}
    for i, (body, times) in enumerate(zip(owner, ratio, strict=True)):
        if body != i:
            groups.setdefault(bodies[body], {})[bodies[i]] = times
    error = stated(achieved, names, limit)
    fates: dict[str, ElementFate] = {}
    for element, fate in zip(model.elements, lumps.fates, strict=True):
        kind, _, component = element.path.partition(".")
        name = component if kind == "bearing" else element.name
        if name not in fates or fate.share > fates[name].share:
            fates[name] = ElementFate(fate.merged, REASONS[fate.reason], fate.share, fate.at)
    simulated = _both(model, smaller) if check == "simulate" else None
    return Reduction(
        smaller, request.up_to, groups, fates, error, tuple(_notes(model, smaller, request, lumps)), simulated
    )


def _notes(model: Model, smaller: Model, request: Request, lumps: Lumps) -> list[str]:
    """Notes of the record beside its numbers."""
    # elements that were merged: clearances and friction given up
    elements = model.elements
    notes = []
    merged = [k for k, fate in enumerate(lumps.fates) if fate.merged]
    if not merged:
        notes.append("nothing could be merged: the model is as large as it was.")
    lost = [elements[k].name for k in merged if k in request.system.clearances]
    if lost:
        notes.append(f"clearances given up: {', '.join(lost)}; they count as closed and can no longer rattle.")
    smooth = sorted(
        {elements[auxiliary.element].name for auxiliary in request.system.auxiliaries if auxiliary.element in merged}
    )
    if smooth:
        notes.append(f"friction given up: {', '.join(smooth)}.")
    # components left out or changed
    notes += left_out(model)
    for component in model.components.values():
        if added := component.added_inertia():
            notes.append(f"the J of {listed(added)} holds what {component.noun} {component.name} adds to it now.")
    wavy = [
        elements[k].name
        for k in merged
        if np.any(request.system.inputs.error_sine[k] != 0.0) or np.any(request.system.inputs.error_cosine[k] != 0.0)
    ]
    if wavy:
        notes.append(f"transmission errors above the band were dropped with {', '.join(wavy)}.")
    names = {component.name for component in model.components.values()}
    turned = [c.name for path, c in smaller.components.items() if c.name in names and path not in model.components]
    if turned:
        notes.append(
            f"now between shafts of different speeds and written as a mesh with radii in ratio: {', '.join(turned)}."
        )
    # excitation above the band
    if request.system.signals is not None:
        notes.append("records are no harmonics: whether they excite above the band is not known.")
    end = request.up_to * request.system.inputs.period / (2.0 * np.pi)
    beyond = int(np.count_nonzero(request.system.inputs.cycles > end * (1.0 + 1e-9)))
    if beyond:
        orders = f"{beyond} of {counted(request.system.inputs.count, 'order')}"
        notes.append(f"{orders} excite above the band, and impacts do: no error is stated there.")
    return notes


def _both(model: Model, smaller: Model) -> Simulated:
    """Run both models and set what the criteria say side by side."""
    full, reduced = (criteria(simulate(variant, audit=False)) for variant in (model, smaller))
    values = {(e.name, e.subject, e.quantity, e.unit): e.value for e in reduced.entries}
    entries = tuple(
        Compared(*key, entry.value, values[key])
        for entry in full.entries
        if (key := (entry.name, entry.subject, entry.quantity, entry.unit)) in values
    )
    return Simulated(full.sentence, reduced.sentence, entries)
