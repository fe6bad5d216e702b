"""``gearrattle stiffness``: eigenvalues of the regions, R_lambda, and which fixed steps are stable."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import gearrattle
from gearrattle.cli.assignments import numbers
from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Changes, Json, ModelFile, Output, Words, number_or_text

if TYPE_CHECKING:
    from gearrattle.analysis.stiffness import RegionStiffness
    from gearrattle.cli.background import Watch
    from gearrattle.model import Model
    from gearrattle.report.stiffness_page import StiffnessPage

RATIOS = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
"""Contact ratios for which R_lambda is printed."""


def stiffness(
    model: ModelFile,
    /,
    *,
    contact_ratio: Words = (),
    step: str | None = None,
    with_damping: bool = False,
    visited: bool = False,
    output: Output = None,
    changes: Changes = (),
    json: Json = False,
) -> None:
    """Print eigenvalues, their ratio with its class, and every fixed step against its stability region.

    Parameters
    ----------
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
    from gearrattle.analysis.stiffness import regions
    from gearrattle.assembly import assemble
    from gearrattle.report.stiffness_page import OverRatios, StiffnessPage
    from gearrattle.simulation.fixed_steps import step_limits
    from gearrattle.simulation.simulate import needs_exact

    driveline = changed_model(model, changes)
    assembled = assemble(driveline)
    ratios = numbers("--contact-ratio", contact_ratio)

    def work(watch: Watch) -> StiffnessPage:
        result = gearrattle.stiffness(driveline, contact_ratio=ratios, with_damping=with_damping)
        met, note = _visited(driveline, watch) if visited else regions(driveline)
        moving = [name for name in assembled.layout.element_names if name in met[0].labels]
        grid = _over_ratios(driveline, moving, ratios, watch, with_damping=with_damping)
        limits = step_limits(driveline, met, number_or_text(step))
        fixed = "" if limits else f"no fixed step is judged: {needs_exact(assembled)}"
        return StiffnessPage(result, OverRatios(RATIOS, grid), met, limits, [*filter(None, (note, fixed))])

    emit("stiffness", work, output, json=json, inputs=[model])


def _over_ratios(
    driveline: Model, names: Sequence[str], ratios: dict[str, float], watch: Watch, *, with_damping: bool
) -> dict[str, list[float]]:
    """R_lambda over the contact ratio of every element named, the others at ``ratios``."""
    from gearrattle.analysis.stiffness import r_lambda_over

    watch.enter("eigenvalues over contact ratios")
    values = {}
    for done, name in enumerate(names):
        watch(done / len(names))
        values[name] = r_lambda_over(driveline, name, RATIOS, ratios, with_damping=with_damping).tolist()
    return values


def _visited(driveline: Model, watch: Watch) -> tuple[Sequence[RegionStiffness], str]:
    """The regions that a run visits, and a note where these are not all."""
    from gearrattle.analysis.stiffness import regions_visited
    from gearrattle.simulation.simulate import simulate

    run = simulate(driveline, algorithm="exact", audit=False, progress=watch)
    watch.enter("eigenvalues of the regions visited")
    visited = regions_visited(run, watch)
    return visited.regions, f"only {visited.words}" if visited.count > len(visited.regions) else ""
