"""``prove_quiet``: the parts of a box of parameters in which a quiet motion exists and is stable, with proof.

While no gap opens or closes, no spring changes its stage and no friction slips, a driveline is linear, and its steady
motion in the state of rest is known exactly: the mean state and a complex amplitude for every order. Its extremes are
bounded over whole boxes of parameters (``enclosure``, ``bounds``), and boxes are divided until they are decided
(``branch_and_bound``). That all other motions nearby come to this one is shown by the structure of the driveline
(``damped``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import inf
from time import monotonic
from typing import Any

import numpy as np

from gearrattle.assembly import refuse_unsteady
from gearrattle.assembly.ripple import load_ripples
from gearrattle.errors import Cancelled, ModelError, Problem
from gearrattle.model import Model, check_model, units
from gearrattle.model.drag_points import has_drag_parts
from gearrattle.model.value_kinds import CALLBACK, Count, Plain, Quantity, Reader, argument_problems, checked
from gearrattle.studies.quiet.branch_and_bound import ENDURES, SLIPS, Search, steady_rate
from gearrattle.studies.quiet.coefficients import Family, family_of
from gearrattle.studies.quiet.edges import SPEEDS, Edge, edges_of
from gearrattle.studies.quiet.proof import QuietProof, proof_of

Progress = Callable[[float], None]
Ends = Sequence[float | str]

RESOLUTION = Plain("non-negative")
BOXES = Count(1)
WITHIN = Quantity(units.TIME, "positive")
_COEXIST = (
    "what is proven is that a quiet motion exists and that motions near it come to it. Rattling motions may exist "
    "at the same values, and hard starts lead to them: periodic motions and basins show these."
)


def prove_quiet(
    model: Model,
    ranges: Mapping[str, Ends | Mapping[str, Ends]],
    *,
    within: float | str | None = None,
    boxes: int = 20_000,
    resolution: float = 0.005,
    progress: Progress | None = None,
) -> QuietProof:
    """Prove where in a box of parameters a quiet motion exists and is stable.

    A box is proven where the linear motion in the state of rest keeps every gap as it is, every spring in its stage
    and all friction sticking, at every one of its points. It is refuted where that motion opens or closes a gap at
    every point while all else is kept: then no motion that stays in the state of rest is quiet. All else is open, with
    the reason. Nothing is integrated.

    Parameters
    ----------
    model
        the driveline, under harmonics of one speed.
    ranges
        by path of the model file a pair (low, high), such as ``{"mesh.m1.backlash": ("50 um", "80 um")}``; by another
        name a mapping from paths to pairs, which vary together. Inertias, drags, stiffness, damping, clearances,
        ends of stages, friction, means, amplitudes and the speed can be varied.
    within
        time that the search may take [s], or as text; None for no limit.
    boxes
        how many boxes are looked at, at most.
    resolution
        share of the volume that may stay undecided because it would have to be divided further.
    progress
        called with the finished share. ``Cancelled``, if it raises that, ends the search with what is known, as
        Ctrl-C does; anything else ends the work.

    Returns
    -------
    QuietProof
        Shares ``proven``, ``refuted`` and ``open``, and the ``boxes``.

    Raises
    ------
    ModelError
        a path that cannot be varied, ends that the model refuses, inputs that are no harmonics of one speed.

    Examples
    --------
    >>> model = gr.example("backlash_oscillator")
    >>> proof = gr.prove_quiet(model, {"excitation.speed": (0.3, 0.6), "torque.0.mean": (0.08, 0.12)})
    >>> proof.proven
    1.0
    """
    # check the arguments
    begin = monotonic()
    check_model(model)
    arguments: dict[str, tuple[Reader, Any]] = {
        "resolution": (RESOLUTION, resolution),
        "boxes": (BOXES, boxes),
        "progress": (CALLBACK, progress),
    }
    limits = {} if within is None else {"within": (WITHIN, within)}
    if problems := argument_problems({**arguments, **limits}, dimensionless=False):
        raise ModelError(problems)
    seconds = inf if within is None else float(checked(WITHIN, within, "within", dimensionless=False))
    # edges of the box
    edges = edges_of(ranges, model)
    refuse_unsteady(model, "a proof of quiet")
    if problems := [*_unprovable(model), *_over_speed(model, edges)]:
        raise ModelError(problems)
    # branch and bound until decided, out of time or stopped
    family = family_of(model, edges)
    search = Search(family)
    ended = True
    try:
        search.run(resolution, boxes, begin + seconds, progress or (lambda _: None))
    except (Cancelled, KeyboardInterrupt):
        ended = False
    # shares proven, refuted and open
    parts = search.every()
    ended = ended and search.undecided <= resolution
    notes = list(_notes(family, search, resolution, ended=ended))
    return proof_of(model, edges, parts, search.looked_at, notes, ended=ended)


def _unprovable(model: Model) -> Iterator[Problem]:
    """Yield the features by which a driveline is not linear with constant coefficients, even in one state."""
    rule = "a proof of quiet needs a driveline that is linear in its state of rest"
    for element in model.elements:
        if element.alternation is not None:
            yield Problem(f"{element.path}.alternation", "", rule, "leave it out, or simulate")
    if load_ripples(model):
        joints = ", ".join(element.path for element in model.elements if element.load_ripple)
        why = f"{rule}; a Hooke joint acts back with its mean load"
        yield Problem(f"{joints}.hooke", "", why, "give its kinematic_error instead")


def _over_speed(model: Model, edges: tuple[Edge, ...]) -> Iterator[Problem]:
    """Yield a problem where the speed varies, and tables over it or drag parts as well."""
    varied = {path for edge in edges for path in edge.low} & set(SPEEDS)
    if varied and (has_drag_parts(model) or model.to_tables() != model.to_tables(at_speed=True)):
        rule = "the model has drag parts or tables over the speed, which a proof cannot follow"
        yield Problem(f"range {min(varied)}", "", rule, "give plain numbers, or prove at single speeds")


def _notes(family: Family, search: Search, resolution: float, *, ended: bool) -> Iterator[str]:
    """Yield the notes of the proof."""
    yield _COEXIST
    if not ended:
        yield f"the search was stopped with {100.0 * search.undecided:.3g} % of the volume undecided: it is open."
    elif search.undecided > 0.0:
        share = 100.0 * search.undecided
        yield f"{share:.2g} % of the volume was not divided further: a smaller resolution than {resolution:g} does."
    reasons = {part.reason for part in search.parts}
    if SLIPS in reasons:
        yield "friction that slips is not linear: of a driveline whose quiet motion makes it slip nothing is shown."
    if ENDURES in reasons:
        yield "that all motion decays is not shown: too few elements have damping in the state of rest."
    rate = steady_rate(family, family.at(np.zeros(len(family.numbers.linear))))
    if np.abs(rate).max(initial=0.0) > 1e-6 * family.driveline.model.excitation.omega:
        largest = float(rate[np.argmax(np.abs(rate))])
        yield (
            f"the means do not balance: in the middle of the box drag lets the train run {largest:.3g} rad/s off the "
            "uniform rotation. The mean loads are those of that steady state."
        )
