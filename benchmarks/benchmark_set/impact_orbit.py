"""The driven body between two stops whose periodic motion has a closed form: its amplitudes and its speed at impact."""

from __future__ import annotations

from mpmath import mp, mpf
from tests.oracles.driveline import Body, Coupling, Driveline, Harmonic, Torque

STIFFNESS = 25
DAMPING = "2"
CONTACT = "0.7"
"""Time in contact; the flight ends at pi."""


def impact_orbit() -> Driveline:
    """Solve the three linear equations for the speed v at contact and the amplitudes P, Q to 40 digits."""
    with mp.workdps(60):
        columns = [_half_period(*unit) for unit in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
        base = _half_period(0, 0, 0)
        matrix = mp.matrix(3, 3)
        for j, column in enumerate(columns):
            for i in range(3):
                matrix[i, j] = column[i] - base[i]
        matrix[2, 0] += 1  # x'(pi) = -v: v itself stands in the third equation
        v, sine, cosine = mp.lu_solve(matrix, mp.matrix([1 - base[0], -1 - base[1], -base[2]]))
        half_turn = mp.nstr(mp.pi / 2, 45)
        stops = Coupling("stops", ("body", "ground"), str(STIFFNESS), DAMPING, "1")
        harmonics = (Harmonic("1", mp.nstr(sine, 40)), Harmonic("1", mp.nstr(cosine, 40), half_turn))
        torque = Torque("body", "0", harmonics)
        line = Driveline("impact orbit", (Body("body", "1"),), (stops,), (), (torque,), "1")
        return line.start(("1",), (mp.nstr(v, 40),))


def _half_period(v: int, sine: int, cosine: int) -> tuple[mpf, mpf, mpf]:
    """x(0.7), x(pi), x'(pi) of the motion in contact from (1, v), then in flight from where it is at 0.7 at its speed.

    x(0.7) enters the flight as it is: linear in v, P, Q, and equal to 1 where the first equation holds.
    """
    k, c, contact = mpf(STIFFNESS), mpf(DAMPING), mpf(CONTACT)
    # in contact u = x - 1: u'' + c u' + k u = P sin t + Q cos t, with the steady part a sin t + b cos t
    size = (k - 1) ** 2 + c**2
    a = ((k - 1) * sine + c * cosine) / size
    b = ((k - 1) * cosine - c * sine) / size
    decay = c / 2
    turn = mp.sqrt(k - decay**2)
    start, rate = -b, v - a
    other = (rate + decay * start) / turn
    e = mp.exp(-decay * contact)
    wave_c = mp.cos(turn * contact)
    wave_s = mp.sin(turn * contact)
    u = e * (start * wave_c + other * wave_s) + a * mp.sin(contact) + b * mp.cos(contact)
    speed = e * ((other * turn - decay * start) * wave_c - (start * turn + decay * other) * wave_s)
    speed += a * mp.cos(contact) - b * mp.sin(contact)
    # in flight x'' = P sin t + Q cos t: x' = -P cos t + Q sin t + C, x = -P sin t - Q cos t + C t + D
    constant = speed + sine * mp.cos(contact) - cosine * mp.sin(contact)
    shift = 1 + u + sine * mp.sin(contact) + cosine * mp.cos(contact) - constant * contact
    return 1 + u, cosine + constant * mp.pi + shift, sine + constant
