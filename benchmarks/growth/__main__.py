"""Measure everything and write docs/reference/growth.json and growth.md: ``python -m benchmarks.growth``.

With the word ``calls`` only the seconds of the public calls are measured anew; the rest of the page stays.
"""

from __future__ import annotations

import json
import sys
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from benchmarks.growth import calls
from benchmarks.growth.measure import measure
from benchmarks.growth.page import page
from benchmarks.machine import machine

HOME = Path(__file__).resolve().parents[2] / "docs" / "reference"
PACKAGES = ("gearrattle", "numpy", "scipy", "numba")


def main() -> None:
    """Measure, and write data and page."""
    today = datetime.now(UTC).date().isoformat()
    if sys.argv[1:] == ["calls"]:
        data = json.loads((HOME / "growth.json").read_text(encoding="utf-8"))
    else:
        versions = {package: version(package) for package in PACKAGES}
        data = {"date": today, "machine": machine(), "versions": versions, **measure()}
    data["calls"] = {"date": today, "cycles": calls.CYCLES, "sizes": calls.SIZES, "rows": calls.measure()}
    (HOME / "growth.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    (HOME / "growth.md").write_text(page(data), encoding="utf-8")
    print("wrote docs/reference/growth.json, docs/reference/growth.md")


main()
