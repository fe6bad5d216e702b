"""Rattle metrics as figures: a panel for values of one kind, and a colour and an offset for every subject.

The x axis has orders or quantities; the y axis has values, in some panels on a logarithmic scale. Subjects of one group
are slightly offset. Colours are those of M. Okabe and K. Ito (2008). Shares of time are bars over the whole width.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gearrattle.pipeline import Findings
from gearrattle.quantities.quantity import Row
from gearrattle.report.plots.chart import Cells, Chart, Key, Line, Panel, Rule
from gearrattle.report.plots.palette import CENTRE, COAST, COLOURS, DRIVE

_SPREAD = 0.5  # share of the distance between two groups, over which the subjects of a group are spread
_SIDES = (("coast-side share", COAST), ("free share", CENTRE), ("drive-side share", DRIVE))


@dataclass(frozen=True)
class _Kind:
    """Values that share a panel: by quantity and its label, or by all orders of a quantity."""

    title: str
    unit: str
    labels: tuple[tuple[str, str], ...] = ()
    by_order: str = ""
    threshold: str = ""
    log: bool = True


_KINDS = (
    _Kind("Separation ratio by order", "1", by_order="separation ratio at order ", threshold="lifts off"),
    _Kind("Transmissibility by engine order", "1", by_order="transmissibility at order "),
    _Kind("Peak-to-peak speed by engine order", "rad/s", by_order="peak-to-peak speed at order "),
    _Kind("Speed irregularity", "1", (("irregularity", "all orders"),)),
    _Kind(
        "Separation ratio",
        "1",
        (
            ("separation ratio", "by the peak"),
            ("largest separation ratio of an order", "of one order"),
        ),
        threshold="lifts off",
    ),
    _Kind(
        "Impacts of the event",
        "J",
        (("largest impact energy", "the hardest"), ("energy lost in impacts", "lost in all")),
    ),
    _Kind("Torques of the event", "N m", (("peak torque", "peak"), ("rms torque", "rms"))),
    _Kind(
        "Accelerations of the event",
        "rad/s^2",
        (("peak angular acceleration", "peak"), ("rms angular acceleration", "rms")),
    ),
    _Kind("Restitution", "1", (("mean restitution", "mean"),), log=False),
    _Kind("Impact intensity", "N", (("mean impact intensity", "mean"),)),
    _Kind("Impact intensity of couplings", "N m", (("mean impact intensity", "mean"),)),
    _Kind("Energy lost", "W", (("impact loss rate", "in impacts"), ("contact work rate", "in all, friction too"))),
    _Kind("Rattle level", "dB", (("rattle level", "each"), ("rattle level of all meshes", "all")), log=False),
    _Kind(
        "Mesh force",
        "N",
        (
            ("force standard deviation", "deviation"),
            ("force exceeded 5 % of the time", "5 % exceed"),
        ),
    ),
    _Kind("Mesh force, shape", "1", (("force crest factor", "crest"), ("force kurtosis", "kurtosis"))),
    _Kind(
        "Acceleration of loose gears",
        "rad/s^2",
        (
            ("rms acceleration", "rms"),
            ("peak acceleration", "peak"),
            ("rms acceleration above the engine orders", "rms above"),
            ("peak acceleration above the engine orders", "peak above"),
        ),
    ),
    _Kind(
        "Impacts by change of flank",
        "1/cycle",
        (
            ("single-sided impacts per cycle", "same flank"),
            ("double-sided impacts per cycle", "other flank"),
        ),
        log=False,
    ),
)


def rattle_metrics(findings: Findings) -> Chart | None:
    """Draw every metric of the run; None where none has a value."""
    return metrics_chart(findings.metrics)


def metrics_chart(rows: Sequence[Row]) -> Chart | None:
    """Draw rows of metrics; None where none has a value."""
    # one colour per subject, apart from those of the two sides
    subjects = list(dict.fromkeys(row.subject for row in rows if row.subject))
    apart = [colour for colour in COLOURS if colour not in (DRIVE, COAST)]
    colours = {subject: apart[i % len(apart)] for i, subject in enumerate(subjects)}
    # one panel per kind of value, without repeated panels
    panels: list[Panel] = []
    for kind in _KINDS:
        panel = _panel(kind, rows, colours)
        if panel is not None and not any(_same(panel, other) for other in panels):
            panels.append(panel)
    # shares of time in contact
    shares = _shares(rows)
    if shares is not None:
        panels.append(shares)
    if not panels:
        return None
    # caption and legend
    over = "the event" if any(row.name == "event" for row in rows) else "the steady part"
    caption = (
        f"Rattle metrics over {over}; each is defined in the table of metrics. Accelerations "
        "marked above are those above the engine's orders. A separation ratio above 1 means that drag cannot hold the "
        "loose gear. Sides of contact: shares of time, coast side left, free in the middle, drive side right."
    )
    drawn = {line.name for panel in panels for line in panel.lines}
    legend = [Key(subject, colour) for subject, colour in colours.items() if subject in drawn]
    sides = [Key("coast side", COAST), Key("free", CENTRE), Key("drive side", DRIVE)] if shares is not None else []
    return Chart(
        "rattle_metrics",
        "Rattle metrics",
        caption,
        tuple(panels),
        columns=2,
        panel_height=150,
        share_x=False,
        legend=(*legend, *sides),
    )


def _same(panel: Panel, other: Panel) -> bool:
    """Whether two panels hold the same values, as in a dimensionless model, where kinds have no units of their own."""
    held = [[(line.name, line.y.tolist()) for line in side.lines] for side in (panel, other)]
    return held[0] == held[1] and panel.x_ticks == other.x_ticks


def _panel(kind: _Kind, rows: Sequence[Row], colours: dict[str, str]) -> Panel | None:
    """Draw the values of one kind as points, a group for every label; None where there are none."""
    # labels of the x axis: orders, or the quantities of this kind
    mine = [row for row in rows if row.unit in (kind.unit, "1") and np.isfinite(row.value)]
    if kind.by_order:
        by_order = {row.quantity for row in mine if row.quantity.startswith(kind.by_order)}
        orders = sorted((float(quantity.removeprefix(kind.by_order)), quantity) for quantity in by_order)
        labels = [(quantity, f"{order:g}") for order, quantity in orders]
    else:
        labels = [label for label in kind.labels if any(row.quantity == label[0] for row in mine)]
    # rows with a label; a logarithmic axis takes positive values alone
    position = {quantity: float(i) for i, (quantity, _) in enumerate(labels)}
    mine = [row for row in mine if row.quantity in position and (row.value > 0.0 or not kind.log)]
    if not mine:
        return None
    # points of every subject, side by side
    names = list(dict.fromkeys(row.subject for row in mine))
    lines = []
    for i, name in enumerate(names):
        shift = _SPREAD * ((i + 0.5) / len(names) - 0.5)
        own = [row for row in mine if row.subject == name]
        x, y = (np.array(values) for values in ([position[r.quantity] + shift for r in own], [r.value for r in own]))
        lines.append(Line(x, y, name, colours[name], "points", 7.0))
    # threshold and limits
    unit = {row.unit for row in mine} - {"1"}
    rules = (Rule(1.0, label=kind.threshold),) if kind.threshold else ()
    values = np.array([row.value for row in mine] + ([1.0] if kind.threshold else []))
    return Panel(
        kind.title,
        next(iter(unit), "").replace("^2", "²"),
        "order" if kind.by_order else "",
        tuple(lines),
        rules=rules,
        x_range=(-0.5, len(labels) - 0.5),
        y_range=_range(values, log=kind.log),
        y_log=kind.log,
        x_ticks=tuple((position[quantity], label) for quantity, label in labels),
    )


def _range(values: np.ndarray[tuple[int], np.dtype[np.float64]], *, log: bool) -> tuple[float, float]:
    """Return limits with room: whole decades of a logarithmic axis."""
    low = float(values.min())
    high = float(values.max())
    if log:
        bottom = 10.0 ** np.floor(np.log10(0.8 * low))
        return float(bottom), float(max(10.0 ** np.ceil(np.log10(1.25 * high)), 10.0 * bottom))
    room = 0.1 * (high - min(low, 0.0)) or 1.0
    return min(low, 0.0) - room, high + room


def _shares(rows: Sequence[Row]) -> Panel | None:
    """Draw shares of time on either side and free as bars, one row per gap; None where there are none."""
    shares = {(row.subject, row.quantity): row.value for row in rows if row.name == "contact_sides"}
    names = [name for name, quantity in shares if quantity == "free share"]
    if not names:
        return None
    cells = []
    left = np.zeros(len(names))
    heights = np.arange(len(names), dtype=np.float64)
    for quantity, colour in _SIDES:
        right = left + 100.0 * np.array([shares[name, quantity] for name in names])
        cells.append(Cells(left, right, heights - 0.35, heights + 0.35, quantity.removesuffix(" share"), colour))
        left = right
    return Panel(
        "Sides of contact",
        "",
        "share of time, %",
        cells=tuple(cells),
        x_range=(0.0, 100.0),
        y_range=(-0.5, len(names) - 0.5),
        y_ticks=tuple((float(i), name[:10]) for i, name in enumerate(names)),
    )
