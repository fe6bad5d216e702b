"""Inertias, couplings and gear meshes: the parts of a driveline.

A coupling (clutch damper, shaft, spline) acts on ``delta = theta_a - theta_b`` [rad], a mesh on the line of action,
``delta = R_a theta_a - R_b theta_b - e(t)`` [m]. Both have a piecewise-linear law: eqs. (9)-(10) of Padmanabhan et
al., J. Mech. Design 117 (1995) 185, are its two-stage case, a multi-stage clutch damper its general one. Either way
``drive_pieces`` and ``coast_pieces`` give the law from the centre outward. Friction in a coupling (``hysteresis``) and
contact damping that cannot pull (``contact_damping``) stand beside the law.

Takes value kinds from ``quantity``; gives the nouns of a ``Model``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

from gearrattle.model import units
from gearrattle.model.excitation import Harmonic
from gearrattle.model.over_speed import OverSpeed
from gearrattle.model.quantity import GROUND, Between, Choice, Label, Name, Plain, Quantity, attempt, two
from gearrattle.model.table import Breach, Table

_until = Quantity(units.ANGLE, "positive")
TorsionalStiffness = Annotated[float, Quantity(units.TORSIONAL_STIFFNESS, "non-negative")]
TorsionalDamping = Annotated[float, Quantity(units.TORSIONAL_DAMPING, "non-negative")]
Ratio = Annotated[float, Plain("non-negative")]
_hysteresis = OverSpeed(units.TORQUE, "non-negative", swept=False)
Hysteresis = Annotated[float, _hysteresis]
StickStiffness = Annotated[float, Quantity(units.TORSIONAL_STIFFNESS, "positive")]
ContactDamping = Annotated[Literal["kelvin-voigt", "clipped"], Choice(("kelvin-voigt", "clipped"))]
_STICK = 20.0
Radius = Annotated[float, Quantity(units.LENGTH, "positive")]


class Piece(NamedTuple):
    """One linear piece of a law, from the centre outward.

    Attributes:
        stiffness: slope [N m/rad or N/m].
        damping: [N m s/rad or N s/m].
        until: where the piece ends, a positive magnitude of the deflection [rad or m]; None for the last.
        hysteresis: full height of the friction loop in this piece [N m].
        stick_stiffness: of the springs that stick in it [N m/rad].
    """

    stiffness: float
    damping: float
    until: float | None
    hysteresis: float = 0.0
    stick_stiffness: float = 0.0


class Inertia(Table):
    """One rigid rotating body: one degree of freedom."""

    name: Annotated[str, Label(reserved=(GROUND,))]
    """Unique name; "ground" is reserved for the fixed frame."""
    J: Annotated[float, Quantity(units.MOMENT_OF_INERTIA, "positive")]
    """Moment of inertia [kg m^2]."""
    drag: TorsionalDamping = 0.0
    """Viscous drag to ground on the fluctuation of speed [N m s/rad]."""
    drag_torque: Annotated[float, OverSpeed(units.TORQUE, "non-negative")] = 0.0
    """Mean drag torque opposing rotation [N m]; acts as a mean torque of the opposite sign."""


class Stage(Table):
    """One stage of a staged clutch damper; the last one of a side has no ``until``."""

    stiffness: TorsionalStiffness
    """Slope of this stage [N m/rad]."""
    until: Annotated[float, _until] | None = None
    """Deflection at which the stage ends [rad]; absent in the last stage."""
    damping: TorsionalDamping = 0.0
    """Damping in this stage [N m s/rad]."""
    hysteresis: Hysteresis = 0.0
    """Full height of the torque-angle loop that dry friction makes in this stage [N m], in all; may be a table over
    speed. What it has beyond the stage before is a slider of its own, engaged unloaded where the stage begins."""
    stick_stiffness: StickStiffness | None = None
    """Slope of a slider's torque until it slips [N m/rad], beside the stage's; default: 20 times the stage's slope."""


