"""The truth at the checked time: the independent solver in 50 digits of ``tests/oracles``."""

from __future__ import annotations

from typing import Any

from mpmath import mp
from tests.literature.paper_cases import paper_case
from tests.oracles.exact_mp import solve_at
from tests.oracles.fixed_point import P, fixed

from benchmarks.peers.base import Outcome
from benchmarks.peers.plant import Plant, half_gaps, load
from gearrattle.assembly import assemble


def reference(plant: Plant) -> Outcome:
    """Return deflections [half gaps] and crossings up to the checked time; takes seconds."""
    driveline: Any = paper_case(int(plant.name[4]), plant.name.endswith("loaded"))
    with mp.workprec(2 * P):
        end = fixed(driveline.period * plant.checked.numerator / plant.checked.denominator)
    solution = solve_at(driveline, [0, end])
    clear = list(plant.clearances)
    gap = half_gaps(assemble(load(plant.name)).system)
    return Outcome(solution.array("deflection")[-1][clear] / gap[clear], len(solution.events))
