"""A run-up and a run-down over the branches they follow."""

from __future__ import annotations

from gearrattle.assembly import assemble
from gearrattle.orbits import RunUpJumps
from gearrattle.report.plots.branches_figure import branch_legend, measure, swing_panel
from gearrattle.report.plots.chart import Chart, Key, Line
from gearrattle.report.plots.palette import COAST, COLOURS
from gearrattle.wording import counted

_MOST_PANELS = 4
_MOST_PERIODS = 4000
UP = Key("run-up", COAST)
DOWN = Key("run-down", COLOURS[2])


def run_up_chart(jumps: RunUpJumps) -> Chart:
    """Draw the peak-to-peak deflection of every period of both runs, and that of the branches over it."""
    branch = jumps.branch
    names = assemble(jumps.model).layout.clearance_names
    panels = []
    for k in range(min(len(names), _MOST_PANELS)):
        runs = []
        for run in jumps.envelopes:
            key = UP if run.upward else DOWN
            step = slice(None, None, max(1, len(run.value) // _MOST_PERIODS))
            runs.append(Line(run.value[step], run.peak_to_peak[step, k], key.name, key.colour, width=3.0, opacity=0.6))
        panels.append(swing_panel(branch, k, runs))
    more = len(names) - len(panels)
    left = f" {counted(more, 'clearance')} more are in results.nc." if more > 0 else ""
    caption = (
        f"Peak-to-peak deflection over {measure(branch).words}: of every period T of the runs, and of the motions that "
        f"repeat, stable ones solid, unstable ones dashed.{left}"
    )
    legend = (*(UP if run.upward else DOWN for run in jumps.envelopes), *branch_legend(branch))
    return Chart("run-ups", "Run-up and run-down", caption, tuple(panels), panel_height=300, legend=legend)
