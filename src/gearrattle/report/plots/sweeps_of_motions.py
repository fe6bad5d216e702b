"""Stable motions by exact runs over a value: the rms deflection of every clearance, going up and going down."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearrattle.assembly import assemble
from gearrattle.orbits import Branch
from gearrattle.orbits.exact_runs import ExactRun
from gearrattle.orbits.swept_motions import Sweeps
from gearrattle.report.plots.branches_figure import measure
from gearrattle.report.plots.chart import Band, Chart, Key, Line, Panel, Rule
from gearrattle.report.plots.corner_marks import units_of
from gearrattle.report.plots.motion_window import scale
from gearrattle.report.plots.palette import COAST, DRIVE, INK
from gearrattle.trajectory import Array
from gearrattle.wording import counted

UP = Key("going up", DRIVE)
DOWN = Key("going down", COAST)
TWO = Key("two motions", "#c9a227")
_JUMP = Key("jump", INK, dash="dashed")
_MOST_PANELS = 8


def swept_chart(branch: Branch, sweeps: Sweeps) -> Chart:
    """Draw the rms deflection of every clearance, the first few."""
    # ranges of two coexisting motions, and jumps
    shown = measure(branch)
    layout = assemble(branch.model).layout
    low, high = (value * shown.factor for value in sweeps.ends)
    room = 0.02 * (high - low)
    bands = tuple(
        Band(begin * shown.factor - room / 4, end * shown.factor + room / 4, TWO.colour, "x", 0.16)
        for begin, end in sweeps.coexistence
    )
    rules = tuple(Rule(jump.value * shown.factor, "x", INK) for jump in sweeps.jumps)

    # both sweeps of one clearance
    def panel(k: int) -> Panel:
        every = np.array([run.rms[k] for run in (*sweeps.up, *sweeps.down)])
        in_unit = scale(every, units_of(branch.model, layout, k)["deflection"])
        lines = tuple(
            Line(*_broken(runs, sweeps, k, upward=upward, factors=(shown.factor, in_unit.factor)), key.name, key.colour)
            for runs, upward, key in ((sweeps.up, True, UP), (sweeps.down, False, DOWN))
        )
        return Panel(
            layout.clearance_names[k],
            in_unit.unit,
            shown.title,
            lines,
            bands=bands,
            rules=rules,
            x_range=(low - room, high + room),
        )

    # caption and legend
    count = len(layout.clearance_names)
    more = f" {counted(count - _MOST_PANELS, 'clearance')} more are in results.nc." if count > _MOST_PANELS else ""
    return Chart(
        "sweeps",
        "Stable motions going up and going down",
        f"Rms deflection of every clearance about its mean over {shown.words}. Each run begins where the one at the "
        "neighbouring value ended; where the curves going up and going down differ, the driveline has two motions, and "
        f"its past decides which it shows. Dashed: jumps.{more}",
        tuple(panel(k) for k in range(min(count, _MOST_PANELS))),
        columns=2 if count > 1 else 1,
        panel_height=210,
        legend=(UP, DOWN, *([TWO] if bands else []), *([_JUMP] if rules else [])),
    )


def _broken(
    runs: Sequence[ExactRun], sweeps: Sweeps, k: int, *, upward: bool, factors: tuple[float, float]
) -> tuple[Array, Array]:
    """Values and rms of a clearance, with the pen lifted at the jumps of the direction."""
    value = np.array([run.value for run in runs])
    rms = np.array([run.rms[k] for run in runs])
    jumps = [jump for jump in sweeps.jumps if jump.upward == upward]
    breaks = [int(np.searchsorted(value, min(jump.before.value, jump.after.value), side="right")) for jump in jumps]
    return np.insert(value, breaks, np.nan) * factors[0], np.insert(rms, breaks, np.nan) * factors[1]
