"""Tables 3 and 4: what seven algorithms cost on cases 1 and 3, over the time that RK2's steps span (800 and 850)."""

from __future__ import annotations

from collections.abc import Iterator

from gearrattle.comparison.contender_runs import Result
from gearrattle.report.tables import Table
from gearrattle.reproduction import printed_values
from gearrattle.reproduction.exact_count import Counted, count_steps
from gearrattle.reproduction.measurements import TOLERANCE, Measurements, Progress, Scope, Setup
from gearrattle.reproduction.number_formats import counted, figure
from gearrattle.reproduction.paper_cases import SPEED
from gearrattle.reproduction.printed_values import Performance
from gearrattle.reproduction.reproduction_record import (
    CONSTRUCTED,
    DIFFERS,
    REPRODUCED,
    UNAVAILABLE,
    UNDECIDED,
    Row,
    Section,
    row,
)

CYCLES = {1: 127, 3: 135}
"""Whole periods in 800 and 850 units of time; a period is 2 pi."""
REPEATS = 3
FIXED = ("rk2", "rk4")
Counts = dict[tuple[int, str, bool], Counted]
"""Steps taken, by table, label and load."""
TABLES = ((3, 1, printed_values.TABLE_3), (4, 3, printed_values.TABLE_4))


def setup_of(scope: Scope, case: int, algorithm: str, *, loaded: bool) -> Setup:
    """The run behind a line of the tables."""
    step = {"rk2": printed_values.RK2_STEP, "rk4": printed_values.RK4_STEP}.get(algorithm)
    return Setup(case, loaded, algorithm, scope.cycles(CYCLES[case]), step=step, repeats=REPEATS)


def needs(scope: Scope) -> Iterator[Setup]:
    """All lines, rattling and loaded, and exact beside them."""
    for _, case, lines in TABLES:
        for loaded in (False, True):
            for algorithm in ("exact", *(line.algorithm for line in lines)):
                yield setup_of(scope, case, algorithm, loaded=loaded)


def section(measurements: Measurements, tick: Progress) -> Section:
    """Compare both tables."""
    counts = _counts(measurements.scope, tick)
    rows = [
        _fixed_row(number, line, [counts[number, line.label, loaded] for loaded in (False, True)])
        if line.algorithm in FIXED
        else _row(measurements, number, case, line)
        for number, case, lines in TABLES
        for line in lines
    ]
    rows += [_spans(), _calls_per_step(), _growth_of_cost(measurements)]
    tables = tuple(
        _table(measurements, (number, case, lines), loaded, counts)
        for number, case, lines in TABLES
        for loaded in (False, True)
    )
    words = (
        f"Cases 1 and 3 under our assumed loads, light (0.05), from static rest; tolerance {TOLERANCE:g} where steps "
        "are chosen, for the paper prints none. RK2 and RK4 take as many steps as printed; the others run over the "
        f"whole periods in RK2's span. Steps are in units of 1/omega. A time is the fastest of {REPEATS} runs, in "
        "parentheses how far the slowest lies above it: processor time of RK2 and RK4, wall time of the others. The "
        "paper's are of a machine thirty years older."
    )
    return Section("tables-3-4", "Tables 3 and 4: cost", words, tuple(rows), tables)


def _counts(scope: Scope, tick: Progress) -> Counts:
    """Take RK2's and RK4's printed steps, a tenth of them in a quick run."""
    chosen = [(n, case, line, loaded) for n, case, lines in TABLES for line in lines for loaded in (False, True)]
    chosen = [entry for entry in chosen if entry[2].algorithm in FIXED]
    counts: Counts = {}
    for done, (number, case, line, loaded) in enumerate(chosen):
        assert line.step is not None
        assert line.steps is not None

        def report_share(share: float, done: int = done) -> None:
            tick((done + share) / len(chosen))

        steps = line.steps // 10 if scope.quick else line.steps
        counts[number, line.label, loaded] = count_steps(
            case, line.algorithm, line.step, steps, loaded=loaded, tick=report_share
        )
    return counts


