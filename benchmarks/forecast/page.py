"""The score as a page of the manual."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.forecast.measure import WITHIN, score
from benchmarks.forecast.models import KINDS

HEAD = """\
# Forecasts of contact ratios, scored

Written by `make forecast` on {date}; do not edit. The numbers behind it: `docs/reference/forecast.json`.

Machine: {machine}. Versions: {versions}.

{count} seeded drivelines (`benchmarks/forecast/models.py`): the paper's cases with other loads, phases, speeds and
clearances, and small trains. `gr.contact_ratio(model, ...)` is compared with the ratios of an exact run from static
equilibrium over {cycles} periods, {discard} discarded. Clearances that stay in contact all the time count for nothing:
every forecast gets them right. *Linearised*: the fixed point most searches ended at, as linearisation leaves it.
*Told*: what is returned, the ratios of a stable motion where one was found ({{doc}}`../theory/contact_ratio`).

"""

TAIL = """\
A stable motion is a solution of the equations, but not always the one the run from equilibrium settles on: where its
error is large, another motion exists beside it. Where no stable motion was found, what is told is linearisation's.

A forecast took {forecast:.1f} s on average ({slowest:.0f} s the slowest), the exact run {run:.2f} s: a forecast shows
several motions and which of them are stable; for the ratios alone of the motion that begins at rest, simulate.
"""

_GROUPS = (
    ("all", lambda row: row["kind"] in KINDS),
    ("paper cases, varied", lambda row: row["kind"] == "paper"),
    ("small trains", lambda row: row["kind"] == "train"),
    ("a stable motion found", lambda row: row["motion"] == "stable"),
    ("an unstable one only", lambda row: row["motion"] == "unstable"),
    ("none found", lambda row: row["motion"] in ("not found", "no fixed point")),
)


def _table(data: dict[str, Any], key: str, title: str) -> str:
    head = ["", "drivelines", "clearances"]
    for name in ("linearised", "told"):
        head += [f"{name}: median error", f"within {WITHIN:g}", "largest"]
    lines = ["| " + " | ".join(head) + " |", "|---" + "|--:" * (len(head) - 1) + "|"]
    for label, belongs in _GROUPS:
        rows = [row for row in data["rows"] if belongs(row)]
        cells = [label, str(len(rows)), ""]
        for name in ("linearised", "told"):
            scored = score(rows, name, key)
            cells[2] = f"{scored['clearances']:.0f}"
            if scored["clearances"]:
                cells += [f"{scored['median']:.4f}", f"{100 * scored['within']:.0f} %", f"{scored['largest']:.2f}"]
            else:
                cells += ["–"] * 3
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join([f"## {title}", "", *lines]) + "\n\n"


def page(data: dict[str, Any]) -> str:
    """Return the page."""
    rows = data["rows"]
    head = HEAD.format(
        date=data["date"],
        machine=data["machine"],
        versions=", ".join(f"{name} {number}" for name, number in data["versions"].items()),
        count=len(rows),
        cycles=data["cycles"],
        discard=data["discard"],
    )
    spent = {key: [row[key] for row in rows] for key in ("forecast_s", "run_s")}
    tail = TAIL.format(
        forecast=np.mean(spent["forecast_s"]), slowest=np.max(spent["forecast_s"]), run=np.mean(spent["run_s"])
    )
    tables = _table(data, "mean_slope", "Mean slope") + _table(data, "gain", "Equivalent gain")
    return head + tables + tail
