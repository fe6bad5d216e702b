"""The measured numbers as a page of the manual."""

from __future__ import annotations

from typing import Any

import numpy as np

HEAD = """\
# Growth with size

Written by `make growth` on {date}; do not edit. The numbers behind it: `docs/reference/growth.json`.

Machine: {machine}. Versions: {versions}. One process, one thread.

## What is measured

Chains and binary trees of n inertias with n / 2 clearances, each loaded by its own torque, so that every clearance
rattles and a longer train is more of the same (`benchmarks/growth/plant.py`). {cycles} periods from rest, one sample a
period, the fastest of {rounds} runs, without the energy audit unless said. The layout of a system (coordinates, sparse
arrays, neighbourhoods) is made once for all its runs and stands apart.

`exact` sweeps a large driveline window by window ({{doc}}`../theory/exact`); every crossing is a change of region. A
*window* is timed on the same train with all gaps closed; what the rattling run takes beyond its windows is its
crossings'. *Near*: the most inertias a crossing is felt by within a window, in rounding.

"""

TABLES = """\
## The march through tables

The same trains by the march that `exact` keeps for small and stiff drivelines. *First*: with the regions built as they
are met, the mean over {cycles} periods. *Again*: the same run with what the first has left of them: where more are met
than the memory set aside for them (1 GiB) holds, some are built again. The
growth of the arrays, which double, is in the memory a region takes.

"""

CHOICE = """\
`exact` takes the sweep where a driveline has more regions than a period has windows, and more than a hundred
(`engine/solvers/scheme_choice.py`).

"""


CALLS = """\
## The public calls

Seconds of processor time of one call on a gearbox of so many inertias / clearances, {cycles} periods simulated, on
{date}; the simulation that a call needs is left out (`benchmarks/growth/calls.py`).

"""


def _table(head: list[str], rows: list[list[str]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|---" + "|--:" * (len(head) - 1) + "|"]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)]) + "\n\n"


def _number(value: float) -> str:
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def exponent(rows: list[dict[str, Any]], key: str, least: int = 0) -> float:
    """Slope of a straight line through (log n, log value), from a least n on."""
    chosen = [(row["n"], row[key]) for row in rows if row["n"] >= least]
    return float(np.polyfit(*np.log(np.array(chosen, dtype=float)).T, 1)[0])


_COLUMNS = (
    ("us a window", "window_us"),
    ("us a crossing", "crossing_us"),
    ("ms a period", "cycle_ms"),
    ("ms a period, audited", "audited_cycle_ms"),
    ("ms of layout", "setup_ms"),
)


def _swept(data: dict[str, Any], shape: str) -> str:
    rows = [row for row in data["sweep"] if row["shape"] == shape]
    head = ["n", "windows a period", "crossings a period", "near", *(title for title, _ in _COLUMNS), "chosen"]
    body = [
        [str(row["n"]), str(row["windows"]), f"{row['crossings']:.0f}", str(row["near"])]
        + [_number(row[key]) for _, key in _COLUMNS]
        + [row["chosen"]]
        for row in rows
    ]
    for title, least in (("exponent, all n", 0), ("exponent, n >= 16", 16)):
        slopes = [f"{exponent(rows, key, least):.2f}" for _, key in _COLUMNS]
        body.append([title, "", f"{exponent(rows, 'crossings', least):.2f}", "", *slopes, ""])
    return f"## {shape.capitalize()}s\n\n" + _table(head, body)


def _tabled(data: dict[str, Any]) -> str:
    head = ["", "regions", "met", "ms a region", "KiB a region", "ms a period, first", "ms a period, again"]
    body = [
        [f"{row['shape']}, n = {row['n']}", str(row["possible"]), str(row["regions"])]
        + [_number(row[key]) for key in ("region_ms", "region_kb", "first_cycle_ms", "again_cycle_ms")]
        for row in data["tables"]
    ]
    return TABLES.format(cycles=data["cycles"]) + _table(head, body)


def _called(calls: dict[str, Any]) -> str:
    """Return the section of the public calls."""
    head = ["call", *(f"{n} / {clearances}" for n, clearances in calls["sizes"])]
    body = [[row["call"], *(f"{seconds:.2g}" for seconds in row["seconds"])] for row in calls["rows"]]
    return CALLS.format(**calls) + _table(head, body)


def page(data: dict[str, Any]) -> str:
    """Return the page."""
    head = HEAD.format(
        date=data["date"],
        machine=data["machine"],
        versions=", ".join(f"{name} {number}" for name, number in data["versions"].items()),
        cycles=data["cycles"],
        rounds=data["rounds"],
    )
    shapes = dict.fromkeys(row["shape"] for row in data["sweep"])
    text = head + "".join(_swept(data, shape) for shape in shapes) + _tabled(data) + CHOICE
    return (text + _called(data["calls"])).rstrip("\n") + "\n"