def _fixed_row(number: int, line: Performance, counts: list[Counted]) -> Row:
    """A fixed step taken as often as printed: what can be compared is so by construction."""
    summary = "; ".join(
        f"{kind}: {counted(count.steps)} steps, {counted(count.calls)} calls, span {count.span:.1f}, "
        f"{_seconds(count.seconds)}"
        for kind, count in zip(("rattling", "loaded"), counts, strict=True)
    )
    figures = {
        f"{name}_{kind}": float(value)
        for kind, count in zip(("rattling", "loaded"), counts, strict=True)
        for name, value in (("steps", count.steps), ("calls", count.calls), ("crossings", count.crossings))
    }
    why = "step and number of steps are set as printed, so calls follow; times are of another machine"
    return row(f"Table {number}, {line.label}", _printed(line), summary, CONSTRUCTED, why, **figures)


def _row(measurements: Measurements, number: int, case: int, line: Performance) -> Row:
    item = f"Table {number}, {line.label}"
    # rattling and loaded runs
    setups = [setup_of(measurements.scope, case, line.algorithm, loaded=loaded) for loaded in (False, True)]
    results = [measurements.result(setup) for setup in setups]
    summary = "; ".join(
        f"{kind}: {_counts_and_times(result, measurements.times(setup))}"
        for kind, result, setup in zip(("rattling", "loaded"), results, setups, strict=True)
    )
    # runs that are missing or failed
    runs = [result.run for result in results if result.run is not None]
    if len(runs) < len(results):
        missing = all(result.wall_time == 0.0 for result in results)
        return row(
            item,
            _printed(line),
            results[0].status if missing else summary,
            UNAVAILABLE if missing else DIFFERS,
            "" if missing else "a run did not come to an end",
        )
    # counts of steps and calls
    figures = {
        f"{name}_{kind}": float(value)
        for kind, run in zip(("rattling", "loaded"), runs, strict=True)
        for name, value in (("steps", run.cost.steps), ("calls", run.cost.function_calls))
    }
    if line.step is None:
        why = (
            "ours converges on these loads at every tolerance tried (see Bulirsch-Stoer below); which loads, which "
            "tolerance and which step control made theirs fail is not printed"
        )
        return row(item, _printed(line), summary, DIFFERS, why, **figures)
    return row(item, _printed(line), summary, UNDECIDED, "nor the tolerance", **figures)


def _printed(line: Performance) -> str:
    if line.step is None or line.steps is None or line.calls is None:
        return "failed to converge"
    return f"h {line.step:g}, {counted(line.steps)} steps, {counted(line.calls)} calls, {line.time}"


def _seconds(times: tuple[float, ...]) -> str:
    """The fastest of several times, and how far the slowest lies above it."""
    return f"{figure(min(times))} s (+{max(times) / min(times) - 1.0:.0%})"


def _counts_and_times(result: Result, times: tuple[float, ...]) -> str:
    if result.run is None:
        return result.status
    cost = result.run.cost
    return (
        f"h {figure(SPEED * cost.average_trial_step)}, {counted(cost.steps)} steps, "
        f"{counted(cost.function_calls)} calls, {_seconds(times)}"
    )


def _table(
    measurements: Measurements, which: tuple[int, int, tuple[Performance, ...]], loaded: bool, counts: Counts
) -> Table:
    # heads of the columns
    number, case, lines = which
    head = (
        "algorithm",
        "paper: h_i",
        "steps",
        "calls",
        "time",
        "ours: average trial step",
        "average step",
        "smallest",
        "steps",
        "rejected",
        "calls",
        "crossings",
        "time, s (slowest)",
    )
    # printed and measured counts, by algorithm
    rows = []
    for line in (*lines, Performance("exact", "exact", None, None, None, None)):
        theirs = ("–",) * 4
        if line.step is not None and line.steps is not None and line.calls is not None:
            theirs = (f"{line.step:g}", counted(line.steps), counted(line.calls), f"{line.time}")
        elif line.label != "exact":
            theirs = ("failed",) * 4
        setup = setup_of(measurements.scope, case, line.algorithm, loaded=loaded)
        if line.algorithm in FIXED:
            ours = _fixed_figures(line, counts[number, line.label, loaded])
        else:
            ours = _figures(measurements.result(setup), measurements.times(setup))
        rows.append((line.label, *theirs, *ours))
    kind = "loaded" if loaded else "rattling"
    return Table(head, tuple(rows), frozenset({0}), f"Table {number}, case {case}, {kind}")


