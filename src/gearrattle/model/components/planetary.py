"""A planetary gear set of sun, ring, carrier and single planets; every mesh has its own gap and phase.

All angles are absolute and have the same positive sense; the axes of the planets turn with the carrier. Then

    sun mesh:    delta = R_s (theta_s - theta_c) + R_p (theta_p - theta_c) - e(t)
    ring mesh:   delta = R_r (theta_r - theta_c) - R_p (theta_p - theta_c) - e(t)

(A. Kahraman, J. Sound Vib. 173 (1994) 125, the torsional model). Without errors both are zero if all bodies turn with
the carrier. The elements are called NAME-sun-PLANET and NAME-ring-PLANET.

Where the carrier is the ground, the sun may have a mass: it floats between the planets, or has bearings. The mesh with
the planet at the angle p is that of ``mesh`` with the line of centres at p, and with backlash either flank is an
element, NAME-sun-PLANET-drive and -coast. Where the carrier turns, lines of action turn with it: in a frame that turns
too they stand still, but the sun feels forces of Coriolis, which no element has.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import pi
from typing import Annotated, Any, ClassVar, Literal

from gearrattle.model import units
from gearrattle.model.components.component import (
    COAST,
    DRIVE,
    Body,
    Component,
    Element,
    Gap,
    LinearDamping,
    LinearStiffness,
    Piece,
    Push,
    Radius,
    line_of_action,
)
from gearrattle.model.components.contact_damping import ContactDamping, clipping_rules
from gearrattle.model.excitation import Harmonic
from gearrattle.model.table import Breach, Location, Table
from gearrattle.model.table_symbol import Symbol
from gearrattle.model.value_kinds import GROUND, Name, Quantity, value_of

Side = Literal["sun", "ring"]
SIDES: tuple[Side, Side] = ("sun", "ring")
_SAME = 1e-9  # relative difference of two lengths that count as equal
_NO_GROUND = "a planet is an inertia of its own; ground has no gear"


class PlanetaryRadii(Table):
    """Base radii of a set."""

    sun: Radius
    """Base radius R_s of the sun [m]."""
    planet: Radius
    """Base radius R_p of every planet [m]."""
    ring: Radius
    """Base radius R_r of the ring [m]; larger than that of a planet."""


class MeshStiffnesses(Table):
    """Stiffness of the meshes of a set."""

    sun: LinearStiffness
    """Of every mesh with the sun [N/m]."""
    ring: LinearStiffness
    """Of every mesh with the ring [N/m]."""


class MeshDampings(Table):
    """Damping of the meshes of a set in contact."""

    sun: LinearDamping = 0.0
    """Of every mesh with the sun [N s/m]."""
    ring: LinearDamping = 0.0
    """Of every mesh with the ring [N s/m]."""


class Backlashes(Table):
    """Total gaps on the lines of action."""

    sun: Gap = 0.0
    """Of every mesh with the sun [m]; 0: no gap."""
    ring: Gap = 0.0
    """Of every mesh with the ring [m]; 0: no gap."""


class MeshErrors(Table):
    """Transmission errors of the meshes of a set."""

    sun: tuple[Harmonic, ...] = ()
    """e(t) of the meshes with the sun [m], the phases of each planet added."""
    ring: tuple[Harmonic, ...] = ()
    """e(t) of the meshes with the ring [m]."""


class MeshPhases(Table):
    """Phases of the planets' meshes."""

    sun: tuple[Annotated[float, Quantity(units.ANGLE)], ...] = ()
    """One a planet [rad], added to the phases of its errors with the sun; empty: 0."""
    ring: tuple[Annotated[float, Quantity(units.ANGLE)], ...] = ()
    """One a planet [rad], of its errors with the ring."""


