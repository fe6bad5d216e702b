"""A gear pair on its line of action, ``delta = R_a theta_a - R_b theta_b - e(t)`` [m].

Where a gear moves sideways, the flanks of drive and coast have lines of action of their own. With the working pressure
angle a in the transverse plane, and the line of centres from the first gear to the second along x,

    n_d = (sin a, cos a)       delta_d = R_a theta_a - R_b theta_b + n_d . (u_a - u_b) - e(t)
    n_c = (sin a, -cos a)      delta_c = R_a theta_a - R_b theta_b - n_c . (u_a - u_b) - e(t)

With the backlash B, NAME-drive pushes for delta_d > B/2 alone, NAME-coast for delta_c < -B/2 alone. Without backlash
teeth never part, and the mesh is one spring along n_d.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import pi
from typing import Annotated, Any, ClassVar

from gearrattle.model import units
from gearrattle.model.components.alternation import Alternation
from gearrattle.model.components.component import (
    COAST,
    DRIVE,
    Body,
    Component,
    Element,
    Gap,
    Leaf,
    LinearDamping,
    LinearStiffness,
    Piece,
    PieceColumns,
    Push,
    Radius,
    arms_of,
    line_of_action,
)
from gearrattle.model.components.contact_damping import ContactDamping, clipping_rules
from gearrattle.model.excitation import Harmonic
from gearrattle.model.table import Breach, Location
from gearrattle.model.table_symbol import Symbol
from gearrattle.model.value_kinds import Between, Quantity, two, value_of


class Mesh(Component):
    """A gear pair on its line of action; its gap, if any, is free of force."""

    noun: ClassVar[str] = "mesh"
    plural: ClassVar[str] = "meshes"
    symbol: ClassVar[Symbol] = Symbol(
        "m0 -18 v5 l12 3 v5 l-12 3 v4 l12 3 v5 l-12 3 v5 m18 -36 v13 l-12 3 v4 l12 3 v13 m0 -18", 18.0
    )
    gap_symbol: ClassVar[Symbol] = Symbol(
        "m0 -18 v5 l12 3 v5 l-12 3 v4 l12 3 v5 l-12 3 v5 m23 -36 v13 l-12 3 v4 l12 3 v13 m0 -18", 23.0
    )
    template: ClassVar[Mapping[str, Any]] = {
        "name": "mesh",
        "between": ["a", "b"],
        "radii": ["50 mm", "50 mm"],
        "stiffness": "3e8 N/m",
        "damping": "1500 N*s/m",
        "backlash": "0.1 mm",
    }
    scaling: ClassVar[Mapping[str, Any]] = {
        "radii": "radius",
        "stiffness": "linear_stiffness",
        "damping": "linear_damping",
        "backlash": "length",
        "transmission_error": {"amplitude": "length"},
    }
    between: Between
    """Names of the two gears' inertias; not "ground". delta = R_a theta_a - R_b theta_b - e(t)."""
    radii: Annotated[tuple[Radius, Radius], two('must be two base radii, such as ["50 mm", "50 mm"]')]
    """Base radii R_a, R_b [m]; positive angles are the kinematically consistent directions."""
    stiffness: LinearStiffness
    """Mesh stiffness along the line of action [N/m]."""
    damping: LinearDamping = 0.0
    """Mesh damping in contact [N s/m]."""
    backlash: Gap = 0.0
    """Total gap on the line of action, twice the half gap [m]; 0: no gap."""
    transmission_error: tuple[Harmonic, ...] = ()
    """e(t) = sum of amplitude sin(order Omega t + phase) [m]."""
    contact_damping: ContactDamping = "kelvin-voigt"
    """"clipped": the force of contact neither pulls nor passes twice the spring's; needs backlash."""
    alternation: Alternation | None = None
    """How the stiffness alternates with the tooth pairs in contact; ``stiffness`` is that with all pairs."""
    pressure_angle: Annotated[float, Quantity(units.ANGLE, "non-negative")] | None = None
    """Working pressure angle in the transverse plane [rad], below 90 deg; where a gear moves sideways."""
    centre_line: Annotated[float, Quantity(units.ANGLE)] | None = None
    """Angle of the line from the first gear to the second [rad]; default 0: along x."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: clipped damping without a gap, or with a stiffness that alternates."""
        if table.get("contact_damping") == "clipped":
            gap = value_of(cls, table, "backlash", dimensionless)
            yield from clipping_rules([gap], [], 'such as backlash = "0.1 mm"')
            if table.get("alternation") is not None:
                rule = "clipped contact damping and alternation exclude each other"
                yield Breach(("alternation",), table["alternation"], rule, "remove one")
        angle = value_of(cls, table, "pressure_angle", dimensionless)
        if angle is not None and angle >= 0.5 * pi:
            yield Breach(("pressure_angle",), table["pressure_angle"], "must be below 90 deg", 'such as "20 deg"')

    @property
    def drive_pieces(self) -> tuple[Piece, ...]:
        """The law for delta > 0, from the centre outward."""
        return tuple(Piece(*stage) for stage in self._stages(lambda _, value: value))

    def _stages(self, leaf: Leaf) -> list[Any]:
        """Pieces of one side: the gap, if any, and the contact."""
        contact = (leaf("stiffness", self.stiffness), leaf("damping", self.damping), None)
        return [contact] if self.backlash == 0.0 else [(0.0, 0.0, leaf("backlash", self.backlash) / 2.0), contact]

    def sides(self, leaf: Leaf, element: Element, /) -> tuple[Sequence[PieceColumns], Sequence[PieceColumns]]:
        """Return drive and coast side of its law, every number read by ``leaf``."""
        stages = self._stages(leaf)
        if not self._parts_flanks:
            return stages, stages
        free = [(0.0, 0.0, None)]
        return (free, stages) if element.name.endswith(COAST) else (stages, free)

    @property
    def coast_pieces(self) -> tuple[Piece, ...]:
        """The law for delta < 0, the same as for delta > 0."""
        return self.drive_pieces

    @property
    def _parts_flanks(self) -> bool:
        """Whether drive and coast flank are elements of their own."""
        return self.pressure_angle is not None and self.backlash > 0.0

    def elements(self) -> tuple[Element, ...]:
        """Return the one element it is; of gears that move sideways and have backlash, that of either flank."""
        if not self._parts_flanks:
            return (self._element(self.name, self.drive_pieces, self.coast_pieces, 1.0),)
        free = (Piece(0.0, 0.0, None),)
        drive = self._element(self.name + DRIVE, self.drive_pieces, free, 1.0)
        return drive, self._element(self.name + COAST, free, self.coast_pieces, -1.0)

    def _element(self, name: str, drive: tuple[Piece, ...], coast: tuple[Piece, ...], way: float) -> Element:
        """The element of the drive flank (way 1) or of the coast flank (-1); of both at once without backlash."""
        return Element(
            name=name,
            path=f"mesh.{self.name}",
            along_line=True,
            arms=arms_of(self.between, (self.radii[0], -self.radii[1])),
            between=self.between,
            radii=self.radii,
            drive=drive,
            coast=coast,
            errors=self.transmission_error,
            error_key="transmission_error",
            contact_damping=self.contact_damping,
            alternation=self.alternation,
            pushes=self._pushes(way),
        )

    def _pushes(self, way: float) -> tuple[Push, ...]:
        """The line of action of a flank, n_d or -n_c, for either gear; none for gears with fixed centres."""
        if self.pressure_angle is None:
            return ()
        x, y = line_of_action(self.pressure_angle, self.centre_line or 0.0, way)
        a, b = self.between
        return Push(a, x, y), Push(b, -x, -y)

    @classmethod
    def element_names(cls, table: Mapping[str, Any], /) -> Iterator[tuple[Location, str]]:
        """Yield the name of the mesh, and those of its flanks where they are elements of their own."""
        yield from super().element_names(table)
        is_closed = value_of(cls, table, "backlash", False) == 0.0
        if isinstance(name := table.get("name"), str) and table.get("pressure_angle") is not None and not is_closed:
            yield ("name",), name + DRIVE
            yield ("name",), name + COAST

    def between_groups(self, to: Mapping[str, tuple[str, float]], /) -> tuple[str, dict[str, Any]]:
        """Return a mesh between the bodies kept, its radii multiplied by the ratios."""
        (a, rho_a), (b, rho_b) = (to[end] for end in self.between)
        radii = [self.radii[0] * rho_a, self.radii[1] * rho_b]
        return "mesh", {**self.to_plain(at_speed=True), "between": [a, b], "radii": radii}

    @classmethod
    def bodies(cls, table: Mapping[str, Any], /) -> Iterator[Body]:
        """Yield the two gears, which must not be ground."""
        for body in super().bodies(table):
            yield body._replace(no_ground="a mesh connects two inertias; ground has no gear", remedy="use a coupling")
