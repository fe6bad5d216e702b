"""``gearrattle stiffness``: eigenvalues of the regions, R_lambda, and which fixed steps are stable."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from gearrattle.cli.options import Json, number_or_text

if TYPE_CHECKING:
    from gearrattle.calls.steps import StepLimit
    from gearrattle.calls.stiffness import RegionStiffness, Stiffness
    from gearrattle.cli.background import Watch
    from gearrattle.model import Model

RATIOS = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
"""Contact ratios over which R_lambda is told."""


def stiffness(
    model: Path,
    /,
    *,
    contact_ratio: Annotated[Sequence[str], Parameter(negative="")] = (),
    step: str | None = None,
    with_damping: Annotated[bool, Parameter(negative="")] = False,
    visited: Annotated[bool, Parameter(negative="")] = False,
    json: Json = False,
) -> None:
    """Print eigenvalues, their ratio with its class, and every fixed step against its stability region.

    Parameters
    ----------
    model
        Model file (TOML).
    contact_ratio
        NAME=RATIO: the element's stiffness counts with this ratio, 0 to 1. May be repeated.
    step
        Step of the fixed-step algorithms: seconds, or e.g. "20 us". Without it the file's, else each one's own.
    with_damping
        Let contact ratios multiply the damping too, not the stiffness alone as in the paper.
    visited
        Simulate with the file's settings, and tell the regions that the motion visits, with how long it stays; of very
        many, those it stays in longest.
    """
    import gearrattle
    from gearrattle.calls.simulate import needs_exact
    from gearrattle.calls.statics import element_names
    from gearrattle.calls.steps import step_limits
    from gearrattle.calls.stiffness import regions
    from gearrattle.cli.assignments import numbers
    from gearrattle.cli.background import watched
    from gearrattle.json_types import json_text, json_value

    driveline = gearrattle.load(model)
    ratios = numbers("--contact-ratio", contact_ratio)
    found = gearrattle.stiffness(driveline, contact_ratio=ratios, with_damping=with_damping)
    met, note = watched(lambda watch: _visited(driveline, watch)) if visited else regions(driveline)
    moving = [name for name in element_names(driveline) if name in met[0].labels]
    grid = watched(lambda watch: _over_ratios(driveline, moving, ratios, watch, with_damping=with_damping))
    limits = step_limits(driveline, met, number_or_text(step))
    fixed = "" if limits else f"no fixed step is judged: {needs_exact(driveline)}"
    for line in (*filter(None, (note, fixed)), *found.notes):
        print(f"note: {line}", file=sys.stderr)
    if json:
        steps = [asdict(limit) for limit in limits]
        over = {"contact_ratio": list(RATIOS), "r_lambda": grid}
        print(json_text(json_value({**_stiffness(found), "over": over, "regions": _regions(met), "steps": steps})))
        return
    si = driveline.units == "SI"
    _tell(found, met, grid, si=si)
    _tell_steps(limits, si=si)


def _over_ratios(
    driveline: Model, names: Sequence[str], ratios: dict[str, float], watch: Watch, *, with_damping: bool
) -> dict[str, list[float]]:
    """R_lambda over the contact ratio of every element named, the others at ``ratios``."""
    from gearrattle.calls.stiffness import r_lambda_over

    watch.enter("eigenvalues over contact ratios")
    values = {}
    for done, name in enumerate(names):
        watch(done / len(names))
        values[name] = r_lambda_over(driveline, name, RATIOS, ratios, with_damping=with_damping).tolist()
    return values


def _tell(found: Stiffness, met: Sequence[RegionStiffness], grid: dict[str, list[float]], *, si: bool) -> None:
    from gearrattle.cli.columns import columns

    print(f"R_lambda {found.r_lambda:.6g} ({found.stiffness_class}), rigid motions left out\n")
    rows = [(f"{x.real:.6g} {x.imag:+.6g}i", f"{abs(x):.6g}") for x in found.eigenvalues.tolist() if x.imag >= 0.0]
    print(columns(("eigenvalue [1/s]" if si else "eigenvalue", "magnitude"), rows))
    table = [(f"{ratio:g}", *(f"{values[j]:.5g}" for values in grid.values())) for j, ratio in enumerate(RATIOS)]
    print("\n" + columns(("R_lambda over contact ratio", *grid), table))
    print("\n" + columns(*_regions_table(list(grid), met, si=si)))


def _tell_steps(limits: Sequence[StepLimit], *, si: bool) -> None:
    from gearrattle.cli.columns import columns

    if not limits:
        return
    lines = [
        (x.algorithm, f"{x.step:.5g}", f"{x.product:.4g}", f"{x.growth:.5g}", f"{x.largest_step:.5g}") for x in limits
    ]
    unit = " [s]" if si else ""
    print("\n" + columns(("fixed step", f"step{unit}", "largest x step", "growth", f"limit{unit}"), lines))
    for x in limits:
        if x.growth > 1.0 + 1e-9:
            factor = f"{x.growth:.4g}" if x.growth > 1.001 else f"1 + {x.growth - 1.0:.2g}"
            print(f"note: {x.algorithm}: a step multiplies a mode by {factor}: unstable", file=sys.stderr)


def _visited(driveline: Model, watch: Watch) -> tuple[Sequence[RegionStiffness], str]:
    """The regions that a run visits, and a note where these are not all."""
    from gearrattle.calls.simulate import simulate
    from gearrattle.calls.stiffness import regions_visited

    run = simulate(driveline, algorithm="exact", audit=False, progress=watch)
    watch.enter("eigenvalues of the regions visited")
    visited = regions_visited(run, watch)
    return visited.regions, f"only {visited.words}" if visited.count > len(visited.regions) else ""


def _regions_table(
    moving: Sequence[str], met: Sequence[RegionStiffness], *, si: bool
) -> tuple[tuple[str, ...], list[Any]]:
    shares = ["share of time [%]"] if not math.isnan(met[0].share) else []
    return (*moving, "R_lambda", "class", "largest [1/s]" if si else "largest", *shares), [
        _row(region) for region in met
    ]


def _row(region: RegionStiffness) -> tuple[str, ...]:
    values = region.eigenvalues
    return (
        *map(str, region.labels.values()),
        f"{values.r_lambda:.5g}",
        values.stiffness_class,
        f"{values.fastest:.5g}",
        *([] if math.isnan(region.share) else [f"{100.0 * region.share:.4g}"]),
    )


def _complex(values: Any) -> list[list[float]]:
    return [[x.real, x.imag] for x in values.tolist()]


def _stiffness(found: Stiffness) -> dict[str, Any]:
    return {
        "r_lambda": found.r_lambda,
        "stiffness_class": found.stiffness_class,
        "eigenvalues": _complex(found.eigenvalues),
        "rigid_eigenvalues": _complex(found.rigid_eigenvalues),
        "condition": found.condition,
    }


def _regions(met: Sequence[RegionStiffness]) -> list[dict[str, Any]]:
    return [
        {
            "labels": region.labels,
            "r_lambda": region.eigenvalues.r_lambda,
            "stiffness_class": region.eigenvalues.stiffness_class,
            "share": region.share,
            "eigenvalues": _complex(region.eigenvalues.elastic),
            "rigid_eigenvalues": _complex(region.eigenvalues.rigid),
        }
        for region in met
    ]
