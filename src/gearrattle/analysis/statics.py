"""Static equilibrium and modes of a model, with its names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.linear import linear_modes as modal
from gearrattle.analysis.train_notes import train_notes
from gearrattle.assembly import (
    Driveline,
    assemble,
    balancing_means,
    coordinate_names,
    free_names,
    free_of,
    left_out,
    prescribed_indices,
    with_prescribed,
)
from gearrattle.engine.system import equilibrium as statics
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model, check_model
from gearrattle.model.value_kinds import FLAG, Count, argument_problems, check_arguments
from gearrattle.result import Result
from gearrattle.trajectory import Layout

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Equilibrium(Result):
    """Static equilibrium under the mean loads.

    Attributes
    ----------
    model
        the driveline.
    angle
        (n,) [rad]; the last inertia of every free train at zero.
    deflection
        by element name [rad or m].
    region
        by name of every element with a corner.
    acceleration
        (n,) uniform acceleration of trains whose mean torques do not balance [rad/s^2].
    balance
        by inertia, the mean of a torque on it that says "balance" [N m].
    notes
        what the user must know.
    displacement
        by direction, "gear.x", of bodies with a mass [m].
    bearing_force
        of bearings on their bodies, by "front.x", "front.y" [N].

    Examples
    --------
    >>> gr.equilibrium(gr.example("case3")).region
    {'clutch': 1, 'spline': 1, 'gear': 1}
    """

    kind: ClassVar[str] = "equilibrium"
    model: Model = field(repr=False, compare=False)
    angle: Array
    deflection: dict[str, float]
    region: dict[str, int]
    acceleration: Array
    balance: dict[str, float]
    notes: tuple[str, ...]
    displacement: dict[str, float] = field(default_factory=dict)
    bearing_force: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Modes(Result):
    """Natural modes, where their energy is, and what excites them.

    A share in ``kinetic_energy`` reads two ways: down its column, where the mode moves; along its row, how the energy
    of a unit impulse on that inertia spreads over the modes. A row of ``strain_energy`` says how the energy
    of a sudden step of transmission error in that element spreads. Of modes of one frequency only sums of shares mean
    anything, as any combination of them is a mode too.

    Attributes
    ----------
    model
        the driveline.
    frequencies
        (n,) [rad/s], ascending; 0 for rigid motion.
    damping_ratios
        (n,); NaN for rigid motion.
    shapes
        (n inertias, n modes), largest entry of each mode 1; of a body that moves sideways also the displacements,
        in metres where the inertias turn by radians.
    inertia_names
        (n,) free inertias, then directions, such as "gear.x".
    element_names
        (m,) couplings, then meshes.
    modal_inertia
        (n,) phi^T J phi of these shapes [kg m^2]; [kg] of a mode whose largest entry is a displacement.
    strain_energy
        (m elements, n modes) k_k (w_k phi)^2 / (phi^T K phi); a column adds up to 1, and is NaN for
        rigid motion, which stores none.
    kinetic_energy
        (n inertias, n modes) J_i phi_i^2 / (phi^T J phi); columns and rows add up to 1.
    participation
        (n inertias, n modes) phi_i^2 / (phi^T J phi), the modal constant of the acceleration of an
        inertia by a unit torque on it (Ewins, Modal Testing, 2nd ed. 2000, sec. 2.4); a row adds up to 1 / J_i
        [1/(kg m^2)], of a direction to 1 / m [1/kg].
    sources
        (p,) what shakes the driveline: inertias with torque harmonics, inertias whose motion is prescribed by
        harmonics, meshes with transmission errors.
    excitation
        (p, n modes) the share of a source's energy that goes into each mode: the row of
        ``kinetic_energy`` or ``strain_energy``, 0 for a transmission error in rigid motion; of a prescribed motion the
        share of the energy that a sudden step of its angle puts into the elements at the inertia.
    notes
        what the modes leave out: friction and the clipping of contact damping.

    Examples
    --------
    >>> gr.modes(gr.example("case3")).shapes.shape
    (4, 4)
    """

    kind: ClassVar[str] = "modes"
    model: Model = field(repr=False, compare=False)
    frequencies: Array
    damping_ratios: Array
    shapes: Array
    inertia_names: tuple[str, ...]
    element_names: tuple[str, ...]
    modal_inertia: Array
    strain_energy: Array
    kinetic_energy: Array
    participation: Array
    sources: tuple[str, ...]
    excitation: Array
    notes: tuple[str, ...] = ()

    def works_in(self, mode: int, least: float = 0.05) -> dict[str, float]:
        """Elements with at least this share of a mode's strain energy, largest first; none for rigid motion.

        Parameters
        ----------
        mode
            its column.
        least
            smallest share listed; the largest is always listed.
        """
        return _largest(self.element_names, self.strain_energy[:, mode], least)

    def excited_by(self, mode: int, least: float = 0.001) -> dict[str, float]:
        """Sources of which at least this share of energy goes into a mode, largest first.

        Parameters
        ----------
        mode
            its column.
        least
            smallest share listed.
        """
        shares = self.excitation[:, mode]
        return {name: share for name, share in _largest(self.sources, shares, least).items() if share >= least}

    @property
    def has_directions(self) -> bool:
        """Whether bodies move sideways."""
        return any(inertia.mass is not None for inertia in self.model.inertias)

    def repeated(self) -> tuple[tuple[int, ...], ...]:
        """Groups of modes, by column, that share one frequency to nine digits; rigid motions are none."""
        groups: list[list[int]] = []
        for mode in np.flatnonzero(self.frequencies > 0.0).tolist():
            near = groups and self.frequencies[mode] <= self.frequencies[groups[-1][-1]] * (1.0 + 1e-9)
            if near:
                groups[-1].append(mode)
            else:
                groups.append([mode])
        return tuple(tuple(group) for group in groups if len(group) > 1)

    def moves(self, mode: int, least: float = 0.05) -> dict[str, float]:
        """Inertias with at least this share of a mode's kinetic energy, largest first.

        Parameters
        ----------
        mode
            its column.
        least
            smallest share listed; the largest is always listed.
        """
        return _largest(self.inertia_names, self.kinetic_energy[:, mode], least)


def _largest(names: tuple[str, ...], shares: Array, least: float) -> dict[str, float]:
    """Names and shares, the largest first, down to the smallest one listed."""
    order = [k for k in np.argsort(-shares, kind="stable").tolist() if np.isfinite(shares[k])]
    return {names[k]: float(shares[k]) for j, k in enumerate(order) if j == 0 or shares[k] >= least}


def equilibrium(model: Model) -> Equilibrium:
    """Static equilibrium under the mean loads, transmission errors at zero.

    Parameters
    ----------
    model
        the driveline.

    Returns
    -------
    Equilibrium
        Angles, deflections and regions by name, and what must be noted.

    Raises
    ------
    ModelError
        an element of zero last slope cannot carry its load; it is named.

    Examples
    --------
    >>> rest = gr.equilibrium(gr.example("case3"))
    >>> round(rest.deflection["clutch"], 5), rest.region["gear"]
    (0.16659, 1)
    """
    check_model(model)
    return named_equilibrium(assemble(model))[0]


def named_equilibrium(driveline: Driveline) -> tuple[Equilibrium, statics.PositionAtRest]:
    """Return the equilibrium with names, and the position at rest by index."""
    model = driveline.model
    system = driveline.system
    names = driveline.layout.element_names
    # mean loads that no last stage carries
    try:
        rest = statics.equilibrium(system)
    except statics.Runaway as runaway:
        which = ", ".join(names[k] for k in runaway.elements)
        problem = Problem(
            f"elements {which}",
            "a mean load",
            "the last stage has no stiffness and cannot carry it: no static equilibrium",
            'balance the mean torques (mean = "balance"), give the last stage a stiffness, or start from '
            'initial = "zero"',
        )
        raise ModelError(problem) from None
    # notes on free trains, middled gaps and what equilibrium leaves out
    notes = train_notes(system, coordinate_names(model), rest, si=model.units == "SI")
    notes += _middled(driveline.layout, rest.middled)
    notes += left_out(model)
    # results by name
    region = {names[k]: rest.pieces[k] + system.laws[k].first_label for k in system.clearances}
    deflection = dict(zip(names, rest.deflection.tolist(), strict=True))
    held = np.zeros(len(model.motions))
    angle, acceleration = (with_prescribed(model, values, held) for values in (rest.angle, rest.acceleration))
    balance = {model.torques[i].on: float(mean) for i, mean in balancing_means(model).items()}
    # displacements, and forces of bearings
    layout = driveline.layout
    displacement = dict(zip(layout.direction_names, rest.angle[free_of(model).size :].tolist(), strict=True))
    elastic = [law.elastic(value) for law, value in zip(system.laws, rest.deflection.tolist(), strict=True)]
    force = dict(zip(layout.bearing_names, (layout.bearing_rows @ elastic).tolist(), strict=True))
    by_name = (angle, deflection, region, acceleration, balance, tuple(notes), displacement, force)
    return Equilibrium(model, *by_name), rest


def _middled(layout: Layout, middled: Sequence[int]) -> list[str]:
    """Note gaps without load, which are taken at their middle; of a ring in contact that its body may roll."""
    loose = {element: layout.element_names[element] for element in middled}
    notes = []
    if not layout.bearing_names:
        return [f"{name}: the free gap carries no load and is taken at its middle." for name in loose.values()]
    from gearrattle.signals import rings

    for ring in rings(layout):
        faces = layout.clearance[list(ring.clearances)].tolist()
        free = [loose.pop(face) for face in faces if face in loose]
        if len(free) == len(faces):
            notes.append(f"{ring.name}: the free gap carries no load and is taken at its middle.")
        elif free:
            notes.append(f"{ring.name}: nothing holds its body along the face on which it rests; its middle is taken.")
    return [*(f"{name}: the free gap carries no load and is taken at its middle." for name in loose.values()), *notes]


def modes(
    model: Model,
    contact_ratio: Mapping[str, float] | None = None,
    region: Mapping[str, int] | None = None,
    *,
    with_damping: bool = False,
) -> Modes:
    """Undamped natural frequencies, damping ratios, shapes, and the elements, inertias and loads of every mode.

    Parameters
    ----------
    model
        the driveline.
    contact_ratio
        Gamma by element name: the slope becomes Gamma K, K the slope of the last drive stage (sec. 6 of
        Padmanabhan et al. 1995).
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
    >>> modes = gr.modes(gr.example("case3"))
    >>> [round(float(frequency), 1) for frequency in modes.frequencies]
    [0.0, 338.8, 6148.4, 37035.3]
    """
    check_model(model)
    check_arguments(with_damping=(FLAG, with_damping))
    driveline = assemble(model)
    stiffness, damping = slopes(driveline, contact_ratio, region, with_damping=with_damping)
    data = modal.modes(driveline.system, stiffness, damping)
    sources, excitation = _excitation(driveline, data, stiffness)
    return Modes(
        model=model,
        frequencies=data.frequencies,
        damping_ratios=data.damping_ratios,
        shapes=data.shapes,
        inertia_names=coordinate_names(model),
        element_names=driveline.layout.element_names,
        modal_inertia=data.modal_inertia,
        strain_energy=data.strain_energy,
        kinetic_energy=data.kinetic_energy,
        participation=data.kinetic_energy / driveline.system.inertia[:, None],
        sources=sources,
        excitation=excitation,
        notes=left_out(model),
    )


def torque_source(name: str) -> str:
    """Name of a harmonic torque on this inertia among the sources."""
    return f"torque on {name}"


def motion_source(name: str) -> str:
    """Name of a prescribed motion of this inertia among the sources."""
    return f"motion of {name}"


def _excitation(driveline: Driveline, data: modal.ModalData, stiffness: Array) -> tuple[tuple[str, ...], Array]:
    """Sources in file order, and the share of each one's energy by mode; the slopes (m,) are those of the modes."""
    model = driveline.model
    loaded = {t.on for t in model.torques if t.signal is not None or t.ramps or any(h.amplitude for h in t.harmonics)}
    shares = {torque_source(name): data.kinetic_energy[i] for i, name in enumerate(free_names(model)) if name in loaded}
    for motion, inertia in zip(model.motions, prescribed_indices(model).tolist(), strict=True):
        if any(h.amplitude for h in motion.harmonics):
            shares[motion_source(motion.on)] = _shares_of_motion(driveline, data, stiffness, inertia)
    for k, element in enumerate(model.elements):
        if any(h.amplitude for h in element.errors):
            shares[element.error_words] = np.nan_to_num(data.strain_energy[k])
    return tuple(shares), np.array(list(shares.values())).reshape(-1, data.frequencies.size)