class Coupling(Table):
    """A torsional element between two inertias, or an inertia and the ground.

    Either the clearance form (``stiffness``, ``damping``, ``clearance`` and the two ratios) or the staged form
    (``stages``, optionally ``coast_stages``).
    """

    clearance_form: ClassVar[tuple[str, ...]] = (
        "stiffness", "damping", "clearance", "stiffness_ratio", "damping_ratio", "hysteresis", "stick_stiffness",
        "contact_damping",
    )  # fmt: skip

    name: Name
    """Unique among couplings and meshes."""
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
    contact_damping: ContactDamping = "kelvin-voigt"
    """"clipped": the torque of contact neither pulls nor passes twice the spring's; needs a free gap."""

    @property
    def drive_pieces(self) -> tuple[Piece, ...]:
        """The law for delta > 0, from the centre outward."""
        if self.stages is not None:
            return tuple(_piece_of(stage) for stage in self.stages)
        stiffness = self.stiffness or 0.0
        friction = _friction(self.hysteresis, self.stick_stiffness, stiffness)
        last = Piece(stiffness, self.damping, None, *friction)
        if self.clearance == 0.0:
            return (last,)
        ratios = self.stiffness_ratio, self.damping_ratio
        return (Piece(ratios[0] * stiffness, ratios[1] * self.damping, self.clearance, *friction), last)

    @property
    def coast_pieces(self) -> tuple[Piece, ...]:
        """The law for delta < 0, from the centre outward, in positive magnitudes."""
        if self.coast_stages is None:
            return self.drive_pieces
        return tuple(_piece_of(stage) for stage in self.coast_stages)

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: the two forms mixed, neither given, stages out of order."""
        given = [key for key in cls.clearance_form if table.get(key) is not None]
        staged = table.get("stages") is not None
        if staged and given:
            rule = f"stages and {given[0]} exclude each other: a coupling has either form, not both"
            yield Breach((given[0],), table[given[0]], rule, f"remove stages, or {', '.join(given)}")
        if not staged and table.get("stiffness") is None and "stiffness" not in table:
            yield Breach((), ..., "a coupling needs stiffness (or stages)", 'such as stiffness = "1500 N*m/rad"')
        if not staged and table.get("coast_stages") is not None:
            rule = "coast_stages needs stages: the drive side is missing"
            yield Breach(("coast_stages",), table["coast_stages"], rule)
        for key in ("stages", "coast_stages"):
            yield from _stage_order(key, table.get(key), dimensionless)
            yield from _stage_friction(key, table.get(key), dimensionless)
        yield from _sticks((), table, "20 K is zero")
        if table.get("contact_damping") == "clipped":
            free = table.get("clearance") and not table.get("stiffness_ratio") and not table.get("damping_ratio")
            yield from _clipped(free, 'such as clearance = "1 deg", without stiffness_ratio and damping_ratio')


def _piece_of(stage: Stage) -> Piece:
    friction = _friction(stage.hysteresis, stage.stick_stiffness, stage.stiffness)
    return Piece(stage.stiffness, stage.damping, stage.until, *friction)


def _friction(hysteresis: float, stick: float | None, slope: float) -> tuple[float, float]:
    """Hysteresis and stick stiffness of a piece; 0 and 0 without friction."""
    return (hysteresis, _STICK * slope if stick is None else stick) if hysteresis > 0.0 else (0.0, 0.0)


def _clipped(free: object, remedy: str) -> Iterator[Breach]:
    """Yield a breach of clipped contact damping where there is no free gap."""
    if not free:
        yield Breach(("contact_damping",), "clipped", "clipped contact damping needs a gap free of torque", remedy)


def _sticks(location: tuple[str | int, ...], table: Mapping[str, Any], why: str) -> Iterator[Breach]:
    """Yield a breach of friction without a slope to stick with."""
    flat = table.get("stiffness") in (0, 0.0) and not isinstance(table.get("stiffness"), bool)
    if flat and table.get("hysteresis") and table.get("stick_stiffness") is None:
        remedy = 'such as stick_stiffness = "100 N*m/rad"'
        yield Breach(
            (*location, "hysteresis"), table["hysteresis"], f"friction needs a stick_stiffness here: {why}", remedy
        )


def _stage_friction(key: str, stages: object, dimensionless: bool) -> Iterator[Breach]:
    """Yield breaches of hysteresis in stages: it may not fall outward, and needs a slope."""
    before = 0.0
    for index, stage in enumerate(stages if isinstance(stages, (list, tuple)) else ()):
        table = stage if isinstance(stage, Mapping) else getattr(stage, "__dict__", {})
        yield from _sticks((key, index), table, "20 times the stage's slope is zero")
        found = table.get("hysteresis", 0.0)
        if isinstance(found, Mapping):  # a table over speed: judged where the values are known, in the assembly
            return
        value = attempt(_hysteresis.read, found, dimensionless)
        if value is not None and value < before:
            rule = f"hysteresis must not fall from stage to stage: the stage before has {before:.6g} N m in all"
            yield Breach((key, index, "hysteresis"), found, rule, "give each stage the full height of its loop")
        before = value if value is not None else before


def _stage_order(key: str, stages: object, dimensionless: bool) -> Iterator[Breach]:
    """Yield breaches of the order of stages: every ``until`` beyond the one before, none in the last stage."""
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
        value = attempt(_until.read, until, dimensionless)
        if value is not None and before is not None and value <= before:
            rule = f"stages out of order: until must be greater than that of the stage before ({before:.6g} rad)"
            yield Breach((key, index, "until"), until, rule, "list the stages from the centre outward")
        before = value if value is not None else before


class Alternation(Table):
    """A mesh stiffness that alternates with the tooth pairs in contact, a rectangular wave over the mesh cycle."""

    order: Annotated[float, Plain("positive", "teeth times the ratio of speeds")]
    """Mesh cycles in a turn of the reference shaft: teeth times the ratio of speeds."""
    share: Ratio
    """Part of a cycle in which all pairs are in contact, between 0 and 1: the transverse contact ratio less 1, if that
    lies between 1 and 2."""
    fewer: Ratio
    """Stiffness with a pair less over that with all pairs, below 1."""
    phase: Annotated[float, Quantity(units.ANGLE)] = 0.0
    """Of the mesh cycle at t = 0 [rad]; a cycle begins with all pairs in contact."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], _dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: a share that is no part of a cycle, a stiffness that does not fall."""
        for key, low in (("share", True), ("fewer", False)):
            value = table.get(key)
            if isinstance(value, float | int) and (value >= 1 or (low and value == 0)):
                yield Breach((key,), value, "must be below 1" + (", and not 0" if low else ""), "such as 0.6")


