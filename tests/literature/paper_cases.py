"""The four-inertia transmission of Padmanabhan et al. (1995), cases 1 to 3 of Table 2, in decimals.

Inertias, stiffnesses and damping are inferred from Table 1 (omega = 150 rad/s, R = 50 mm, half backlash 50 um); the
loads are assumed: harmonics 202.5, 81, 50.625, 24.3, 12.15 N m at orders 1 to 5, mean = ratio x 202.5 N m.
Dimensionless time is 150 t.
"""

from __future__ import annotations

from fractions import Fraction

from tests.oracles.driveline import Body, Coupling, Driveline, Harmonic, Mesh, Torque

SPEED = 150.0
HALF_GAP = 5e-5
_CLUTCH = {1: ("0.10", "0.25"), 2: ("0.01", "0.025"), 3: ("0.001", "0.01")}
_ORDERS = (("1", "202.5"), ("2", "81"), ("3", "50.625"), ("4", "24.3"), ("5", "12.15"))


def decimal(x: Fraction) -> str:
    """Return a fraction with a short decimal expansion as that decimal."""
    return f"{round(x * 10**8)}e-8"


def paper_case(number: int, loaded: bool, ratio: str = "0.05") -> Driveline:
    """Return a case: rattling (a loose output gear that drags with 0.5 N m) or loaded (it carries the mean)."""
    mean = Fraction(ratio) * Fraction("202.5")
    drag = mean / 50
    if loaded:
        drags, rest = (drag, drag, Fraction(0)), Torque("output_gear", decimal(2 * drag - mean))
    else:
        drags, rest = (drag, Fraction(0), Fraction("0.5")), Torque("input_gear", decimal(drag + Fraction("0.5") - mean))
    alpha, beta = _CLUTCH[number]
    error = () if number == 1 else (Harmonic("20", "5e-6"),)
    return Driveline(
        f"case {number}, {'loaded' if loaded else 'rattling'}",
        (
            Body("flywheel", "0.3", "1.5e-4"),
            Body("hub", "4.5e-4", "1.35e-4", decimal(drags[0])),
            Body("input_gear", "1.05e-2", "1.5e-4", decimal(drags[1])),
            Body("output_gear", "1.5e-3", "3.75e-5", decimal(drags[2])),
        ),
        (
            Coupling("clutch", ("flywheel", "hub"), "1500", "0.225", "0.16", alpha, beta),
            Coupling("spline", ("hub", "input_gear"), "15e3", "0.0075", None if number == 1 else "0.05867"),
        ),
        (Mesh("gear", ("input_gear", "output_gear"), ("0.05", "0.05"), "7.2e8", "4500", "1e-4", error),),
        torques=(Torque("flywheel", decimal(mean), tuple(Harmonic(o, a) for o, a in _ORDERS)), rest),
        speed="150",
    )
