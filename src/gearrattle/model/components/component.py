"""Base of components: a component makes one or more elements, and an element is one deflection with its law.

    delta = sum_i w_i theta_i - e(t),      torque on body i:  -w_i F(delta, delta')

A component is a table of the model file. Its class defines the keys (fields and ``rules``), the bodies it names and the
elements it makes. All other packages use elements only. ``COMPONENTS`` in ``__init__.py`` lists all components.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import cos, sin
from typing import Annotated, Any, ClassVar, NamedTuple, Protocol

from gearrattle.model import units
from gearrattle.model.components.alternation import Alternation
from gearrattle.model.excitation import Harmonic
from gearrattle.model.table import Location
from gearrattle.model.table_symbol import Shown, Symbol
from gearrattle.model.value_kinds import GROUND, Name, Quantity

TorsionalStiffness = Annotated[float, Quantity(units.TORSIONAL_STIFFNESS, "non-negative")]
TorsionalDamping = Annotated[float, Quantity(units.TORSIONAL_DAMPING, "non-negative")]
LinearStiffness = Annotated[float, Quantity(units.LINEAR_STIFFNESS, "non-negative")]
LinearDamping = Annotated[float, Quantity(units.LINEAR_DAMPING, "non-negative")]
Radius = Annotated[float, Quantity(units.LENGTH, "positive")]
Gap = Annotated[float, Quantity(units.LENGTH, "non-negative")]


DRIVE = "-drive"
COAST = "-coast"
"""After the name of a mesh, of its flanks that are elements of their own."""


class Piece(NamedTuple):
    """One linear piece of a law, from the centre outward.

    Attributes
    ----------
    stiffness
        slope [N m/rad or N/m].
    damping
        [N m s/rad or N s/m].
    until
        magnitude of the deflection at which the piece ends [rad or m]; None for the last piece.
    hysteresis
        full height of the friction loop in this piece [N m].
    stick_stiffness
        stiffness of the sliders' springs in this piece [N m/rad].
    """

    stiffness: float
    damping: float
    until: float | None
    hysteresis: float = 0.0
    stick_stiffness: float = 0.0


def line_of_action(pressure_angle: float, centre_line: float, way: float) -> tuple[float, float]:
    """Return n_d of the drive flank (way 1), or -n_c of the coast flank (-1): the direction of its pull on the first
    gear, (sin a, cos a) or (-sin a, cos a) turned by the angle of the line of centres.
    """
    along = way * sin(pressure_angle)
    across = cos(pressure_angle)
    turn = centre_line
    return along * cos(turn) - across * sin(turn), along * sin(turn) + across * cos(turn)


class Push(NamedTuple):
    """How an element sees the displacement of a body: ``x u_x + y u_y`` is added to its deflection.

    Attributes
    ----------
    body
        that is displaced; one without a mass never is.
    x, y
        of the direction in which it pulls on the body.
    """

    body: str
    x: float
    y: float


@dataclass(frozen=True)
class Element:
    """One deflection and its law, in words and SI numbers.

    Attributes
    ----------
    name
        unique among all elements of a model.
    path
        of the component in the model file, such as "coupling.clutch".
    along_line
        True: the deflection is a length along a line of action [m], and F is a force [N]. False: the deflection is an
        angle [rad], and F is a torque [N m].
    arms
        bodies and the factors w_i of their angles [m or 1]; ground has none.
    between
        the two bodies at its ends; "ground" for the frame.
    radii
        (R_a, R_b) of these [m]; (1, 1) for a torsional element, (0, 0) for a bearing, which turns nothing. R_a refers
        the force to the first.
    drive, coast
        the law for delta > 0 and for delta < 0 (positive magnitudes), from the centre outward.
    preload
        force at delta = 0 [N m].
    errors
        e(t) = sum of amplitude sin(order Omega t + phase) [rad or m].
    error_key
        key of the component that holds the errors; empty if the errors follow from other keys.
    load_ripple
        torque on the first body per unit of the mean load, sum of amplitude sin(order Omega t + phase).
    contact_damping
        "kelvin-voigt" or "clipped".
    alternation
        how the stiffness alternates with the tooth pairs in contact; None if it does not.
    pushes
        how it sees displacements of bodies with a mass.
    """

    name: str
    path: str
    along_line: bool
    arms: tuple[tuple[str, float], ...]
    between: tuple[str, str]
    radii: tuple[float, float]
    drive: tuple[Piece, ...]
    coast: tuple[Piece, ...]
    preload: float = 0.0
    errors: tuple[Harmonic, ...] = ()
    error_key: str = ""
    load_ripple: tuple[Harmonic, ...] = ()
    contact_damping: str = "kelvin-voigt"
    alternation: Alternation | None = None
    pushes: tuple[Push, ...] = ()

    @property
    def error_words(self) -> str:
        """Name of its errors in words."""
        return f"{'transmission' if self.along_line else 'kinematic'} error of {self.name}"

    @property
    def rubs(self) -> bool:
        """Whether dry friction acts in any stage."""
        return any(piece.hysteresis for piece in (*self.drive, *self.coast))


class Body(NamedTuple):
    """A body that a table names: location and name as written, and why it must not be ground (empty: it may be)."""

    location: Location
    name: object
    no_ground: str = ""
    remedy: str = ""


Number = Any
PieceColumns = tuple[Number, Number, Number | None]
"""Slope, damping and end of a piece: numbers, or columns with one number for every variant."""


class Leaf(Protocol):
    """Reads one number of a component: the number itself, or a column of values if it is varied."""

    def __call__(self, key: str, value: float, /) -> Number:
        """Return number or column for a key such as ``stages.0.stiffness``; ``value`` is the number in the model."""
        ...


class Component(Shown):
    """A table that makes elements."""

    gap_symbol: ClassVar[Symbol | None] = None
    """Symbol for drawings if an element has a gap; None: the same symbol as without a gap."""
    plural: ClassVar[str]
    """Plural of ``noun``."""
    scaling: ClassVar[Mapping[str, Any]]
    """Kind of quantity (a key of ``Scales.units``) of every key whose number has a dimension."""
    name: Name
    """Unique among all elements."""

    def elements(self) -> tuple[Element, ...]:
        """Return the elements of the component in order."""
        raise NotImplementedError

    def sides(self, leaf: Leaf, element: Element, /) -> tuple[Sequence[PieceColumns], Sequence[PieceColumns]]:  # noqa: ARG002
        """Return drive side and coast side of the law of one of its elements, with all numbers read by ``leaf``."""
        drive, coast = ([(p.stiffness, p.damping, p.until) for p in side] for side in (element.drive, element.coast))
        return drive, coast

    def added_inertia(self) -> Mapping[str, float]:
        """Return by body the inertia that it adds to the J in the file [kg m^2]."""
        return {}

    def notes(self) -> tuple[str, ...]:
        """Return notes for the user."""
        return ()

    def written_out(self, table: dict[str, Any], /) -> dict[str, Any]:
        """Return its table with only numbers that ``scaling`` can scale; J of the model includes ``added_inertia``."""
        return table

    @property
    def keeps_bodies(self) -> bool:
        """Whether a reduction must not lump its bodies with others."""
        return False

    def between_groups(self, to: Mapping[str, tuple[str, float]], /) -> tuple[str, dict[str, Any]]:
        """Return name of the array of tables, and the table, for the component between groups of bodies.

        ``to`` has for every body the body kept for its group, and the ratio of its angle to the angle of this body.
        """
        raise NotImplementedError

    @classmethod
    def element_names(cls, table: Mapping[str, Any], /) -> Iterator[tuple[Location, str]]:
        """Yield location and name of every element; the table is not validated yet."""
        if isinstance(name := table.get("name"), str):
            yield ("name",), name

    @classmethod
    def bodies(cls, table: Mapping[str, Any], /) -> Iterator[Body]:
        """Yield the bodies that a table names, as written in the file."""
        between = table.get("between")
        if isinstance(between, (list, tuple)) and len(between) == 2:
            for end in between:
                yield Body(("between",), end)


def multiply(table: dict[str, Any], factors: Mapping[str, float]) -> None:
    """Multiply numbers of a table by factors, if the table has these keys."""
    for key, factor in factors.items():
        if table.get(key) is not None:
            table[key] *= factor


def arms_of(between: tuple[str, str], factors: tuple[float, float]) -> tuple[tuple[str, float], ...]:
    """Return the arms of an element between two bodies; ground has none."""
    return tuple((body, factor) for body, factor in zip(between, factors, strict=True) if body != GROUND)
