"""A driveline written in decimal strings, once: the model file and the oracle are both made from it.

The numbers stay text until the last moment, so that the program under test reads exactly the decimals the oracle
reads. ``Driveline.toml()`` writes the model file; :mod:`tests.oracles.exact_mp` takes the same object.
Plain numbers only (SI, or dimensionless), so that units play no part here.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from math import gcd

from mpmath import mp, mpf


@dataclass(frozen=True)
class Harmonic:
    """One sine of a torque or a transmission error: amplitude sin(order Omega t + phase)."""

    order: str
    amplitude: str
    phase: str = "0"

    def toml(self) -> str:
        return f"{{ order = {self.order}, amplitude = {self.amplitude}, phase = {self.phase} }}"


@dataclass(frozen=True)
class Stage:
    """One stage of a piecewise-linear law, outward; the last has ``until`` None."""

    stiffness: str
    damping: str = "0"
    until: str | None = None
    hysteresis: str = "0"
    stick_stiffness: str | None = None

    def toml(self) -> str:
        until = "" if self.until is None else f", until = {self.until}"
        friction = "" if self.hysteresis == "0" else f", hysteresis = {self.hysteresis}"
        stick = "" if self.stick_stiffness is None else f", stick_stiffness = {self.stick_stiffness}"
        return f"{{ stiffness = {self.stiffness}, damping = {self.damping}{until}{friction}{stick} }}"

    @property
    def stick(self) -> Fraction:
        """Stiffness of its friction's spring."""
        return Fraction(self.stick_stiffness) if self.stick_stiffness is not None else 20 * Fraction(self.stiffness)


@dataclass(frozen=True)
class Body:
    """A rotating inertia."""

    name: str
    J: str
    drag: str = "0"
    drag_torque: str = "0"


@dataclass(frozen=True)
class Coupling:
    """A torsional element: linear, with a clearance, or staged (the file's three forms)."""

    name: str
    between: tuple[str, str]
    stiffness: str = "0"
    damping: str = "0"
    clearance: str | None = None
    stiffness_ratio: str = "0"
    damping_ratio: str = "0"
    stages: tuple[Stage, ...] | None = None
    coast_stages: tuple[Stage, ...] | None = None
    preload: str = "0"
    hysteresis: str = "0"
    stick_stiffness: str | None = None
    contact_damping: str = "kelvin-voigt"

    radii = ("1", "1")
    error: tuple[Harmonic, ...] = ()

    @property
    def sides(self) -> tuple[tuple[Stage, ...], tuple[Stage, ...]]:
        """Drive and coast stages from the centre outward, as exact decimal fractions."""
        if self.stages is not None:
            return self.stages, self.coast_stages or self.stages
        stick = str(20 * Fraction(self.stiffness)) if self.stick_stiffness is None else self.stick_stiffness
        outer = Stage(self.stiffness, self.damping, None, self.hysteresis, stick)
        if self.clearance is None or Fraction(self.clearance) == 0:
            return (outer,), (outer,)
        inner = Stage(
            str(Fraction(self.stiffness) * Fraction(self.stiffness_ratio)),
            str(Fraction(self.damping) * Fraction(self.damping_ratio)),
            self.clearance,
            self.hysteresis,
            stick,
        )
        return (inner, outer), (inner, outer)

    def toml(self) -> str:
        lines = ["[[coupling]]", f'name = "{self.name}"', f'between = ["{self.between[0]}", "{self.between[1]}"]']
        if self.stages is not None:
            lines.append(f"stages = [{', '.join(s.toml() for s in self.stages)}]")
            if self.coast_stages is not None:
                lines.append(f"coast_stages = [{', '.join(s.toml() for s in self.coast_stages)}]")
        else:
            lines += [f"stiffness = {self.stiffness}", f"damping = {self.damping}"]
            if self.clearance is not None:
                lines += [
                    f"clearance = {self.clearance}",
                    f"stiffness_ratio = {self.stiffness_ratio}",
                    f"damping_ratio = {self.damping_ratio}",
                ]
        if self.preload != "0":
            lines.append(f"preload = {self.preload}")
        if self.hysteresis != "0":
            lines.append(f"hysteresis = {self.hysteresis}")
        if self.stick_stiffness is not None:
            lines.append(f"stick_stiffness = {self.stick_stiffness}")
        if self.contact_damping != "kelvin-voigt":
            lines.append(f'contact_damping = "{self.contact_damping}"')
        return "\n".join(lines)


@dataclass(frozen=True)
class Mesh:
    """A gear pair on the line of action; ``backlash`` is the total gap."""

    name: str
    between: tuple[str, str]
    radii: tuple[str, str]
    stiffness: str
    damping: str = "0"
    backlash: str | None = None
    error: tuple[Harmonic, ...] = ()
    contact_damping: str = "kelvin-voigt"

    preload = "0"

    @property
    def sides(self) -> tuple[tuple[Stage, ...], tuple[Stage, ...]]:
        """Drive and coast stages from the centre outward."""
        outer = Stage(self.stiffness, self.damping)
        if self.backlash is None or Fraction(self.backlash) == 0:
            return (outer,), (outer,)
        side = (Stage("0", "0", str(Fraction(self.backlash) / 2)), outer)
        return side, side

    def toml(self) -> str:
        lines = [
            "[[mesh]]",
            f'name = "{self.name}"',
            f'between = ["{self.between[0]}", "{self.between[1]}"]',
            f"radii = [{self.radii[0]}, {self.radii[1]}]",
            f"stiffness = {self.stiffness}",
            f"damping = {self.damping}",
        ]
        if self.backlash is not None:
            lines.append(f"backlash = {self.backlash}")
        if self.error:
            lines.append(f"transmission_error = [{', '.join(h.toml() for h in self.error)}]")
        if self.contact_damping != "kelvin-voigt":
            lines.append(f'contact_damping = "{self.contact_damping}"')
        return "\n".join(lines)