class Mesh(Table):
    """A gear pair on its line of action; its gap, if any, is free of force."""

    name: Name
    """Unique among couplings and meshes."""
    between: Between
    """Names of the two gears' inertias; not "ground". delta = R_a theta_a - R_b theta_b - e(t)."""
    radii: Annotated[tuple[Radius, Radius], two('must be two base radii, such as ["50 mm", "50 mm"]')]
    """Base radii R_a, R_b [m]; positive angles are the kinematically consistent directions."""
    stiffness: Annotated[float, Quantity(units.LINEAR_STIFFNESS, "non-negative")]
    """Mesh stiffness along the line of action [N/m]."""
    damping: Annotated[float, Quantity(units.LINEAR_DAMPING, "non-negative")] = 0.0
    """Mesh damping in contact [N s/m]."""
    backlash: Annotated[float, Quantity(units.LENGTH, "non-negative")] = 0.0
    """Total gap on the line of action, twice the half gap [m]; 0: no gap."""
    transmission_error: tuple[Harmonic, ...] = ()
    """e(t) = sum of amplitude sin(order Omega t + phase) [m]."""
    contact_damping: ContactDamping = "kelvin-voigt"
    """"clipped": the force of contact neither pulls nor passes twice the spring's; needs backlash."""
    alternation: Alternation | None = None
    """How the stiffness alternates with the tooth pairs in contact; ``stiffness`` is that with all pairs."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], _dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: clipped damping without a gap, or with a stiffness that alternates."""
        if table.get("contact_damping") == "clipped":
            yield from _clipped(table.get("backlash"), 'such as backlash = "0.1 mm"')
            if table.get("alternation") is not None:
                rule = "clipped contact damping and alternation exclude each other"
                yield Breach(("alternation",), table["alternation"], rule, "remove one")

    @property
    def drive_pieces(self) -> tuple[Piece, ...]:
        """The law for delta > 0, from the centre outward."""
        last = Piece(self.stiffness, self.damping, None)
        return (last,) if self.backlash == 0.0 else (Piece(0.0, 0.0, self.backlash / 2.0), last)

    @property
    def coast_pieces(self) -> tuple[Piece, ...]:
        """The law for delta < 0: the same."""
        return self.drive_pieces
