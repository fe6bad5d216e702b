"""What moves the jumps of a branch: by how much 10 % more of every number of the model shifts their folds.

A fold at which unstable motions turn back is none of them.

Takes a Branch; gives a Table.
"""

from __future__ import annotations

from gearrattle.assembly import assemble
from gearrattle.engine.periodic.events import FOLD
from gearrattle.errors import GearRattleError
from gearrattle.model.path_labels import path_label
from gearrattle.orbits import Branch
from gearrattle.orbits.family import is_compiled
from gearrattle.orbits.stable_ranges import losses_of
from gearrattle.report.plots.branches import measure
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.tables import Table

_MOST_FOLDS, _MOST_NUMBERS, _MOST_BODIES = 2, 6, 8
_LEAST = 1e-4  # of what the most effective number does: less is left out


def moving_table(branch: Branch) -> Table:
    """Return what moves the first jumps of the first branch; without rows where there is none, or it would take long.

    Parameters
    ----------
    branch
        of motions.
    """
    shown = measure(branch)
    unit = f" [{shown.unit}]" if shown.unit else ""
    head = ("fold at" + unit, "10 % more of", "moves it by" + unit)
    system = assemble(branch.model).system
    events = branch.events
    folds = sorted({loss.event for loss in losses_of(branch) if loss.kind == FOLD and loss.branch == 0})
    folds = [event for event in folds if not events["collision"][event]]
    rows: list[tuple[str, ...]] = []
    for fold in folds[:_MOST_FOLDS] if is_compiled(system) and system.size <= _MOST_BODIES else ():
        try:
            table = branch.gradients(fold).dropna()
        except GearRattleError:  # a fold in a corner of the branch
            continue
        largest = table["per_10_percent"].abs().max()
        kept = table[table["per_10_percent"].abs() > _LEAST * largest][:_MOST_NUMBERS]
        value = numeral(float(events["value"][fold]) * shown.factor, 6)
        for path, change in zip(kept["path"], kept["per_10_percent"], strict=True):
            rows.append((value, path_label(path, branch.model).words, f"{change * shown.factor:+.3g}"))
    note = "To first order, all other numbers unchanged. Python: branch.gradients(event), branch.scatter(event, ...)."
    return Table(head, tuple(rows), frozenset({1}), "What moves the jumps", note)
