"""A gear pair on its line of action, ``delta = R_a theta_a - R_b theta_b - e(t)`` [m]."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, ClassVar

from gearrattle.model.components.alternation import Alternation
from gearrattle.model.components.component import (
    Body,
    Component,
    Element,
    Gap,
    Leaf,
    LinearDamping,
    LinearStiffness,
    Piece,
    PieceColumns,
    Radius,
    arms_of,
)
from gearrattle.model.components.contact_damping import ContactDamping, clipping_rules
from gearrattle.model.excitation import Harmonic
from gearrattle.model.table import Breach
from gearrattle.model.table_symbol import Symbol
from gearrattle.model.value_kinds import Between, two, value_of


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

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: clipped damping without a gap, or with a stiffness that alternates."""
        if table.get("contact_damping") == "clipped":
            gap = value_of(cls, table, "backlash", dimensionless)
            yield from clipping_rules([gap], [], 'such as backlash = "0.1 mm"')
            if table.get("alternation") is not None:
                rule = "clipped contact damping and alternation exclude each other"
                yield Breach(("alternation",), table["alternation"], rule, "remove one")

    @property
    def drive_pieces(self) -> tuple[Piece, ...]:
        """The law for delta > 0, from the centre outward."""
        return tuple(Piece(*stage) for stage in self._stages(lambda _, value: value))

    def _stages(self, leaf: Leaf) -> list[Any]:
        """Pieces of one side: the gap, if any, and the contact."""
        contact = (leaf("stiffness", self.stiffness), leaf("damping", self.damping), None)
        return [contact] if self.backlash == 0.0 else [(0.0, 0.0, leaf("backlash", self.backlash) / 2.0), contact]

    def sides(self, leaf: Leaf, element: Element, /) -> tuple[Sequence[PieceColumns], Sequence[PieceColumns]]:  # noqa: ARG002
        """Return drive side and coast side of its law, with all numbers read by ``leaf``."""
        stages = self._stages(leaf)
        return stages, stages

    @property
    def coast_pieces(self) -> tuple[Piece, ...]:
        """The law for delta < 0, the same as for delta > 0."""
        return self.drive_pieces

    def elements(self) -> tuple[Element, ...]:
        """Return the element of the mesh."""
        element = Element(
            name=self.name,
            path=f"mesh.{self.name}",
            along_line=True,
            arms=arms_of(self.between, (self.radii[0], -self.radii[1])),
            between=self.between,
            radii=self.radii,
            drive=self.drive_pieces,
            coast=self.coast_pieces,
            errors=self.transmission_error,
            error_key="transmission_error",
            contact_damping=self.contact_damping,
            alternation=self.alternation,
        )
        return (element,)

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
