"""One region of a dressed driveline as a plain linear system: deflections, stretches and polynomials are all states.

z = (delta, q', e, 1, cos, sin, ..., p), with the stretch e of every slider's spring and, for every channel of
polynomials, p_j = L^j p^(j) / j!, L the longest interval:

    delta' = W q' - e_t',   J q'' = T + A p_0 - D q' - W^T F,   e' = delta' where it sticks,   L p_j' = (j + 1) p_(j+1)

with e_t the transmission error and F every element's whole force in the modes given: the elastic force k delta + f
less what is lacking, twice that where the damper is held down to it, nothing where it is held up to it, else with
c delta'; and s e of the sliders.

Watched, in the order of ``modes``: deflections; (E - c s delta') / k and (E + c s delta') / k of clipped contacts on
side s; e or delta' of sliders; nothing of alternating elements.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.dense.dressed import Dressed
from tests.dense.modes import BACKWARD, FORWARD, STICKS, Modes, contact
from tests.dense.plain import Region, region_between


@dataclass(frozen=True)
class Layout:
    """Where the states stand: m deflections, n velocities, stretches, 1, pairs of cosine and sine, chains."""

    m: int
    n: int
    stretches: int
    one: int
    chain: int
    width: int

    @property
    def cos(self) -> np.ndarray:
        """Columns of the cosines; the sines stand behind each."""
        return np.arange(self.one + 1, self.chain, 2)


def layout_of(case: Dressed) -> Layout:
    """The layout of a case."""
    m, n = case.rows.shape
    one = m + n + len(case.sliders)
    chain = one + 1 + 2 * case.cycles.size
    return Layout(m, n, m + n, one, chain, chain + (0 if case.signals is None else case.signals.coefficients[0].size))


def unit_of(case: Dressed) -> float:
    """L, the longest interval of the polynomials."""
    return 1.0 if case.signals is None else float(np.diff(case.signals.knots).max())


@dataclass(frozen=True)
class Inside:
    """A region, the rows of all forces in it (m, Z), and the same and the probes' (K, Z) in absolute terms."""

    region: Region
    force: np.ndarray
    force_size: np.ndarray
    probe_size: np.ndarray


