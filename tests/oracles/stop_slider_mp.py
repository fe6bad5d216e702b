"""Slow and obvious: an oscillator against a stop with dry friction, to thirty digits, from closed forms.

    x'' + 0.1 x' + x + F = 0.1 + A sin(W t),    F = 0 for x < 1,  4 (x - 1) + G for x > 1

G is the torque of a spring of stiffness s in series with a Coulomb slider that slips at H; it is engaged, without
torque, where x passes 1 upward, and let go where x comes back. Between two changes the motion is elementary. Nothing
here is taken from the program.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mpmath import mp, mpf

from tests.oracles.backlash_mp import newton

DIGITS = 40
_SCAN = 200  # steps a period in search of changes

State = tuple[mpf, mpf]


@dataclass(frozen=True)
class Stop:
    """W, the slider's s and H, and a name for what it does: "sticks", "forward", "backward", "off"."""

    frequency: mpf
    spring: mpf
    limit: mpf

    def period(self) -> mpf:
        return 2 * mp.pi / self.frequency

    def force(self, phase: str, held: mpf) -> tuple[mpf, mpf]:
        """Return slope and value at x = 0 of all that depends on x; a spring that sticks has its zero at ``held``."""
        if phase == "off":
            return mpf(1), mpf(0)
        if phase == "sticks":
            return 5 + self.spring, -4 - self.spring * held
        return mpf(5), -4 + (self.limit if phase == "forward" else -self.limit)

    def moved(self, force: tuple[mpf, mpf], amplitude: mpf, begin: mpf, state: State, end: mpf) -> State:
        """Return the state at the end of a time in one phase."""
        slope, offset = force
        wave = amplitude / (slope - self.frequency**2 + mpf("0.1") * 1j * self.frequency)
        rest, tau = (mpf("0.1") - offset) / slope, end - begin
        first, last = wave * mp.expj(self.frequency * begin), wave * mp.expj(self.frequency * end)
        a = state[0] - rest - mp.im(first)
        b = state[1] - mp.im(1j * self.frequency * first)
        own, decay = mp.sqrt(slope - mpf("0.05") ** 2), mp.exp(-mpf("0.05") * tau)
        q = (b + mpf("0.05") * a) / own
        y = decay * (a * mp.cos(own * tau) + q * mp.sin(own * tau))
        rate = decay * own * (q * mp.cos(own * tau) - a * mp.sin(own * tau)) - mpf("0.05") * y
        return rest + mp.im(last) + y, mp.im(1j * self.frequency * last) + rate

    def mapped(self, amplitude: mpf, state: State) -> tuple[State, list[tuple[str, mpf]]]:
        """Follow a state below the stop over a period: the end, and for each phase its name and its largest x."""
        time, phase, held, deepest = mpf(0), "off", mpf(0), []
        while time < self.period():
            force = self.force(phase, held)

            def at(t: mpf, force: tuple[mpf, mpf] = force, start: State = state, begin: mpf = time) -> State:
                return self.moved(force, amplitude, begin, start, t)

            time, state, following = self._change(phase, held, time, at)
            deepest.append((phase, state[0]))
            if following == "sticks":
                held = self._held(phase, state[0])
            phase = following
        return state, deepest

    def _held(self, phase: str, x: mpf) -> mpf:
        """Where the slider's spring has no torque, once it sticks."""
        carried = {"off": mpf(0), "forward": self.limit, "backward": -self.limit}[phase]
        return x - carried / self.spring

    def _change(self, phase: str, held: mpf, begin: mpf, at: Callable[[mpf], State]) -> tuple[mpf, State, str]:
        """The first change of phase, or the end of the period: its time, the state there, and the phase after it."""
        reach = self.limit / self.spring
        bounds: dict[str, Callable[[State], mpf]] = {
            "off": {"sticks": lambda z: 1 - z[0]},
            "sticks": {
                "off": lambda z: z[0] - 1,
                "forward": lambda z: held + reach - z[0],
                "backward": lambda z: z[0] - held + reach,
            },
            "forward": {"sticks": lambda z: z[1]},
            "backward": {"sticks": lambda z: -z[1], "off": lambda z: z[0] - 1},
        }[phase]
        low, step = begin, self.period() / _SCAN
        while low < self.period():
            high = min(low + step, self.period())
            high = _turn(at, low, high) if phase == "sticks" and low > begin else high
            left = {name: bound for name, bound in bounds.items() if bound(at(high)) < 0}
            if low == begin:
                low += step / mpf(2) ** 90
            if left:
                times = {
                    name: mp.findroot(lambda t, b=bound: b(at(t)), (low, high), solver="anderson", tol=mp.eps**1.8)
                    for name, bound in left.items()
                }
                name = min(times, key=lambda key: times[key])
                return times[name], at(times[name]), name
            low = high
        return self.period(), at(self.period()), phase


def _turn(at: Callable[[mpf], State], low: mpf, high: mpf) -> mpf:
    """The end of a step, or where the velocity falls to zero within it."""
    if at(low)[1] <= mp.eps ** mpf("0.5") or at(high)[1] >= 0:
        return high
    return mp.findroot(lambda t: at(t)[1], (low, high), solver="anderson", tol=mp.eps**1.8)


def touching(stop: Stop, amplitude: mpf, state: State) -> tuple[mpf, State]:
    """Return the amplitude and the state at t = 0 of the motion, near a guess, whose slider is about to slip.

    The slider's limit is taken away for the search; the deepest x of the motion is then 1 + H / s.
    """
    endless = Stop(stop.frequency, stop.spring, mpf(100))

    def equations(x: mpf, v: mpf, a: mpf) -> list[mpf]:
        end, _ = endless.mapped(a, (x, v))
        return [end[0] - x, end[1] - v, peak(endless, a, (x, v)) - 1 - stop.limit / stop.spring]

    x, v, a = newton(lambda z: equations(*z), [*state, amplitude])
    return a, (x, v)


def peak(stop: Stop, amplitude: mpf, state: State) -> mpf:
    """Return the largest x of a motion over the period, by the zero of its velocity while it sticks."""
    time, phase, held = mpf(0), "off", mpf(0)
    while True:
        force = stop.force(phase, held)

        def at(t: mpf, force: tuple[mpf, mpf] = force, start: State = state, begin: mpf = time) -> State:
            return stop.moved(force, amplitude, begin, start, t)

        if phase == "sticks":
            low, step = time, stop.period() / _SCAN
            while at(low + step)[1] > 0:
                low += step
            t = mp.findroot(lambda t: at(t)[1], (low, low + step), solver="anderson", tol=mp.eps**1.8)
            return at(t)[0]
        time, state, phase = stop._change(phase, held, time, at)
        if phase == "sticks":
            held = mpf(1)


def orbit(stop: Stop, amplitude: mpf, near: State) -> State:
    """Return the state at t = 0 of the motion that repeats, near a guess."""

    def gap(x: mpf, v: mpf) -> list[mpf]:
        end, _ = stop.mapped(amplitude, (x, v))
        return [end[0] - x, end[1] - v]

    x, v = newton(lambda z: gap(*z), list(near))
    return x, v


def gradient(stop: Stop, amplitude: mpf, state: State) -> mp.matrix:
    """Return the gradient of the map over a period, by central differences."""
    h, columns = mpf(10) ** (-mp.dps // 3), []
    for j in range(2):
        ends = [
            stop.mapped(amplitude, (state[0] + sign * h * (j == 0), state[1] + sign * h * (j == 1)))[0]
            for sign in (1, -1)
        ]
        columns.append([(a - b) / (2 * h) for a, b in zip(*ends, strict=True)])
    return mp.matrix(columns).T
