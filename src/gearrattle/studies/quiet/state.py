"""The state a driveline rests in: a piece for every element, friction that sticks; and the linear motion in it.

While no element leaves its piece and no friction slips, the driveline is linear. About the mean state, in which

    mu a + W^T (K (W q - e - B) + P) = T,      a = Phi rate,

with mu = J where a free train accelerates under its means, or mu = D where its drag brings it to a steady rate, every
order j of the inputs makes

    (-w^2 J + i w D) q + W^T (K + K_stuck + i w C) (W q - e) = T_j,      w = j Omega.

Takes a ``Family``, pieces and a box; gives the deflections as forms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.trains import trains
from gearrattle.engine.system.auxiliary import STICK
from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.engine.system.equilibrium import elastic_elements
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.signals import centre, is_gap
from gearrattle.studies.quiet.coefficients import Family
from gearrattle.studies.quiet.damped import all_decays
from gearrattle.studies.quiet.enclosure import Frame, Solution, centre_of, enclose
from gearrattle.studies.quiet.forms import Array, Form, joined

GAP, STAGE, SLIP, CLIP = range(4)
"""What a bound of a state is: contact is lost or made; a spring changes stage; friction slips; damping is clipped."""


class Corner(NamedTuple):
    """A corner of a piece: its element, its number among all corners, 1 above and -1 below, GAP or STAGE."""

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
        bodies' rates, then deflections from the inner corners.
    orders
        the same of every order, complex amplitudes.
    """

    mean: Form
    orders: tuple[Form, ...]


