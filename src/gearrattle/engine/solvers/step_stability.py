"""Stability of a fixed step: |R(h lambda)| <= 1 for every eigenvalue of every visited region.

With a step outside this region a mode grows in the computation although it decays (as with the RK4 step of the 1995
paper).
"""

from __future__ import annotations

from collections import Counter
from math import ceil

import numpy as np
from numpy.typing import NDArray

from gearrattle.derived_values import kept
from gearrattle.engine.solvers.tableaus import Tableau
from gearrattle.engine.system.flow import Flow

IntArray = NDArray[np.int64]

_STEP_OVER_FASTEST = 0.25
_GROSS = 1.01  # steps are tried in this ratio before the limit is bisected
ROUNDING = 1e-9
_MOST_KEPT = 4096
MOST_REGIONS = 256
FEWEST_REGIONS = 8
_WORK = 2e8  # sum of the cubes of their orders: about a second of eigenvalues


def most_regions(states: int) -> int:
    """Return how many state matrices of this order have their eigenvalues found in about a second, 8 to 256."""
    return int(np.clip(_WORK / max(states, 1) ** 3, FEWEST_REGIONS, MOST_REGIONS))


def eigenvalues(flow: Flow, pieces: tuple[int, ...]) -> NDArray[np.complex128]:
    """(N,) eigenvalues of one region in relative coordinates [1/s]; those of a flow's first regions are kept."""
    known = _known(flow)
    if pieces in known:
        return known[pieces]
    n = flow.states
    values = np.linalg.eigvals(flow.generator(pieces)[:n, :n] / flow.system.inputs.period).astype(complex)
    if len(known) < _MOST_KEPT:
        known[pieces] = values
    return values


@kept
def _known(_flow: Flow) -> dict[tuple[int, ...], NDArray[np.complex128]]:
    """Eigenvalues of regions of this flow, filled as they are asked for: a train visits thousands, run after run."""
    return {}


def default_step(flow: Flow, start: tuple[int, ...]) -> float:
    """0.25 / max |lambda| over the region at start and that with all elements in contact, down to T / integer [s]."""
    contact = tuple(law.pieces - 1 for law in flow.system.laws)
    fastest = max(float(np.abs(eigenvalues(flow, pieces)).max()) for pieces in (start, contact))
    period = flow.system.inputs.period
    return period / max(1, ceil(period * fastest / _STEP_OVER_FASTEST * (1.0 - ROUNDING)))


def largest_stable_step(tableau: Tableau, values: NDArray[np.complex128]) -> float:
    """Largest step up to which no mode grows: |R(h lambda)| <= 1 for all smaller steps too; infinite without modes.

    values: eigenvalues of every region of interest [1/s].
    """
    fastest = float(np.abs(values).max(initial=0.0))
    if fastest == 0.0:
        return float("inf")

    def grows(step: float) -> bool:
        return float(tableau.growth(step * values).max()) > 1.0 + ROUNDING

    high = 1e-3 / fastest
    while not grows(high):
        if high * fastest > 1e3:
            return float("inf")
        high *= _GROSS
    low = high / _GROSS
    while grows(low) and low * fastest > 1e-12:
        low /= 2.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if grows(middle) else (middle, high)
    return low


def regions_visited(
    flow: Flow, start: tuple[int, ...], clearance: IntArray, to_piece: IntArray
) -> tuple[set[tuple[int, ...]], int]:
    """The pieces of all elements, region by region, that a log of crossings (E,) leads through most often.

    Returns as many regions as can be decomposed in about a second, all of most drivelines; and how many
        there are.
    """
    pieces = list(start)
    clearances = flow.system.clearances
    visits = Counter([tuple(pieces)])
    for k, target in zip(clearance.tolist(), to_piece.tolist(), strict=True):
        pieces[clearances[k]] = target
        visits[tuple(pieces)] += 1
    return {region for region, _ in visits.most_common(most_regions(flow.states))}, len(visits)


def growths(tableau: Tableau, step: float, flow: Flow, regions: set[tuple[int, ...]]) -> dict[tuple[int, ...], float]:
    """The largest factor by which a step [s] multiplies a mode, in each of some regions."""
    return {region: float(tableau.growth(step * eigenvalues(flow, region)).max()) for region in sorted(regions)}


def labels_of(flow: Flow, region: tuple[int, ...]) -> list[int]:
    """Region labels of the clearances, 0 in the centre."""
    return [region[k] + flow.system.laws[k].first_label for k in flow.system.clearances]


def stability_notes(
    tableau: Tableau, step: float, flow: Flow, regions: set[tuple[int, ...]], count: int
) -> tuple[str, ...]:
    """A note if the step lies outside the stability region in any region, or not all ``count`` are looked at."""
    region, worst = max(growths(tableau, step, flow, regions).items(), key=lambda item: item[1])
    if worst <= 1.0 + ROUNDING:
        if len(regions) == count:
            return ()
        few = f"the {len(regions)} regions visited most often, of {count}"
        return (f"{tableau.name}: the step {step:.6g} s is stable in {few}; the others were not looked at.",)
    return (
        f"{tableau.name}: the step {step:.6g} s is unstable in region {labels_of(flow, region)}: a mode grows by "
        f"{worst:.4g} a step there; what follows may be invented by the algorithm. Use a smaller step or 'exact'.",
    )
