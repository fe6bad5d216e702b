"""Numerical stiffness of a model: eigenvalues, R_lambda, condition numbers, and the growth factors of fixed steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from math import prod
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.linear.condition_number import conditions
from gearrattle.analysis.linear.stiffness_ratio import Eigenvalues, StiffnessClass
from gearrattle.analysis.linear.stiffness_ratio import eigenvalues as eigenvalues_of
from gearrattle.analysis.statics import slopes
from gearrattle.assembly import Driveline, assemble, left_out
from gearrattle.engine.solvers.step_stability import most_regions
from gearrattle.engine.system.characteristic import characteristic
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.model import Model, check_model
from gearrattle.model.value_kinds import FLAG, check_arguments
from gearrattle.result import Result
from gearrattle.results import Run
from gearrattle.signals import dwell_of_regions
from gearrattle.wording import counted

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Stiffness(Result):
    """How stiff a driveline is to an integrator, every clearance replaced by one slope.

    Attributes
    ----------
    model
        the driveline.
    r_lambda
        largest over smallest eigenvalue in magnitude, rigid motions left out; no scaling can change it.
    stiffness_class
        "mild" (below 1e3), "strong" (below 1e6), "extreme" (below 1e9) or "pathological"; "rigid"
        where no motion is elastic, so that R_lambda is NaN.
    eigenvalues
        those of all motion that is not rigid, by magnitude [1/s].
    rigid_eigenvalues
        those of rigid motions: a zero and a drag rate each [1/s].
    condition
        condition number of the Jacobian by formulation: "dimensional", then with the characteristic
        quantities of ``nondimensionalize`` "translational", "mixed" and "torsional", and "balanced".
    notes
        what these leave out: friction and the clipping of contact damping.

    Examples
    --------
    >>> gr.stiffness(gr.example("case3")).stiffness_class
    'mild'
    """

    kind: ClassVar[str] = "stiffness"
    model: Model = field(repr=False, compare=False)
    r_lambda: float
    stiffness_class: StiffnessClass
    eigenvalues: Complex
    rigid_eigenvalues: Complex
    condition: dict[str, float]
    notes: tuple[str, ...] = ()


def stiffness(
    model: Model,
    contact_ratio: Mapping[str, float] | None = None,
    region: Mapping[str, int] | None = None,
    *,
    with_damping: bool = False,
) -> Stiffness:
    """Eigenvalues, their ratio R_lambda with its class, and condition numbers (Padmanabhan et al. 1995, sec. 6).

    Parameters
    ----------
    model
        the driveline.
    contact_ratio
        Gamma by element name: the slope becomes Gamma K.
    region
        region label by element name; elements in neither mapping are in their last drive stage.
    with_damping
        whether Gamma multiplies the damping too; in the paper it multiplies stiffness only.

    Raises
    ------
    ModelError
        a name no element has, a ratio outside 0 ... 1, a region the element does not have.

    Examples
    --------
    >>> answer = gr.stiffness(gr.example("case3"))
    >>> answer.stiffness_class, round(answer.r_lambda)
    ('mild', 109)
    """
    check_model(model)
    check_arguments(with_damping=(FLAG, with_damping))
    driveline = assemble(model)
    slope, damping = slopes(driveline, contact_ratio, region, with_damping=with_damping)
    eigenvalues = eigenvalues_of(driveline.system, slope, damping)
    condition = conditions(driveline.system, slope, damping, _formulations(driveline))
    return Stiffness(
        model,
        eigenvalues.r_lambda,
        eigenvalues.stiffness_class,
        eigenvalues.elastic,
        eigenvalues.rigid,
        condition,
        left_out(model),
    )


def _formulations(driveline: Driveline) -> dict[str, tuple[Array, float]]:
    """Unit of every angle and of frequency, by formulation; a body without a gear has the radius R_c. Displacements
    count in x_c.
    """
    system = driveline.system
    layout = driveline.layout
    scales = characteristic(system, layout.is_mesh, layout.omega)
    geared = np.zeros(system.size)
    turning = system.size - len(layout.direction_names)
    arms = np.abs(system.rows[layout.is_mesh])
    arms[:, turning:] = 1.0
    for row in arms[::-1]:  # the first mesh a body is in counts
        geared = np.where(row > 0.0, row, geared)
    along = scales.length / np.where(geared > 0.0, geared, scales.radius)
    torsional = np.full(system.size, scales.angle)
    torsional[turning:] = scales.length
    return {
        "dimensional": (np.ones(system.size), 1.0),
        "translational": (along, scales.frequency),
        "mixed": (np.where(geared > 0.0, along, torsional), scales.frequency),
        "torsional": (torsional, scales.frequency),
    }


def r_lambda_over(
    model: Model,
    element: str,
    ratios: Sequence[float],
    contact_ratio: Mapping[str, float] | None = None,
    *,
    with_damping: bool = False,
) -> Array:
    """(len(ratios),) R_lambda against the contact ratio of one element, as in the paper's Fig. 6.

    ModelError: as ``stiffness``.
    """
    driveline = assemble(model)
    fixed = dict(contact_ratio or {})
    states = [slopes(driveline, {**fixed, element: r}, None, with_damping=with_damping) for r in ratios]
    return np.array([eigenvalues_of(driveline.system, *state).r_lambda for state in states])


@dataclass(frozen=True)
class RegionStiffness:
    """A region with its eigenvalues, and the share of time that a run spends in it; NaN where no run is behind it."""

    labels: dict[str, int]
    eigenvalues: Eigenvalues
    share: float = float("nan")


def regions(model: Model) -> tuple[list[RegionStiffness], str]:
    """Eigenvalues of the regions that differ in a slope or damping, on the drive side where both sides are alike.

    Where there are too many, only those with one clearance outside its centre are returned, and those with all at their
    centre or in their last stage; a note says so.
    """
    driveline = assemble(model)
    system = driveline.system
    names = driveline.layout.element_names
    kinds = [_kinds(system, k) for k in range(len(names))]
    note = ""
    most = most_regions(len(names) + system.size)
    if prod(len(kind) for kind in kinds) <= most:
        chosen = list(product(*kinds))
    else:
        at_rest = tuple(kind[0] for kind in kinds)
        one = [(*at_rest[:k], p, *at_rest[k + 1 :]) for k, kind in enumerate(kinds) for p in kind[1:]]
        chosen = [at_rest, *one, tuple(kind[-1] for kind in kinds)]
        note = f"more than {most} regions: only those with one clearance outside its centre, none or all"
    return [_region(system, names, pieces) for pieces in chosen], note


def _region(
    system: PiecewiseSystem, names: Sequence[str], pieces: Sequence[int], share: float = float("nan")
) -> RegionStiffness:
    slope, damping = (
        np.array([getattr(law, name)[p] for law, p in zip(system.laws, pieces, strict=True)])
        for name in ("stiffness", "damping")
    )
    labels = {names[k]: pieces[k] + system.laws[k].first_label for k in system.clearances}
    return RegionStiffness(labels, eigenvalues_of(system, slope, damping), share)


@dataclass(frozen=True)
class Visited:
    """Regions in which a motion stays: those with known eigenvalues, longest dwell first, and the number of all."""

    regions: tuple[RegionStiffness, ...]
    count: int

    @property
    def words(self) -> str:
        """The regions in words."""
        known = len(self.regions)
        if known == self.count:
            return f"{counted(known, 'region')} visited"
        share = 100.0 * sum(region.share for region in self.regions)
        return f"the {known} regions visited longest, {share:.3g} % of the time, of {self.count} visited"


def regions_visited(run: Run, progress: Callable[[float], None] | None = None) -> Visited:
    """Eigenvalues of the regions that a run visits after the discarded cycles, longest dwell first.

    A train of many clearances visits thousands of regions. Only those visited longest are treated, at most
    ``MOST_REGIONS``, and fewer of more than fifty inertias, where the eigenvalues of one take tens of milliseconds.

    Parameters
    ----------
    run
        the motion; times are those of its crossings, exact to their accuracy.
    progress
        called with the finished share; what it raises ends the work.

    Raises
    ------
    ModelError
        no cycle left after the discarded ones.
    """
    system = assemble(run.model).system
    names = run.trajectory.layout.element_names
    dwell = dwell_of_regions(run.trajectory)
    total = sum(dwell.values())
    first = [law.first_label for law in system.laws]
    most = most_regions(len(names) + system.size)
    longest = sorted(dwell.items(), key=lambda item: -item[1])[:most]
    treated: list[RegionStiffness] = []
    for labels, time in longest:
        if progress is not None:
            progress(len(treated) / len(longest))
        pieces = [0] * len(names)
        for k, label in zip(system.clearances, labels, strict=True):
            pieces[k] = label - first[k]
        treated.append(_region(system, names, pieces, time / total))
    return Visited(tuple(treated), len(dwell))


def _kinds(system: PiecewiseSystem, element: int) -> list[int]:
    """Pieces of one element that differ, from the centre outward; the drive side before the coast side."""
    law = system.laws[element]
    seen = dict[tuple[float, float], int]()
    outward = sorted(range(law.pieces), key=lambda p: (abs(p + law.first_label), p + law.first_label < 0))
    for piece in outward:
        seen.setdefault((float(law.stiffness[piece]), float(law.damping[piece])), piece)
    return list(seen.values())