def _shares_of_motion(driveline: Driveline, data: modal.ModalData, stiffness: Array, inertia: int) -> Array:
    """(n modes,) shares of the energy that a step of a prescribed angle puts into the elements: as for an error of one.

    (sum_k K_k w_ka w_k phi)^2 / (omega^2 phi^T J phi), over sum_k K_k w_ka^2.
    """
    arm = driveline.layout.rows[:, inertia]
    pull = (stiffness * arm) @ driveline.system.rows @ data.shapes
    whole_energy = float(stiffness @ arm**2)
    elastic = data.frequencies > 0.0
    shares = np.zeros(data.frequencies.size)
    if whole_energy > 0.0:
        stored = data.frequencies[elastic] ** 2 * data.modal_inertia[elastic]
        shares[elastic] = pull[elastic] ** 2 / stored / whole_energy
    return shares


def slopes(
    driveline: Driveline,
    contact_ratio: Mapping[str, float] | None,
    region: Mapping[str, int] | None,
    *,
    with_damping: bool = False,
) -> tuple[Array, Array]:
    """(m,) slope and (m,) damping of every element; arguments and errors as of ``modes``."""
    names = driveline.layout.element_names
    system = driveline.system
    contact_ratio = dict(contact_ratio or {})
    region = dict(region or {})
    # names that no element has, ratios outside 0 to 1
    problems = [
        Problem(f"{kind}: {name}", name, f"there is no such element; there are {', '.join(names)}")
        for kind, named in (("contact_ratio", contact_ratio), ("region", region))
        for name in named
        if name not in names
    ]
    problems += [
        Problem(f"contact_ratio: {name}", f"{ratio}", "must lie between 0 and 1")
        for name, ratio in contact_ratio.items()
        if not 0 <= ratio <= 1
    ]
    # slope and damping of the piece chosen, reduced by the contact ratio
    stiffness = np.empty(len(names))
    damping = np.empty(len(names))
    for k, (name, law) in enumerate(zip(names, system.laws, strict=True)):
        first = law.first_label
        last = law.first_label + law.pieces - 1
        label = region.get(name, last)
        if argument_problems({name: (Count(first, last), label)}):
            problems.append(
                Problem(f"region: {name}", str(label), f"must be a whole number, one of {first} ... {last}")
            )
            continue
        piece = label - first
        ratio = contact_ratio.get(name, 1.0)
        stiffness[k] = ratio * law.stiffness[piece]
        damping[k] = (ratio if with_damping else 1.0) * law.damping[piece]
    if problems:
        raise ModelError(problems)
    return stiffness, damping
