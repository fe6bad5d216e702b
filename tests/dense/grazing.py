"""Cases made to touch a corner, by a part 1e-6 to 1e-15 of the corner's deflection, or to miss it by as much.

Two ways. *first*: put the motion at rest on (nearly) a corner at some instant, with everything else at random, and
follow the region's own linear motion back to t = 0. *late*: take a motion with all its crossings, find the largest
deflection of one clearance in the outermost stage, and end that stage there: until that instant nothing changes.
"""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np
from scipy.linalg import expm

from tests.dense.case import Case, run
from tests.dense.families import FAMILIES, random_case, share
from tests.dense.judge import Judge
from tests.dense.plain import matrices
from tests.dense.replay import lowest

PARTS = (1e-6, 1e-8, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14, 1e-15, 0.0)
FIRST = ("chain", "tree", "undamped", "flight", "stages", "one-sided", "error", "critical", "to-ground")
LATE = ("chain", "loop", "undamped", "stages", "bilinear", "resonance", "error", "stiff", "to-ground")


def graze_first(_family: str, rng: random.Random, name: str = "graze") -> Case:
    """Return a case whose start leads to a graze, the first crossing unless another comes before."""
    while True:
        case = random_case(rng.choice(FIRST), rng, name)
        made = case.clearances and _led_to(case, rng)
        if made:
            return made


def _led_to(case: Case, rng: random.Random) -> Case | None:
    """The case started where its linear motion comes to rest on a corner; None if that is no maximum."""
    k = rng.choice(case.clearances)
    corner, part = rng.choice(list(case.laws[k].corners)), rng.choice(PARTS) * rng.choice([-1, 1])
    row = case.rows[k]
    q = case.angle.copy()
    v = case.velocity.copy()
    turn = 2 * np.pi * np.array([share(rng) for _ in case.cycles])  # of the inputs at the graze
    u = np.concatenate([[1.0], np.stack([np.cos(turn), np.sin(turn)], axis=1).ravel()])
    omega = 2 * np.pi * case.cycles / case.period
    error = case.error_cosine @ u[1::2] + case.error_sine @ u[2::2]
    error_rate = (case.error_sine * omega) @ u[1::2] - (case.error_cosine * omega) @ u[2::2]
    q += row * (corner * (1 + part) + error[k] - row @ q) / (row @ row)
    v += row * (error_rate[k] - row @ v) / (row @ row)
    delta = case.rows @ q - error
    inside = -1 if corner > 0 or (corner == 0 and share(rng) < 0.5) else 1
    pieces = [int(np.searchsorted(law.corners, d)) for law, d in zip(case.laws, delta, strict=True)]
    at = int(np.searchsorted(case.laws[k].corners, corner))
    pieces[k] = at if inside < 0 else at + 1
    matrix, _ = matrices(case, tuple(pieces))
    z = np.concatenate([delta, v, u])
    if inside * (matrix @ matrix @ z)[k] <= 0:
        return None
    fastest = max(np.abs(np.linalg.eigvals(matrix)).max(), 1.0 / case.period)
    ahead = 0.0 if share(rng) < 0.15 else 10.0 * share(rng) / fastest
    return _begun(case, expm(-matrix * ahead) @ z)


def _begun(case: Case, z: np.ndarray) -> Case:
    """The case with the state z at t = 0, its inputs turned to the phases they have in z."""
    m, n = case.rows.shape
    cos, sin = z[m + n + 1 :: 2], z[m + n + 2 :: 2]
    waves = {
        name: value
        for kind in ("torque", "error")
        for s, c in [(getattr(case, f"{kind}_sine"), getattr(case, f"{kind}_cosine"))]
        for name, value in ((f"{kind}_sine", s * cos - c * sin), (f"{kind}_cosine", c * cos + s * sin))
    }
    error = waves["error_cosine"].sum(axis=1)
    angle = np.linalg.lstsq(case.rows, z[:m] + error, rcond=None)[0]
    return replace(case, angle=angle, velocity=z[m : m + n], **waves)


def graze_late(_family: str, rng: random.Random, name: str = "graze") -> Case:
    """Return a case whose largest deflection of one clearance just reaches an added corner, or just does not."""
    while True:
        case = random_case(rng.choice(LATE), rng, name)
        made = case.clearances and _ended_at_peak(case, rng)
        if made:
            return made


def _ended_at_peak(case: Case, rng: random.Random) -> Case | None:
    judge = Judge(case, run(case), keep=True)
    judge.judge()
    i = rng.randrange(len(judge.clear))
    k, sign = judge.clear[i], rng.choice([-1, 1])
    best, top = None, 0.0
    for region, segment in judge.segments:
        delta = sign * segment.states[k]
        j = int(np.argmax(delta))
        if delta[j] > top and 0 < j < segment.states.shape[1] - 1:
            best, top = (region, segment, j), float(delta[j])
    if best is None or max(float((sign * s.states[k]).max()) for _, s in judge.segments) > top:
        return None  # none, or at an end of a segment
    region, segment, j = best
    outer = region.upper[i] if sign > 0 else -region.lower[i]
    if outer < np.inf:
        return None
    series = np.stack([-sign * (region.series[i] @ segment.states[:, s]) for s in (j - 1, j)])
    series[1] *= (segment.lengths[j] / region.h) ** np.arange(series.shape[1])
    peak = -float(lowest(series)[0].min())
    until = peak * (1 + rng.choice(PARTS) * rng.choice([-1, 1]))
    element = case.elements[k]
    side = element.drive if sign > 0 else element.coast
    if len(side) > 1 and until <= side[-2][2]:
        return None
    k_last, c_last, _ = side[-1]
    beyond = (k_last * rng.choice([0.0, 0.2, 3.0]) + (k_last == 0.0), c_last * rng.choice([0.0, 1.0, 2.0]), None)
    longer = (*side[:-1], (k_last, c_last, until), beyond)
    changed = replace(element, drive=longer) if sign > 0 else replace(element, coast=longer)
    elements = (*case.elements[:k], changed, *case.elements[k + 1 :])
    return replace(case, elements=elements)


MAKERS = {**dict.fromkeys(FAMILIES, random_case), "graze-first": graze_first, "graze-late": graze_late}
"""How a case of each family is made; 500 seeds of these 20 families are the ten thousand."""
