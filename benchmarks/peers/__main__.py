"""Measure everything and write docs/reference/peers.json and peers.md: ``python -m benchmarks.peers [case ...]``.

With cases named nothing is written, the page goes to the terminal. With ``--fast`` only the fast ones are measured, and
the rows of the others are those of the last page, as multiples of the ``exact`` that they were measured beside.
"""

from __future__ import annotations

import json
import sys
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from benchmarks.machine import machine
from benchmarks.peers.measure import FAST, PEERS, ROUNDS, SLOW_ROUNDS, cooldown, measure
from benchmarks.peers.page import page
from benchmarks.peers.plant import CASES
from benchmarks.peers.taylor import HEYOKA

HOME = Path(__file__).resolve().parents[2] / "docs" / "reference"
PACKAGES = ("gearrattle", "numpy", "scipy", "numba", "heyoka", "scikit-sundae")


def kept(results: list[dict[str, Any]], measured: set[str]) -> list[dict[str, Any]]:
    """Return the cases with the rows that the last page has of peers not measured now, each with its date."""
    last = json.loads((HOME / "peers.json").read_text(encoding="utf-8"))
    order = [peer.name for peer in PEERS]
    cases = []
    for case in results:
        rows = next(case_of_file["peers"] for case_of_file in last["cases"] if case_of_file["case"] == case["case"])
        exact = next(row["ms"] for row in rows if row["peer"] == "exact")
        older = [
            {**row, "ratio": row["ms"] / exact, "date": row.get("date", last["date"])}
            for row in rows
            if row["peer"] not in measured
        ]
        cases.append({**case, "peers": sorted([*case["peers"], *older], key=lambda row: order.index(row["peer"]))})
    return cases


def main(cases: list[str], *, fast: bool) -> None:
    """Measure the cases, say how it goes, write data and page."""
    peers = [peer for peer in (FAST if fast else PEERS) if peer.version]
    missing = sorted({peer.package for peer in (FAST if fast else PEERS) if not peer.version})
    if missing:
        print("not installed, left out:", ", ".join(missing))
    results = []
    for name in cases or CASES:
        print("measuring", name, flush=True)
        results.append(measure(name, peers))
    if fast:
        results = kept(results, {peer.name for peer in peers})
    data = {
        "date": datetime.now(UTC).date().isoformat(),
        "machine": machine(),
        "versions": {package: version(package) for package in PACKAGES if package not in missing},
        "missing": missing,
        "rounds": ROUNDS,
        "slow_rounds": SLOW_ROUNDS,
        "peers": [{"name": peer.name, "formulation": peer.formulation} for peer in (PEERS if fast else peers)],
        "cases": results,
        "cooldown": [cooldown(name) for name in cases or CASES] if HEYOKA in peers else [],
    }
    if cases:
        print(page(data))
        return
    (HOME / "peers.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    (HOME / "peers.md").write_text(page(data), encoding="utf-8")
    print("wrote docs/reference/peers.json, docs/reference/peers.md")


main([word for word in sys.argv[1:] if word != "--fast"], fast="--fast" in sys.argv[1:])
