"""Slow and obvious: periodic motions of the oscillator with backlash to thirty digits, from closed forms.

    x'' + 0.1 x' + f(x) = 0.1 + 0.05 W^2 cos(W t),    f(x) = x - 1 for x > 1, 0, x + 1 for x < -1

Between two corners the motion is elementary. A periodic motion with m crossings has 2 m unknowns, the instant and the
velocity of each, and as many equations: from every crossing the closed form leads to the position and the velocity of
the next one, and from the last one to the first a period later. Along a branch W is one unknown more. At a fold the
equations have a null vector; at a grazing the velocity of a crossing, or of the least or the largest deflection on a
corner, is zero. Nothing here is taken from the program.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from mpmath import mp, mpf

DIGITS = 40
DAMPING, MEAN, ERROR = "0.1", "0.1", "0.05"
_SCAN = 64  # steps a period in search of crossings

State = tuple[mpf, mpf]
Unknowns = list[mpf]


@dataclass(frozen=True)
class Crossing:
    """Of a corner (1 or -1): the region (1, 0, -1) after it."""

    corner: int
    region: int


Pattern = tuple[Crossing, ...]


def period(frequency: mpf) -> mpf:
    return 2 * mp.pi / frequency


def flow(region: int, frequency: mpf, begin: mpf, state: State, end: mpf, *, load: mpf | str = MEAN) -> State:
    """Return the state at the end of a time within one region: x_particular + x_homogeneous, written out."""
    c, mean, force = mpf(DAMPING), mpf(load), mpf(ERROR) * frequency**2
    (x, v), tau = state, end - begin
    first, last = mp.expj(frequency * begin), mp.expj(frequency * end)
    if region == 0:  # v' = mean + force cos(W t) - c v
        wave = force / (1j * frequency + c)
        transient = v - mean / c - mp.re(wave * first)
        decay = mp.exp(-c * tau)
        moved = transient * (1 - decay) / c + mean / c * tau + mp.re(wave / (1j * frequency) * (last - first))
        return x + moved, transient * decay + mean / c + mp.re(wave * last)
    wave = force / (1 - frequency**2 + 1j * c * frequency)
    a = x - region - mean - mp.re(wave * first)
    b = v - mp.re(1j * frequency * wave * first)
    own = mp.sqrt(1 - c**2 / 4)
    q = (b + c / 2 * a) / own
    cosine, sine, decay = mp.cos(own * tau), mp.sin(own * tau), mp.exp(-c / 2 * tau)
    y = decay * (a * cosine + q * sine)
    return (
        region + mean + mp.re(wave * last) + y,
        mp.re(1j * frequency * wave * last) - c / 2 * y + decay * own * (q * cosine - a * sine),
    )


def region_of(state: State) -> int:
    x, v = state
    if abs(x) == 1:
        return int(x) if x * v > 0 else 0
    return 0 if abs(x) < 1 else int(mp.sign(x))


def mapped(frequency: mpf, state: State, cycles: int = 1, load: mpf | str = MEAN) -> tuple[State, Unknowns, Pattern]:
    """Follow a state over whole periods, crossing by crossing.

    Returns
    -------
    tuple
        The state at the end; instants and velocities of the crossings, one after the other; and what they cross.
    """
    end = cycles * period(frequency)
    region, time = region_of(state), mpf(0)
    actual: Unknowns = []
    order: list[Crossing] = []
    while True:
        crossing = _first_exit(region, frequency, time, state, end, load=load)
        if crossing is None:
            return flow(region, frequency, time, state, end, load=load), actual, tuple(order)
        instant, corner = crossing
        velocity = flow(region, frequency, time, state, instant, load=load)[1]
        region = corner if region == 0 else 0
        time, state = instant, (mpf(corner), velocity)
        actual += [time, velocity]
        order.append(Crossing(corner, region))


def _first_exit(
    region: int, frequency: mpf, begin: mpf, state: State, end: mpf, *, load: mpf | str
) -> tuple[mpf, int] | None:
    """The first instant at which a motion leaves its region, and the corner that it passes."""

    def inside(t: mpf) -> mpf:
        x = flow(region, frequency, begin, state, t, load=load)[0]
        return 1 - abs(x) if region == 0 else region * x - 1

    low, step = begin, period(frequency) / _SCAN
    while low < end:
        high = min(low + step, end)
        if inside(high) < 0:
            if low == begin:  # it begins on the corner
                low += step / 2**20
            instant = mp.findroot(inside, (low, high), solver="anderson", tol=mp.eps**1.8)
            side = region or int(mp.sign(flow(region, frequency, begin, state, instant, load=load)[0]))
            return instant, side
        low = high
    return None


def equations(
    pattern: Pattern, cycles: int, unknowns: Sequence[mpf], frequency: mpf, load: mpf | str = MEAN
) -> list[mpf]:
    """Return what is zero for a periodic motion: from every crossing the closed form leads to the next."""
    instants, velocities = list(unknowns[0::2]), list(unknowns[1::2])
    instants.append(instants[0] + cycles * period(frequency))
    velocities.append(velocities[0])
    out: list[mpf] = []
    for i, crossing in enumerate(pattern):
        following = pattern[(i + 1) % len(pattern)]
        begin = (mpf(crossing.corner), velocities[i])
        x, v = flow(crossing.region, frequency, instants[i], begin, instants[i + 1], load=load)
        out += [x - following.corner, v - velocities[i + 1]]
    return out


def orbit(
    frequency: mpf, near: tuple[float, float], cycles: int = 1, load: mpf | str = MEAN
) -> tuple[Pattern, Unknowns]:
    """Return the crossings of the periodic motion near a state at t = 0: what they cross, instants and velocities."""
    with mp.workdps(15):
        guess, pattern = mapped(mpf(frequency), (mpf(near[0]), mpf(near[1])), cycles, load)[1:]
    return pattern, newton(lambda z: equations(pattern, cycles, z, frequency, load), guess)


def newton(function: Callable[[Sequence[mpf]], list[mpf]], guess: Unknowns) -> Unknowns:
    """Newton's method with differences for the gradient; a root must have all digits but a few."""
    z = [mpf(value) for value in guess]
    for _ in range(60):
        value = mp.matrix(function(z))
        change = mp.lu_solve(jacobian(function, z), value)
        z = [old - new for old, new in zip(z, change, strict=True)]
        if mp.norm(change) < mpf(10) ** (5 - mp.dps) * (1 + mp.norm(mp.matrix(z))):
            return z
    raise ArithmeticError("Newton's method did not settle")


