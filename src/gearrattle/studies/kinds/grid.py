"""The kind "grid": all combinations of values, and values that scatter.

    outputs = ["regime", "impacts per cycle"]
    most = 2_000_000                         # cases allowed, if more than a million

    [fixed]                                  # other values of the model, by path
    "simulation.cycles" = 60

    [axis]                                   # what is varied in order, all combinations
    "mesh.gear.backlash" = { from = "0.02 mm", to = "0.2 mm", count = 10, spacing = "log" }
    load = { "torque.0.mean" = [5, 10], "inertia.gear.drag_torque" = [0.5, 1.0] }    # together

    [vary]                                   # what scatters
    "coupling.clutch.stiffness" = { distribution = "normal", mean = 1500.0, deviation = 50.0 }

    [sample]
    count = 256                              # or half_width = 0.05, of a probability's 95 % interval
    method = "sobol"                         # ... "saltelli", "saltelli-pairs"; "one-at-a-time" takes no count
    seed = 7

Takes the tables of a file; gives the arguments of ``study``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gearrattle.errors import LARGEST_WHOLE, ModelError, Problem
from gearrattle.model.quantity import AnyTable, Count, Plain, Text, Texts
from gearrattle.studies.kinds.base import Kind
from gearrattle.studies.probability import samples_needed
from gearrattle.studies.study import prepare


def _arguments(tables: Mapping[str, Any]) -> dict[str, Any]:
    sample = tables.get("sample", {})
    found = {"axes": tables.get("axis", {}), "vary": tables.get("vary", {}), "fixed": tables.get("fixed", {})}
    if {"count", "half_width"} <= set(sample):
        raise ModelError(Problem("sample", "count and half_width", "one of them decides how many samples there are"))
    found |= {"samples": samples_needed(sample["half_width"]) if "half_width" in sample else sample.get("count", 0)}
    found |= {key: sample[key] for key in ("method", "seed") if key in sample}
    return found | {key: tables[key] for key in ("outputs", "most") if key in tables}


GRID = Kind(
    name="grid",
    prepare=prepare,
    arguments=_arguments,
    keys={
        "outputs": Texts('["verdict"]'), "most": Count(1, LARGEST_WHOLE), "fixed": AnyTable(), "axis": AnyTable(),
        "vary": AnyTable(), "sample": AnyTable(),
    },
    tables={
        "sample": {
            "count": Count(), "half_width": Plain("positive"), "method": Text(), "seed": Count(0, LARGEST_WHOLE),
        },
    },
    options=frozenset({"function"}),
)  # fmt: skip