class State:
    """A piece for every element, and what follows from it alone."""

    def __init__(self, family: Family, pieces: Sequence[int]) -> None:
        system = family.system
        self.family = family
        self.pieces = tuple(pieces)
        firsts = np.cumsum([0, *(law.pieces for law in system.laws)])[:-1].astype(np.int64)
        self.chosen = firsts + np.array(self.pieces, dtype=np.int64)
        sliders = [auxiliary for auxiliary in system.auxiliaries if auxiliary.kind == "slider"]
        self.stuck = [
            (number, slider.element)
            for number, slider in enumerate(sliders)
            if slider.follow[self.pieces[slider.element], STICK] == STICK
        ]
        """Sliders that are engaged, and their elements."""
        clipped = {auxiliary.element for auxiliary in system.auxiliaries if auxiliary.kind == "limiter"}
        self.clipped = [k for k in sorted(clipped) if system.laws[k].stiffness[self.pieces[k]] > 0.0]
        """Elements in contact whose damping may be clipped."""
        self.corners = tuple(_corners(family, self.pieces))

    @cached_property
    def _still(self) -> Frame:
        """The equations of the mean state."""
        system = self.family.system
        size = system.size
        rigid = self._rigid
        count = rigid.shape[1]
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
        """(n, t) rigid motions of the driveline in contact everywhere."""
        system = self.family.system
        return relative_coordinates(system, elastic_elements(system)).angle_from_reference

    @cached_property
    def _turning(self) -> Frame:
        """The equations of one order."""
        system = self.family.system
        unit = np.eye(system.size)
        return Frame(
            np.hstack([unit, system.rows.T]), np.vstack([unit, system.rows]), np.zeros((system.size, system.size))
        )

    @cached_property
    def _dragged(self) -> NDArray[np.bool_]:
        """(n,) bodies of free trains that drag brings to a steady rate."""
        family = self.family
        has_drag = family.system.drag > 0.0
        marked = np.zeros(family.system.size, dtype=np.bool_)
        for bodies, _ in trains(family.system):
            marked[bodies] = has_drag[bodies].any()
        return marked

    @cached_property
    def is_held(self) -> bool:
        """Whether no body floats in a gap: those with a stiffness in their piece hold as many motions as all do."""
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
        if np.any(~stiff & (stiffness.value + stiffness.span > 0.0)):
            return False
        return all_decays(
            family.system.rows, stiff, positive(whole["damping"][self.chosen]), positive(whole["drag"])
        )

    def _means(self, numbers: dict[str, Form]) -> tuple[Form, Form, Form]:
        """Factors, drive and shift of the mean state."""
        dragged = self._dragged
        bodies = Form(
            np.where(dragged, numbers["drag"].value, numbers["inertia"].value),
            np.where(dragged, numbers["drag"].slopes, numbers["inertia"].slopes),
            np.where(dragged, numbers["drag"].rest, numbers["inertia"].rest),
        )
        nothing = bodies.plus(bodies, -1.0)
        nothing = Form(nothing.value, nothing.slopes, np.zeros(nothing.rest.shape))
        force = numbers["force"][self.chosen]
        shift = numbers["lasting_error"].plus(numbers["inner"][self.chosen])
        return (
            joined(bodies, numbers["stiffness"][self.chosen]),
            joined(numbers["mean"], Form(-force.value, -force.slopes, force.rest)),
            joined(nothing, shift),
        )

    def rest_at(self, numbers: dict[str, Form]) -> NDArray[np.generic] | None:
        """Return bodies' rates and deflections from the inner corners at the centre of a box."""
        factor, drive, shift = self._means(numbers)
        return centre_of(self._still, factor.value, drive.value, shift.value)

    def motion(self, numbers: dict[str, Form]) -> tuple[Motion | None, Array]:
        """Return the linear motion over a box, None where it is too large; and how every parameter bends it."""
        mean, bent = enclose(self._still, *self._means(numbers))
        if mean is None:
            return None, bent
        system = self.family.system
        cycles = system.inputs.cycles[system.inputs.cycles > 0.0]
        orders = []
        for order, cycle in enumerate(cycles.tolist()):
            solution, curved = self._order(numbers, order, cycle, cycles.size)
            bent = np.maximum(bent, curved)
            if solution is None:
                return None, bent
            orders.append(solution.view)
        return Motion(mean.view, tuple(orders)), bent

    def _order(self, numbers: dict[str, Form], order: int, cycle: float, count: int) -> tuple[Solution | None, Array]:
        """The motion at one order."""
        rate = numbers["rate"]
        rate = Form(cycle * rate.value, cycle * rate.slopes, cycle * rate.rest)
        bodies = _complex(
            _scaled(numbers["inertia"].times(rate.times(rate)), -1.0), numbers["drag"].times(rate)
        )
        elements = _complex(self.spring(numbers), numbers["damping"][self.chosen].times(rate))
        every = slice(order, None, count)
        torque = _complex(numbers["torque_cosine"][every], _scaled(numbers["torque_sine"][every], -1.0))
        error = _complex(numbers["error_cosine"][every], _scaled(numbers["error_sine"][every], -1.0))
        no_force = _nothing(error)
        no_error = _nothing(torque)
        return enclose(self._turning, joined(bodies, elements), joined(torque, no_force), joined(no_error, error))

    def spring(self, numbers: dict[str, Form]) -> Form:
        """Return the stiffness of every element, with the springs of friction that sticks."""
        stiffness = numbers["stiffness"][self.chosen]
        out = Form(stiffness.value.copy(), stiffness.slopes.copy(), stiffness.rest.copy())
        for number, element in self.stuck:
            one = numbers["spring"][number]
            out.value[element] += one.value
            out.slopes[:, element] += one.slopes
            out.rest[element] += one.rest
        return out


def _scaled(form: Form, factor: complex) -> Form:
    return Form(factor * form.value, factor * form.slopes, abs(factor) * form.rest)


def _nothing(form: Form) -> Form:
    return Form(np.zeros_like(form.value), np.zeros_like(form.slopes), np.zeros_like(form.rest))


def _complex(real: Form, imaginary: Form) -> Form:
    """The form of complex numbers, from their parts."""
    return real.plus(imaginary, 1j)


def _corners(family: Family, pieces: Sequence[int]) -> list[Corner]:
    """The corners that pieces have."""
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