def jacobian(function: Callable[[Sequence[mpf]], list[mpf]], z: Sequence[mpf]) -> mp.matrix:
    """Central differences with twice the digits: what they leave out is below the digits that count."""
    with mp.workdps(2 * mp.dps):
        h = mpf(10) ** (-mp.dps // 3)
        columns = []
        for j in range(len(z)):
            ahead, behind = ([value + (sign * h if i == j else 0) for i, value in enumerate(z)] for sign in (1, -1))
            columns.append([(a - b) / (2 * h) for a, b in zip(function(ahead), function(behind), strict=True)])
        return mp.matrix(columns).T


def fold(frequency: mpf, near: tuple[float, float], cycles: int = 1) -> mpf:
    """Return the frequency, near that of the motion near a state, at which the equations have a null vector n.

    Unknowns z, W and n; equations F = 0, dF/dz n = 0 by a difference along n, |n| = 1.
    """
    pattern, guess = orbit(frequency, near, cycles)
    m = len(guess)

    def extended(u: Sequence[mpf]) -> list[mpf]:
        z, w, n = list(u[:m]), u[m], list(u[m + 1 :])
        with mp.workdps(2 * mp.dps):
            h = mpf(10) ** (-mp.dps // 4)
            ahead, behind = ([a + sign * h * b for a, b in zip(z, n, strict=True)] for sign in (1, -1))
            along = [
                (a - b) / (2 * h)
                for a, b in zip(
                    equations(pattern, cycles, ahead, w), equations(pattern, cycles, behind, w), strict=True
                )
            ]
        return [*equations(pattern, cycles, z, w), *along, sum(x**2 for x in n) - 1]

    gradient = jacobian(lambda z: equations(pattern, cycles, z, frequency), guess)
    vectors = mp.svd(gradient)[2]
    null = [vectors[m - 1, j] for j in range(m)]
    return newton(extended, [*guess, mpf(frequency), *null])[m]


def _crossings(frequency: mpf, near: tuple[float, float], load: mpf) -> tuple[Pattern, Unknowns]:
    """What the motion from a state crosses, instants and velocities: a guess where the equations are singular."""
    with mp.workdps(15):
        guess, pattern = mapped(frequency, (mpf(near[0]), mpf(near[1])), 1, load)[1:]
    return pattern, guess


def _null(pattern: Pattern, guess: Unknowns, frequency: mpf, load: mpf) -> Unknowns:
    """The direction in which the equations are nearest to singular."""
    vectors = mp.svd(jacobian(lambda z: equations(pattern, 1, z, frequency, load), guess))[2]
    return [vectors[len(guess) - 1, j] for j in range(len(guess))]


def cusp(frequency: mpf, load: mpf, near: tuple[float, float]) -> tuple[mpf, mpf]:
    """Return frequency and mean load, near a guess and the motion near a state, at which two folds meet.

    Unknowns z, W, the load, n, r: along z + h n + h^2 r / 2 the equations are zero but for terms of third order.
    """
    pattern, guess = _crossings(frequency, near, load)
    m = len(guess)

    def extended(u: Sequence[mpf]) -> list[mpf]:
        z, (w, q), n, r = list(u[:m]), u[m : m + 2], list(u[m + 2 : 2 * m + 2]), list(u[2 * m + 2 :])
        with mp.workdps(2 * mp.dps):
            h = mpf(10) ** (-mp.dps // 6)
            moved = ([a + s * h * b + h**2 / 2 * c for a, b, c in zip(z, n, r, strict=True)] for s in (1, -1))
            ahead, behind = (equations(pattern, 1, one, w, q) for one in moved)
            here = equations(pattern, 1, z, w, q)
            first = [(a - b) / (2 * h) for a, b in zip(ahead, behind, strict=True)]
            second = [(a + b - 2 * c) / h**2 for a, b, c in zip(ahead, behind, here, strict=True)]
        return [*here, *first, *second, sum(x**2 for x in n) - 1, sum(x * y for x, y in zip(n, r, strict=True))]

    start = [*guess, frequency, load, *_null(pattern, guess, frequency, load), *([mpf(0)] * m)]
    w, q = newton(extended, start)[m : m + 2]
    return w, q


def fold_at_grazing(frequency: mpf, load: mpf, near: tuple[float, float], instant: mpf) -> tuple[mpf, mpf]:
    """Return frequency and mean load at which a motion that crosses twice folds while it touches x = 1 in its gap.

    Unknowns z, W, the load, n and the instant of the touch, near a guess of it.
    """
    pattern, guess = _crossings(frequency, near, load)
    m = len(guess)
    leaving = next(i for i, crossing in enumerate(pattern) if crossing.region == 0)

    def extended(u: Sequence[mpf]) -> list[mpf]:
        z, (w, q), n, t = list(u[:m]), u[m : m + 2], list(u[m + 2 : 2 * m + 2]), u[2 * m + 2]
        with mp.workdps(2 * mp.dps):
            h = mpf(10) ** (-mp.dps // 4)
            moved = ([a + sign * h * b for a, b in zip(z, n, strict=True)] for sign in (1, -1))
            ahead, behind = (equations(pattern, 1, one, w, q) for one in moved)
            along = [(a - b) / (2 * h) for a, b in zip(ahead, behind, strict=True)]
        x, v = flow(0, w, z[2 * leaving], (mpf(1), z[2 * leaving + 1]), t, load=q)
        return [*equations(pattern, 1, z, w, q), *along, sum(x**2 for x in n) - 1, x - 1, v]

    w, q = newton(extended, [*guess, frequency, load, *_null(pattern, guess, frequency, load), instant])[m : m + 2]
    return w, q


def grazing_from_contact(guess: str) -> mpf:
    """Return the frequency at which the motion in contact, x = 1 + mean + |H| cos(...), touches the corner."""

    def distance(w: mpf) -> mpf:
        return abs(mpf(ERROR) * w**2 / (1 - w**2 + 1j * mpf(DAMPING) * w)) - mpf(MEAN)

    return mp.findroot(distance, mpf(guess))


def state_at_zero(pattern: Pattern, frequency: mpf, unknowns: Sequence[mpf], cycles: int = 1) -> State:
    """Return the state at t = 0 (every whole number of periods) from the last crossing before it."""
    span = cycles * period(frequency)
    instants, velocities = unknowns[0::2], unknowns[1::2]
    last = max(range(len(pattern)), key=lambda i: instants[i] - span * mp.ceil(instants[i] / span))
    begin = instants[last] - span * mp.ceil(instants[last] / span)
    corner = (mpf(pattern[last].corner), velocities[last])
    return flow(pattern[last].region, frequency, begin, corner, mpf(0))


def contact_state(frequency: mpf) -> State:
    """Return the state at t = 0 of the motion that stays in contact."""
    wave = mpf(ERROR) * frequency**2 / (1 - frequency**2 + 1j * mpf(DAMPING) * frequency)
    return 1 + mpf(MEAN) + mp.re(wave), mp.re(1j * frequency * wave)


def monodromy(frequency: mpf, state: State, cycles: int = 1) -> mp.matrix:
    """Return the gradient of the map at a state, by central differences of the map itself."""
    columns = []
    h = mpf(10) ** (-mp.dps // 3)
    for j in range(2):
        ends = [
            mapped(frequency, (state[0] + sign * h * (j == 0), state[1] + sign * h * (j == 1)), cycles)[0]
            for sign in (1, -1)
        ]
        columns.append([(a - b) / (2 * h) for a, b in zip(*ends, strict=True)])
    return mp.matrix(columns).T


def multipliers(frequency: mpf, state: State, cycles: int = 1) -> list[complex]:
    """Return the eigenvalues of the gradient, the largest modulus first."""
    m = monodromy(frequency, state, cycles)
    trace, determinant = m[0, 0] + m[1, 1], m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0]
    root = mp.sqrt(trace**2 / 4 - determinant)
    return sorted((complex(trace / 2 + root), complex(trace / 2 - root)), key=lambda x: (-round(abs(x), 12), -x.imag))
