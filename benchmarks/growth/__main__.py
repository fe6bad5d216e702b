"""Measure everything and write docs/reference/growth.json and growth.md: ``python -m benchmarks.growth``."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from benchmarks.growth.measure import measure
from benchmarks.growth.page import page
from benchmarks.machine import machine

HOME = Path(__file__).resolve().parents[2] / "docs" / "reference"
PACKAGES = ("gearrattle", "numpy", "scipy", "numba")


def main() -> None:
    """Measure, and write data and page."""
    data = {
        "date": datetime.now(UTC).date().isoformat(),
        "machine": machine(),
        "versions": {package: version(package) for package in PACKAGES},
        **measure(),
    }
    (HOME / "growth.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    (HOME / "growth.md").write_text(page(data), encoding="utf-8")
    print("wrote docs/reference/growth.json, docs/reference/growth.md")


main()
