"""RK4 at the paper's step h = 0.0128: outside its stability region while the gears are in contact.

With R the stability polynomial, |R(h lambda)| <= 1 must hold for every eigenvalue of every region met. Where the mesh
is in contact the paper's step gives 1.69; its limit there is found by bisection. The loaded cases show what follows:
the exact teeth stay in contact, RK4's rattle.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gearrattle.assembly import assemble
from gearrattle.engine.solvers.step_stability import growths
from gearrattle.engine.solvers.tableaus import CLASSICAL
from gearrattle.engine.system.flow import flow_of
from gearrattle.reproduction import printed_values
from gearrattle.reproduction.measurements import Measurements, Scope, Setup
from gearrattle.reproduction.number_formats import counted, several
from gearrattle.reproduction.paper_cases import HALF_GAP, SPEED, load_case
from gearrattle.reproduction.reproduction_record import DIFFERS, Row, Section, row
from gearrattle.results import Run

CYCLES = 127
SETTLED = 20
SAMPLES = 128
_DIGITS = 1e-9


def setup_of(scope: Scope, case: int, algorithm: str) -> Setup:
    """A run of a loaded case, longer than its start-up."""
    step = {"rk2": printed_values.RK2_STEP, "rk4": printed_values.RK4_STEP}.get(algorithm)
    return Setup(case, True, algorithm, max(40, scope.cycles(CYCLES)), step=step, samples=SAMPLES)


def needs(scope: Scope) -> Iterator[Setup]:
    """The loaded cases with exact, RK4 and RK2."""
    for case in (1, 2, 3):
        for algorithm in ("exact", "rk4", "rk2"):
            yield setup_of(scope, case, algorithm)


def growth(step: float) -> float:
    """Largest |R(h lambda)| of RK4 over all regions with the mesh in contact; step in units of 1/omega."""
    system = assemble(load_case(1, loaded=True)).system
    pieces: set[tuple[int, ...]] = {(clutch, 0, gear) for clutch in range(system.laws[0].pieces) for gear in (0, 2)}
    return max(growths(CLASSICAL, step / SPEED, flow_of(system), pieces).values())


def limit() -> float:
    """The longest stable step, by bisection."""
    stable = 0.0
    unstable = printed_values.RK4_STEP
    while unstable - stable > _DIGITS:
        middle = 0.5 * (stable + unstable)
        stable, unstable = (middle, unstable) if growth(middle) <= 1.0 + 1e-12 else (stable, middle)
    return stable


def section(measurements: Measurements) -> Section:
    """Show the growth and what it invents."""
    factor = growth(printed_values.RK4_STEP)
    longest = limit()
    first = row(
        "Tables 3 and 4, RK4's step",
        f"h = {printed_values.RK4_STEP:g}",
        f"a mode grows by {factor:.2f} a step in contact; the limit is h = {longest:.7f}",
        DIFFERS,
        "the step lies outside RK4's stability region",
        growth=factor,
        limit=longest,
    )
    words = (
        f"Loaded cases 1 to 3, after {SETTLED} cycles of start-up. The exact mesh never separates there; neither does "
        "that of RK2 at the paper's step."
    )
    return Section("unstable-step", "RK4's step", words, (first, *(_row(measurements, case) for case in (1, 2, 3))))


def separations(run: Run) -> int:
    """Crossings of the mesh's corners after the start-up."""
    t = run.trajectory
    gear = t.layout.clearance_names.index("gear")
    return int(np.sum((t.events.clearance == gear) & (t.events.time > SETTLED * t.layout.period)))


def _row(measurements: Measurements, case: int) -> Row:
    # loaded runs of three algorithms
    item = f"Sec. 9, RK4 gives compatible solutions, loaded case {case}"
    runs = {name: measurements.run(setup_of(measurements.scope, case, name)) for name in ("exact", "rk4", "rk2")}
    exact = runs["exact"]
    rk4 = runs["rk4"]
    rk2 = runs["rk2"]
    if exact is None or rk4 is None or rk2 is None:
        return row(item, "compatible", "a run did not come to an end", DIFFERS, "a run did not come to an end")
    # contact and deflection of the gears under RK4
    t = rk4.trajectory
    gear = t.layout.clearance_names.index("gear")
    share = float(np.mean(t.region[t.time > SETTLED * t.layout.period, gear] != 0))
    reach = np.max(np.abs(t.deflection[:, gear])) / HALF_GAP
    # separations of the teeth
    none = separations(exact)
    some = separations(rk4)
    fine = separations(rk2)
    summary = (
        f"RK4: {several(some, 'crossing')} in the mesh, |delta_3| up to {reach:.2f} half-gaps, in contact "
        f"{100 * share:.0f} % of the time; exact: {counted(none)}; RK2 at h = 0.001: {counted(fine)}"
    )
    return row(
        item,
        "compatible with the others",
        summary,
        DIFFERS,
        "RK4 invents the rattle",
        exact=none,
        rk4=some,
        rk2=fine,
        reach=float(reach),
        contact=share,
    )
