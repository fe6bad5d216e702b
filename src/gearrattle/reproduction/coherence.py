"""Sec. 9: coherences of the accelerations of case 2, as printed, and ours against two references and chance.

The mean of gamma^2 over five harmonics, four segments of 128 points (``signals.coherence``). Beside them the ceiling:
exact against exact begun 1e-12 half-gaps away, which no algorithm can be expected to beat.

Takes a Bench; gives a section.
"""

from __future__ import annotations

from collections.abc import Iterator

from gearrattle.comparison.coherence import compare_coherence
from gearrattle.report.tables import Table
from gearrattle.reproduction import printed
from gearrattle.reproduction.bench import Bench, Scope, Setup
from gearrattle.reproduction.digits import figure
from gearrattle.reproduction.record import DIFFERS, NOISE, REPRODUCED, UNAVAILABLE, UNDECIDED, Row, Section, row
from gearrattle.signals.coherence import ENSEMBLES, HARMONICS, by_chance

CASE, CYCLES, SAMPLES = 2, 135, 512
BODIES = ("flywheel", "hub", "input_gear", "output_gear")
CHANCE = by_chance(ENSEMBLES, HARMONICS)
KINDS = {"rattling": False, "loaded": True}


def setup_of(scope: Scope, algorithm: str, *, loaded: bool, nearby: bool = False) -> Setup:
    """A run of case 2, finely sampled."""
    step = {"rk2": printed.RK2_STEP, "rk4": printed.RK4_STEP}.get(algorithm)
    cycles = scope.coherent(CYCLES)
    return Setup(CASE, loaded, algorithm, cycles, step=step, samples=SAMPLES, nearby=nearby)


def needs(scope: Scope) -> Iterator[Setup]:
    """The paper's three schemes, its reference, the exact one and its neighbour."""
    for loaded in KINDS.values():
        for algorithm in ("exact", "rk2", *(algorithm for algorithm, _ in printed.COHERENCES.values())):
            yield setup_of(scope, algorithm, loaded=loaded)
        yield setup_of(scope, "exact", loaded=loaded, nearby=True)


def kappa(bench: Bench, given: Setup, reference: Setup) -> tuple[float, ...] | None:
    """(4,) mean coherences of a run with a reference; None without either."""
    mine, theirs = bench.run(given), bench.run(reference)
    if mine is None or theirs is None:
        return None
    found = compare_coherence(mine.trajectory, theirs.trajectory)
    return tuple(found[name].mean for name in BODIES)


def section(bench: Bench) -> Section:
    """Compare the twelve coherences."""
    found = dict(_all(bench))
    rows = [row for label in printed.COHERENCES for row in _rows(label, found)]
    rows += [_ceiling(found), _hardest(found)]
    words = (
        f"Case 2. Two independent signals give {CHANCE.bias:.2f} on average with four segments; a mean over five bins "
        f"lies between {CHANCE.mean_low:.2f} and {CHANCE.mean_high:.2f} in 90 of 100 cases, and the 95 % threshold of "
        f"one bin is {CHANCE.threshold:.2f}. The paper prints neither, nor its sampling rate. Where two motions follow "
        "one excitation, harmonics are coherent for that alone: a high coherence does not say that a motion is right."
    )
    return Section("coherence", "Section 9: coherence", words, tuple(rows), (_table(found),))


def _all(bench: Bench) -> Iterator[tuple[tuple[str, str, str], tuple[float, ...] | None]]:
    """(label, kind of load, reference) -> kappas."""
    for kind, loaded in KINDS.items():
        exact = setup_of(bench.scope, "exact", loaded=loaded)
        for label, (algorithm, _) in printed.COHERENCES.items():
            for reference in ("rk2", "exact"):
                judge = setup_of(bench.scope, reference, loaded=loaded)
                yield (label, kind, reference), kappa(bench, setup_of(bench.scope, algorithm, loaded=loaded), judge)
        yield ("RK2", kind, "exact"), kappa(bench, setup_of(bench.scope, "rk2", loaded=loaded), exact)
        away = setup_of(bench.scope, "exact", loaded=loaded, nearby=True)
        yield ("exact, 1e-12 away", kind, "exact"), kappa(bench, away, exact)


Found = dict[tuple[str, str, str], tuple[float, ...] | None]


def _rows(label: str, found: Found) -> Iterator[Row]:
    for i, (body, paper) in enumerate(zip(BODIES, printed.COHERENCES[label][1], strict=True)):
        item = f"Sec. 9, coherence of {label}, theta_{i + 1}'' ({body})"
        told: list[str] = []
        figures: dict[str, float] = {}
        for kind in KINDS:
            pair = [found[label, kind, reference] for reference in ("rk2", "exact")]
            if pair[0] is not None and pair[1] is not None:
                told.append(f"{kind}: {pair[0][i]:.2f} with RK2, {pair[1][i]:.2f} with exact")
                figures |= {f"{kind}_rk2": pair[0][i], f"{kind}_exact": pair[1][i]}
        noise = paper <= CHANCE.mean_high
        if noise:
            why = f"independent signals give {CHANCE.mean_low:.2f} to {CHANCE.mean_high:.2f}"
        else:
            why = "nor the sampling rate"
        status = NOISE if noise else UNDECIDED if told else UNAVAILABLE
        yield row(item, f"{paper:g}", "; ".join(told) or UNAVAILABLE, status, why, **figures)


def _ceiling(found: Found) -> Row:
    told: list[str] = []
    figures: dict[str, float] = {}
    for kind in KINDS:
        values = found["exact, 1e-12 away", kind, "exact"]
        if values is not None:
            told.append(f"{kind}: {', '.join(f'{value:.2f}' for value in values)}")
            figures |= {f"{kind}_{body}": value for body, value in zip(BODIES, values, strict=True)}
    why = (
        "the exact motion against itself, begun 1e-12 half-gaps away: where this falls short of 1, a low coherence "
        "says nothing about an algorithm"
    )
    return row("Sec. 9, coherence as a measure of agreement", "the solutions of algorithms are compared by it",
               "; ".join(told), DIFFERS, why, **figures)  # fmt: skip


def _hardest(found: Found) -> Row:
    """Sec. 9: it is more difficult to find the solution at I_2."""
    lowest = [
        BODIES[min(range(4), key=lambda i: values[i])]
        for (_, _, reference), values in found.items()
        if values is not None and reference == "exact"
    ]
    hub = sum(name == "hub" for name in lowest)
    told = f"the hub's is the lowest in {hub} of {len(lowest)} comparisons with exact"
    return row("Sec. 9, the solution at I_2 is the hardest", "lowest coherence at theta_2''", told,
               REPRODUCED if 2 * hub > len(lowest) else DIFFERS,
               "in the paper by values that cannot be told from zero; which inertia is lowest depends on the loads",
               hub=hub, of=len(lowest))  # fmt: skip


def _table(found: Found) -> Table:
    lines = tuple(
        (label, kind, reference, *(figure(value, 2) for value in values))
        for (label, kind, reference), values in found.items()
        if values is not None
    )
    paper = tuple(
        (f"{label}, as printed", "?", "rk2", *(f"{value:g}" for value in values))
        for label, (_, values) in printed.COHERENCES.items()
    )
    return Table(("algorithm", "load", "reference", *BODIES), (*paper, *lines), frozenset({0, 1, 2}), "Coherences")
