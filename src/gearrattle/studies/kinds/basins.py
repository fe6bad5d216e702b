"""The kind "basins": which settled motion every initial state leads to.

    cycles = 300                             # of every motion; the model's without
    discard = 250
    phase = 0.0                              # of the period, at which the motion is seen
    section = ["deflection.gear"]            # what is kept; deflection and rate of every clearance without
    tolerance = 1e-6                         # a motion that repeats this well is settled
    same = 1e-3                              # settled motions nearer than this are one
    outputs = ["verdict", "regime"]
    most = 2_000_000                         # initial states allowed, if more than a million

    [over]                                   # initial values: a grid, all combinations
    "deflection.gear" = { from = "-0.05 mm", to = "0.05 mm", count = 40 }
    "rate.gear" = { from = -0.05, to = 0.05, count = 40 }

    [sample]                                 # or drawn from a box, without counts above
    count = 1000
    method = "sobol"
    seed = 1

    [fixed]
    "torque.0.mean" = 5.0

Takes the tables of a file; gives the arguments of ``basins``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gearrattle.errors import LARGEST_WHOLE
from gearrattle.model.quantity import AnyTable, Count, Plain, Text, Texts
from gearrattle.studies.attraction import prepare
from gearrattle.studies.kinds.base import Kind

_PLAIN = ("cycles", "discard", "phase", "section", "tolerance", "same", "outputs", "most", "over", "fixed")


def _arguments(tables: Mapping[str, Any]) -> dict[str, Any]:
    sample = tables.get("sample", {})
    found = {key: tables[key] for key in _PLAIN if key in tables} | {"samples": sample.get("count", 0)}
    return found | {key: sample[key] for key in ("method", "seed") if key in sample}


BASINS = Kind(
    name="basins",
    prepare=prepare,
    arguments=_arguments,
    keys={
        "cycles": Count(1), "discard": Count(), "phase": Plain(), "section": Texts('["deflection.gear"]'),
        "tolerance": Plain("positive"), "same": Plain("positive"), "outputs": Texts('["verdict"]'),
        "most": Count(1, LARGEST_WHOLE), "over": AnyTable(), "sample": AnyTable(), "fixed": AnyTable(),
    },
    tables={"sample": {"count": Count(), "method": Text(), "seed": Count(0, LARGEST_WHOLE)}},
    needed=("over",),
)  # fmt: skip