class Planetary(Component):
    """A planetary gear set; its angles are absolute, in one positive sense."""

    noun: ClassVar[str] = "planetary set"
    plural: ClassVar[str] = "planetary sets"
    symbol: ClassVar[Symbol] = Symbol(
        "a18 18 0 1 1 36 0 a18 18 0 1 1 -36 0 m12 0 a6 6 0 1 1 12 0 a6 6 0 1 1 -12 0 "
        "m1 -11 a5 5 0 1 1 10 0 a5 5 0 1 1 -10 0 m0 22 a5 5 0 1 1 10 0 a5 5 0 1 1 -10 0 m23 -11",
        36.0,
    )
    template: ClassVar[Mapping[str, Any]] = {
        "name": "planetary",
        "sun": "a",
        "ring": "b",
        "carrier": "c",
        "planets": ["d"],
        "radii": {"sun": "30 mm", "planet": "20 mm", "ring": "70 mm"},
        "stiffness": {"sun": "2e8 N/m", "ring": "2e8 N/m"},
        "damping": {"sun": "1000 N*s/m", "ring": "1000 N*s/m"},
        "backlash": {"sun": "0.1 mm", "ring": "0.1 mm"},
    }
    scaling: ClassVar[Mapping[str, Any]] = {
        "radii": dict.fromkeys(("sun", "planet", "ring"), "radius"),
        "stiffness": dict.fromkeys(SIDES, "linear_stiffness"),
        "damping": dict.fromkeys(SIDES, "linear_damping"),
        "backlash": dict.fromkeys(SIDES, "length"),
        "transmission_error": {side: {"amplitude": "length"} for side in SIDES},
    }
    sun: Name
    """Name of the sun's inertia, or "ground"."""
    ring: Name
    """Name of the ring's inertia, or "ground"."""
    carrier: Name
    """Name of the carrier's inertia, or "ground"."""
    planets: tuple[Name, ...]
    """Names of the planets' inertias."""
    radii: PlanetaryRadii
    """Base radii."""
    stiffness: MeshStiffnesses
    """Mesh stiffnesses."""
    damping: MeshDampings = MeshDampings()
    """Mesh dampings."""
    backlash: Backlashes = Backlashes()
    """Total gaps."""
    transmission_error: MeshErrors = MeshErrors()
    """Transmission errors."""
    mesh_phase: MeshPhases = MeshPhases()
    """Phases of the planets' meshes."""
    contact_damping: ContactDamping = "kelvin-voigt"
    """"clipped": the forces of contact neither pull nor pass twice the spring's; needs both gaps."""
    planet_mass: Annotated[float, Quantity(units.MASS, "positive")] | None = None
    """Mass of a planet [kg], if the carrier's J does not contain the planets' masses."""
    pressure_angle: Annotated[float, Quantity(units.ANGLE, "non-negative")] | None = None
    """Working transverse pressure angle of the meshes with the sun [rad], below 90 deg; where the sun has a mass."""
    planet_positions: tuple[Annotated[float, Quantity(units.ANGLE)], ...] = ()
    """Angles of the lines from the sun to the planets [rad], one a planet; empty: evenly around, the first along x."""
    centre_distance: Annotated[float, Quantity(units.LENGTH, "positive")] | None = None
    """Distance r of the planets' axes from that of the carrier [m]; with ``planet_mass`` it adds N m r^2 to the
    carrier's J."""

    def elements(self) -> tuple[Element, ...]:
        """Return the meshes, planet by planet: with the sun, then with the ring."""
        meshes = [self._mesh(side, index) for index in range(len(self.planets)) for side in SIDES]
        if self.pressure_angle is None:
            return tuple(meshes)
        return tuple(
            flank
            for k, mesh in enumerate(meshes)
            for flank in (self._flanks(mesh, k // len(SIDES)) if mesh.between[0] == self.sun else (mesh,))
        )

    def _flanks(self, mesh: Element, index: int) -> tuple[Element, ...]:
        """The mesh of a planet with a sun that moves sideways, with backlash by its flanks."""
        assert self.pressure_angle is not None
        even = 2.0 * pi * index / len(self.planets)
        position = self.planet_positions[index] if self.planet_positions else even
        pulls = {way: line_of_action(self.pressure_angle, position, way) for way in (1.0, -1.0)}
        drive = replace(mesh, pushes=(Push(self.sun, *pulls[1.0]),))
        if self.backlash.sun == 0.0:
            return (drive,)
        free = (Piece(0.0, 0.0, None),)
        coast = replace(mesh, name=mesh.name + COAST, drive=free, pushes=(Push(self.sun, *pulls[-1.0]),))
        return replace(drive, name=mesh.name + DRIVE, coast=free), coast

    def _mesh(self, side: Side, index: int) -> Element:
        """One mesh of one planet."""
        own = getattr(self.radii, side)
        planet = self.radii.planet
        signed = planet if side == "sun" else -planet
        gear = getattr(self, side)
        axle = self.planets[index]
        arms = ((gear, own), (axle, signed), (self.carrier, -(own + signed)))
        contact = Piece(getattr(self.stiffness, side), getattr(self.damping, side), None)
        gap = getattr(self.backlash, side)
        pieces = (contact,) if gap == 0.0 else (Piece(0.0, 0.0, gap / 2.0), contact)
        phases = getattr(self.mesh_phase, side)
        phase = phases[index] if phases else 0.0
        errors = getattr(self.transmission_error, side)
        return Element(
            name=f"{self.name}-{side}-{axle}",
            path=f"planetary.{self.name}",
            along_line=True,
            arms=tuple((body, factor) for body, factor in arms if body != GROUND),
            between=(gear, axle),
            radii=(own, planet),
            drive=pieces,
            coast=pieces,
            errors=tuple(h.model_copy(update={"phase": h.phase + phase}) for h in errors),
            contact_damping=self.contact_damping,
        )

    def added_inertia(self) -> Mapping[str, float]:
        """Return the inertia that the planets' masses add to the carrier's J [kg m^2]."""
        if self.planet_mass is None or self.centre_distance is None or self.carrier == GROUND:
            return {}
        return {self.carrier: len(self.planets) * self.planet_mass * self.centre_distance**2}

    def notes(self) -> tuple[str, ...]:
        """Return notes on radii that do not fit, and on added masses."""
        radii = self.radii
        notes = []
        fitting = radii.sun + 2.0 * radii.planet
        if abs(radii.ring - fitting) > _SAME * radii.ring:
            notes.append(
                f"planetary set {self.name}: the ring's base radius is {radii.ring:.6g} m, sun and two planets give "
                f"{fitting:.6g} m: the pressure angles of its meshes differ."
            )
        for body, more in self.added_inertia().items():
            notes.append(f"planetary set {self.name}: the planets' masses add {more:.6g} kg m^2 to the J of {body}.")
        return tuple(notes)

    def written_out(self, table: dict[str, Any], /) -> dict[str, Any]:
        """Return its table without the planets' masses, which are included in the carrier's J."""
        return {key: value for key, value in table.items() if key not in ("planet_mass", "centre_distance")}

    @property
    def keeps_bodies(self) -> bool:
        """Always True."""
        return True

    def between_groups(self, to: Mapping[str, tuple[str, float]], /) -> tuple[str, dict[str, Any]]:
        """Return the set between the bodies kept, whose J include the planets' masses."""
        table = self.written_out(self.to_plain(at_speed=True))
        table |= {key: to[table[key]][0] for key in ("sun", "ring", "carrier")}
        return "planetary", {**table, "planets": [to[planet][0] for planet in table["planets"]]}

    @classmethod
    def element_names(cls, table: Mapping[str, Any], /) -> Iterator[tuple[Location, str]]:
        """Yield the name of the set and the names of its elements."""
        yield from super().element_names(table)
        planets = table.get("planets")
        if isinstance(name := table.get("name"), str) and isinstance(planets, (list, tuple)):
            for planet in dict.fromkeys(p for p in planets if isinstance(p, str)):
                for side in SIDES:
                    yield ("name",), f"{name}-{side}-{planet}"
                if table.get("pressure_angle") is not None:
                    yield ("name",), f"{name}-sun-{planet}{DRIVE}"
                    yield ("name",), f"{name}-sun-{planet}{COAST}"

    @classmethod
    def bodies(cls, table: Mapping[str, Any], /) -> Iterator[Body]:
        """Yield sun, ring, carrier and planets."""
        for key in ("sun", "ring", "carrier"):
            if key in table:
                yield Body((key,), table[key])
        planets = table.get("planets")
        for index, planet in enumerate(planets if isinstance(planets, (list, tuple)) else ()):
            yield Body(("planets", index), planet, _NO_GROUND)

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: no planets, not one phase per planet, a mass without a distance, a ring too small."""
        planets = table.get("planets")
        count = len(planets) if isinstance(planets, (list, tuple)) else None
        if count == 0:
            yield Breach(("planets",), planets, "a planetary set needs one planet at least", 'such as planets = ["p1"]')
        phases = table.get("mesh_phase")
        for side in SIDES:
            written = _at(phases, side)
            if isinstance(written, (list, tuple)) and count is not None and len(written) not in (0, count):
                rule = f"must have one phase for each of the {count} planets, in their order, or none"
                yield Breach(("mesh_phase", side), written, rule)
        positions = table.get("planet_positions")
        if isinstance(positions, (list, tuple)) and count is not None and len(positions) not in (0, count):
            rule = f"must have one angle for each of the {count} planets, in their order, or none"
            yield Breach(("planet_positions",), positions, rule)
        angle = value_of(cls, table, "pressure_angle", dimensionless)
        if angle is not None and angle >= 0.5 * pi:
            yield Breach(("pressure_angle",), table["pressure_angle"], "must be below 90 deg", 'such as "20 deg"')
        for key, other in (("planet_mass", "centre_distance"), ("centre_distance", "planet_mass")):
            if table.get(key) is not None and table.get(other) is None:
                rule = f"{key} needs {other}: both together give N m r^2"
                yield Breach((key,), table[key], rule, f"give {other}, or leave {key} out")
        yield from _ring_rules(table.get("radii"), dimensionless)
        if table.get("contact_damping") == "clipped":
            gaps = [value_of(Backlashes, table.get("backlash"), side, dimensionless) for side in SIDES]
            yield from clipping_rules(gaps, [], 'such as backlash = { sun = "0.1 mm", ring = "0.1 mm" }')


def _ring_rules(radii: object, dimensionless: bool) -> Iterator[Breach]:
    """Yield a breach if the ring is too small for a planet."""
    planet = value_of(PlanetaryRadii, radii, "planet", dimensionless)
    ring = value_of(PlanetaryRadii, radii, "ring", dimensionless)
    if planet is not None and ring is not None and ring <= planet:
        rule = f"the ring must be larger than a planet ({planet:.6g} m)"
        yield Breach(("radii", "ring"), _at(radii, "ring"), rule, "ring = sun + 2 planet")


def _at(table: object, key: str) -> Any:
    """Return the value of a key, from a table as written or from a table object."""
    return table.get(key) if isinstance(table, Mapping) else getattr(table, key, None)
