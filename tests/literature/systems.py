"""The systems with known answers, in decimals, for the oracle's tests and for the program's.

b is the half gap, dz(x, b) = x - b for x > b, x + b for x < -b, 0 between. Where a system has no forcing the
excitation only fixes the output grid.
"""

from __future__ import annotations

from tests.oracles.driveline import Body, Coupling, Driveline, Harmonic, Stage, Torque

SECOND = "6.283185307179586476925286766559005768394338798750211641949889184615632812572417997256069650684"
"""Speed whose period is one second."""


def gap_oscillator(angle: str = "1.25", velocity: str = "0") -> Driveline:
    """V1: x'' + w^2 dz(x, b) = 0 with w = 2, b = 0.5, from rest at A."""
    return Driveline(
        "gap oscillator",
        (Body("x", "1"),),
        (Coupling("gap", ("x", "ground"), stiffness="4", clearance="0.5"),),
        speed="1",
        angle=(angle,),
        velocity=(velocity,),
    )


def trilinear() -> Driveline:
    """V2: inner ki = 0.64, outer ko = 9, b = 0.2, v0 = 0.7."""
    return Driveline(
        "trilinear oscillator",
        (Body("x", "1"),),
        (Coupling("spring", ("x", "ground"), stages=(Stage("0.64", until="0.2"), Stage("9"))),),
        speed="1",
        angle=("0",),
        velocity=("0.7",),
    )


def bilinear(damped: bool = True) -> Driveline:
    """V3: w = 1 for x > 0 and 3 for x < 0, with damping ratios 0.02 and 0.05, from x = 0 with velocity 1."""
    c1, c2 = ("0.04", "0.3") if damped else ("0", "0")
    spring = Coupling("spring", ("x", "ground"), stages=(Stage("1", c1),), coast_stages=(Stage("9", c2),))
    return Driveline("bilinear oscillator", (Body("x", "1"),), (spring,), speed="1", angle=("0",), velocity=("1",))


def loose_pair(order: str, amplitude: str) -> Driveline:
    """V5: x'' + 2 zeta x' + dz(x, 1) = Fm + Fa sin(order t), zeta = 0.05, Fm = 0.1, from static equilibrium."""
    return Driveline(
        "loose pair",
        (Body("x", "1", drag="0.1"),),
        (Coupling("gap", ("x", "ground"), stiffness="1", clearance="1"),),
        torques=(Torque("x", "0.1", (Harmonic("1", amplitude),)),),
        speed=order,
    )


def struck_pair() -> Driveline:
    """V6: two inertias, 35 N m step on the first, from rest; the period is 0.05 s."""
    twenty_hertz = "125.66370614359172953850573533118011536788677597500423283899778369231265625144835994512139301368"
    return Driveline(
        "struck pair",
        (Body("first", "0.25"), Body("second", "0.04")),
        (Coupling("shaft", ("first", "second"), "1800", "1.2"),),
        torques=(Torque("first", "35"),),
        speed=twenty_hertz,
        angle=("0", "0"),
        velocity=("0", "0"),
    )


def three_stage_clutch() -> Driveline:
    """V7: J = 0.12, 50, 600, 3000 N m/rad with breaks at 0.05 and 0.20 rad, 45 rad/s at zero."""
    stages = (Stage("50", until="0.05"), Stage("600", until="0.2"), Stage("3000"))
    return Driveline(
        "three-stage clutch",
        (Body("hub", "0.12"),),
        (Coupling("clutch", ("hub", "ground"), stages=stages),),
        speed="100",
        angle=("0",),
        velocity=("45",),
    )


def two_body_backlash() -> Driveline:
    """V11: the ModelicaBook two-body backlash."""
    return Driveline(
        "two-body backlash",
        (Body("a", "0.4"), Body("b", "1")),
        (
            Coupling("spring", ("a", "b"), "11", "0.2"),
            Coupling("gap", ("a", "b"), "1000", clearance="0.25"),
            Coupling("mount", ("b", "ground"), "5", "1"),
        ),
        speed=SECOND,
        angle=("0", "0"),
        velocity=("5", "0"),
    )
