"""Sweeps in words and tables: the change at every jump, and the motion between two jumps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from gearrattle.assembly import assemble
from gearrattle.orbits import Branch
from gearrattle.orbits.attractors import KINDS
from gearrattle.orbits.exact_runs import ExactRun
from gearrattle.orbits.settling_limits import LONGEST
from gearrattle.orbits.swept_motions import Jump, Sweeps
from gearrattle.report.plots.branches_figure import measure
from gearrattle.report.plots.corner_marks import units_of
from gearrattle.report.plots.motion_window import scale
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.tables import Table
from gearrattle.wording import listed

_MOST_SAID = 6
_RANKS = list(KINDS)


def value_words(branch: Branch, jump: Jump) -> str:
    """Return where a jump is, with its error, in the unit of the page."""
    shown = measure(branch)
    if not jump.error:
        return shown.with_unit(jump.value, 6)
    error = jump.error * shown.factor
    decimals = max(0, 1 - int(np.floor(np.log10(error)))) if error < 10.0 else 0
    unit = f" {shown.unit}" if shown.unit else ""
    return f"{jump.value * shown.factor:.{decimals}f} ± {numeral(error, 2)}{unit}"


def changes_words(branch: Branch, sweeps: Sweeps) -> list[str]:
    """Return a sentence for every jump, the first few: which clearance it changes most, and by how much."""
    sentences = []
    names = assemble(branch.model).layout.clearance_names
    for jump in sweeps.jumps[:_MOST_SAID]:
        k = jump.clearance
        before, after = _sizes(branch, k, (jump.before.rms[k], jump.after.rms[k]))
        way = "rises" if jump.after.rms[k] > jump.before.rms[k] else "falls"
        also = _also(jump, names)
        sentences.append(
            f"Going {'up' if jump.upward else 'down'} at {value_words(branch, jump)} the swing of {names[k]} {way} "
            f"from {before} to {after} (rms){also}."
        )
    return sentences


def _also(jump: Jump, names: Sequence[str]) -> str:
    """Return the gaps that begin or cease to rattle in a jump."""
    parts = []
    for word, first, last in (("ceases", jump.before, jump.after), ("begins", jump.after, jump.before)):
        changed = [
            name
            for name, one, other, is_gap in zip(names, first.severities, last.severities, first.is_gap, strict=True)
            if is_gap and one == "rattles" and other != "rattles"
        ]
        if changed:
            parts.append(f"rattle of {listed(changed)} {word}")
    return f"; {', '.join(parts)}" if parts else ""


def _sizes(branch: Branch, k: int, values: Sequence[float]) -> list[str]:
    """Deflections of a clearance with their unit, in that of the largest."""
    in_unit = scale(np.array(values), units_of(branch.model, assemble(branch.model).layout, k)["deflection"])
    unit = f" {in_unit.unit}" if in_unit.unit else ""
    return [f"{numeral(value * in_unit.factor, 3)}{unit}" for value in values]


def jump_table(branch: Branch, sweeps: Sweeps) -> Table:
    """Return the jumps that the sweeps show."""
    shown = measure(branch)
    names = assemble(branch.model).layout.clearance_names
    rows = []
    for jump in sweeps.jumps:
        k = jump.clearance
        ends = sorted((jump.before.value, jump.after.value))
        low, high = (numeral(value * shown.factor, 6) for value in ends)
        back = "elsewhere: two motions beside it" if jump.has_return else "not seen beside it"
        located = f"{jump.kind} at {numeral(jump.value * shown.factor, 8)}" if jump.kind else ""
        sizes = _sizes(branch, k, (jump.before.rms[k], jump.after.rms[k]))
        rows.append(("up" if jump.upward else "down", low, high, names[k], *sizes, back, located))
    unit = f" [{shown.unit}]" if shown.unit else ""
    head = ("going", f"between{unit}", f"and{unit}", "at clearance", "rms before", "rms after", "jump back", "located")
    note = "The driveline jumps between the two values."
    if any(jump.kind for jump in sweeps.jumps):
        note += " Located: on a branch that was followed through it."
        return Table(head, tuple(rows), frozenset({0, 3, 6, 7}), "Jumps", note)
    return Table(head[:-1], tuple(row[:-1] for row in rows), frozenset({0, 3, 6}), "Jumps", note)


def stretch_table(branch: Branch, sweeps: Sweeps) -> Table:
    """Return what the driveline does between two jumps, in both directions."""
    shown = measure(branch)
    names = assemble(branch.model).layout.clearance_names
    rows = []
    for way, runs in (("up", sweeps.up), ("down", sweeps.down)):
        for part in _stretches(runs, [jump for jump in sweeps.jumps if jump.upward == (way == "up")]):
            verdicts = sorted({run.headline for run in part}, key=_RANKS.index)
            words = KINDS[verdicts[-1]] if len(verdicts) == 1 else f"{KINDS[verdicts[0]]} to {KINDS[verdicts[-1]]}"
            rattling = [
                name
                for k, name in enumerate(names)
                if part[0].is_gap[k] and any(run.severities[k] == "rattles" for run in part)
            ]
            ends = (numeral(run.value * shown.factor, 5) for run in (part[0], part[-1]))
            rows.append((way, *ends, f"{len(part)}", words, listed(rattling) if rattling else "none", _repeats(part)))
    unit = f" [{shown.unit}]" if shown.unit else ""
    head = ("going", f"from{unit}", f"to{unit}", "values", "verdict", "rattling parts", "repeats after")
    note = (
        f"Irregular: the motion does not repeat within {LONGEST} T. A part is listed if it rattles anywhere along the "
        "stretch."
    )
    return Table(head, tuple(rows), frozenset({0, 4, 5, 6}), "Motions between the jumps", note)


def _stretches(runs: Sequence[ExactRun], jumps: Sequence[Jump]) -> Iterator[list[ExactRun]]:
    """Runs by ascending values, divided at the jumps."""
    cuts = sorted(max(jump.before.value, jump.after.value) for jump in jumps)
    part: list[ExactRun] = []
    for run in runs:
        if cuts and run.value >= cuts[0] and part:
            cuts = [cut for cut in cuts if cut > run.value]
            yield part
            part = []
        part.append(run)
    if part:
        yield part


def _repeats(runs: Sequence[ExactRun]) -> str:
    """After how many periods motions repeat."""
    numbers = sorted({run.cycles for run in runs if run.cycles})
    irregular = sum(not run.cycles for run in runs)
    words = f"{listed([str(number) for number in numbers])} T" if numbers else ""
    if not irregular:
        return words
    return f"{words}; irregular at {irregular} of {len(runs)}" if words else "irregular"


def run_table(branch: Branch, sweeps: Sweeps) -> Table:
    """Return all exact runs."""
    shown = measure(branch)
    names = assemble(branch.model).layout.clearance_names
    rows = []
    for way, runs in (("up", sweeps.up), ("down", sweeps.down)):
        for run in runs:
            gaps = [k for k in range(len(names)) if run.is_gap[k]]
            hits = max((run.impacts[k] for k in gaps), default=0.0)
            repeats = f"{run.cycles} T" if run.cycles else "irregular"
            sizes = [_sizes(branch, k, [run.rms[k]])[0] for k in range(len(names))]
            rows.append(
                (way, numeral(run.value * shown.factor, 6), repeats, KINDS[run.headline], f"{hits:.3g}", *sizes)
            )
    head = ("going", shown.title, "repeats after", "verdict", "most impacts a period", *names)
    return Table(head, tuple(rows), frozenset({0, 2, 3}), "Exact runs", "Of every clearance the rms deflection.")
