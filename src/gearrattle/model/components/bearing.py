"""A bearing that holds a body of some mass sideways; with a radial clearance C, faces around the body stand for a ring.

u is the displacement of the body, of a bearing around another body relative to that: u = u_a - u_b.

Without clearance its elements are ``NAME-x`` and ``NAME-y``, ``delta = u_x`` and ``delta = u_y``; with one direction
alone it is a single element, ``delta = n . u``. With clearance the ring is a polygon of N faces, an element for each of
the N/2 pairs that face each other, ``NAME-0``, ``NAME-1``, ...:

    delta_i = n_i . u,      n_i = (cos(2 pi i / N), sin(2 pi i / N)),      i = 0, 1, ... N/2 - 1

A ring pushes back by k (|u| - C). With N faces the body touches at |u| = C opposite a face and at C / cos(pi/N) between
two. Deep inside, many faces push together: the sum of N/4 (n . u) n is u/4 N. So a face has the slope k from C to
C (N - pi) / (N - 4), and 4 k / N beyond, which is the far end of the law g of one face that gives a ring of very many
exactly,

    sum_i g(n_i . u) n_i = k (|u| - C) u/|u|,      g(s) = 2k/N (2 sqrt(s^2 - C^2) - C arccos(C/s))

(the integral equation of Schloemilch; E. T. Whittaker, G. N. Watson, A Course of Modern Analysis, sec. 11.81).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import cos, pi, sin
from typing import Annotated, Any, ClassVar

from gearrattle.model import units
from gearrattle.model.components.component import (
    Body,
    Component,
    Element,
    Gap,
    Leaf,
    LinearDamping,
    Piece,
    PieceColumns,
    Push,
)
from gearrattle.model.table import Breach
from gearrattle.model.table_symbol import Symbol
from gearrattle.model.value_kinds import GROUND, Count, Name, Quantity, value_of

FACES = 16
"""Of a ring, where the file is silent."""
OFF = ((12, 0.09), (10, 0.15), (8, 0.25), (6, 0.42), (4, 0.75))
"""Fewest faces, and by how much of k C the force differs from that of a circle at most, up to |u| = 4 C."""
_FEWEST = 4
_MOST = 128


class Bearing(Component):
    """A bearing of one body, in the housing or around another body, such as the needles of a gear around its shaft."""

    noun: ClassVar[str] = "bearing"
    plural: ClassVar[str] = "bearings"
    symbol: ClassVar[Symbol] = Symbol("a8 8 0 1 1 16 0 a8 8 0 1 1 -16 0 m8 8 v10 m-10 0 h20", 16.0)
    gap_symbol: ClassVar[Symbol] = Symbol("a8 8 0 1 1 16 0 a8 8 0 1 1 -16 0 m4 0 h8 m-4 8 v10 m-10 0 h20", 16.0)
    template: ClassVar[Mapping[str, Any]] = {
        "name": "bearing",
        "on": "a",
        "stiffness": "1e8 N/m",
        "damping": "500 N*s/m",
    }
    scaling: ClassVar[Mapping[str, Any]] = {
        "stiffness": "linear_stiffness",
        "damping": "linear_damping",
        "clearance": "length",
    }
    on: Name
    """Name of the inertia that it holds, which has a mass."""
    around: Name = GROUND
    """Name of the inertia around which it holds that one, such as its shaft, which has a mass; default: the housing."""
    stiffness: Annotated[float, Quantity(units.LINEAR_STIFFNESS, "positive")]
    """Radial stiffness k [N/m]; with clearance, of contact."""
    damping: LinearDamping = 0.0
    """Radial damping [N s/m]; with clearance, in contact."""
    clearance: Gap = 0.0
    """Radial clearance C, half the diametral one [m]; 0: none."""
    faces: Annotated[int, Count(_FEWEST, _MOST)] | None = None
    """Even number N of faces that stand for a ring with clearance; default 16."""
    direction: Annotated[float, Quantity(units.ANGLE)] | None = None
    """Angle of the only direction in which it holds, or lets its body move [rad]; None: all."""

    @property
    def face_count(self) -> int:
        """Number N of faces of a ring with clearance."""
        return FACES if self.faces is None else self.faces

    @property
    def _normals(self) -> tuple[tuple[str, float, float], ...]:
        """Name and direction of every element."""
        if self.direction is not None:
            return ((self.name, cos(self.direction), sin(self.direction)),)
        if self.clearance == 0.0:
            return ((f"{self.name}-x", 1.0, 0.0), (f"{self.name}-y", 0.0, 1.0))
        step = 2.0 * pi / self.face_count
        return tuple((f"{self.name}-{i}", cos(i * step), sin(i * step)) for i in range(self.face_count // 2))

    def _stages(self, leaf: Leaf) -> list[Any]:
        """The gap, if there is one, and the contact; of a ring the slope of one face, and that of many together."""
        stiffness = leaf("stiffness", self.stiffness)
        damping = leaf("damping", self.damping)
        contact = (stiffness, damping, None)
        if self.clearance == 0.0:
            return [contact]
        gap = leaf("clearance", self.clearance)
        count = self.face_count
        if self.direction is not None or count == _FEWEST:
            return [(0.0, 0.0, gap), contact]
        many = 4.0 / count
        until = gap * ((count - pi) / (count - 4.0))
        return [(0.0, 0.0, gap), (stiffness, damping, until), (many * stiffness, many * damping, None)]

    def sides(self, leaf: Leaf, element: Element, /) -> tuple[Sequence[PieceColumns], Sequence[PieceColumns]]:  # noqa: ARG002
        """Return drive and coast side of its law, every number read by ``leaf``."""
        stages = self._stages(leaf)
        return stages, stages

    def elements(self) -> tuple[Element, ...]:
        """Return two directions without clearance, one for each pair of faces with it, or its only direction."""
        pieces = tuple(Piece(*stage) for stage in self._stages(lambda _, value: value))
        return tuple(
            Element(
                name=name,
                path=f"bearing.{self.name}",
                along_line=True,
                arms=(),
                between=(self.on, self.around),
                radii=(0.0, 0.0),
                drive=pieces,
                coast=pieces,
                pushes=(Push(self.on, x, y), *self._back(x, y)),
            )
            for name, x, y in self._normals
        )

    def _back(self, x: float, y: float) -> tuple[Push, ...]:
        """How an element sees the displacement of the body around which it lies; the housing has none."""
        return () if self.around == GROUND else (Push(self.around, -x, -y),)

    def notes(self) -> tuple[str, ...]:
        """Return how far a polygon is from a ring; what one direction leaves out."""
        if self.direction is not None:
            return (f"bearing {self.name}: it holds in one direction alone; what acts across it is no force of it.",)
        if self.clearance == 0.0:
            return ()
        count = self.face_count
        wide = 1.0 / cos(pi / count) - 1.0
        off = next(share for fewest, share in OFF if count >= fewest)
        return (
            f"bearing {self.name}: its ring is a polygon of {count} faces, whose radius is {100.0 * wide:.3g} % larger "
            f"between two faces than opposite one; up to |u| = 4 C its force differs from k (|u| - C) by at most "
            f"{off:g} k C.",
        )

    def between_groups(self, to: Mapping[str, tuple[str, float]], /) -> tuple[str, dict[str, Any]]:
        """Return itself: its bodies stay bodies of their own."""
        table = self.to_plain(at_speed=True)
        return "bearing", {**table, **{key: to[table[key]][0] for key in ("on", "around") if key in table}}

    @property
    def keeps_bodies(self) -> bool:
        """Always: its body moves sideways by itself."""
        return True

    @classmethod
    def element_names(cls, table: Mapping[str, Any], /) -> Iterator[tuple[tuple[int | str, ...], str]]:
        """Yield the name of the bearing and those of its elements."""
        yield from super().element_names(table)
        if not isinstance(name := table.get("name"), str) or table.get("direction") is not None:
            return
        faces = table.get("faces")
        count = faces if isinstance(faces, int) and _FEWEST <= faces <= _MOST else FACES
        gap = value_of(cls, table, "clearance", False)
        for of_element in range(count // 2) if gap != 0.0 else ("x", "y"):
            yield ("name",), f"{name}-{of_element}"

    @classmethod
    def bodies(cls, table: Mapping[str, Any], /) -> Iterator[Body]:
        """Yield the body that it holds, as ground needs no bearing, and that around which it does."""
        if "on" in table:
            yield Body(("on",), table["on"], "a bearing holds an inertia; ground stays where it is", "name an inertia")
        if "around" in table:
            yield Body(("around",), table["around"])

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: faces that are no pairs, without clearance, or with one direction."""
        faces = table.get("faces")
        if faces is None:
            return
        if isinstance(faces, int) and faces % 2:
            yield Breach(("faces",), faces, "must be even: faces stand opposite each other", f"such as {faces + 1}")
        if table.get("direction") is not None:
            rule = "faces and direction exclude each other: a bearing holds all around, or in one direction"
            yield Breach(("faces",), faces, rule, "remove one")
        elif value_of(cls, table, "clearance", dimensionless) == 0.0:
            yield Breach(("faces",), faces, "faces stand for a ring with clearance", 'such as clearance = "20 um"')
