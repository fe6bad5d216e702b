"""Hold a motion of ``exact`` against the dense check: every sample, every crossing, and every instant in between.

The statement, for each pair of neighbouring samples: start from the deflections and velocities the program stored at
the first, let every region act from one logged crossing to the next, and

1. at each logged crossing the deflection is on the corner, it moves in the logged direction, with the logged velocity;
2. between them no deflection leaves the region the log puts it in: no crossing is missing, none is invented;
3. the state reached at the second sample is the one the program stored; and
4. the pieces, forces and accelerations stored there are those of that state.

Together with the start this covers the whole run, and growth of perturbations over the run plays no part: an error
must show between the samples where it is made. Allowed is the rounding of ``replay`` at the size of the motion, times
``ROUNDINGS`` because both sides round, and the program rounds free and forced motion apart; and for a penetration the
1e-12 of the clearance's scale below which nothing is promised.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gearrattle.engine.solvers import Motion
from tests.dense.case import Case
from tests.dense.plain import EPS, Region, region_of
from tests.dense.replay import Segment, follow
from tests.dense.rounding import sums_of

ROUNDINGS = 6.0
FORCED = 2.0
"""Of the motion's size: a forced motion that the program may add and take away (``kernels.workspace.LARGEST``)."""
LATE = 4 * EPS
"""Of the time: how exactly a logged time can be read, as a float."""
PENETRATION = 1e-12
"""Of the clearance's scale: its largest corner, or its largest deflection where the only corner is at zero."""


@dataclass
class Verdict:
    """Faults in words, and what was looked at.

    Attributes
    ----------
    worst
        largest error of each kind in units of what was allowed.
    blur
        largest rounding allowed to a deflection, relative to its clearance's scale.
    """

    faults: list[str] = field(default_factory=list)
    segments: int = 0
    steps: int = 0
    crossings: int = 0
    blur: float = 0.0
    worst: dict[str, float] = field(default_factory=dict)

    def hold(self, kind: str, error: float, allowed: float, where: str) -> None:
        """Note an error, a fault if it is more than allowed (or not a number)."""
        ratio = error / allowed if allowed > 0 else (0.0 if error == 0 else np.inf)
        self.worst[kind] = max(self.worst.get(kind, 0.0), ratio)
        if not error <= allowed:
            self.faults.append(f"{kind}: off by {error:.3g}, allowed {allowed:.3g}, {where}")


