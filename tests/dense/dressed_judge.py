"""Hold a motion of a dressed driveline against the dense check: ``judge`` for drivelines with more on board.

The statement is that of ``judge``, and besides, with modes as ``modes`` defines them,

* at each logged switch what it is about has the value at which it changes, and goes the way it is said to;
* between them no slider carries more than its limit nor slips against itself, no damper pushes or pulls more than it
  may, and whichever is limited would;
* the stiffness of alternating elements changes at all of its instants, and at no others;
* the log of corners is the same motion's as the log of everything; and
* stretches and modes stored at the samples are those of the state reached there.
"""

from __future__ import annotations

from dataclasses import replace
from math import comb

import numpy as np

from gearrattle.engine.solvers import Motion
from gearrattle.engine.system.crossings_in_order import Auxiliaries, Passages
from tests.dense.dressed import Dressed
from tests.dense.dressed_plain import Inside, inside, layout_of, rate_rows, unit_of
from tests.dense.judge import FORCED, LATE, PENETRATION, ROUNDINGS, Verdict
from tests.dense.modes import OFF, STICKS, Impossible, Modes, after, at_start, read, stretch
from tests.dense.plain import EPS
from tests.dense.replay import follow
from tests.dense.rounding import sums_of

TOGETHER = 8 * EPS
"""Of the time: two instants as near as this may come in either order."""


def no_auxiliaries(motion: Motion) -> Auxiliaries:
    """What a motion without auxiliaries would say of them: only its crossings."""
    log, none = motion.crossings, np.zeros((len(motion.angle), 0))
    upward = (log.to_piece > log.from_piece).astype(np.int64)
    passages = Passages(log.time, log.clearance, upward, log.velocity, np.zeros((len(log.time), 0)))
    return Auxiliaries(none, none, none.astype(np.int64), np.zeros(0, np.int64), passages)