@dataclass(frozen=True)
class Ramp:
    """A torque goes to another mean in a straight line."""

    at: str
    over: str
    to: str

    def toml(self) -> str:
        return f"{{ at = {self.at}, over = {self.over}, to = {self.to} }}"


@dataclass(frozen=True)
class Torque:
    """An applied torque."""

    on: str
    mean: str = "0"
    harmonics: tuple[Harmonic, ...] = ()
    ramps: tuple[Ramp, ...] = ()

    def toml(self) -> str:
        lines = ["[[torque]]", f'on = "{self.on}"', f"mean = {self.mean}"]
        if self.ramps:
            lines.append(f"ramps = [{', '.join(r.toml() for r in self.ramps)}]")
        if self.harmonics:
            lines.append(f"harmonics = [{', '.join(h.toml() for h in self.harmonics)}]")
        return "\n".join(lines)


@dataclass(frozen=True)
class Driveline:
    """A whole model. ``angle`` and ``velocity`` give the start; both None: static, the equilibrium at rest."""

    name: str
    bodies: tuple[Body, ...]
    couplings: tuple[Coupling, ...] = ()
    meshes: tuple[Mesh, ...] = ()
    torques: tuple[Torque, ...] = ()
    speed: str = "1"
    angle: tuple[str, ...] | None = None
    velocity: tuple[str, ...] | None = None

    @property
    def elements(self) -> tuple[Coupling | Mesh, ...]:
        """All couplings in file order, then all meshes."""
        return self.couplings + self.meshes

    @property
    def clearances(self) -> tuple[int, ...]:
        """Indices of the elements with at least one corner."""
        return tuple(k for k, e in enumerate(self.elements) if has_corner(e))

    @property
    def orders(self) -> tuple[Fraction, ...]:
        """Distinct orders > 0 of all harmonics."""
        harmonics = [h for t in self.torques for h in t.harmonics] + [h for e in self.meshes for h in e.error]
        return tuple(sorted({Fraction(h.order) for h in harmonics if Fraction(h.order) > 0}))

    @property
    def period(self) -> mpf:
        """Common period of all orders [s].

        2 pi/(Omega gcd(orders)), an order counting as p/q if within 1e-9 of it with q <= 64; one fundamental if an
        order is no such fraction, if the common period would pass 64 fundamentals, or if there are no orders.
        """
        ratios = [order.limit_denominator(64) for order in self.orders]
        common = Fraction(0)
        for ratio in ratios:
            denominator = common.denominator * ratio.denominator
            common = Fraction(gcd(int(common * denominator), int(ratio * denominator)), denominator)
        odd = any(abs(x - y) > Fraction(1, 10**9) for x, y in zip(ratios, self.orders, strict=True))
        if odd or common == 0 or common < Fraction(1, 64):
            common = Fraction(1)
        speed = Fraction(self.speed) * common
        with mp.workdps(120):
            return 2 * mp.pi * speed.denominator / speed.numerator

    def start(self, angle: tuple[str, ...], velocity: tuple[str, ...]) -> Driveline:
        """Return the same driveline with another start."""
        return replace(self, angle=angle, velocity=velocity)

    def toml(self) -> str:
        """Return the model file."""
        lines = ["schema = 1", f'name = "{self.name}"', 'units = "SI"', ""]
        for body in self.bodies:
            lines += ["[[inertia]]", f'name = "{body.name}"', f"J = {body.J}", f"drag = {body.drag}"]
            lines += [f"drag_torque = {body.drag_torque}", ""]
        for part in (*self.couplings, *self.meshes):
            lines += [part.toml(), ""]
        lines += ["[excitation]", f"speed = {self.speed}", ""]
        for torque in self.torques:
            lines += [torque.toml(), ""]
        start = '"static"'
        if self.angle is not None and self.velocity is not None:
            start = f"{{ angle = [{', '.join(self.angle)}], velocity = [{', '.join(self.velocity)}] }}"
        lines += ["[simulation]", f"initial = {start}", ""]
        return "\n".join(lines)


def has_corner(element: Coupling | Mesh) -> bool:
    """Whether a law has a corner: more than one stage, or sides whose first stages differ."""
    drive, coast = element.sides
    return len(drive) > 1 or len(coast) > 1 or differ(drive[0], coast[0])


def differ(a: Stage, b: Stage) -> bool:
    """Whether two stages differ in slope, damping or friction."""
    return any(Fraction(getattr(a, name)) != Fraction(getattr(b, name)) for name in _TOLD)


_TOLD = ("stiffness", "damping", "hysteresis")
