"""Choose each peer's cheapest sufficient setting, then time all peers in turn, round after round."""

from __future__ import annotations

import gc
from dataclasses import asdict, dataclass
from time import perf_counter, process_time
from typing import Any

import numpy as np

from benchmarks.peers.base import Outcome, Peer, Prepared
from benchmarks.peers.cvode import ADAMS, BDF
from benchmarks.peers.exact import EXACT
from benchmarks.peers.fixed_step import RK2, RK4
from benchmarks.peers.plant import CYCLES, Plant, plant
from benchmarks.peers.reference import reference
from benchmarks.peers.scipy_ivp import DOP853, RADAU
from benchmarks.peers.sundae import SUNDAE
from benchmarks.peers.taylor import AUTOMATIC, COOLDOWN, HEYOKA

PEERS = (EXACT, HEYOKA, ADAMS, BDF, SUNDAE, DOP853, RADAU, RK2, RK4)
FAST = (EXACT, HEYOKA, RK2, RK4)
"""Those that are through in a minute or two; the others take many."""
ENOUGH = 1e-9
"""Error asked for [half gaps]."""
ROUNDS, SLOW_ROUNDS = 7, 2
TURN = 0.15
"""Length of a turn [s]."""
SLOW = 1.5
PATIENCE = 1.5
SHORT = 12
"""A run of 127 cycles above SLOW [s] is extrapolated from one of about PATIENCE [s], of 2 to SHORT cycles."""
COOLDOWN_TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-10, 1e-12)


@dataclass
class Row:
    """One peer on one case. Processor times in ms; ``ratio``: to that of exact.

    ``crossings``: up to the checked time, ``all_crossings``: in 127 cycles.
    """

    peer: str
    setting: str
    error: float
    reached: bool
    crossings: int
    failed: list[str]
    ms: float = 0.0
    ratio: float = 0.0
    cycles: int = CYCLES
    all_crossings: int = -1
    prepare_ms: float = 0.0


def _length(prepared: Prepared, expected: float) -> int:
    """Return how many cycles to run: all, or as many as a slow peer does in about PATIENCE."""
    if expected <= SLOW:
        return CYCLES
    began = perf_counter()
    prepared.run(2)  # the checked piece may have been mostly fixed cost
    expected = (perf_counter() - began) * CYCLES / 2
    length = CYCLES if expected <= SLOW else max(2, min(SHORT, int(CYCLES * PATIENCE / expected)))
    prepared.run(length)  # it may yet fail
    return length


def choose(peer: Peer, case: Plant, truth: Outcome) -> tuple[Row, Prepared] | None:
    """Walk the ladder from loose to tight and stop where the error is small enough and no crossing is missed.

    If none will do: the setting with the smallest error. Settings that fail, there or later, are named.
    """
    others: list[tuple[Row, Prepared, float]] = []
    failed: list[str] = []
    for label, keywords in peer.settings:
        began = perf_counter()
        prepared = peer.build(case, **keywords)
        try:
            prepared.run(case.checked / 100)  # the first call may compile
            ready = perf_counter()
            outcome = prepared.run(case.checked)
            expected = (perf_counter() - ready) * CYCLES / float(case.checked)
            error = float(np.abs(outcome.deflection - truth.deflection).max())
            enough = error <= ENOUGH and outcome.events in (truth.events, -1)
            row = Row(peer.name, label, error, enough, outcome.events, failed, prepare_ms=1e3 * (ready - began))
            if enough:
                row.cycles = _length(prepared, expected)
                return row, prepared
            others.append((row, prepared, expected))
        except ArithmeticError as why:
            failed.append(f"{label}: {why}")
    for row, prepared, expected in sorted(others, key=lambda entry: entry[0].error):
        try:
            row.cycles = _length(prepared, expected)
            return row, prepared
        except ArithmeticError as why:
            failed.append(f"{row.setting}: {why}")
    return None


def _turn(prepared: Prepared, cycles: int) -> tuple[float, Outcome]:
    """Run for TURN seconds, at least once, with the garbage collector off; return the fastest and what came out."""
    gc.collect()
    gc.disable()
    times: list[float] = []
    while sum(times) < TURN:
        began = process_time()
        outcome = prepared.run(cycles)
        times.append(process_time() - began)
    gc.enable()
    return min(times), outcome


def time_in_turn(chosen: list[tuple[Row, Prepared]]) -> None:
    """Run all peers one after the other, round after round; keep each one's fastest.

    A turn is runs in a row for TURN seconds, so that the first may warm the caches the others have used.
    """
    best = {row.peer: np.inf for row, _ in chosen}
    for number in range(ROUNDS):
        for row, prepared in chosen:
            slow = row.cycles < CYCLES
            if slow and number >= SLOW_ROUNDS:
                continue
            fastest, outcome = _turn(prepared, row.cycles)
            best[row.peer] = min(best[row.peer], fastest * CYCLES / row.cycles)
            row.all_crossings = -1 if slow else outcome.events
    for row, _ in chosen:
        row.ms, row.ratio = 1e3 * best[row.peer], best[row.peer] / best[EXACT.name]


def measure(name: str, peers: list[Peer]) -> dict[str, Any]:
    """Measure a case."""
    case = plant(name)
    truth = reference(case)
    chosen_runs = [choose(peer, case, truth) for peer in peers]
    chosen = [pair for pair in chosen_runs if pair is not None]
    time_in_turn(chosen)
    rows = [asdict(row) for row, _ in chosen]
    return {"case": name, "checked_cycles": str(case.checked), "crossings": truth.events, "peers": rows}


def cooldown(name: str) -> dict[str, Any]:
    """Count heyoka's crossings in 127 cycles with its own cooldown and with ours, tolerance by tolerance."""
    case = plant(name)
    counts = [
        {
            "tolerance": tolerance,
            "automatic": HEYOKA.build(case, tolerance, cooldown=AUTOMATIC).run(CYCLES).events,
            "explicit": HEYOKA.build(case, tolerance, cooldown=COOLDOWN).run(CYCLES).events,
        }
        for tolerance in COOLDOWN_TOLERANCES
    ]
    return {"case": name, "exact": EXACT.build(case).run(CYCLES).events, "counts": counts}
