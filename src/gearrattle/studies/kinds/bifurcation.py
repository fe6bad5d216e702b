"""The kind "bifurcation": the settled motion against one value, swept up and down.

    direction = "both"                       # or "up", "down"
    cycles = 300                             # at every value; the model's without
    discard = 250
    phase = 0.25                             # of the period, at which the motion is seen
    section = ["deflection.gear"]            # what is kept; deflection and rate of every clearance without
    tolerance = 1e-6
    outputs = ["verdict", "regime"]

    [sweep]                                  # one value, ascending; or several together under a name
    "torque.0.harmonics.0.amplitude" = { from = 1.0, to = 12.0, count = 100 }

    [axis]                                   # further axes: a sweep for every combination
    "inertia.gear.drag" = [0.4, 0.6]

    [fixed]
    "mesh.gear.backlash" = "0.1 mm"

Takes the tables of a file; gives the arguments of ``bifurcation``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.model.quantity import AnyTable, Count, Plain, Text, Texts
from gearrattle.model.table import listed
from gearrattle.studies.diagram import prepare
from gearrattle.studies.kinds.base import Kind

_PLAIN = ("direction", "cycles", "discard", "phase", "section", "tolerance", "outputs", "fixed")


def _arguments(tables: Mapping[str, Any]) -> dict[str, Any]:
    swept = tables["sweep"]
    if len(swept) != 1:
        remedy = "put the others into [axis], or several together under one name"
        raise ModelError(
            Problem("sweep", listed(swept) or "nothing", "one value is swept, neither none nor more", remedy)
        )
    ((path, values),) = swept.items()
    found = {"path": path, "values": values, "axes": tables.get("axis", {})}
    return found | {key: tables[key] for key in _PLAIN if key in tables}


BIFURCATION = Kind(
    name="bifurcation",
    prepare=prepare,
    arguments=_arguments,
    keys={
        "direction": Text(), "cycles": Count(1), "discard": Count(), "phase": Plain(),
        "section": Texts('["deflection.gear"]'), "tolerance": Plain("positive"), "outputs": Texts('["verdict"]'),
        "fixed": AnyTable(), "axis": AnyTable(), "sweep": AnyTable(),
    },
    needed=("sweep",),
)  # fmt: skip