class Judge:
    """A case, its motion, and the regions met; ``verdict`` is what came out, ``segments`` the motion if kept."""

    def __init__(self, case: Case, motion: Motion, keep: bool = False) -> None:
        self.case = case
        self.motion = motion
        self.keep = keep
        self.verdict = Verdict()
        self.clear = list(case.clearances)
        self.m, self.n = case.rows.shape
        self.regions: dict[tuple[int, ...], Region] = {}
        self.pieces = np.zeros(self.m, dtype=np.int64)
        self.pieces[self.clear] = motion.initial_piece
        self.time = np.arange(len(motion.angle)) * (case.period / case.samples)
        corners = np.array([np.abs(case.laws[k].corners).max() for k in self.clear])
        swing = np.abs(motion.deflection).max(axis=0, initial=0.0)
        self.scale = np.where(corners > 0, corners, np.where(swing > 0, swing, 1.0))
        self.sums = sums_of(case)
        self.segments: list[tuple[Region, Segment]] = []
        self.size = FORCED * np.max([np.abs(self.state(j)[0]) for j in range(len(self.time))], axis=0)
        moving, root = slice(self.m, self.m + self.n), np.sqrt(case.inertia)
        self.size[moving] = (
            self.size[moving] * root
        ).max() / root  # a body still at rest moves like the others in time

    def region(self) -> Region:
        """The region the log is in."""
        key = tuple(int(p) for p in self.pieces)
        if key not in self.regions:
            self.regions[key] = region_of(self.case, key)
            self.verdict.hold("step matrix", self.regions[key].disagreement, 64 * EPS, f"region {key}")
        return self.regions[key]

    def inputs(self, time: float) -> np.ndarray:
        """(1 + 2 H) constant, cosines and sines."""
        phase = 2 * np.pi * self.case.cycles * (time / self.case.period)
        return np.concatenate([[1.0], np.stack([np.cos(phase), np.sin(phase)], axis=1).ravel()])

    def state(self, j: int) -> tuple[np.ndarray, np.ndarray]:
        """(Z,) state at sample j as the stored angles make it, and the angles."""
        case, u = self.case, self.inputs(self.time[j])
        q, v = (case.angle, case.velocity) if j == 0 else (self.motion.angle[j], self.motion.velocity[j])
        error = case.error_cosine @ u[1::2] + case.error_sine @ u[2::2]
        return np.concatenate([case.rows @ q - error, v, u]), q

    def anchor(self, j: int) -> tuple[np.ndarray, np.ndarray]:
        """State and its squared rounding as stored at sample j; linear elements' deflections from the angles."""
        case, (z, q) = self.case, self.state(j)
        delta = z[: self.m]
        v = z[self.m : self.m + self.n]
        u = z[self.m + self.n :]
        noise = self.sums.from_angles(case.rows, q, delta, values=j == 0)
        if j:
            stored = self.motion.deflection[j]
            for i, k in enumerate(self.clear):
                self.verdict.hold("stored deflection", abs(stored[i] - delta[k]), ROUNDINGS * noise[k], f"sample {j}")
            delta[self.clear] = stored
            noise[self.clear] = self.sums.stored(delta)[self.clear]
        phase = EPS * (1 + 2 * np.pi * np.repeat(case.cycles, 2) * (1 + self.time[j] / case.period))
        noise = np.concatenate([noise, EPS * np.abs(v), [0.0], phase])
        return np.concatenate([delta, v, u]), np.diag(noise**2)

    def judge(self) -> Verdict:
        """Go through the run, sample by sample."""
        log = self.motion.crossings
        if np.any(np.diff(log.time) < 0) or np.any(log.time < 0) or np.any(log.time > self.time[-1] * (1 + 4 * EPS)):
            self.verdict.faults.append("crossings are not in order of time, or outside the run")
            return self.verdict
        first = np.searchsorted(log.time, self.time, side="right")
        done = 0
        for j in range(len(self.time) - 1):
            z, spread = self.anchor(j)
            self._stored(j, z, spread)
            now, passed = self.time[j], 1
            until = first[j + 1] if j + 2 < len(self.time) else len(log.time)
            for e in range(done, until):
                z, spread = self._segment(z, spread, now, log.time[e], passed)
                now, passed = max(now, log.time[e]), passed + 1
                before = self.region().matrix
                if not self._crossing(e, z, spread, passed):
                    return self.verdict
                jump = (self.region().matrix - before) @ z * (LATE * now)
                spread = spread + np.outer(jump, jump)
            z, spread = self._segment(z, spread, now, self.time[j + 1], passed)
            self._arrival(j + 1, z, spread, passed)
            done = until
        self._stored(len(self.time) - 1, *self.anchor(len(self.time) - 1))
        return self.verdict

    def _segment(self, z, spread, now, then, passed):
        region = self.region()
        z = np.concatenate([z[: self.m + self.n], self.inputs(now)])
        segment = follow(region, z, spread, max(then - now, 0.0), sums=self.sums, size=self.size)
        self.verdict.segments += 1
        self.verdict.steps += segment.lengths.size
        hurry = np.abs(region.watch[1] @ segment.states).max(axis=1, initial=0.0)
        noise = ROUNDINGS * np.sqrt(passed) * segment.noise + hurry * LATE * then
        self.verdict.blur = max(self.verdict.blur, float(np.max(noise / self.scale, initial=0.0)))
        for i, k in enumerate(self.clear):
            allowed = noise[i] + PENETRATION * self.scale[i]
            for side in (0, 1):
                if segment.gap[i, side] < 0:
                    where = f"element {k} beyond its {('lower', 'upper')[side]} corner in piece {self.pieces[k]}"
                    where += f" at t = {now + segment.when[i, side]:.17g}"
                    self.verdict.hold("outside its region", -segment.gap[i, side], allowed, where)
        if self.keep:
            self.segments.append((region, segment))
        return segment.end, segment.spread

    def _crossing(self, e, z, spread, passed) -> bool:
        """Judge logged crossing e, z being the state there, and step into the region beyond."""
        log, case = self.motion.crossings, self.case
        i = int(log.clearance[e])
        before = int(log.from_piece[e])
        after = int(log.to_piece[e])
        k = self.clear[i]
        law, where = case.laws[k], f"crossing {e} of element {k}, {before} -> {after}, t = {log.time[e]:.17g}"
        self.verdict.crossings += 1
        if before != self.pieces[k] or abs(after - before) != 1 or not 0 <= after <= law.corners.size:
            self.verdict.faults.append(f"crossing: the element is in piece {self.pieces[k]}, {where}")
            return False
        region = self.region()
        late = LATE * log.time[e]
        rows = region.watch[:2, i]
        curvature = abs(region.watch[2, i] @ z)
        delta, rate = rows @ z
        noise = ROUNDINGS * np.sqrt(passed * np.einsum("rz,zy,ry->r", rows, spread, rows))
        corner = law.corners[min(before, after)]
        position = noise[0] + abs(rate) * late + curvature * late**2 + PENETRATION / 10 * self.scale[i]
        speed = noise[1] + curvature * late + ROUNDINGS * EPS * (region.size[k] @ np.abs(z))
        self.verdict.hold("on the corner", abs(delta - corner), position, where)
        self.verdict.hold("velocity", abs(rate - log.velocity[e]), speed, where)
        self.verdict.hold("direction", max(0.0, (before - after) * rate), speed, where)
        self.pieces[k] = after
        return True

    def _arrival(self, j, z, spread, passed) -> None:
        """Hold the state reached at sample j against the one stored."""
        stored, own = self.anchor(j)
        noise = ROUNDINGS * np.sqrt(passed * np.diag(spread) + np.diag(own))
        off = np.abs(z - stored)
        for i in range(self.m + self.n):
            kind = "deflection" if i < self.m else "speed"
            self.verdict.hold(kind, off[i], noise[i], f"state {i} at sample {j}, t = {self.time[j]:.17g}")

    def _stored(self, j, z, spread) -> None:
        """Pieces, forces and accelerations stored at sample j, against its state."""
        motion, case = self.motion, self.case
        log, now = motion.crossings, self.time[j]
        for i, k in enumerate(self.clear):
            if motion.piece[j, i] != self.pieces[k]:
                others = (log.clearance == i) & (np.abs(log.time - now) <= 8 * EPS * max(now, case.period))
                if not others.any():
                    self.verdict.faults.append(
                        f"piece: sample {j} has element {k} in {motion.piece[j, i]}, the log in {self.pieces[k]}"
                    )
        pieces = self.pieces.copy()
        pieces[self.clear] = motion.piece[j]
        k, c, f = (
            np.array([getattr(law, name)[p] for law, p in zip(case.laws, pieces, strict=True)])
            for name in ("stiffness", "damping", "offset")
        )
        region = self.region()
        delta, rate = z[: self.m], region.matrix[: self.m] @ z
        sums = k * np.sqrt(np.diag(spread)[: self.m]) / EPS
        sums += [np.abs(law.offset).max() for law in case.laws]
        sums += c * np.sqrt(np.sum((region.size[: self.m] * np.sqrt(np.diag(spread))) ** 2, axis=1)) / EPS
        sums += c * (region.size[: self.m] @ np.abs(z))
        force = k * delta + c * rate + f
        u = z[self.m + self.n :]
        torque = case.mean + case.torque_cosine @ u[1::2] + case.torque_sine @ u[2::2]
        balance = (torque - case.drag * z[self.m : self.m + self.n] - case.rows.T @ force) / case.inertia
        phase = 1 + 2 * np.pi * case.cycles * now / case.period
        terms = np.abs(case.mean) + (np.abs(case.torque_cosine) + np.abs(case.torque_sine)) @ phase
        terms = (terms + case.drag * np.abs(z[self.m : self.m + self.n]) + np.abs(case.rows.T) @ sums) / case.inertia
        room = 4 * ROUNDINGS * EPS
        for name, off, size in (
            ("stored force", np.abs(force - motion.force[j]), sums),
            ("stored acceleration", np.abs(balance - motion.acceleration[j]), terms),
        ):
            at = int(np.argmax(off - room * size))
            self.verdict.hold(name, off[at], room * size[at], f"number {at}, sample {j}")


def check(case: Case, motion: Motion) -> Verdict:
    """Judge a motion."""
    return Judge(case, motion).judge()
