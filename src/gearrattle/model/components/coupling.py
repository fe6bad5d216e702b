"""A coupling: clutch damper, shaft or spline, on ``delta = theta_a - theta_b - e(t)`` [rad].

Its law is piecewise linear: eqs. (9)-(10) of Padmanabhan et al., J. Mech. Design 117 (1995) 185, are the case of two
stages; the general case is a multi-stage clutch damper. Friction (``hysteresis``) and contact damping that cannot pull
(``contact_damping``) act in addition to the law. With ``hooke`` the coupling is a Hooke joint.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, ClassVar

from gearrattle.model import units
from gearrattle.model.components.component import (
    Component,
    Element,
    Leaf,
    Piece,
    PieceColumns,
    TorsionalDamping,
    TorsionalStiffness,
    arms_of,
    multiply,
)
from gearrattle.model.components.contact_damping import ContactDamping, clipping_rules
from gearrattle.model.components.friction import Hysteresis, StickStiffness, friction, stage_rules, stick_rules
from gearrattle.model.components.hooke import HookeJoint, joint_rules
from gearrattle.model.excitation import AngularHarmonic
from gearrattle.model.table import Breach, Table
from gearrattle.model.table_symbol import Symbol
from gearrattle.model.value_kinds import GROUND, Between, Quantity, Ratio, value_of

_FRICTION_SCALING = {"hysteresis": "torque", "stick_stiffness": "torsional_stiffness"}
_STAGE_SCALING = {
    "stiffness": "torsional_stiffness",
    "damping": "torsional_damping",
    "until": "angle",
    **_FRICTION_SCALING,
}
_SAME = 1e-9  # relative difference of two ratios that count as equal
_RADIUS = 1.0  # [m] radius of a coupling written as a mesh: its deflection in m equals the angle in rad


class Stage(Table):
    """One stage of a staged clutch damper; the last one of a side has no ``until``."""

    stiffness: TorsionalStiffness
    """Slope of this stage [N m/rad]."""
    until: Annotated[float, Quantity(units.ANGLE, "positive")] | None = None
    """Deflection at which the stage ends [rad]; absent in the last stage."""
    damping: TorsionalDamping = 0.0
    """Damping in this stage [N m s/rad]."""
    hysteresis: Hysteresis = 0.0
    """Full height of the torque-angle loop that dry friction makes in this stage [N m], in all; may be a table over
    speed. What it has beyond the stage before is a slider of its own, engaged unloaded where the stage begins."""
    stick_stiffness: StickStiffness | None = None
    """Slope of a slider's torque until it slips [N m/rad], added to the stage's; default: 20 times that slope."""


class Coupling(Component):
    """A torsional element between two inertias, or an inertia and the ground.

    Either the clearance form (``stiffness``, ``damping``, ``clearance`` and the two ratios) or the staged form
    (``stages``, optionally ``coast_stages``).
    """

    clearance_form: ClassVar[tuple[str, ...]] = (
        "stiffness",
        "damping",
        "clearance",
        "stiffness_ratio",
        "damping_ratio",
        "hysteresis",
        "stick_stiffness",
        "contact_damping",
    )

    noun: ClassVar[str] = "coupling"
    plural: ClassVar[str] = "couplings"
    symbol: ClassVar[Symbol] = Symbol("l4 -7 l4 7 l4 7 l4 -7 l4 -7 l4 7 l4 7 l4 -7", 32.0)
    gap_symbol: ClassVar[Symbol] = Symbol(
        "l4 -7 l4 7 l4 7 l4 -7 l4 -7 l4 7 l4 7 l4 -7 h10 m0 -10 v20 m14 -20 v20 m0 -10", 56.0
    )
    template: ClassVar[Mapping[str, Any]] = {
        "name": "coupling",
        "between": ["a", "b"],
        "stiffness": "10 kN*m/rad",
        "damping": "1 N*m*s/rad",
    }
    scaling: ClassVar[Mapping[str, Any]] = {
        "stiffness": "torsional_stiffness",
        "damping": "torsional_damping",
        "clearance": "angle",
        "preload": "torque",
        "stages": _STAGE_SCALING,
        "coast_stages": _STAGE_SCALING,
        "kinematic_error": {"amplitude": "angle"},
        **_FRICTION_SCALING,
    }
    between: Between
    """Names of the two inertias; either may be "ground". delta = theta_a - theta_b."""
    stiffness: TorsionalStiffness | None = None
    """K, slope of the last stage [N m/rad]; None in the staged form."""
    damping: TorsionalDamping = 0.0
    """C, damping in the last stage [N m s/rad]."""
    clearance: Annotated[float, Quantity(units.ANGLE, "non-negative")] = 0.0
    """b, half-width of the first stage [rad]; 0: linear, no corner."""
    stiffness_ratio: Ratio = 0.0
    """alpha, first-stage slope divided by K; 0: a free gap."""
    damping_ratio: Ratio = 0.0
    """beta, first-stage damping divided by C."""
    stages: tuple[Stage, ...] | None = None
    """Drive side (delta > 0) from the centre outward; None in the clearance form."""
    coast_stages: tuple[Stage, ...] | None = None
    """Coast side (delta < 0), positive magnitudes; None: the drive side mirrored."""
    preload: Annotated[float, Quantity(units.TORQUE)] = 0.0
    """Torque at delta = 0 [N m]."""
    hysteresis: Hysteresis = 0.0
    """Full height of the torque-angle loop of dry friction at any deflection [N m]; may be a table over speed."""
    stick_stiffness: StickStiffness | None = None
    """Slope of the friction's torque until it slips [N m/rad]; default: 20 K."""
    kinematic_error: tuple[AngularHarmonic, ...] = ()
    """e(t) = sum of amplitude sin(order Omega t + phase) [rad]."""
    hooke: HookeJoint | None = None
    """A Hooke joint in addition to the law; its error is added to ``kinematic_error``."""
    contact_damping: ContactDamping = "kelvin-voigt"
    """"clipped": the torque of contact neither pulls nor passes twice the spring's; needs a free gap."""

    @property
    def drive_pieces(self) -> tuple[Piece, ...]:
        """The law for delta > 0, from the centre outward."""
        if self.stages is not None:
            return tuple(_piece_of(stage) for stage in self.stages)
        loop = friction(self.hysteresis, self.stick_stiffness, self.stiffness or 0.0)
        return tuple(Piece(k, c, until, *loop) for k, c, until in self._two_stages(lambda _, value: value))

    def _two_stages(self, leaf: Leaf) -> list[Any]:
        """Pieces of the clearance form: the first stage, if it has one, and the last stage."""
        stiffness = leaf("stiffness", self.stiffness or 0.0)
        damping = leaf("damping", self.damping)
        last = (stiffness, damping, None)
        if self.clearance == 0.0:
            return [last]
        alpha, beta = (leaf(key, getattr(self, key)) for key in ("stiffness_ratio", "damping_ratio"))
        return [(alpha * stiffness, beta * damping, leaf("clearance", self.clearance)), last]

    def sides(self, leaf: Leaf, element: Element, /) -> tuple[Sequence[PieceColumns], Sequence[PieceColumns]]:  # noqa: ARG002
        """Return drive side and coast side of its law, with all numbers read by ``leaf``."""
        if self.stages is None:
            drive = self._two_stages(leaf)
            return drive, drive
        drive = _read("stages", self.stages, leaf)
        return drive, drive if self.coast_stages is None else _read("coast_stages", self.coast_stages, leaf)

    @property
    def coast_pieces(self) -> tuple[Piece, ...]:
        """The law for delta < 0, from the centre outward, in positive magnitudes."""
        if self.coast_stages is None:
            return self.drive_pieces
        return tuple(_piece_of(stage) for stage in self.coast_stages)

    def elements(self) -> tuple[Element, ...]:
        """Return the element of the coupling."""
        element = Element(
            name=self.name,
            path=f"coupling.{self.name}",
            along_line=False,
            arms=arms_of(self.between, (1.0, -1.0)),
            between=self.between,
            radii=(1.0, 1.0),
            drive=self.drive_pieces,
            coast=self.coast_pieces,
            preload=self.preload,
            errors=(*self.kinematic_error, *(self.hooke.errors() if self.hooke else ())),
            error_key="kinematic_error",
            load_ripple=self.hooke.load_ripple() if self.hooke else (),
            contact_damping=self.contact_damping,
        )
        return (element,)

    def written_out(self, table: dict[str, Any], /) -> dict[str, Any]:
        """Return its table with the Hooke joint expressed by sines."""
        if self.hooke is None:
            return table
        kept = {key: value for key, value in table.items() if key != "hooke"}
        return {**kept, "kinematic_error": [sine.to_plain() for sine in self.elements()[0].errors]}

    @property
    def keeps_bodies(self) -> bool:
        """Whether it is a Hooke joint."""
        return self.hooke is not None

    def between_groups(self, to: Mapping[str, tuple[str, float]], /) -> tuple[str, dict[str, Any]]:
        """Return a coupling between the bodies kept, or a mesh if these bodies have different speeds."""
        (a, rho_a), (b, rho_b) = (to[end] for end in self.between)
        table = {**self.to_plain(at_speed=True), "between": [a, b]}
        if GROUND in (a, b):
            return "coupling", _referred(table, rho_b if a == GROUND else rho_a)
        if abs(rho_a - rho_b) <= _SAME * rho_a:
            return "coupling", _referred(table, rho_a)
        first = self.drive_pieces[0]
        piece = self.drive_pieces[-1]
        mesh: dict[str, Any] = {"name": self.name, "between": [a, b], "radii": [rho_a * _RADIUS, rho_b * _RADIUS]}
        mesh |= {"stiffness": piece.stiffness / _RADIUS**2, "damping": piece.damping / _RADIUS**2}
        if self.kinematic_error:
            mesh["transmission_error"] = table["kinematic_error"]
            for sine in mesh["transmission_error"]:
                multiply(sine, {"amplitude": _RADIUS})
        if first.until is not None:
            mesh |= {"backlash": 2.0 * first.until * _RADIUS, "contact_damping": self.contact_damping}
        return "mesh", mesh

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: both forms or neither, stages in the wrong order."""
        keys_set = [key for key in cls.clearance_form if table.get(key) is not None]
        staged = table.get("stages") is not None
        if staged and keys_set:
            rule = f"stages and {keys_set[0]} exclude each other: a coupling has either form, not both"
            yield Breach((keys_set[0],), table[keys_set[0]], rule, f"remove stages, or {', '.join(keys_set)}")
        if not staged and table.get("stiffness") is None and "stiffness" not in table:
            yield Breach((), ..., "a coupling needs stiffness (or stages)", 'such as stiffness = "1500 N*m/rad"')
        if not staged and table.get("coast_stages") is not None:
            rule = "coast_stages needs stages: the drive side is missing"
            yield Breach(("coast_stages",), table["coast_stages"], rule)
        for key in ("stages", "coast_stages"):
            yield from _stage_order(key, table.get(key), dimensionless)
            yield from stage_rules(Stage, key, table.get(key), dimensionless)
        yield from joint_rules(table, dimensionless)
        yield from stick_rules(cls, (), table, dimensionless, "20 K is zero")
        if table.get("contact_damping") == "clipped":
            gap = value_of(cls, table, "clearance", dimensionless)
            carrying = [value_of(cls, table, key, dimensionless) for key in ("stiffness_ratio", "damping_ratio")]
            remedy = 'such as clearance = "1 deg", without stiffness_ratio and damping_ratio'
            yield from clipping_rules([gap], carrying, remedy)


def _read(key: str, stages: Sequence[Stage], leaf: Leaf) -> list[PieceColumns]:
    """Pieces of one side in the staged form."""
    return [
        (
            leaf(f"{key}.{i}.stiffness", stage.stiffness),
            leaf(f"{key}.{i}.damping", stage.damping),
            None if stage.until is None else leaf(f"{key}.{i}.until", stage.until),
        )
        for i, stage in enumerate(stages)
    ]


def _referred(table: dict[str, Any], ratio: float) -> dict[str, Any]:
    """Refer a coupling to a shaft that turns 1/ratio times as fast: delta' = delta / ratio, T' = ratio T."""
    if ratio == 1.0:
        return table
    friction = {"hysteresis": ratio, "stick_stiffness": ratio**2}
    law = {"stiffness": ratio**2, "damping": ratio**2, **friction}
    multiply(table, {**law, "clearance": 1.0 / ratio, "preload": ratio})
    for stage in (*table.get("stages", ()), *table.get("coast_stages", ())):
        multiply(stage, {**law, "until": 1.0 / ratio})
    for sine in table.get("kinematic_error", ()):
        multiply(sine, {"amplitude": 1.0 / ratio})
    return table


def _piece_of(stage: Stage) -> Piece:
    loop = friction(stage.hysteresis, stage.stick_stiffness, stage.stiffness)
    return Piece(stage.stiffness, stage.damping, stage.until, *loop)


def _stage_order(key: str, stages: object, dimensionless: bool) -> Iterator[Breach]:
    """Yield breaches of the order of stages: ``until`` must increase, and the last stage must not have it."""
    if not isinstance(stages, (list, tuple)):
        return
    if not stages:
        yield Breach((key,), stages, "must have at least one stage")
    before: float | None = None
    for index, stage in enumerate(stages):
        until = stage.get("until") if isinstance(stage, Mapping) else getattr(stage, "until", None)
        last = index == len(stages) - 1
        if until is None:
            if not last and isinstance(stage, (Mapping, Stage)):
                yield Breach((key, index), ..., "every stage but the last needs until", 'such as until = "4 deg"')
            continue
        if last:
            rule = "the last stage must have no until: it goes on for ever"
            yield Breach((key, index, "until"), until, rule, "remove until, or add a stage after it")
        value = value_of(Stage, stage, "until", dimensionless)
        if value is not None and before is not None and value <= before:
            rule = f"stages out of order: until must be greater than that of the stage before ({before:.6g} rad)"
            yield Breach((key, index, "until"), until, rule, "list the stages from the centre outward")
        before = value if value is not None else before
