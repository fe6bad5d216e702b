"""The kind "optimization": values found within ranges, outputs small or large, others within limits.

    population = 32                          # designs of a generation
    generations = 20
    seed = 0
    outputs = ["regime"]                     # kept besides

    [variable]                               # what may change, and from where to where
    "coupling.damper.stages.0.stiffness" = { from = "0.2 N*m/deg", to = "2 N*m/deg", spacing = "log" }

    [objective]                              # "min" or "max"; an output of several parts by part and output
    "second_mesh: largest impact energy" = "min"

    [constraint]                             # below, above, or both; SI
    "second_mesh: impacts per cycle" = { below = 20.0 }

    [fixed]
    "simulation.cycles" = 60

Takes the tables of a file; gives the arguments of ``optimize``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gearrattle.errors import LARGEST_WHOLE
from gearrattle.model.quantity import AnyTable, Count, Texts
from gearrattle.studies.kinds.base import Kind
from gearrattle.studies.optimization import MOST, prepare

_PLAIN = ("population", "generations", "seed", "outputs", "fixed")


def _arguments(tables: Mapping[str, Any]) -> dict[str, Any]:
    found = {"variables": tables["variable"], "objectives": tables["objective"]}
    found["constraints"] = tables.get("constraint", {})
    return found | {key: tables[key] for key in _PLAIN if key in tables}


OPTIMIZATION = Kind(
    name="optimization",
    prepare=prepare,
    arguments=_arguments,
    keys={
        "population": Count(4, MOST), "generations": Count(1, MOST), "seed": Count(0, LARGEST_WHOLE),
        "outputs": Texts('["verdict"]'), "variable": AnyTable(), "objective": AnyTable(), "constraint": AnyTable(),
        "fixed": AnyTable(),
    },
    needed=("variable", "objective"),
    options=frozenset({"function"}),
)  # fmt: skip
