"""The measured numbers as a page of the manual."""

from __future__ import annotations

from typing import Any

from benchmarks.peers.plant import CYCLES

HEAD = """\
# Against other solvers

Written by `make peers` on {date}; do not edit. The numbers behind it: `docs/reference/peers.json`.

Machine: {machine}. Versions: {versions}. One process, one thread.{missing}

## What is measured

Simulations; branches of periodic motions against harmonic balance are in {{doc}}`harmonic_balance`.

The paper's six cases ({{doc}}`../reproduction`) over 127 cycles, dimensionless time 798, from the static equilibrium.
*Error*: the largest deviation of a clearance's deflection, in half gaps, at 226/71 cycles (20/150 s); at 113/142 cycles
(5/150 s) in the rattling cases 2 and 3, which are chaotic. The truth is the independent event-driven solver in 50
digits of `tests/oracles`.

Each solver climbs a ladder of tolerances, from loose to tight, and is timed at the first rung where the error is at
most 1e-9 and every crossing up to there has been found, even if that rung was luck. Where none does, it is timed at its
most accurate rung; its figure stands in brackets. Between corners each gets the same smooth equations in relative
coordinates, scaled, with time in radians of the excitation; at a crossing its parameters change, and it is restarted
where the tool needs that. RK2 and RK4 march the paper's own equations, all in scalars, with the sines by recurrence
(`benchmarks/midpoint.py`): the fastest plain fixed step that we could write. They see no corner, and do not reach the
error.

Times are processor times, the fastest of {rounds} rounds in which all take turns, a turn being runs in a row.
Compilation and the first call are left out for all and stand in the last column of the details. What numba compiles
(RK2, RK4, exact, callbacks) comes from its cache on disk there; from scratch, once an installation, `exact` takes some
twenty seconds. `exact` is timed through `gr.simulate` with its event log and one sample a cycle, as arrays, without the
energy audit; assembly, equilibrium and regions are those of the call before, as the peers' right-hand sides are. The
peers return the end state and a count of crossings. A ~ marks a run too slow to be done
in full: the fastest of {slow_rounds} runs of 2 to 12 cycles, extrapolated.

{formulations}

## Time for 127 cycles, as a multiple of that of `exact`

Smaller is faster. A figure in brackets does not reach the error of 1e-9; RK2 at the paper's step is off by {rk2}
half gaps.

"""

GRAPHICS_PROCESSOR = """\
## On a graphics processor

Not run here. The highest published figure for motions with impacts that we know is that of MPGOS: a pressure-relief
valve of three variables at a tolerance of 1e-10, 4144 trajectories or 4.4e6 periods of the excitation a second on a
GeForce Titan Black ([arXiv:2011.01740](https://arxiv.org/abs/2011.01740)). One core marches case 3, eight variables and
65 crossings a period, at 1.3e4 periods a second ({doc}`cost`). The problems differ; only the orders of magnitude
compare.

"""

COOLDOWN = """\
## Why the cooldown is explicit

After an event heyoka ignores the same event for a *cooldown* which, unless told otherwise, it deduces from the
tolerance. A tooth that touches and leaves within it is not seen to leave, and what follows is another motion. Crossings
found in 127 cycles, with the automatic cooldown / with a cooldown of 1e-9 (a chaotic motion differs by a few per cent
from one tolerance to the next; losing nine in ten is another matter):

"""


def _table(head: list[str], rows: list[list[str]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|---" + "|--:" * (len(head) - 1) + "|"]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)]) + "\n\n"


def _ratio(row: dict[str, Any]) -> str:
    text = f"{row['ratio']:.2f}" if row["ratio"] < 10 else f"{row['ratio']:.0f}"
    text = f"~{text}" if row["cycles"] < CYCLES else text
    text = f"{text}†" if "date" in row else text
    return text if row["reached"] else f"({text})"


def _name(case: str) -> str:
    kind = "loaded" if case.endswith("_loaded") else "rattling"
    return f"case {case[4]}, {kind}"


def _of(case: dict[str, Any], peer: str) -> dict[str, Any] | None:
    return next((row for row in case["peers"] if row["peer"] == peer), None)


def _summary(data: dict[str, Any]) -> str:
    rows = []
    for peer in (p["name"] for p in data["peers"]):
        rows_of_peer = [_of(case, peer) for case in data["cases"]]
        rows.append([peer, *("-" if row is None else _ratio(row) for row in rows_of_peer)])
    return _table(["", *(_name(case["case"]) for case in data["cases"])], rows)


def _older(data: dict[str, Any]) -> str:
    """Say what was not measured with the rest."""
    dates = sorted({row["date"] for case in data["cases"] for row in case["peers"] if "date" in row})
    if not dates:
        return ""
    return f"† Measured on {', '.join(dates)} by wall time, as a multiple of the `exact` beside it.\n\n"


def _count(number: int) -> str:
    return "-" if number < 0 else str(number)


def _detail(case: dict[str, Any]) -> str:
    head = ["", "setting", "error", "crossings", "ms, 127 cycles", "x exact", "crossings, 127 cycles", "once, ms"]
    rows, notes = [], []
    for row in case["peers"]:
        error = f"{row['error']:.0e}" if row["reached"] else f"{row['error']:.0e}, not reached"
        ms = f"{'~' if row['cycles'] < CYCLES else ''}{row['ms']:.1f}"
        counts = (_count(row["crossings"]), _count(row["all_crossings"]))
        once = f"{row['prepare_ms']:.0f}"
        rows.append([row["peer"], row["setting"], error, counts[0], ms, _ratio(row), counts[1], once])
        notes += [f"{row['peer']} fails at {why}." for why in row["failed"]]
    title = f"### {_name(case['case']).capitalize()}\n\n{case['crossings']} crossings up to the checked time.\n\n"
    return title + _table(head, rows) + ("".join(f"{note}\n" for note in notes) + "\n" if notes else "")


def _cooldown(data: dict[str, Any]) -> str:
    if not data["cooldown"]:
        return ""
    tolerances = [entry["tolerance"] for entry in data["cooldown"][0]["counts"]]
    rows = [
        [_name(case["case"]), str(case["exact"]), *(f"{c['automatic']} / {c['explicit']}" for c in case["counts"])]
        for case in data["cooldown"]
    ]
    return COOLDOWN + _table(["", "exact", *(f"{t:.0e}" for t in tolerances)], rows)


def page(data: dict[str, Any]) -> str:
    """Return the page."""
    missing = data["missing"]
    off = [row["error"] for case in data["cases"] for row in case["peers"] if row["peer"] == "RK2"]
    head = HEAD.format(
        date=data["date"],
        machine=data["machine"],
        versions=", ".join(f"{name} {number}" for name, number in data["versions"].items()),
        missing=f" Not installed, left out: {', '.join(missing)}." if missing else "",
        rk2=f"{min(off):.0e} to {max(off):.0e}",
        rounds=data["rounds"],
        slow_rounds=data["slow_rounds"],
        formulations="\n".join(f"- **{peer['name']}**: {peer['formulation']}" for peer in data["peers"]),
    )
    details = "## In detail\n\n" + "".join(_detail(case) for case in data["cases"])
    return (head + _summary(data) + _older(data) + GRAPHICS_PROCESSOR + details + _cooldown(data)).rstrip("\n") + "\n"
