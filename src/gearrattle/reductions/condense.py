"""Condensed matrices of a model for a band.

The reductions that give no bodies: full mass matrices, amplitudes for angles. They serve frequencies,
responses and estimates in every contact state; what can be saved and simulated as a driveline comes from ``reduce``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.linear.matrices import LinearSystem, linearised
from gearrattle.assembly import assemble, coordinate_names, left_out
from gearrattle.errors import ModelError, Problem
from gearrattle.json_types import Json, json_value
from gearrattle.model import Model, check_model
from gearrattle.model.table import did_you_mean, shown
from gearrattle.reductions import REDUCTIONS, Request, accuracy
from gearrattle.reductions.lumping import LIMIT
from gearrattle.reductions.reduce import band_end, requested, unknown
from gearrattle.reductions.reduction import ReductionError, stated
from gearrattle.result import Result

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Condensed(Result):
    """A model in a subspace q = T p.

    Attributes
    ----------
    method
        its name, as ``condense`` takes it.
    basis
        (n, r) T: angles of all inertias by the coordinates.
    inertia_names
        (n,).
    coordinates
        (r,) name of the inertia whose angle a coordinate is; "" for the amplitude of a shape.
    clearances
        names of the clearances kept.
    rows
        (len(clearances), r) their deflections by the coordinates [rad or m].
    mass
        (r, r) T^T J T.
    damping
        (r, r), all elements in their last drive stage.
    stiffness
        (r, r), likewise.
    error
        how far from the full model, over all contact states.
    notes
        what the matrices leave out: friction and the clipping of contact damping.
    units
        of the model, "SI" or "dimensionless".

    Examples
    --------
    >>> gr.condense(gr.example("eight_dof"), "100 Hz").method
    'craig-bampton'
    """

    kind: ClassVar[str] = "condensation"
    method: str
    basis: Array
    inertia_names: tuple[str, ...]
    coordinates: tuple[str, ...]
    clearances: tuple[str, ...]
    rows: Array
    mass: Array
    damping: Array
    stiffness: Array
    error: ReductionError
    _request: Request
    notes: tuple[str, ...] = ()
    units: str = "SI"

    @property
    def matrices(self) -> dict[str, Array]:
        """Basis, rows, mass, damping and stiffness by name; shapes and units as of the attributes."""
        return {name: getattr(self, name) for name in ("basis", "rows", "mass", "damping", "stiffness")}

    def to_dict(self) -> dict[str, Json]:
        """Return the whole in JSON types."""
        return {
            "method": self.method,
            "inertias": list(self.inertia_names),
            "coordinates": list(self.coordinates),
            "clearances": list(self.clearances),
            **{name: matrix.tolist() for name, matrix in self.matrices.items()},
            "error": json_value(self.error),
            "notes": list(self.notes),
        }

    def frequencies(self, contact_ratio: Mapping[str, float] | None = None) -> Array:
        """Return (r,) natural frequencies [rad/s], under factors on the last slope of kept clearances; 1 where nothing
        is said.
        """
        ratios = dict(contact_ratio or {})
        if problems := unknown("contact_ratio", tuple(ratios), self.clearances):
            raise ModelError(problems)
        slopes = np.array([law.stiffness[-1] for law in self._request.system.laws], dtype=float)
        at = dict(zip(self.clearances, self._request.clearances, strict=True))
        for name, ratio in ratios.items():
            slopes[at[name]] *= ratio
        return _linear(self._request, slopes).within(self.basis).frequencies()


def condense(
    model: Model,
    up_to: str | float,
    *,
    method: str = "craig-bampton",
    keep: Sequence[str] | None = None,
    limit: float = LIMIT,
    margin: float = 3.0,
) -> Condensed:
    """Write a model in few coordinates that serve a band, its clearances free to open and close.

    Parameters
    ----------
    model
        the driveline.
    up_to
        end of the band, as in ``reduce``.
    method
        "craig-bampton", "guyan", "modal" or "lumping".
    keep
        names of the elements whose ends must stay free; default: every element with a clearance. Others count as
        closed.
    limit
        largest relative error of a natural frequency in the band, over all contact states.
    margin
        modes up to margin x up_to are represented.

    Raises
    ------
    ModelError
        a name that does not exist, nothing to keep, or an error beyond the limit.

    Examples
    --------
    >>> small = gr.condense(gr.example("eight_dof"), "100 Hz")
    >>> small.coordinates
    ('flywheel', 'hub', 'gear_3', 'gear_4', 'gear_5', 'gear_6', 'gear_7', 'gear_8')
    """
    # check names and method
    check_model(model)
    end = band_end(model, up_to)
    names = [element.name for element in model.elements]
    problems = unknown("keep", keep or (), names)
    if method not in REDUCTIONS:
        rule = f"must be one of {', '.join(REDUCTIONS)}"
        problems.append(Problem("method", shown(method), rule, did_you_mean(method, REDUCTIONS)))
    if problems:
        raise ModelError(problems)
    # subspace of the reduction
    driveline = assemble(model)
    system = driveline.system
    request = requested(driveline, end, margin=margin, keep=keep)
    subspace = REDUCTIONS[method](request)
    if subspace.size == 0:
        rule = "leaves no coordinate: there is no clearance, no torque and no rigid motion to keep"
        raise ModelError(Problem("method", shown(method), rule, "name elements in keep, or widen the band"))
    # error in the band over all contact states
    achieved = accuracy(request, subspace.basis, tuple(range(system.size)))
    if achieved.frequency_error > limit:
        rule = (
            f"puts a frequency in the band off by {100 * achieved.frequency_error:.3g} %; {100 * limit:g} % is allowed"
        )
        raise ModelError(Problem("method", shown(method), rule, "craig-bampton, a larger margin, or more in keep"))
    # matrices in the subspace
    bodies = coordinate_names(model)
    slopes = np.array([law.stiffness[-1] for law in system.laws], dtype=float)
    small = _linear(request, slopes).within(subspace.basis)
    return Condensed(
        method=method,
        basis=subspace.basis,
        inertia_names=bodies,
        coordinates=tuple("" if i < 0 else bodies[i] for i in subspace.coordinates),
        clearances=tuple(names[k] for k in request.clearances),
        rows=system.rows[list(request.clearances)] @ subspace.basis,
        mass=small.mass,
        damping=small.damping,
        stiffness=small.stiffness,
        error=stated(achieved, names, limit),
        _request=request,
        notes=left_out(model),
        units=model.units,
    )


def _linear(request: Request, slopes: Array) -> LinearSystem:
    damping = np.array([law.damping[-1] for law in request.system.laws], dtype=float)
    return linearised(request.system, slopes, damping)
