"""State of rest of a driveline: one piece for every element, all friction sticking; and the linear motion about it.

While no element leaves its piece and no friction slips, the driveline is linear: F = K (W q - e - B) + P, with q the
angles, W q - e the deflections, e the transmission errors, B the corner at a piece's inner end and P the force there
(``coefficients``). The mean state obeys

    mu a + W^T (K (W q - e - B) + P) = T,      a = Phi rate.

Phi are the rigid-body motions and rate their unknown sizes, T the mean torques. Where drag brings a free train to a
steady speed, mu = D and a are speeds; elsewhere mu = J and a are accelerations. Every order j of the inputs makes

    (-w^2 J + i w D) q + W^T (K + K_stuck + i w C) (W q - e) = T_j,      w = j Omega.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.auxiliary import STICK
from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.engine.system.equilibrium import elastic_elements
from gearrattle.engine.system.free_trains import trains
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.signals import centre, is_gap
from gearrattle.studies.quiet.coefficients import Family
from gearrattle.studies.quiet.decay_proof import all_decays
from gearrattle.studies.quiet.enclosure import Frame, centre_of, enclose
from gearrattle.studies.quiet.taylor_forms import Array, Form, Matrix, joined, zeros

GAP, STAGE, SLIP, CLIP = range(4)
"""What ends a state: a gap opens or closes; a spring changes its stage; friction slips; contact damping is clipped."""


class Corner(NamedTuple):
    """A corner of a piece.

    The element, the corner's number among all corners, its side (1 above, -1 below), its kind (GAP or STAGE).
    """

    element: int
    number: int
    side: int
    kind: int


@dataclass(frozen=True)
class Motion:
    """The linear motion over a box.

    Attributes
    ----------
    mean
        (M,) speeds or accelerations of the bodies, then deflections measured from the inner corners.
    orders
        (H, M) complex amplitudes of the bodies' angles, then of the deflections.
    """

    mean: Form
    orders: Form


class State:
    """One piece for every element, and what follows from the pieces alone."""

    def __init__(self, family: Family, pieces: Sequence[int]) -> None:
        system = family.system
        self.family = family
        self.pieces = tuple(pieces)
        firsts = np.cumsum([0, *(law.pieces for law in system.laws)])[:-1].astype(np.int64)
        self.piece_numbers = firsts + np.array(self.pieces, dtype=np.int64)
        sliders = [auxiliary for auxiliary in system.auxiliaries if auxiliary.kind == "slider"]
        self.stuck = [
            (number, slider.element)
            for number, slider in enumerate(sliders)
            if slider.follow[self.pieces[slider.element], STICK] == STICK
        ]
        """(number, element) of every slider that is engaged in its piece."""
        clipped = {auxiliary.element for auxiliary in system.auxiliaries if auxiliary.kind == "limiter"}
        self.clipped = [k for k in sorted(clipped) if system.laws[k].stiffness[self.pieces[k]] > 0.0]
        """Elements in contact whose damping may be clipped."""
        self.corners = tuple(_corners(family, self.pieces))

    @cached_property
    def corner_columns(self) -> tuple[Array, NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """Side, element, number and kind of all corners, (B,) each."""
        element, number, side, kind = np.array(self.corners, dtype=np.int64).reshape(-1, 4).T
        return side.astype(float), element, number, kind

    @cached_property
    def _mean_equations(self) -> Frame:
        """The equations of the mean state."""
        system = self.family.system
        size = system.size
        rigid = self._rigid
        count = rigid.shape[1]
        # U and V of ``enclosure``: bodies first, then elements
        spread = np.zeros((size + count, size + len(system.laws)))
        spread[:size] = np.hstack([np.eye(size), system.rows.T])
        view = np.zeros((size + len(system.laws), size + count))
        view[:size, size:] = rigid
        view[size:, :size] = system.rows
        constant = np.zeros((size + count, size + count))
        constant[size:, :size] = rigid.T
        return Frame(spread, view, constant)

    @cached_property
    def _rigid(self) -> Array:
        """(n, t) rigid-body motions of the driveline with every element in contact."""
        system = self.family.system
        return relative_coordinates(system, elastic_elements(system)).angle_from_reference

    @cached_property
    def _order_equations(self) -> Frame:
        """The equations of one order."""
        system = self.family.system
        unit = np.eye(system.size)
        return Frame(
            np.hstack([unit, system.rows.T]), np.vstack([unit, system.rows]), np.zeros((system.size, system.size))
        )

    @cached_property
    def _dragged(self) -> NDArray[np.bool_]:
        """(n,) bodies of free trains that drag brings to a steady speed."""
        family = self.family
        has_drag = family.system.drag > 0.0
        marked = np.zeros(family.system.size, dtype=np.bool_)
        for bodies, _ in trains(family.system):
            marked[bodies] = has_drag[bodies].any()
        return marked

    @cached_property
    def is_held(self) -> bool:
        """Whether no body floats in a gap.

        Elements with stiffness in their piece then allow no more rigid-body motions than all elements do.
        """
        system = self.family.system
        firm = [k for k, (law, p) in enumerate(zip(system.laws, self.pieces, strict=True)) if law.stiffness[p] > 0.0]
        return relative_coordinates(system, firm).angle_from_reference.shape == self._rigid.shape

    @cached_property
    def decays(self) -> bool:
        """Whether every elastic mode decays, in the whole box."""
        family = self.family
        whole = family.over(np.zeros(len(family.numbers.linear)), np.ones(len(family.numbers.linear)))

        def positive(form: Form) -> NDArray[np.bool_]:
            return np.asarray(form.value - form.span - form.rest > 0.0)

        stiffness = self.spring(whole)
        stiff = positive(stiffness)
        # a stiffness whose sign is not the same in the whole box
        if np.any(~stiff & (stiffness.value + stiffness.span > 0.0)):
            return False
        return all_decays(
            family.system.rows, stiff, positive(whole["damping"].at(self.piece_numbers)), positive(whole["drag"])
        )

    def _means(self, numbers: dict[str, Form]) -> tuple[Form, Form, Form]:
        """Return m, g and s of ``enclosure`` for the mean state, (1, M) each, bodies first."""
        drag = numbers["drag"]
        inertia = numbers["inertia"]
        pairs = zip(drag, inertia, strict=True)
        bodies = Form(*(np.where(self._dragged, one, other) for one, other in pairs))
        shift = numbers["lasting_error"].plus(numbers["inner"].at(self.piece_numbers))
        return (
            joined(bodies, numbers["stiffness"].at(self.piece_numbers)).rows(1),
            joined(numbers["mean"], numbers["force"].at(self.piece_numbers).scaled(-1.0)).rows(1),
            joined(zeros(len(drag.slopes), drag.rest.size), shift).rows(1),
        )

    def rest_at(self, numbers: dict[str, Form]) -> Matrix | None:
        """Return ``Motion.mean`` at the centre of a box."""
        factor, drive, shift = self._means(numbers)
        return centre_of(self._mean_equations, factor.value[0], drive.value[0], shift.value[0])

    def motion(self, numbers: dict[str, Form]) -> tuple[Motion | None, Array]:
        """Return the linear motion over a box, None if the box is too large for a bound; and (d,) how strongly every
        parameter bends it.
        """
        mean, bent = enclose(self._mean_equations, *self._means(numbers))
        orders, bent_by_orders = enclose(self._order_equations, *self._orders(numbers))
        bent = np.maximum(bent, bent_by_orders)
        if mean is None or orders is None:
            return None, bent
        return Motion(Form(mean.value[0], mean.slopes[:, 0], mean.rest[0]), orders), bent

    def _orders(self, numbers: dict[str, Form]) -> tuple[Form, Form, Form]:
        """Return m, g and s of ``enclosure`` for every order above zero, (H, M) each, bodies first."""
        cycles = positive_orders(self.family.system)
        count = len(numbers["rate"].slopes)
        rate = numbers["rate"].rows(1).scaled(cycles[:, None])  # (H, 1)
        inertia, drag = (numbers[name].rows(1) for name in ("inertia", "drag"))
        bodies = inertia.times(rate.times(rate)).scaled(-1.0).plus(drag.times(rate), 1j)
        loss = numbers["damping"].at(self.piece_numbers).rows(1).times(rate)
        elements = loss.scaled(1j).plus(self.spring(numbers).rows(1))
        torque, error = (
            numbers[f"{what}_cosine"].plus(numbers[f"{what}_sine"], -1j).rows(cycles.size)
            for what in ("torque", "error")
        )
        sizes = self.family.system.size, len(self.pieces)
        no_error, no_force = (zeros(count, cycles.size, size) for size in sizes)
        return joined(bodies, elements), joined(torque, no_force), joined(no_error, error)

    def spring(self, numbers: dict[str, Form]) -> Form:
        """Return the stiffness of every element, with the springs of friction that sticks."""
        out = numbers["stiffness"].at(self.piece_numbers)
        for number, element in self.stuck:
            for to, part in zip(out, numbers["spring"], strict=True):
                to[..., element] += part[..., number]
        return out


def positive_orders(system: PiecewiseSystem) -> Array:
    """(H,) the orders above zero, in cycles per period."""
    return np.asarray(system.inputs.cycles[system.inputs.cycles > 0.0])


def _corners(family: Family, pieces: Sequence[int]) -> list[Corner]:
    """Return every corner that bounds a piece."""
    system: PiecewiseSystem = family.system
    layout = family.driveline.layout
    corners = []
    first = 0
    clearance = {element: index for index, element in enumerate(system.clearances)}
    for k, (law, piece) in enumerate(zip(system.laws, pieces, strict=True)):
        label = piece + law.first_label
        for side, number in ((1, piece), (-1, piece - 1)):
            if not 0 <= number < law.corners.size:
                continue
            kind = STAGE
            if is_gap(layout, clearance[k]):
                inner = centre(layout, clearance[k])
                kind = GAP if (label in inner) != (label + side in inner) else STAGE
            corners.append(Corner(k, first + number, side, kind))
        first += law.corners.size
    return corners
