"""Base of components: each makes elements, and an element is one deflection with its law.

    delta = sum_i w_i theta_i - e(t),      torque on body i:  -w_i F(delta, delta')

A component is a table of the model file. It defines its keys (fields and ``rules``), the bodies it names and the
elements it makes. The rest of the package knows elements only. ``COMPONENTS`` in ``__init__.py`` lists all components.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
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


class Piece(NamedTuple):
    """One linear piece of a law, from the centre outward.

    Attributes
    ----------
    stiffness
        slope [N m/rad or N/m].
    damping
        [N m s/rad or N s/m].
    until
        where the piece ends, a positive magnitude of the deflection [rad or m]; None for the last.
    hysteresis
        full height of the friction loop in this piece [N m].
    stick_stiffness
        of the springs that stick in it [N m/rad].
    """

    stiffness: float
    damping: float
    until: float | None
    hysteresis: float = 0.0
    stick_stiffness: float = 0.0


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
        whether the deflection is a length on a line of action [m] and the force a force [N]; otherwise an
        angle [rad] and a torque [N m].
    arms
        bodies and the factors w_i of their angles [m or 1]; ground has none.
    between
        the two bodies it lies between; "ground" for the frame.
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
        key of the component under which these stand; what has none follows from other keys.
    load_ripple
        torque on the first body for a unit of the mean load, sum of amplitude sin(order Omega t + phase).
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
        """What its errors are called."""
        return f"{'transmission' if self.along_line else 'kinematic'} error of {self.name}"

    @property
    def rubs(self) -> bool:
        """Whether dry friction acts in any stage."""
        return any(piece.hysteresis for piece in (*self.drive, *self.coast))


class Body(NamedTuple):
    """A body that a table names: where, the name as written, and why it may not be ground (empty: it may)."""

    location: Location
    name: object
    no_ground: str = ""
    remedy: str = ""


Number = Any
PieceColumns = tuple[Number, Number, Number | None]
"""Slope, damping and end of a piece; numbers, or columns of them, one a variant."""


class Leaf(Protocol):
    """Reads one number of a component: the number itself, or a column where it varies."""

    def __call__(self, key: str, value: float, /) -> Number:
        """Return what stands under a key, such as ``stages.0.stiffness``, whose value in the model is given."""
        ...


class Component(Shown):
    """A table that makes elements."""

    gap_symbol: ClassVar[Symbol | None] = None
    """How it is drawn where an element of it has a gap; None: alike."""
    plural: ClassVar[str]
    """What several of them are called."""
    scaling: ClassVar[Mapping[str, Any]]
    """What kind of quantity, of ``Scales.units``, every key is whose number has a dimension."""
    name: Name
    """Unique among all elements."""

    def elements(self) -> tuple[Element, ...]:
        """Return its elements, in their order."""
        raise NotImplementedError

    def sides(self, leaf: Leaf, element: Element, /) -> tuple[Sequence[PieceColumns], Sequence[PieceColumns]]:  # noqa: ARG002
        """Return drive and coast side of the law of one of its elements, every number read by ``leaf``."""
        drive, coast = ([(p.stiffness, p.damping, p.until) for p in side] for side in (element.drive, element.coast))
        return drive, coast

    def added_inertia(self) -> Mapping[str, float]:
        """Return by body what it adds to the J of the file [kg m^2]."""
        return {}

    def notes(self) -> tuple[str, ...]:
        """Return what a user must know of it in addition to the numbers."""
        return ()

    def written_out(self, table: dict[str, Any], /) -> dict[str, Any]:
        """Return its table with only numbers that ``scaling`` can scale; the model's J already include what it adds."""
        return table

    @property
    def keeps_bodies(self) -> bool:
        """Whether its bodies must stay bodies of their own speed where others are lumped."""
        return False

    def between_groups(self, to: Mapping[str, tuple[str, float]], /) -> tuple[str, dict[str, Any]]:
        """Return the array of tables, and the table, of the component between groups of bodies; by body ``to`` has the
        one kept of its group, and its angle over that one's.
        """
        raise NotImplementedError

    @classmethod
    def element_names(cls, table: Mapping[str, Any], /) -> Iterator[tuple[Location, str]]:
        """Yield where the name of every element comes from, and the name; the table may hold anything."""
        if isinstance(name := table.get("name"), str):
            yield ("name",), name

    @classmethod
    def bodies(cls, table: Mapping[str, Any], /) -> Iterator[Body]:
        """Yield the bodies that a table names, as written."""
        between = table.get("between")
        if isinstance(between, (list, tuple)) and len(between) == 2:
            for end in between:
                yield Body(("between",), end)


def multiply(table: dict[str, Any], factors: Mapping[str, float]) -> None:
    """Multiply the numbers that are there in a table."""
    for key, factor in factors.items():
        if table.get(key) is not None:
            table[key] *= factor


def arms_of(between: tuple[str, str], factors: tuple[float, float]) -> tuple[tuple[str, float], ...]:
    """Return the arms of an element between two bodies; ground has none."""
    return tuple((body, factor) for body, factor in zip(between, factors, strict=True) if body != GROUND)