def _fixed_figures(line: Performance, counts: Counted) -> tuple[str, ...]:
    step = f"{line.step:g}"
    numbers = (counted(n) for n in (counts.steps, 0, counts.calls, counts.crossings))
    return step, step, step, *numbers, _seconds(counts.seconds)


def _figures(result: Result, times: tuple[float, ...]) -> tuple[str, ...]:
    if result.run is None:
        return (result.status, *["–"] * 7)
    cost = result.run.cost
    smallest = float("nan") if cost.smallest_step is None else SPEED * cost.smallest_step
    steps = (SPEED * cost.average_trial_step, SPEED * cost.average_step, smallest)
    counts = (cost.steps, cost.rejected_steps, cost.function_calls, cost.events)
    return (*(figure(step) for step in steps), *(counted(n) for n in counts), _seconds(times))


def _spans() -> Row:
    spans = [(line.label, line.step * line.steps) for line in printed_values.TABLE_3 if line.step and line.steps]
    summary = ", ".join(f"{label} {span:.0f}" for label, span in spans)
    return row(
        "Table 3, step times count",
        summary,
        "the span in every row, with the average of accepted steps",
        DIFFERS,
        "the paper's h_i is the initial average trial step; and its spans differ even among fixed steps (800, 819.2)",
    )


def _calls_per_step() -> Row:
    rkf = next(line for line in printed_values.TABLE_3 if line.label == "RKF")
    assert rkf.steps is not None and rkf.calls is not None  # noqa: PT018 - printed
    return row(
        "Table 3, RKF, calls against steps",
        f"{counted(rkf.steps)} steps, {counted(rkf.calls)} calls",
        f"six calls a step make {counted(6 * rkf.steps)} at least",
        DIFFERS,
        "a digit may have slipped: 141 034 steps of six calls, none rejected, are 846 204",
        least=6 * rkf.steps,
    )


def _growth_of_cost(measurements: Measurements) -> Row:
    """Sec. 9: time increases with the number of nonlinearities."""
    names = ("rkf", "rkv", "bulirsch-stoer")
    change = {}
    theirs = []
    for name in names:
        for loaded in (False, True):
            runs = [measurements.run(setup_of(measurements.scope, case, name, loaded=loaded)) for case in (1, 3)]
            if runs[0] is not None and runs[1] is not None:
                a, b = (run.cost.function_calls / run.trajectory.cycles for run in runs if run is not None)
                change[f"{name}, {'loaded' if loaded else 'rattling'}"] = b / a - 1.0
    for one, three in zip(printed_values.TABLE_3, printed_values.TABLE_4, strict=True):
        if one.calls and three.calls and one.steps and one.algorithm in ("rkf", "rkv"):
            theirs.append(f"{one.label} {100 * (three.calls / one.calls / 850 * 800 - 1):+.0f} %")
    summary = ", ".join(f"{name} {100 * share:+.0f} %" for name, share in change.items())
    more = sum(share > 0 for share in change.values())
    return row(
        "Sec. 9, cost rises from case 1 to case 3",
        f"calls for the same span: {', '.join(theirs)}",
        summary,
        REPRODUCED if more == len(change) else DIFFERS,
        f"more in {more} of {len(change)} comparisons; how much depends on the loads",
        more=more,
        of=len(change),
    )
