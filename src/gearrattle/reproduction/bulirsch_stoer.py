"""Sec. 9: the failure of Bulirsch-Stoer on systems with several nonlinearities, checked with our implementation."""

from __future__ import annotations

from collections.abc import Iterator

from gearrattle.comparison.pointwise import pointwise
from gearrattle.report.tables import Table
from gearrattle.reproduction.measurements import Measurements, Scope, Setup
from gearrattle.reproduction.number_formats import counted, figure
from gearrattle.reproduction.paper_cases import SPEED
from gearrattle.reproduction.reproduction_record import DIFFERS, REPRODUCED, Row, Section, row

CYCLES = 40
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-6, 1e-9, 1e-12)
LOOSE = 1e-3
TIGHT = 1e-6
QUICK = (LOOSE, TIGHT)
_ALIKE = 0.2
OTHERS = ("rkf", "rkv")
"""Other methods, checked for incompatible solutions as well."""
_TWICE = 2.0
KINDS = {"rattling": False, "loaded": True}


def tolerances(scope: Scope) -> tuple[float, ...]:
    """Tolerances that are tried."""
    return QUICK if scope.quick else TOLERANCES


def setup_of(scope: Scope, case: int, tolerance: float | None, *, loaded: bool) -> Setup:
    """A run at a tolerance, or the exact one."""
    name, accuracy = ("exact", 1e-6) if tolerance is None else ("bulirsch-stoer", tolerance)
    return Setup(case, loaded, name, scope.cycles(CYCLES), tolerance=accuracy)


def needs(scope: Scope) -> Iterator[Setup]:
    """Cases 2 and 3 over all tolerances, and exact beside them."""
    for case in (2, 3):
        for loaded in KINDS.values():
            for tolerance in (None, *tolerances(scope)):
                yield setup_of(scope, case, tolerance, loaded=loaded)
        for other in OTHERS:
            yield setup_of(scope, case, LOOSE, loaded=True).at(algorithm=other)


def section(measurements: Measurements) -> Section:
    """Tell how every tolerance ended."""
    lines = [
        line for case in (2, 3) for kind, loaded in KINDS.items() for line in _lines(measurements, case, kind, loaded)
    ]
    words = (
        "Extrapolation assumes a right side smoother than a corner allows, so steps are rejected at every crossing; a "
        "step control that may go on shortening gets past it, one with a floor gives up. Errors are within the first "
        "part of the motion, up to where perturbations have grown a thousandfold."
    )
    table = Table(
        ("case", "load", "tolerance", "outcome", "smallest step", "steps", "rejected", "crossings", "error, half-gaps"),
        tuple(lines),
        frozenset({0, 1, 3}),
        "Bulirsch-Stoer over tolerances",
        "Steps in units of 1/omega. At 1e-12 an error test asks for less than rounding leaves.",
    )
    return Section(
        "bulirsch-stoer", "Bulirsch-Stoer", words, (_row(measurements), _incompatible(measurements)), (table,)
    )


def _lines(measurements: Measurements, case: int, kind: str, loaded: bool) -> Iterator[tuple[str, ...]]:
    truth = measurements.run(setup_of(measurements.scope, case, None, loaded=loaded))
    for tolerance in tolerances(measurements.scope):
        result = measurements.result(setup_of(measurements.scope, case, tolerance, loaded=loaded))
        head = (f"{case}", kind, f"{tolerance:.0e}")
        if result.run is None or truth is None:
            yield (*head, result.status, *["–"] * 5)
            continue
        cost = result.run.cost
        window = min(float(truth.variation.horizon(1e3)), truth.trajectory.end)
        error = pointwise(result.run.trajectory, truth.trajectory, window).worst
        smallest = float("nan") if cost.smallest_step is None else SPEED * cost.smallest_step
        yield (
            *head,
            "done",
            figure(smallest, 2),
            counted(cost.steps),
            counted(cost.rejected_steps),
            counted(cost.events),
            figure(error, 2),
        )


def _incompatible(measurements: Measurements) -> Row:
    """Sec. 9: the only routine that consistently displayed incompatible solutions.

    Reproduced if, on a loaded case, Bulirsch-Stoer has more than twice the crossings of the exact motion at the loose
    tolerance and agrees with it at the tight tolerance, and no other method has more than twice the crossings.
    """
    parts: list[str] = []
    figures: dict[str, float] = {}
    wrong = False
    right = False
    others = []
    # crossings of every algorithm against exact, loaded cases
    for case in (2, 3):
        setup = setup_of(measurements.scope, case, LOOSE, loaded=True)
        setups = {
            "exact": setup_of(measurements.scope, case, None, loaded=True),
            "loose": setup,
            "tight": setup_of(measurements.scope, case, TIGHT, loaded=True),
            **{name: setup.at(algorithm=name) for name in OTHERS},
        }
        runs = {name: run for name, setup in setups.items() if (run := measurements.run(setup)) is not None}
        if len(runs) < len(setups):
            continue
        count = {name: run.cost.events for name, run in runs.items()}
        figures |= {f"case_{case}_{name}": float(number) for name, number in count.items()}
        # more than twice the crossings of exact at the loose tolerance, alike at the tight one
        wrong |= count["loose"] > _TWICE * count["exact"]
        right |= abs(count["tight"] / count["exact"] - 1.0) < _ALIKE
        others += [f"{name}, case {case}" for name in OTHERS if count[name] > _TWICE * count["exact"]]
        parts.append(
            f"case {case}: exact {counted(count['exact'])}, at {LOOSE:g} {counted(count['loose'])}, at {TIGHT:g} "
            f"{counted(count['tight'])}; at {LOOSE:g} " + ", ".join(f"{name} {counted(count[name])}" for name in OTHERS)
        )
    # is it the only one
    alone = wrong and right and not others
    if others:
        why = (
            f"at {LOOSE:g} it is not the only one with more than twice the crossings of exact: {'; '.join(others)} too"
        )
    else:
        why = f"at {LOOSE:g} it is the only one of three; at {TIGHT:g} it agrees with exact"
    return row(
        "Sec. 9, BUS gives incompatible solutions",
        "with several nonlinearities, as the only one of seven",
        f"crossings, loaded: {'; '.join(parts)}",
        REPRODUCED if alone else DIFFERS,
        why,
        **figures,
    )


def _row(measurements: Measurements) -> Row:
    ended = 0
    failed = []
    for case in (2, 3):
        for kind, loaded in KINDS.items():
            for tolerance in tolerances(measurements.scope):
                result = measurements.result(setup_of(measurements.scope, case, tolerance, loaded=loaded))
                if result.run is None:
                    failed.append(f"case {case} {kind} at {tolerance:.0e}")
                else:
                    ended += 1
    total = ended + len(failed)
    summary = f"{ended} of {total} runs came to their end" + (f"; not: {', '.join(failed)}" if failed else "")
    sensible = [label for label in failed if not label.endswith("1e-12")]
    if sensible:
        return row(
            "Table 4, BUS failed to converge", "convergence failures", summary, REPRODUCED, "", ended=ended, of=total
        )
    why = (
        "ours may shorten its step to 1e-14 of a period, and no sensible tolerance makes it fail on these loads; the "
        "paper's step floor, tolerance and loads are not printed"
    )
    return row("Table 4, BUS failed to converge", "convergence failures", summary, DIFFERS, why, ended=ended, of=total)
