"""Measure everything and write docs/reference/peers.json and peers.md: ``python -m benchmarks.peers [case ...]``.

With cases named nothing is written, the page goes to the terminal.
"""

from __future__ import annotations

import json
import sys
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from benchmarks.machine import machine
from benchmarks.peers.measure import PEERS, ROUNDS, SLOW_ROUNDS, cooldown, measure
from benchmarks.peers.page import page
from benchmarks.peers.plant import CASES
from benchmarks.peers.taylor import HEYOKA

HOME = Path(__file__).resolve().parents[2] / "docs" / "reference"
PACKAGES = ("gearrattle", "numpy", "scipy", "numba", "heyoka", "scikit-sundae")


def main(cases: list[str]) -> None:
    """Measure the cases, say how it goes, write data and page."""
    peers = [peer for peer in PEERS if peer.version]
    missing = sorted({peer.package for peer in PEERS if not peer.version})
    if missing:
        print("not installed, left out:", ", ".join(missing))
    results = []
    for name in cases or CASES:
        print("measuring", name, flush=True)
        results.append(measure(name, peers))
    data = {
        "date": datetime.now(UTC).date().isoformat(),
        "machine": machine(),
        "versions": {package: version(package) for package in PACKAGES if package not in missing},
        "missing": missing,
        "rounds": ROUNDS,
        "slow_rounds": SLOW_ROUNDS,
        "peers": [{"name": peer.name, "formulation": peer.formulation} for peer in peers],
        "cases": results,
        "cooldown": [cooldown(name) for name in cases or CASES] if HEYOKA in peers else [],
    }
    if cases:
        print(page(data))
        return
    (HOME / "peers.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    (HOME / "peers.md").write_text(page(data), encoding="utf-8")
    print("wrote docs/reference/peers.json, docs/reference/peers.md")


main(sys.argv[1:])
