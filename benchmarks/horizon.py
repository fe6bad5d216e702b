"""What rounding comes to at the predictability horizon: measured against fifty digits, on a page of its own.

    make horizon        rewrites docs/reference/horizon.md

Chaotic motions of the paper's cases and of random drivelines, followed up to their horizon by ``exact`` and by the
oracle of ``tests/oracles``.
"""

from __future__ import annotations

import datetime
import math
from pathlib import Path

import numpy as np
from tests.oracles.horizon import Measured, motions

from benchmarks.machine import machine
from gearrattle.engine.system.perturbation_growth import GROWTH, ROUNDING, ROUNDING_95

PAGE = Path(__file__).resolve().parents[1] / "docs" / "reference" / "horizon.md"
SEEDS = 40

TEXT = """# What rounding comes to at the predictability horizon

Written by `make horizon` on {date}; do not edit.

Machine: {machine}.

{count} chaotic motions, the paper's and those of random drivelines (`tests/oracles/random_drivelines.py`, seeds 0 to
{seeds}, all families), were followed to their predictability horizon by `exact` and by an independent solver in 50
digits, all whose horizon lies within 14 cycles. *Error* is the largest of any deflection up to the horizon, in
half-gaps; divided by the growth of {growth:.0e} that defines the horizon it is the *effective rounding*.

| effective rounding | half-gaps |
|---|--:|
| geometric mean | {mean:.1e} |
| standard deviation of the logarithm | factor {factor:.1f} |
| 5 % of the motions are below | {low:.1e} |
| median | {median:.1e} |
| 95 % of the motions are below | {high:.1e} |
| largest | {largest:.1e} |
| stated by the program, typical (`ROUNDING`) | {stated:.0e} |
| stated by the program, 95 of 100 are below (`ROUNDING_95`) | {stated95:.0e} |

A deflection is off by 1e-9 half-gaps for the first time at {earliest:.2f} of the horizon in one motion of ten, at
{half:.2f} in half of them.

| motion | horizon, cycles | crossings | error, half-gaps | effective rounding | 1e-9 passed at, of the horizon |
|---|--:|--:|--:|--:|--:|
{rows}
"""


def page(measured: list[Measured]) -> str:
    """Return the page of what was measured."""
    rounding = np.array([one.rounding for one in measured])
    passed = [one.passed for one in measured]
    rows = [
        f"| {one.name} | {one.cycles:.3g} | {one.crossings} | {one.error:.1e} | {one.rounding:.1e} | "
        f"{'beyond' if math.isinf(one.passed) else f'{one.passed:.2f}'} |"
        for one in measured
    ]
    return TEXT.format(
        date=datetime.date.today().isoformat(),
        machine=machine(),
        count=len(measured),
        seeds=SEEDS - 1,
        growth=GROWTH,
        mean=np.exp(np.mean(np.log(rounding))),
        factor=np.exp(np.std(np.log(rounding))),
        low=np.quantile(rounding, 0.05),
        median=np.median(rounding),
        high=np.quantile(rounding, 0.95),
        largest=np.max(rounding),
        stated=ROUNDING,
        stated95=ROUNDING_95,
        earliest=np.quantile(passed, 0.1),
        half=np.median(passed),
        rows="\n".join(rows),
    )


if __name__ == "__main__":
    PAGE.write_text(page(list(motions(SEEDS))), encoding="utf-8")