def coefficients(case: Dressed, modes: Modes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """k, c, f of every element, (m,) each, without sliders."""
    k, c, f = (
        np.array([getattr(law, name)[p] for law, p in zip(case.laws, modes.pieces, strict=True)])
        for name in ("stiffness", "damping", "offset")
    )
    for pair, lacks in zip(case.pairs, modes.lacking, strict=True):
        if lacks:
            k[pair.element] *= 1.0 - pair.lacking
            f[pair.element] *= 1.0 - pair.lacking
    for e, (push, pull) in zip(case.clipped, modes.limits, strict=True):
        if push or pull:
            k[e], c[e], f[e] = (2.0 * k[e], 0.0, 2.0 * f[e]) if push else (0.0, 0.0, 0.0)
    return k, c, f


def sizes(case: Dressed, modes: Modes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sizes of the terms k, c, f are sums of: offsets from zero deflection on, and what auxiliaries take or add."""
    others = [*case.clipped, *(pair.element for pair in case.pairs)]
    terms = 1.0 + np.isin(np.arange(len(case.laws)), others)
    k, c = (
        np.array([getattr(law, name)[p] for law, p in zip(case.laws, modes.pieces, strict=True)])
        for name in ("stiffness", "damping")
    )
    return terms * k, terms * c, terms * np.array([np.abs(law.offset).max() for law in case.laws])


def rate_rows(case: Dressed, layout: Layout, *, signs: bool) -> np.ndarray:
    """(m, Z) delta' of every element."""
    a, minus = (np.asarray, -1.0) if signs else (np.abs, 1.0)
    rows = np.zeros((layout.m, layout.width))
    omega = 2 * np.pi * case.cycles / case.period
    rows[:, layout.m : layout.stretches] = a(case.rows)
    rows[:, layout.cos] = minus * a(case.error_sine) * omega
    rows[:, layout.cos + 1] = a(case.error_cosine) * omega
    if case.signals is not None and case.signals.degree:
        order = case.signals.degree + 1
        rows[:, layout.chain + 1 :: order] = minus * a(case.signals.error) / unit_of(case)
    return rows


def matrices(case: Dressed, modes: Modes, *, signs: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """M (Z, Z) and the forces' rows (m, Z); with absolute terms unless ``signs``."""
    position = layout_of(case)
    a, minus = (np.asarray, -1.0) if signs else (np.abs, 1.0)
    k, c, f = coefficients(case, modes)
    if not signs:
        k, c, f = sizes(case, modes)
    rates = rate_rows(case, position, signs=signs)
    force = c[:, None] * rates
    force[:, : position.m] += np.diag(k)
    force[:, position.one] += f
    for i, slider in enumerate(case.sliders):
        force[slider.element, position.stretches + i] += slider.spring
    M = np.zeros((position.width, position.width))
    M[: position.m] = rates
    moving = slice(position.m, position.stretches)
    torque = np.zeros((position.n, position.width))
    torque[:, position.one] = a(case.mean)
    torque[:, position.cos], torque[:, position.cos + 1] = a(case.torque_cosine), a(case.torque_sine)
    torque[:, moving] += minus * np.diag(case.drag)
    if case.signals is not None:
        order, first = case.signals.degree + 1, position.chain
        torque[:, first::order] = a(case.signals.torque)
        for j in range(position.width - first):
            if j % order < order - 1:
                M[first + j, first + j + 1] = (j % order + 1) / unit_of(case)
    M[moving] = (torque + minus * a(case.rows).T @ force) / case.inertia[:, None]
    for i, slider in enumerate(case.sliders):
        if modes.sliders[i] == STICKS:
            M[position.stretches + i] = rates[slider.element]
    omega = 2 * np.pi * case.cycles / case.period
    M[position.cos, position.cos + 1] = minus * omega
    M[position.cos + 1, position.cos] = omega
    return M, force


def probes(case: Dressed, modes: Modes, *, signs: bool = True) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What is watched, (K, Z), and its bounds, (K,) each; rows with absolute terms unless ``signs``."""
    position = layout_of(case)
    a, minus = (float, -1.0) if signs else (abs, 1.0)
    rates, unit = rate_rows(case, position, signs=signs), np.eye(position.width)
    rows = []
    lower = []
    upper = []

    def watch(row: np.ndarray, low: float = -np.inf, high: float = np.inf) -> None:
        rows.append(row)
        lower.append(low)
        upper.append(high)

    for k in case.clearances:
        corners = [-np.inf, *case.laws[k].corners, np.inf]
        watch(unit[k], *corners[modes.pieces[k] : modes.pieces[k] + 2])
    for k, limits in zip(case.clipped, modes.limits, strict=True):
        law = case.laws[k]
        p = modes.pieces[k]
        side = contact(case, k, modes.pieces[k])
        for sign, limited in ((minus, limits[0]), (1.0, limits[1])):
            if not side:
                watch(0.0 * unit[k])
                continue
            row = sign * a(side) * (law.damping[p] / law.stiffness[p]) * rates[k]
            row[k] += a(side)
            row[position.one] += a(side * law.offset[p] / law.stiffness[p])
            watch(row, *((-np.inf, 0.0) if limited else (0.0, np.inf)))
    for i, slider in enumerate(case.sliders):
        word = modes.sliders[i]
        if word == STICKS:
            watch(unit[position.stretches + i], -slider.reach, slider.reach)
        elif word in (FORWARD, BACKWARD):
            watch(rates[slider.element], *((0.0, np.inf) if word == FORWARD else (-np.inf, 0.0)))
        else:
            watch(0.0 * unit[0])
    for _ in case.pairs:
        watch(0.0 * unit[0])
    return np.array(rows).reshape(-1, position.width), np.array(lower), np.array(upper)


def inside(case: Dressed, modes: Modes) -> Inside:
    """Everything the check needs of one region."""
    M, force = matrices(case, modes)
    size, force_size = matrices(case, modes, signs=False)
    rows, lower, upper = probes(case, modes)
    slowest = 2 * np.pi / case.period
    region = region_between(M, size, rows, lower=lower, upper=upper, slowest=slowest)
    return Inside(region, force, force_size, probes(case, modes, signs=False)[0])
