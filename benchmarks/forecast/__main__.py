"""Measure everything and write docs/reference/forecast.json and forecast.md: ``python -m benchmarks.forecast``."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from benchmarks.forecast.measure import measure
from benchmarks.forecast.page import page
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
    (HOME / "forecast.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    (HOME / "forecast.md").write_text(page(data), encoding="utf-8")
    print("wrote docs/reference/forecast.json, docs/reference/forecast.md")


main()