class DressedJudge:
    """A case, its motion, and the regions met; ``verdict`` is what came out."""

    def __init__(self, case: Dressed, motion: Motion) -> None:
        self.case = case
        self.motion = motion
        self.verdict = Verdict()
        self.place = layout_of(case)
        self.auxiliaries = motion.auxiliaries or no_auxiliaries(motion)
        self.clear, self.known = list(case.clearances), {}
        self.time = np.arange(len(motion.angle)) * (case.period / case.samples)
        sums, signals = sums_of(case), case.signals
        if signals is not None:
            most = np.abs(signals.coefficients * unit_of(case) ** np.arange(signals.degree + 1)).sum(axis=2).max(axis=0)
            sums = replace(sums, carried=sums.carried + np.abs(signals.error) @ most)
        self.sums, self.first_slider = sums, len(self.clear) + 2 * len(case.clipped)
        states = np.abs([self.state(j)[0] for j in range(len(self.time))])
        self.size = FORCED * states.max(axis=0)
        moving, root = slice(self.place.m, self.place.stretches), np.sqrt(case.inertia)
        self.size[moving] = (self.size[moving] * root).max() / root
        for i, slider in enumerate(case.sliders):  # a spring that sticks is carried along with its deflection
            at = self.place.stretches + i
            self.size[at] = max(self.size[at], self.size[slider.element])
        self.modes = self._initial()

    def _initial(self) -> Modes:
        """The modes the run begins in: by the check's own rules, where they do not depend on rounding."""
        said = read(self.case, self.motion.initial_piece, self.auxiliaries.initial)
        z, _ = self.state(0)
        rate = rate_rows(self.case, self.place, signs=True) @ z
        own = at_start(self.case, said.pieces, z[: self.place.m], rate)
        if (own.sliders, own.lacking) != (said.sliders, said.lacking):
            self.verdict.faults.append(f"start: {said} instead of {own}")
        for k, limit, mine in zip(self.case.clipped, said.limits, own.limits, strict=True):
            corner = np.abs(z[k] - self.case.laws[k].corners).min()
            if limit != mine and corner > 1e-9 * np.abs(self.case.laws[k].corners).max():
                self.verdict.faults.append(f"start: element {k} has the limits {limit} instead of {mine}")
        return said

    def now(self) -> Inside:
        """The region the log is in."""
        if self.modes not in self.known:
            self.known[self.modes] = made = inside(self.case, self.modes)
            self.verdict.hold("step matrix", made.region.disagreement, 64 * EPS, f"{self.modes}")
        return self.known[self.modes]

    def scale(self, watch: int) -> float:
        """The size of what is watched in the present modes, of which a part of 1e-12 is not promised."""
        case, i = self.case, watch - self.first_slider
        if i < 0:
            k = self.clear[watch] if watch < len(self.clear) else case.clipped[(watch - len(self.clear)) // 2]
            corner = float(np.abs(case.laws[k].corners).max())
            return corner if corner > 0 else float(np.abs(self.motion.deflection[:, self.clear.index(k)]).max()) or 1.0
        if i >= len(case.sliders):
            return 1.0
        return case.sliders[i].reach / (1.0 if self.modes.sliders[i] in (STICKS, OFF) else case.period)

    def inputs(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """One, cosines and sines, and chains of the interval that begins at or before a time; and their rounding."""
        phase = 2 * np.pi * self.case.cycles * (time / self.case.period)
        waves = np.concatenate([[1.0], np.stack([np.cos(phase), np.sin(phase)], axis=1).ravel()])
        noise = EPS * (1 + 2 * np.pi * np.repeat(self.case.cycles, 2) * (1 + time / self.case.period))
        chain, sums = self.chain(time)
        return np.concatenate([waves, chain]), np.concatenate([[0.0], noise, EPS * sums])

    def chain(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """p_j of every channel, and the sums of the sizes of their terms."""
        signals = self.case.signals
        if signals is None:
            return np.zeros(0), np.zeros(0)
        g = int(np.clip(np.searchsorted(signals.knots, time, side="right") - 1, 0, len(signals.knots) - 2))
        order = signals.degree + 1
        unit = unit_of(self.case)
        x = time - signals.knots[g]
        a = signals.coefficients[g]
        move = np.array(
            [[comb(i, j) * x ** max(i - j, 0) * unit**j if i >= j else 0.0 for i in range(order)] for j in range(order)]
        )
        return (a @ move.T).ravel(), (np.abs(a) @ move.T * (2 + np.arange(order))).ravel()

    def state(self, j: int) -> tuple[np.ndarray, np.ndarray]:
        """(Z,) state at sample j as the stored angles make it, and the angles."""
        case, position = self.case, self.place
        u, _ = self.inputs(self.time[j])
        q, v = (case.angle, case.velocity) if j == 0 else (self.motion.angle[j], self.motion.velocity[j])
        waves, chain = u[: position.chain - position.one], u[position.chain - position.one :]
        error = case.error_cosine @ waves[1::2] + case.error_sine @ waves[2::2]
        if case.signals is not None:
            error = error + case.signals.error @ chain[:: case.signals.degree + 1]
        first = 2 * len(case.clipped)
        e = self.auxiliaries.memory[j, first : first + len(case.sliders)]
        return np.concatenate([case.rows @ q - error, v, e if j else 0.0 * e, u]), q

    def anchor(self, j: int) -> tuple[np.ndarray, np.ndarray]:
        """State and its squared rounding as stored at sample j; linear elements' deflections from the angles."""
        case = self.case
        position = self.place
        (z, q) = self.state(j)
        delta = z[: position.m]
        noise = self.sums.from_angles(case.rows, q, delta, values=j == 0)
        if j:
            stored = self.motion.deflection[j]
            for i, k in enumerate(self.clear):
                self.verdict.hold("stored deflection", abs(stored[i] - delta[k]), ROUNDINGS * noise[k], f"sample {j}")
            delta[self.clear] = stored
            noise[self.clear] = self.sums.stored(delta)[self.clear]
        rest = EPS * np.abs(z[position.m : position.one])
        noise = np.concatenate([noise, rest, self.inputs(self.time[j])[1]])
        return z, np.diag(noise**2)

    def judge(self) -> Verdict:
        """Go through the run, sample by sample."""
        log, faults = self.auxiliaries.passages, self.verdict.faults
        if np.any(np.diff(log.time) < 0) or np.any(log.time < 0) or np.any(log.time > self.time[-1] * (1 + 4 * EPS)):
            faults.append("crossings are not in order of time, or outside the run")
            return self.verdict
        self._ticks()
        self._corners()
        first = np.searchsorted(log.time, self.time, side="right")
        done = 0
        for j in range(len(self.time) - 1):
            z, spread = self.anchor(j)
            self._stored(j, z, spread)
            self._fix(z, self.modes)
            now, passed = self.time[j], 1
            until = first[j + 1] if j + 2 < len(self.time) else len(log.time)
            for e in range(done, until):
                z, spread = self._segment(z, spread, now, log.time[e], passed)
                now, passed = max(now, log.time[e]), passed + 1
                try:
                    z, spread = self._crossing(e, z, spread, passed)
                except Impossible as wrong:
                    faults.append(f"switch: {wrong}, entry {e} of the log at t = {log.time[e]:.17g}")
                    return self.verdict
            z, spread = self._segment(z, spread, now, self.time[j + 1], passed)
            self._arrival(j + 1, z, spread, passed)
            done = until
        self._stored(len(self.time) - 1, *self.anchor(len(self.time) - 1))
        return self.verdict

    def _fix(self, z: np.ndarray, modes: Modes) -> None:
        """Write the stretches that modes know into a state."""
        for i in range(len(self.case.sliders)):
            known = stretch(self.case, modes, i)
            if known is not None:
                z[self.place.stretches + i] = known

    def _ticks(self) -> None:
        """Every change by the clock at its instant."""
        log, first = self.auxiliaries.passages, self.first_slider + len(self.case.sliders)
        end = self.case.length * self.case.period
        for i in range(len(self.case.pairs)):
            reported, due = log.time[log.watch == first + i], self.case.ticks(i)
            reported = reported[reported < end * (1 - TOGETHER)]
            if len(reported) != len(due):
                self.verdict.faults.append(f"tick: {len(reported)} changes of pair {i}, due are {len(due)}")
                continue
            off = np.abs(reported - due) / (LATE * np.maximum(due, self.case.period))
            self.verdict.hold("tick", float(off.max(initial=0.0)), 1.0, f"pair {i}")

    def _corners(self) -> None:
        """The log of corners against the log of everything."""
        log, passages = self.motion.crossings, self.auxiliaries.passages
        for i, k in enumerate(self.clear):
            own, other = log.clearance == i, passages.watch == i
            same = own.sum() == other.sum() and np.array_equal(
                log.to_piece[own] - log.from_piece[own], 2 * passages.upward[other] - 1
            )
            if not same:
                self.verdict.faults.append(f"two logs: they differ in the crossings of element {k}")
                continue
            late = np.abs(log.time[own] - passages.time[other])
            self.verdict.hold("two logs", float(late.max(initial=0.0)), 4 * LATE * self.time[-1], f"element {k}")
            self.verdict.faults += [
                f"two logs: velocity of element {k} at t = {t:.17g}"
                for t, a, b in zip(log.time[own], log.velocity[own], passages.velocity[other], strict=True)
                if a != b
            ]

    def _segment(self, z, spread, now, then, passed):
        """From one instant to another, interval by interval of the polynomials."""
        knots = np.zeros(0) if self.case.signals is None else self.case.signals.knots
        for knot in knots[(knots > now) & (knots < then)]:
            z, spread = self._interval(z, spread, now, knot, passed)
            before, z = self.now().region.matrix @ z, z.copy()
            z[self.place.one :], noise = self.inputs(knot)
            spread[self.place.chain :] = spread[:, self.place.chain :] = 0.0
            at = np.arange(self.place.chain, self.place.width)
            spread[at, at] = noise[self.place.chain - self.place.one :] ** 2
            spread = self._late(spread, before, self.now().region.matrix @ z, knot)
            now = knot
        return self._interval(z, spread, now, then, passed)

    def _late(self, spread, before, behind, now):
        """What it makes of the spread that the instant of a change is rounded; rates (Z,) before and behind it."""
        jump = (behind - before) * (LATE * now)
        jump[self.place.one :] = 0.0
        return spread + np.outer(jump, jump)

    def _interval(self, z, spread, now, then, passed):
        here = self.now()
        region = here.region
        z = np.concatenate([z[: self.place.one], self.inputs(now)[0]])
        segment = follow(region, z, spread, max(then - now, 0.0), sums=self.sums, size=self.size)
        self.verdict.segments += 1
        self.verdict.steps += segment.lengths.size
        hurry = np.abs(region.watch[1] @ segment.states).max(axis=1, initial=0.0)
        terms = EPS * here.probe_size @ np.maximum(np.abs(segment.states).max(axis=1), self.size)
        noise = ROUNDINGS * (np.sqrt(passed) * segment.noise + terms) + hurry * LATE * then
        for i in range(len(region.lower)):
            scale = self.scale(i)
            if i < len(self.clear):
                self.verdict.blur = max(self.verdict.blur, float(noise[i]) / scale)
            for side in (0, 1):
                if segment.gap[i, side] < 0:
                    kind, what = self._named(i)
                    where = f"{what} beyond its {('lower', 'upper')[side]} bound, {self.modes}"
                    where += f" at t = {now + segment.when[i, side]:.17g}"
                    allowed = noise[i] + PENETRATION * scale
                    self.verdict.hold(kind, -segment.gap[i, side], allowed, where)
        return segment.end, segment.spread

    def _named(self, watch: int) -> tuple[str, str]:
        """What is said of it if it is outside its bounds, and its name."""
        if watch < len(self.clear):
            return "outside its region", f"element {self.clear[watch]}"
        if watch < self.first_slider:
            i, which = divmod(watch - len(self.clear), 2)
            return "limit of the damper", f"{('push', 'pull')[which]} of element {self.case.clipped[i]}"
        i = watch - self.first_slider
        return ("slider" if i < len(self.case.sliders) else "pairs"), f"number {i}"

    def _crossing(self, e, z, spread, passed):
        """Judge entry e of the log, z being the state there, and step into what follows."""
        log, here = self.auxiliaries.passages, self.now()
        i = int(log.watch[e])
        upward = int(log.upward[e])
        region = self.now().region
        kind, what = self._named(i)
        self.verdict.crossings += kind != "pairs"
        then, new = after(self.case, self.modes, i, upward)
        where = f"entry {e}: {what} goes {('down', 'up')[upward]}, {self.modes}, t = {log.time[e]:.17g}"
        if kind != "pairs":
            late, bound = LATE * log.time[e], (region.lower, region.upper)[upward][i]
            rows, size = region.watch[:2, i], np.maximum(np.abs(z), self.size)
            curvature = abs(region.watch[2, i] @ z)
            value, rate = rows @ z
            noise = ROUNDINGS * np.sqrt(passed * np.einsum("rz,zy,ry->r", rows, spread, rows))
            terms = ROUNDINGS * EPS * here.probe_size[i]
            position = (
                noise[0] + terms @ size + abs(rate) * late + curvature * late**2 + PENETRATION / 10 * self.scale(i)
            )
            speed = noise[1] + curvature * late + terms @ (region.size @ size)
            self.verdict.hold("on the corner", abs(value - bound), position, where)
            if i < len(self.clear):
                self.verdict.hold("velocity", abs(rate - log.velocity[e]), speed, where)
            self.verdict.hold("direction", max(0.0, (1 - 2 * upward) * rate), speed, where)
        before = region.matrix @ z
        behind = z.copy()
        spread = spread.copy()
        self.modes = then
        for s, value in new.items():
            at = self.place.stretches + s
            behind[at] = value
            spread[at] = spread[:, at] = 0.0
            spread[at, at] = (EPS * value) ** 2
        return behind, self._late(spread, before, self.now().region.matrix @ behind, log.time[e])

    def _arrival(self, j, z, spread, passed) -> None:
        """Hold the state reached at sample j against the one stored."""
        stored, own = self.anchor(j)
        noise = ROUNDINGS * np.sqrt(passed * np.diag(spread) + np.diag(own))
        off = np.abs(z - stored)
        for i in range(self.place.one):
            kind = "deflection" if i < self.place.m else "speed" if i < self.place.stretches else "stretch"
            let = kind == "stretch" and self._beside(self.first_slider + i - self.place.stretches, self.time[j])
            if not let:
                self.verdict.hold(kind, off[i], noise[i], f"state {i} at sample {j}, t = {self.time[j]:.17g}")

    def _beside(self, watch: int, now: float) -> bool:
        """Whether one of those watched, or its element, changes at an instant."""
        log, case = self.auxiliaries.passages, self.case
        owners = [*self.clear, *(k for k in case.clipped for _ in range(2))]
        owners += [entry.element for entry in (*case.sliders, *case.pairs)]
        mine = np.array([owners[w] == owners[watch] for w in log.watch], dtype=bool)
        return bool((mine & (np.abs(log.time - now) <= TOGETHER * max(now, case.period))).any())

    def _stored(self, j, z, spread) -> None:
        """Modes, forces and accelerations stored at sample j, against its state."""
        motion = self.motion
        case = self.case
        position = self.place
        reported = self.modes
        try:
            said = read(case, motion.piece[j], self.auxiliaries.piece[j])
        except Impossible as wrong:
            self.verdict.faults.append(f"piece: {wrong}, sample {j}")
            return
        if said != reported:
            first = self.first_slider
            apart = [i for i, k in enumerate(self.clear) if said.pieces[k] != reported.pieces[k]]
            apart += [len(self.clear) + 2 * i for i in range(len(case.clipped)) if said.limits[i] != reported.limits[i]]
            apart += [first + i for i in range(len(case.sliders)) if said.sliders[i] != reported.sliders[i]]
            first += len(case.sliders)
            apart += [first + i for i in range(len(case.pairs)) if said.lacking[i] != reported.lacking[i]]
            self.verdict.faults += [
                f"piece: sample {j} has {said}, the log {reported}"
                for watch in apart
                if not self._beside(watch, self.time[j])
            ]
        self.modes = said
        here, z = self.now(), z.copy()
        self._fix(z, said)
        self.modes = reported
        spreads = np.sqrt(np.diag(spread)) / EPS
        spreads[position.one : position.chain] = 0.0
        sums = here.force_size @ (np.abs(z) + spreads)
        force, balance = here.force @ z, (here.region.matrix @ z)[position.m : position.stretches]
        spreads[: position.one] = 0.0
        terms = (here.region.size @ (np.abs(z) + spreads))[position.m : position.stretches]
        phase = 1 + 2 * np.pi * case.cycles * self.time[j] / case.period
        waves = (np.abs(case.torque_cosine) + np.abs(case.torque_sine)) @ phase
        terms = terms + (waves + np.abs(case.rows.T) @ sums) / case.inertia
        room = 4 * ROUNDINGS * EPS
        for name, off, size in (
            ("stored force", np.abs(force - motion.force[j]), sums),
            ("stored acceleration", np.abs(balance - motion.acceleration[j]), terms),
        ):
            at = int(np.argmax(off - room * size))
            self.verdict.hold(name, off[at], room * size[at], f"number {at}, sample {j}")


def check_dressed(case: Dressed, motion: Motion) -> Verdict:
    """Judge a motion."""
    return DressedJudge(case, motion).judge()
