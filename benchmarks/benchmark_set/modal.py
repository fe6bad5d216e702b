"""Method A: from corner to corner in closed form, by the eigenvectors of each region, in eighty digits of mpmath.

It reads the published ``problem.json`` and shares nothing with method B (:mod:`tests.oracles.exact_mp`: Taylor series
of the absolute angles in integers): neither the statement of the problem, nor the arithmetic, nor how a corner is met.
In a region a part of the driveline that active elements hold together is linear,

    J q'' + D q' + K q = T(t),   so   q(t) = sum over modes r_m c_m exp(lambda_m t) + polynomial + harmonics.

Where nothing acts on the rigid motion of a part, it is taken off first, for it has a double eigenvalue zero that is
defective. The first crossing comes from a bound: |delta''| stays below the sum of |lambda_m|^2 times the amplitudes, so
that a corner at distance g with closing speed v is out of reach for 2 g / (v + sqrt(v^2 + 2 B g)). Where B g < 0.1 v^2
exactly one root lies ahead and Newton's method polishes it.
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from mpmath import mp, mpf

DIGITS = 80
NEAR = mpf(10) ** -50
"""A deflection this near a corner, in units of the corner, lies on it."""
NIL = mpf(10) ** -40
"""A derivative this small, in units of what its terms add up to, is zero."""
ORDERS = 10
"""Derivatives that are asked which way a motion leaves its corner."""


def number(text: str) -> mpf:
    """A decimal string, or a fraction of two, as an mpf."""
    fraction = Fraction(text)
    return mpf(fraction.numerator) / fraction.denominator


@dataclass
class Modes:
    """Eigenvalues of a part and its state (angles, rates) from and to modal coordinates.

    ``rigid``: the motion that is taken off, or none; ``last``: how the last body then follows from the others.
    """

    bodies: list[int]
    rigid: list[mpf] | None
    last: list[mpf]
    eigenvalues: list[Any]
    shapes: list[list[Any]]
    inverse: list[list[Any]]


class Statement:
    """The numbers of a ``problem.json``."""

    def __init__(self, problem: dict[str, Any]) -> None:
        names = [body["name"] for body in problem["bodies"]]
        self.n = len(names)
        self.inertia = [number(body["inertia"]) for body in problem["bodies"]]
        self.drag = [number(body["drag"]) for body in problem["bodies"]]
        self.speed = number(problem["speed"])
        self.waves: list[tuple[mpf, mpf]] = []
        self.elements = problem["elements"]
        self.rows, self.corners, self.laws, self.labels = [], [], [], []
        self.errors: list[list[tuple[int, mpf]]] = []
        for element in self.elements:
            row = [mpf(0)] * self.n
            for name, factor in zip(element["bodies"], element["factors"], strict=True):
                if name != "ground":
                    row[names.index(name)] += number(factor)
            self.rows.append(row)
            self.corners.append([number(x) for x in element["corners"]])
            self.laws.append(
                [tuple(number(r[key]) for key in ("stiffness", "damping", "offset")) for r in element["regions"]]
            )
            self.labels.append([r["region"] for r in element["regions"]])
            self.errors.append([(self._wave(h), number(h["amplitude"])) for h in element["error"]])
        self.mean = [mpf(0)] * self.n
        self.slope = [mpf(0)] * self.n
        self.torques: list[tuple[int, int, mpf]] = []
        self.breaks: list[tuple[mpf, int, mpf, mpf]] = []
        for load in problem["loads"]:
            body = names.index(load["body"])
            self.mean[body] += number(load["mean"])
            self.torques += [(body, self._wave(h), number(h["amplitude"])) for h in load["harmonics"]]
            before = number(load["mean"])
            for ramp in load["ramps"]:
                begin, over, to = (number(ramp[key]) for key in ("at", "over", "to"))
                slope = (to - before) / over
                self.breaks += [
                    (begin, body, -slope * begin, slope),
                    (begin + over, body, slope * (begin + over), -slope),
                ]
                before = to
        self.breaks.sort(key=lambda change: change[0], reverse=True)
        self.start = [[number(x) for x in problem["start"][key]] for key in ("angle", "velocity")]
        count, turn = problem["samples"]["count"], number(problem["samples"]["per_turn"])
        self.times = [2 * mp.pi * i / (self.speed * turn) for i in range(count + 1)]

    def _wave(self, harmonic: dict[str, str]) -> int:
        wave = (number(harmonic["order"]) * self.speed, number(harmonic["phase"]))
        if wave not in self.waves:
            self.waves.append(wave)
        return self.waves.index(wave)


class Motion:
    """The motion in one region vector from ``time`` on: coefficients of exponentials, powers, harmonics of t - time."""

    def __init__(self, solver: Solver, time: mpf, angle: list[mpf], velocity: list[mpf], region: list[int]) -> None:
        st, self.time = solver.statement, time
        waves = len(st.waves)
        self.frequency = [w for w, _ in st.waves]
        # what acts: constant, slope, cosine and sine parts of every body's torque, errors of the elements included
        wave = [
            mp.cos_sin(w * time + phase) for w, phase in st.waves
        ]  # sin(w (t0 + s) + p) = sine cos ws + cosine sin ws
        constant = [a + b * time for a, b in zip(st.mean, st.slope, strict=True)]
        cosine = [[mpf(0)] * waves for _ in range(st.n)]
        sine = [[mpf(0)] * waves for _ in range(st.n)]
        for body, j, amplitude in st.torques:
            cosine[body][j] += amplitude * wave[j][1]
            sine[body][j] += amplitude * wave[j][0]
        self.error = [(mp.zeros(1, waves), mp.zeros(1, waves)) for _ in st.rows]
        for k, row in enumerate(st.rows):
            stiffness, damping, offset = st.laws[k][region[k]]
            parts = self.error[k]
            for j, amplitude in st.errors[k]:
                parts[0][j] += amplitude * wave[j][1]
                parts[1][j] += amplitude * wave[j][0]
            for i in (i for i in range(st.n) if row[i]):
                constant[i] -= row[i] * offset
                for j in range(waves):
                    w = self.frequency[j]
                    cosine[i][j] += row[i] * (stiffness * parts[0][j] + damping * w * parts[1][j])
                    sine[i][j] += row[i] * (stiffness * parts[1][j] - damping * w * parts[0][j])
        self.torque = (constant, st.slope, cosine, sine)
        # the motion of every part
        self.eigenvalues: list[Any] = []
        self.modes: list[list[tuple[int, Any]]] = [[] for _ in range(st.n)]
        self.powers = [[mpf(0)] * 4 for _ in range(st.n)]
        self.cosine = [[mpf(0)] * waves for _ in range(st.n)]
        self.sine = [[mpf(0)] * waves for _ in range(st.n)]
        for part in solver.parts(tuple(region)):
            self._add(st, part, angle, velocity)
        self._deflect(st)

    def _add(self, st: Statement, part: Modes, angle: list[mpf], velocity: list[mpf]) -> None:
        bodies = part.bodies
        constant, slope, cosine, sine = ([column[i] for i in bodies] for column in self.torque)
        q, v = [angle[i] for i in bodies], [velocity[i] for i in bodies]
        if part.rigid is not None:
            # the rigid motion X: m X'' = sum of r_i T_i, in powers and harmonics
            r, inertia = part.rigid, [st.inertia[i] for i in bodies]
            mass = mp.fsum(a * b * b for a, b in zip(inertia, r, strict=True))
            x, rate = (mp.fsum(a * b * c for a, b, c in zip(inertia, r, y, strict=True)) / mass for y in (q, v))
            a0, a1 = (mp.fdot(r, y) / mass for y in (constant, slope))
            powers = [x, rate, a0 / 2, a1 / 6]
            pushes = []
            for j, w in enumerate(self.frequency):
                a, b = (mp.fdot(r, [column[j] for column in y]) / mass for y in (cosine, sine))
                pushes.append((a, b))
                powers[0] += a / w**2
                powers[1] += b / w
                for i, share in zip(bodies, r, strict=True):
                    self.cosine[i][j] -= share * a / w**2
                    self.sine[i][j] -= share * b / w**2
            for i, share in zip(bodies, r, strict=True):
                self.powers[i] = [a + share * b for a, b in zip(self.powers[i], powers, strict=True)]
            # what is left: angles and torques relative to it, without the last body
            q = [a - share * x for a, share in zip(q, r, strict=True)]
            v = [a - share * rate for a, share in zip(v, r, strict=True)]
            constant = [t - m * share * a0 for t, m, share in zip(constant, inertia, r, strict=True)]
            slope = [t - m * share * a1 for t, m, share in zip(slope, inertia, r, strict=True)]
            cosine, sine = (
                [
                    [t - m * share * push[side] for t, push in zip(column, pushes, strict=True)]
                    for column, m, share in zip(columns, inertia, r, strict=True)
                ]
                for side, columns in enumerate((cosine, sine))
            )
        self._add_modes(st, part, [q, v], [constant, slope, cosine, sine])

    def _add_modes(self, st: Statement, part: Modes, state: list[list[mpf]], torque: list[Any]) -> None:
        size = len(part.eigenvalues) // 2
        if size == 0:
            return
        used = part.bodies[:size]
        start = [*state[0][:size], *state[1][:size]]
        push = [[y[i] / st.inertia[body] for i, body in enumerate(used)] for y in torque[:2]]
        waves = range(len(self.frequency))
        harmonic = [[[y[i][j] / st.inertia[body] for i, body in enumerate(used)] for j in waves] for y in torque[2:]]
        for m, value in enumerate(part.eigenvalues):
            left = part.inverse[m]
            g0, g1 = (mp.fdot(left[size:], y) for y in push)
            # a particular solution of eta' = value eta + g0 + g1 s + harmonics
            powers = [0, g0, g1 / 2, 0] if value == 0 else [-g0 / value - g1 / value**2, -g1 / value, 0, 0]
            steady = []
            for j, w in enumerate(self.frequency):
                a, b = (mp.fdot(left[size:], y[j]) for y in harmonic)
                p = -(value * a + w * b) / (w**2 + value**2)
                steady.append((p, (value * p + a) / w))
            eta = mp.fdot(left, start) - powers[0] - mp.fsum(p for p, _ in steady)
            self._shape(part, m, eta, powers, steady)

    def _shape(self, part: Modes, m: int, eta: Any, powers: list[Any], steady: list[Any]) -> None:
        """Add the mode m to the angles: eta exp(lambda s), powers and harmonics."""
        shape = [row[m] for row in part.shapes[: len(part.eigenvalues) // 2]]
        index = len(self.eigenvalues)
        self.eigenvalues.append(part.eigenvalues[m])
        if part.rigid is not None:  # the last body moves so that the rigid motion stays taken off
            shape.append(mp.fdot(part.last, shape))
        for i, share in zip(part.bodies, shape, strict=True):
            self.modes[i].append((index, share * eta))
            self.powers[i] = [a + mp.re(share * b) for a, b in zip(self.powers[i], powers, strict=True)]
            for j, (p, q) in enumerate(steady):
                self.cosine[i][j] += mp.re(share * p)
                self.sine[i][j] += mp.re(share * q)

    def _deflect(self, st: Statement) -> None:
        """Coefficients of every deflection, exact and as doubles for the march."""
        self.deflection = []
        for k, row in enumerate(st.rows):
            modes: dict[int, Any] = {}
            powers = [mpf(0)] * 4
            cosine = [-x for x in self.error[k][0]]
            sine = [-x for x in self.error[k][1]]
            for i in (i for i in range(st.n) if row[i]):
                for index, coefficient in self.modes[i]:
                    modes[index] = modes.get(index, 0) + row[i] * coefficient
                powers = [a + row[i] * b for a, b in zip(powers, self.powers[i], strict=True)]
                cosine = [a + row[i] * b for a, b in zip(cosine, self.cosine[i], strict=True)]
                sine = [a + row[i] * b for a, b in zip(sine, self.sine[i], strict=True)]
            self.deflection.append((list(modes.items()), powers, cosine, sine))
        m = len(st.rows)
        self.lam = np.array([complex(x) for x in self.eigenvalues], dtype=complex)
        self.amplitude = np.zeros((m, len(self.lam)), dtype=complex)
        for k, (modes_k, _, _, _) in enumerate(self.deflection):
            for index, coefficient in modes_k:
                self.amplitude[k, index] = complex(coefficient)
        self.power = np.array([[float(x) for x in d[1]] for d in self.deflection]).reshape(m, 4)
        self.wave_c, self.wave_s = (
            np.array([[float(x) for x in d[side]] for d in self.deflection]).reshape(m, -1) for side in (2, 3)
        )
        self.w = np.array([float(x) for x in self.frequency])

    def _sum(self, parts: Any, s: mpf, order: int) -> mpf:
        modes, powers, cosine, sine = parts
        values = [mp.re(c * self._power(index, order) * self._exp(index, s)) for index, c in modes]
        values += [
            c * s ** (i - order) * mp.factorial(i) / mp.factorial(i - order) for i, c in enumerate(powers) if i >= order
        ]
        for w, a, b in zip(self.frequency, cosine, sine, strict=True):
            if a or b:
                c, d = mp.cos_sin(w * s)
                turned = ((a, b), (b, -a), (-a, -b), (-b, a))[order % 4]
                values.append(w**order * (turned[0] * c + turned[1] * d))
        self.size = max([abs(x) for x in values], default=mpf(0))
        return mp.fsum(values)

    def _power(self, index: int, order: int) -> Any:
        return self.eigenvalues[index] ** order if order else 1

    def _exp(self, index: int, s: mpf) -> Any:
        if s == 0:
            return 1
        if getattr(self, "_at", None) != s:
            self._at, self._exps = s, {}
        if index not in self._exps:
            self._exps[index] = mp.exp(self.eigenvalues[index] * s)
        return self._exps[index]

    def delta(self, k: int, s: mpf, order: int = 0) -> mpf:
        """A deflection, or a derivative of it, at time + s."""
        return self._sum(self.deflection[k], s, order)

    def state(self, s: mpf) -> tuple[list[mpf], list[mpf]]:
        """Angles and velocities at time + s."""
        angle, velocity = [], []
        for parts in zip(self.modes, self.powers, self.cosine, self.sine, strict=True):
            angle.append(self._sum(parts, s, 0))
            velocity.append(self._sum(parts, s, 1))
        return angle, velocity

    def doubles(self, s: float, end: float) -> tuple[Any, Any, Any]:
        """Deflections, rates, and the bound of their second derivatives from s to the end."""
        e = np.exp(self.lam * s)
        c, d = np.cos(self.w * s), np.sin(self.w * s)
        p = self.power
        delta = (self.amplitude @ e).real + p[:, 0] + s * (p[:, 1] + s * (p[:, 2] + s * p[:, 3]))
        rate = (self.amplitude @ (self.lam * e)).real + p[:, 1] + s * (2 * p[:, 2] + 3 * s * p[:, 3])
        delta += self.wave_c @ c + self.wave_s @ d
        rate += self.wave_s @ (self.w * c) - self.wave_c @ (self.w * d)
        return delta, rate, self.bound(2, s, end)

    def bound(self, order: int, s: float, end: float) -> Any:
        """A bound on the derivatives of that order (2 or more) from s to the end."""
        decayed = np.abs(self.lam) ** order * np.exp(np.minimum(self.lam.real, 0.0) * s)
        powers = {2: 2 * np.abs(self.power[:, 2]) + 6 * np.abs(self.power[:, 3]) * end, 3: 6 * np.abs(self.power[:, 3])}
        waves = np.hypot(self.wave_c, self.wave_s) @ self.w**order
        return 1.000001 * (np.abs(self.amplitude) @ decayed + powers.get(order, 0.0) + waves)


class Solver:
    """Marches from corner to corner and keeps samples and crossings; ``known``: has the modes of the same driveline.

    With ``nudges`` every velocity changes by so much, up or down, at the start and behind every event, as by rounding.
    """

    def __init__(self, problem: dict[str, Any], known: Solver | None = None, nudges: list[mpf] | None = None) -> None:
        self.statement = Statement(problem)
        self.nudges = nudges
        self._signs = random.Random(1)
        self._parts: dict[Any, Modes] = {} if known is None else known._parts

    def parts(self, region: tuple[int, ...]) -> list[Modes]:
        """The parts that active elements hold together, with their modes."""
        st = self.statement
        owner = list(range(st.n))
        active = [k for k, r in enumerate(region) if st.laws[k][r][0] or st.laws[k][r][1]]
        for k in active:
            ends = [i for i in range(st.n) if st.rows[k][i]]
            old, new = owner[ends[0]], owner[ends[-1]]
            owner = [new if x == old else x for x in owner]
        parts = []
        for label in sorted(set(owner)):
            bodies = [i for i in range(st.n) if owner[i] == label]
            inside = tuple((k, region[k]) for k in active if any(st.rows[k][i] for i in bodies))
            key = (tuple(bodies), inside)
            if key not in self._parts:
                self._parts[key] = self._modes(bodies, inside)
            parts.append(self._parts[key])
        return parts

    def _modes(self, bodies: list[int], inside: tuple[tuple[int, int], ...]) -> Modes:
        st, size = self.statement, len(bodies)
        stiffness, damping = mp.zeros(size), mp.zeros(size)
        for i, body in enumerate(bodies):
            damping[i, i] = st.drag[body]
        for k, r in inside:
            row = [st.rows[k][body] for body in bodies]
            for i in range(size):
                for j in range(size):
                    stiffness[i, j] += row[i] * row[j] * st.laws[k][r][0]
                    damping[i, j] += row[i] * row[j] * st.laws[k][r][1]
        rigid = self._rigid(bodies, inside)
        if rigid is not None:
            r = mp.matrix(rigid)
            scale = mp.norm(stiffness) + mp.norm(damping) + 1
            if mp.norm(stiffness * r) + mp.norm(damping * r) > NIL * scale:
                rigid = None
        inertia = [st.inertia[body] for body in bodies]
        use = size if rigid is None else size - 1
        last = [] if rigid is None else [-inertia[j] * rigid[j] / (inertia[-1] * rigid[-1]) for j in range(use)]
        matrix = mp.zeros(2 * use)
        for i in range(use):
            matrix[i, use + i] = mpf(1)
            for j in range(use):
                extra = last[j] if last else 0
                matrix[use + i, j] = -(stiffness[i, j] + extra * stiffness[i, size - 1]) / inertia[i]
                matrix[use + i, use + j] = -(damping[i, j] + extra * damping[i, size - 1]) / inertia[i]
        return Modes(bodies, rigid, last, *eigen(matrix))

    def _rigid(self, bodies: list[int], inside: tuple[tuple[int, int], ...]) -> list[mpf] | None:
        """The motion of a part that deflects none of its elements, or None."""
        ratio = {bodies[0]: mpf(1)}
        for _ in bodies:
            for k, _r in inside:
                ends = [i for i in bodies if self.statement.rows[k][i]]
                if len(ends) == 1:
                    return None
                a, b = ends
                row = self.statement.rows[k]
                if a in ratio and b not in ratio:
                    ratio[b] = -row[a] * ratio[a] / row[b]
                elif b in ratio and a not in ratio:
                    ratio[a] = -row[b] * ratio[b] / row[a]
        return [ratio[i] for i in bodies]

    def solve(self) -> Solution:
        """Follow the motion to the last sample."""
        st = self.statement
        out = Solution([], [], [])
        angle, velocity = st.start
        region = [sum(d > c for c in cs) for d, cs in zip(self._deflections(angle, mpf(0)), st.corners, strict=True)]
        time, end = mpf(0), st.times[-1]
        waiting = list(reversed(st.times))
        breaks = list(st.breaks)
        rates: dict[int, mpf] = {}
        while True:
            while breaks and breaks[-1][0] <= time:
                _, body, constant, slope = breaks.pop()
                st.mean[body] += constant
                st.slope[body] += slope
            before = list(region)
            if self.nudges is not None:
                self._nudge(time, angle, velocity)
            motion, region, skip = self._settle(time, angle, velocity, region)
            for k in (k for k in range(len(region)) if region[k] != before[k] and time > 0):
                out.events.append(
                    (
                        time,
                        k,
                        st.labels[k][before[k]],
                        st.labels[k][region[k]],
                        rates.get(k, motion.delta(k, mpf(0), 1)),
                    )
                )
            until = (breaks[-1][0] if breaks and breaks[-1][0] < end else end) - time
            s = self._first_crossing(motion, region, skip, until)
            while waiting and waiting[-1] < time + s:
                self._sample(motion, waiting.pop(), out)
            if time + s >= end:
                self._sample(motion, end, out)
                return out
            angle, velocity = motion.state(s)
            rates = {k: motion.delta(k, s, 1) for k in range(len(region))}
            time += s
            out.segments += 1

    def _nudge(self, time: mpf, angle: list[mpf], velocity: list[mpf]) -> None:
        """Move the velocities a little, but not those of an element that rests on a corner: it would leave it."""
        st = self.statement
        delta = self._deflections(angle, time)
        resting = {
            i
            for k, corners in enumerate(st.corners)
            if any(abs(delta[k] - c) <= NEAR * abs(c) for c in corners)
            and abs(mp.fdot(st.rows[k], velocity)) < NIL
            and not st.errors[k]
            for i in range(st.n)
            if st.rows[k][i]
        }
        for i in set(range(st.n)) - resting:
            velocity[i] += self.nudges[i] * self._signs.choice((-1, 1))

    def _deflections(self, angle: list[mpf], time: mpf) -> list[mpf]:
        st = self.statement
        errors = [mp.fsum(a * mp.sin(st.waves[j][0] * time + st.waves[j][1]) for j, a in e) for e in st.errors]
        return [mp.fdot(row, angle) - e for row, e in zip(st.rows, errors, strict=True)]

    def _settle(self, time: mpf, angle: list[mpf], velocity: list[mpf], region: list[int]) -> Any:
        """Decide regions of elements on a corner; return the motion, the regions, how long each corner is safe."""
        st = self.statement
        delta = self._deflections(angle, time)
        scale = [max([abs(c) for c in cs], default=mpf(1)) for cs in st.corners]
        on = {
            k: c
            for k, cs in enumerate(st.corners)
            for c, corner in enumerate(cs)
            if abs(delta[k] - corner) <= NEAR * scale[k]
        }
        region = list(region)
        for k, c in on.items():
            region[k] = c if abs(st.labels[k][c]) < abs(st.labels[k][c + 1]) else c + 1
        for _ in range(2 * len(on) + 8):
            motion = Motion(self, time, angle, velocity, region)
            previous, leaves = list(region), {}
            for k, c in on.items():
                inner = c if abs(st.labels[k][c]) < abs(st.labels[k][c + 1]) else c + 1
                leaves[k] = self._first_derivative(motion, k)
                sign = mp.sign(leaves[k][1])
                region[k] = c + 1 if sign > 0 else c if sign < 0 else inner
            if region == previous:
                break
        else:
            raise ArithmeticError("no consistent region")
        skip = {}
        for k, c in on.items():
            order, value = leaves[k]
            side = 1 if region[k] == c else -1
            bound = motion.bound(order + 1, 0.0, 1e300)[k] if order else 0.0
            skip[k, side] = (order + 1) * abs(float(value)) / bound if order and bound > 0 else np.inf
        return motion, region, skip

    def _first_derivative(self, motion: Motion, k: int) -> tuple[int, mpf]:
        for order in range(1, ORDERS + 1):
            value = motion.delta(k, mpf(0), order)
            if abs(value) > NIL * motion.size:
                return order, value
        return 0, mpf(0)

    def _first_crossing(self, motion: Motion, region: list[int], skip: dict[Any, float], until: mpf) -> mpf:
        """March to the first corner that is met; return when, or ``until``."""
        st = self.statement
        m = len(region)
        upper = np.array([float(c[r]) if r < len(c) else np.inf for c, r in zip(st.corners, region, strict=True)])
        lower = np.array([float(c[r - 1]) if r > 0 else -np.inf for c, r in zip(st.corners, region, strict=True)])
        safe = np.zeros((2, m))
        for (k, side), length in skip.items():
            safe[0 if side > 0 else 1, k] = length
        limit, s, end = until, 0.0, float(until)
        roots: dict[tuple[int, int], mpf] = {}
        while True:
            delta, rate, bound = motion.doubles(s, end)
            gap = np.array([upper - delta, delta - lower])
            speed = np.array([rate, -rate])
            with np.errstate(all="ignore"):
                root = np.sqrt(speed**2 + 2 * bound * np.maximum(gap, 0.0))
                step = np.where(speed > 0, 2 * gap / (speed + root), (root - speed) / bound)
            step[np.isinf(gap) | np.isnan(step)] = np.inf
            step = np.where(s < safe, np.maximum(step, safe - s), step)
            ahead = np.where(np.isfinite(gap), gap, 0.0)
            near = (s >= safe) & (speed > 0) & (bound * ahead < 0.1 * speed**2) & np.isfinite(gap)
            for side, k in np.argwhere(near):
                if (side, k) not in roots:
                    corner = st.corners[k][region[k] - int(side)]
                    roots[side, k] = self._polish(motion, int(k), corner, s)
                    limit = min(limit, roots[side, k])
            for side, k in roots:
                step[side, k] = np.inf
            length = float(step.min(initial=np.inf))
            if s + length >= float(limit):
                return limit
            if length < 1e-15 * (s + 1e-300):
                raise ArithmeticError("the march stands still: a corner is grazed more closely than doubles show")
            s += length

    def _polish(self, motion: Motion, k: int, corner: mpf, s: float) -> mpf:
        root = mpf(s)
        for _ in range(12):
            residual = motion.delta(k, root) - corner
            floor = mpf(10) ** (10 - DIGITS) * motion.size
            change = residual / motion.delta(k, root, 1)
            root -= change
            if abs(change) < mpf(10) ** (20 - DIGITS) * abs(root) or abs(residual) < floor:
                return root
        raise ArithmeticError("Newton did not settle")

    def _sample(self, motion: Motion, time: mpf, out: Solution) -> None:
        angle, velocity = motion.state(time - motion.time)
        out.times.append(time)
        out.states.append([*angle, *velocity])


@dataclass
class Solution:
    """Sample times, states (angles, then velocities), and events (time, element, from, to, rate)."""

    times: list[mpf]
    states: list[list[mpf]]
    events: list[tuple[mpf, int, int, int, mpf]]
    segments: int = 0


def eigen(matrix: Any) -> tuple[list[Any], list[list[Any]], list[list[Any]]]:
    """Eigenvalues, eigenvectors as columns, and their inverse: numpy's, polished to all digits.

    With R near the eigenvectors, G = R^-1 A R is nearly diagonal, and R (I + F), F_ij = G_ij / (G_jj - G_ii), is
    nearer: the digits double each time.
    """
    n = matrix.rows
    if n == 0:
        return [], [], []
    rows = [[matrix[i, j] for j in range(n)] for i in range(n)]
    shapes = mp.matrix(np.linalg.eig(np.array(rows, dtype=float))[1].tolist())
    for _ in range(9):
        inverse = mp.inverse(shapes)
        columns = [[shapes[i, j] for i in range(n)] for j in range(n)]
        moved = [[mp.fdot(row, column) for row in rows] for column in columns]
        left = [[inverse[i, j] for j in range(n)] for i in range(n)]
        turned = [[mp.fdot(left[i], moved[j]) for j in range(n)] for i in range(n)]
        values = [turned[i][i] for i in range(n)]
        largest = mpf(0)
        change = mp.eye(n)
        for i in range(n):
            for j in range(n):
                if i != j:
                    change[i, j] = turned[i][j] / (values[j] - values[i])
                    largest = max(largest, abs(change[i, j]))
        if largest < mpf(10) ** (-DIGITS + 22):
            top = max(abs(x) for x in values)
            values = [x if abs(x) > NIL * top else mpf(0) for x in values]
            return values, [[shapes[i, j] for j in range(n)] for i in range(n)], left
        shapes = shapes * change
    raise ArithmeticError("two eigenvalues of a region coincide")
