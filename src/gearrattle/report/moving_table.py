"""Sensitivity of the jumps of a branch: their shift when a number of the model increases by 10 %.

A jump is a fold at which stable motions end, or a hard loss of stability. A jump at a corner of the branch, where the
motion or its gradient jumps, has no gradient and is left out.
"""

from __future__ import annotations

from gearrattle.assembly import assemble
from gearrattle.errors import GearRattleError
from gearrattle.model.path_labels import path_label
from gearrattle.orbits import Branch
from gearrattle.orbits.stability_ranges import losses_of
from gearrattle.orbits.value_family import is_compiled
from gearrattle.report.plots.branches_figure import measure
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.tables import Table

_MOST_JUMPS = 3
_MOST_NUMBERS = 6
_MOST_BODIES = 8
_LEAST = 1e-4  # share of the largest shift: smaller shifts are left out


def moving_table(branch: Branch) -> Table:
    """Return the shifts of the first jumps of the first branch; empty without jumps, or if it would take long."""
    shown = measure(branch)
    unit = f" [{shown.unit}]" if shown.unit else ""
    head = ("jump at" + unit, "event", "10 % more of", "moves it by" + unit)
    system = assemble(branch.model).system
    jumps = {loss.event: loss for loss in losses_of(branch) if loss.jumps and loss.branch == 0}
    chosen = sorted(event for event in jumps if not branch.events["collision"][event])[:_MOST_JUMPS]
    rows: list[tuple[str, ...]] = []
    for event in chosen if is_compiled(system) and system.size <= _MOST_BODIES else ():
        try:
            table = branch.gradients(event).dropna()
        except GearRattleError:
            continue
        largest = table["per_10_percent"].abs().max()
        kept = table[table["per_10_percent"].abs() > _LEAST * largest][:_MOST_NUMBERS]
        value = numeral(jumps[event].value * shown.factor, 6)
        kind = jumps[event].kind
        for path, change in zip(kept["path"], kept["per_10_percent"], strict=True):
            rows.append((value, kind, path_label(path, branch.model).words, f"{change * shown.factor:+.3g}"))
    note = "To first order, all other numbers unchanged. Python: branch.gradients(event), branch.scatter(event, ...)."
    return Table(head, tuple(rows), frozenset({1, 2}), "What moves the jumps", note)
