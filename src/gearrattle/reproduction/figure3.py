"""Fig. 3: the three vibro-impact regimes of a backlash, a history of every regime, and the ranges of load with it.

Two systems are swept up and down (``load_sweep``): case 1 with its loose gear, over the drag torque of the gear, and
the mesh alone near its resonance, over the amplitude. While the teeth of case 1 stay in contact, the motion does not
depend on the drag torque D, and the mesh force F is R F = D + J_4 theta_4''. Contact is therefore first lost at

    D* = max over a period of -J_4 theta_4'',

which follows from the smooth motion under the largest D, without any crossing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from gearrattle.model import Model
from gearrattle.report.plots.chart import Chart, Key, Line, Panel, Rule
from gearrattle.report.plots.palette import COLOURS, INK
from gearrattle.report.tables import Table
from gearrattle.reproduction.load_sweep import GEAR, Stop, Tick, history, loose_gear, mesh_alone, sweep
from gearrattle.reproduction.measurements import Scope
from gearrattle.reproduction.number_formats import figure
from gearrattle.reproduction.paper_cases import HALF_GAP, J
from gearrattle.reproduction.reproduction_record import DIFFERS, LOST, REPRODUCED, Row, Section, row
from gearrattle.signals import steady
from gearrattle.signals.regions import Regime

FREQUENCY = 0.8
MEAN = 0.1
"""Frequency and mean load of the mesh alone: over its resonance, and over the force at a deflection of a half-gap."""
WORDS: dict[Regime, str] = {"quiet": "no impact", "single-sided": "single-sided", "double-sided": "double-sided"}
_HEIGHT: dict[Regime, float] = {"quiet": 0.0, "single-sided": 1.0, "double-sided": 2.0}
_APART = 0.06
_SHOWN = 1
_FINE = 2048


def drags(scope: Scope) -> list[float]:
    """Drag torques of the loose gear [N m]: coarse at first, fine where the regime changes."""
    coarse, fine = (4, 9) if scope.quick else (10, 25)
    return [*np.geomspace(0.1, 6.0, coarse).tolist(), *np.linspace(7.0, 10.0, fine).tolist()]


def amplitudes(scope: Scope) -> list[float]:
    """Amplitudes of the load of the mesh alone [K b]."""
    levels: list[float] = np.geomspace(0.02, 1.0, 16 if scope.quick else 40).tolist()
    return levels


def near_resonance(amplitude: float) -> Model:
    """The mesh alone under an amplitude [K b]."""
    return mesh_alone(FREQUENCY, MEAN, amplitude)


def section(scope: Scope, tick: Tick) -> Section:
    """Find all three regimes."""
    cycles = 24 if scope.quick else 60
    case = sweep(loose_gear, drags(scope), cycles, tick)
    mesh = sweep(near_resonance, amplitudes(scope), 3 * cycles, tick)
    shown = tuple(_middle(case, kind) for kind in WORDS)
    words = (
        "Case 1 with its loose gear, over the gear's drag torque, and the mesh of Table 1 alone, loaded by a mean of "
        f"{MEAN:g} K b and one harmonic at {FREQUENCY:g} of its resonance in contact, over the harmonic's amplitude. "
        "Every motion begins with the last state of the one before it, upward and then downward."
    )
    rows = (_regimes(case), _threshold(case, cycles, tick), _curves())
    tables = (_table(case, "Case 1, drag torque of the loose gear [N m]"), _table(mesh, "Mesh alone, amplitude [K b]"))
    charts = (_histories([history for history in shown if history is not None], cycles, tick), _map(case, mesh))
    return Section("figure-3", "Figure 3: vibro-impact regimes", words, rows, tables, charts)


def runs(scope: Scope) -> int:
    """How many runs the figure takes."""
    return 2 * len(drags(scope)) + 2 * len(amplitudes(scope)) + 1 + len(WORDS)


def _middle(stops: Sequence[Stop], kind: Regime) -> Stop | None:
    """The stop in the middle of those of a regime, on the way up."""
    matching = [stop for stop in stops if stop.rising and stop.regime == kind]
    return matching[len(matching) // 2] if matching else None


def ranges(stops: Sequence[Stop], rising: bool) -> Iterator[tuple[Regime, float, float]]:
    """Neighbouring loads of the same regime as one: regime, lowest and highest load, ascending."""
    chosen = sorted((stop for stop in stops if stop.rising == rising), key=lambda stop: stop.load)
    begin = 0
    for i, stop in enumerate(chosen):
        if i + 1 == len(chosen) or chosen[i + 1].regime != stop.regime:
            yield stop.regime, chosen[begin].load, stop.load
            begin = i + 1


def twofold(stops: Sequence[Stop]) -> list[float]:
    """Loads under which both ways do not end in the same regime."""
    up, down = ({stop.load: stop.regime for stop in stops if stop.rising == way} for way in (True, False))
    return [load for load in up if up[load] != down[load]]


def _regimes(case: Sequence[Stop]) -> Row:
    summary = "; ".join(f"{WORDS[kind]} {low:.3g} to {high:.3g}" for kind, low, high in ranges(case, True))
    kinds = {stop.regime for stop in case}
    return row(
        "Fig. 3, three vibro-impact regimes",
        "no impact, single-sided, double-sided",
        f"case 1, drag torque of the loose gear [N m]: {summary}",
        REPRODUCED if kinds == set(WORDS) else DIFFERS,
        "" if kinds == set(WORDS) else "not every regime was met",
        regimes=len(kinds),
        twofold=len(twofold(case)),
    )


def threshold(stop: Stop, cycles: int) -> float:
    """D* [N m] from a motion whose teeth stay closed."""
    t = history(stop, loose_gear, cycles, _FINE).trajectory
    output = t.layout.inertia_names.index("output_gear")
    return float(-J["output_gear"] * steady(t).periodic(t.acceleration[:, output]).min())


def _threshold(case: Sequence[Stop], cycles: int, tick: Tick) -> Row:
    item = "Sec. 6, contact is lost by alternating load, light mean load or both"
    tick()
    smooth = max(case, key=lambda stop: (stop.load, stop.rising))
    lost = [stop.load for stop in case if stop.regime != "quiet"]
    kept = [stop.load for stop in case if stop.regime == "quiet"]
    if smooth.regime != "quiet" or not lost:
        return row(item, "named as causes", "contact is never kept, or never lost", DIFFERS, "the sweep is too narrow")
    limit = threshold(smooth, cycles)
    last = max(lost)
    first = min(kept)
    summary = (
        f"case 1: lost up to D = {last:.3f}, kept from {first:.3f} N m; the smooth motion says D* = {limit:.3f} N m"
    )
    good = last < limit < first
    why = "" if good else "start-up may open a mesh that would stay closed"
    return row(
        item, "named as causes", summary, REPRODUCED if good else DIFFERS, why, limit=limit, last=last, first=first
    )


def _curves() -> Row:
    return row(
        "Fig. 3, its histories",
        "three curves",
        "three histories under our loads, drawn below",
        LOST,
        "the text that survives has neither their loads nor their axes",
    )


def _table(stops: Sequence[Stop], title: str) -> Table:
    lines = [
        ("upward" if rising else "downward", WORDS[kind], figure(low, 4), figure(high, 4))
        for rising in (True, False)
        for kind, low, high in ranges(stops, rising)
    ]
    loads = twofold(stops)
    note = "Both ways agree under every load."
    if loads:
        note = (
            f"The two ways end in different regimes under {len(loads)} of {len(stops) // 2} loads, {min(loads):.3g} to "
            f"{max(loads):.3g}: two motions exist there."
        )
    return Table(("", "regime", "from", "to"), tuple(lines), frozenset({0, 1}), title, note)


def _histories(shown: Sequence[Stop], cycles: int, tick: Tick) -> Chart:
    panels = []
    for stop, colour in zip(shown, COLOURS, strict=False):
        tick()
        t = history(stop, loose_gear, cycles, _FINE).trajectory
        index = np.arange(t.time.size - _SHOWN * t.samples_per_cycle - 1, t.time.size)
        deflection = t.deflection[index, t.layout.clearance_names.index(GEAR)] / HALF_GAP
        x = (index - index[0]) / t.samples_per_cycle
        name = f"{WORDS[stop.regime]}, D = {stop.load:.3g} N m"
        panels.append(
            Panel(
                name,
                "half-gaps",
                "time / T  [cycles]",
                (Line(x, deflection, name, colour, width=0.8),),
                rules=(Rule(1.0), Rule(-1.0)),
                x_range=(0.0, float(_SHOWN)),
                y_range=(-1.3, 1.3),
            )
        )
    caption = "Mesh deflection of case 1 in the three regimes, last cycle; dashed: the gap's ends."
    return Chart("fig-3", "Figure 3", caption, tuple(panels))


def _map(case: Sequence[Stop], mesh: Sequence[Stop]) -> Chart:
    # regimes over the load, up and down, of both systems
    panels = []
    titles = (
        ("Case 1, loose gear", "drag torque D  [N m]", (0.08, 12.5)),
        ("Mesh alone", "amplitude / (K b)", (0.016, 1.25)),
    )
    for stops, (title, x_title, x_range) in zip((case, mesh), titles, strict=True):
        lines = []
        for rising, name, colour in ((True, "upward", INK), (False, "downward", COLOURS[0])):
            chosen = [stop for stop in stops if stop.rising == rising]
            shift = _APART if rising else -_APART
            y = np.array([_HEIGHT[stop.regime] + shift for stop in chosen])
            lines.append(Line(np.array([stop.load for stop in chosen]), y, name, colour, "points", 4.0))
        panels.append(Panel(title, "regime", x_title, tuple(lines), x_range=x_range, y_range=(-0.3, 2.3), x_log=True))
    # caption and legend
    caption = (
        "Regime over the load: 0 no impact, 1 single-sided, 2 double-sided; upward drawn a little higher. Where they "
        "differ, two motions exist under the same load."
    )
    legend = tuple(Key(line.name, line.colour) for line in panels[0].lines)
    return Chart(
        "fig-3-map",
        "Regime over the load",
        caption,
        tuple(panels),
        columns=2,
        panel_height=180,
        share_x=False,
        legend=legend,
    )
