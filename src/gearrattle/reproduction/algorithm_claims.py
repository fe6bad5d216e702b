"""The claims of sec. 9 about algorithms, checked with the runs of Tables 3 and 4."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import product

from gearrattle.report.tables import Table
from gearrattle.reproduction.mean_load import setup_of as of_load
from gearrattle.reproduction.measurements import Measurements, Scope, Setup
from gearrattle.reproduction.number_formats import counted, figure
from gearrattle.reproduction.paper_cases import SPEED
from gearrattle.reproduction.paper_coherence import KINDS
from gearrattle.reproduction.paper_coherence import setup_of as fine_of
from gearrattle.reproduction.paper_transmissibility import bandwidth
from gearrattle.reproduction.printed_values import MODERATE, Performance
from gearrattle.reproduction.reproduction_record import DIFFERS, REPRODUCED, Row, Section, row
from gearrattle.reproduction.tables_3_4 import TABLES
from gearrattle.reproduction.tables_3_4 import setup_of as of_tables

_VARIABLE = ("rkf", "rkv", "adams", "gear", "bulirsch-stoer")


def needs(scope: Scope) -> Iterator[Setup]:
    """Verner's method restarted at corners, beside the tables' runs."""
    for _, case, _ in TABLES:
        for loaded in KINDS.values():
            yield of_tables(scope, case, "rkv-events", loaded=loaded)


def section(measurements: Measurements) -> Section:
    """Measure the claims one by one."""
    rows = (
        *(_fixed_are_faster(measurements, number, case, kind) for number, case, _ in TABLES for kind in KINDS),
        *(_trials_fail(measurements, case, kind) for _, case, _ in TABLES for kind in KINDS),
        _trial_steps(measurements),
        _bottoms_out(measurements),
        *(bandwidth(measurements, kind, fine_of) for kind in KINDS),
    )
    words = (
        "Section 9 explains run times by steps rejected at corners. Rejections can be counted: RKV-events is the same "
        "method restarted at every corner, so that no accepted step contains one."
    )
    return Section("claims", "Section 9: claims", words, rows, (_table(measurements),))


def _fixed_are_faster(measurements: Measurements, number: int, case: int, kind: str) -> Row:
    # printed times relative to RK2
    lines = next(lines for table_number, _, lines in TABLES if table_number == number)
    rk2, rk4, *others = (line for line in lines if line.calls)
    theirs = ", ".join(f"{line.label} {line.seconds / rk2.seconds:.2f}" for line in (rk4, *others))
    # runs and times of ours
    runs = {
        line.label: run
        for line in lines
        if (run := measurements.run(of_tables(measurements.scope, case, line.algorithm, loaded=KINDS[kind])))
        is not None
    }
    times = {
        line.label: measurements.times(of_tables(measurements.scope, case, line.algorithm, loaded=KINDS[kind]))
        for line in lines
        if line.label in runs
    }
    base = times["RK2"]
    ours = ", ".join(f"{label} {min(time) / min(base):.2f}" for label, time in times.items() if label != "RK2")
    ours += f" (fastest of {len(base)} runs each; the slowest of all up to {_scatter(times.values()):.0%} above)"
    # methods that choose their steps and are slower than RK2
    slower = [name for name, time in times.items() if name not in ("RK2", "RK4") and min(time) > max(base)]
    chosen = [name for name in runs if name not in ("RK2", "RK4")]
    why = (
        f"RK2 is not clearly faster than {len(chosen) - len(slower)} of {len(chosen)} methods that choose their steps "
        f"here; in the paper a call costs {_cost_of_a_call(lines)}, so its times are partly those of its codes"
    )
    return row(
        f"Table {number}, times relative to RK2, {kind}",
        theirs,
        ours,
        REPRODUCED if len(slower) == len(chosen) else DIFFERS,
        why if len(slower) < len(chosen) else "",
        slower=len(slower),
        of=len(chosen),
    )


def _scatter(times: Iterable[Sequence[float]]) -> float:
    """Return how far the slowest run of any algorithm lies above its fastest, as a share."""
    return max(max(time) / min(time) - 1.0 for time in times)


def _cost_of_a_call(lines: Sequence[Performance]) -> str:
    """Return the printed run time over the printed calls, lowest to highest, with the algorithms."""
    costs = {line.label: 1e3 * line.seconds / line.calls for line in lines if line.calls}
    low = min(costs, key=costs.__getitem__)
    high = max(costs, key=costs.__getitem__)
    return f"{costs[low]:.2f} ({low}) to {costs[high]:.2f} ms ({high})"


def _trials_fail(measurements: Measurements, case: int, kind: str) -> Row:
    rates = []
    figures = {}
    for name in ("rkf", "rkv", "rkv-events"):
        run = measurements.run(of_tables(measurements.scope, case, name, loaded=KINDS[kind]))
        if run is not None:
            rate = run.cost.rejected_steps / max(1, run.cost.events)
            rates.append(f"{name} {rate:.1f}")
            figures[name] = rate
    blind = min(figures["rkf"], figures["rkv"])
    more = blind > figures["rkv-events"] and blind >= 1.0
    why = "what is left when the method is restarted at corners is not due to corners"
    why = why if more else "rejections are not mainly due to crossings here"
    return row(
        f"Sec. 9, trial steps fail at breakpoints, case {case}, {kind}",
        "nearly always",
        f"rejected steps a crossing: {', '.join(rates)}",
        REPRODUCED if more else DIFFERS,
        why,
        **figures,
    )


def _trial_steps(measurements: Measurements) -> Row:
    """Sec. 9: variable methods show a larger (initial average) trial step."""
    parts = []
    larger = 0
    total = 0
    for (_, case, _), (kind, loaded), name in product(TABLES, KINDS.items(), ("rkf", "rkv", "bulirsch-stoer")):
        run = measurements.run(of_tables(measurements.scope, case, name, loaded=loaded))
        if run is None:
            continue
        total += 1
        larger += run.cost.average_trial_step > run.cost.average_step
        if name == "rkv":
            pair = (SPEED * run.cost.average_trial_step, SPEED * run.cost.average_step)
            parts.append(f"case {case} {kind} {figure(pair[0], 2)} and {figure(pair[1], 2)}")
    return row(
        "Sec. 9, trial steps are larger than steps taken",
        f"RKF, RKV, case 3: 0.0400, 0.0377 against span over count {850 / 125034:.4f}, {850 / 170441:.4f}",
        f"RKV, trial and taken: {'; '.join(parts)}",
        REPRODUCED if 2 * larger > total else DIFFERS,
        f"of all steps tried, larger in {larger} of {total} runs; the paper's average is over the initial ones",
        larger=larger,
        of=total,
    )


def _bottoms_out(measurements: Measurements) -> Row:
    """Sec. 9: a variable step bottoms out at discontinuities."""
    parts = []
    least = 1.0
    for name in ("rkf", "rkv", "bulirsch-stoer"):
        run = measurements.run(of_tables(measurements.scope, 3, name, loaded=False))
        if run is not None and run.cost.smallest_step is not None:
            share = run.cost.smallest_step / run.cost.average_step
            least = min(least, share)
            parts.append(f"{name} {figure(share, 2)}")
    return row(
        "Sec. 9, steps bottom out at discontinuities",
        "h is reduced to the prescribed tolerance",
        f"smallest over average step, case 3, rattling: {', '.join(parts)}",
        DIFFERS,
        "at a corner the step falls to about a hundredth, not to the tolerance, and grows again",
        least=least,
    )


def _table(measurements: Measurements) -> Table:
    lines = []
    for _, case, _ in TABLES:
        for kind, loaded in KINDS.items():
            for name in (*_VARIABLE, "rkv-events"):
                run = measurements.run(of_tables(measurements.scope, case, name, loaded=loaded))
                if run is not None:
                    lines.append(
                        _line(f"case {case}, {kind}", name, run.cost.steps, run.cost.rejected_steps, run.cost.events)
                    )
    for kind, loaded in KINDS.items():
        for name in ("rkf", "rkv"):
            run = measurements.run(of_load(measurements.scope, name, MODERATE, loaded=loaded))
            if run is not None:
                lines.append(
                    _line(f"case 3, {kind}, mean 0.5", name, run.cost.steps, run.cost.rejected_steps, run.cost.events)
                )
    return Table(
        ("run", "algorithm", "steps", "rejected", "crossings", "rejected a crossing"),
        tuple(lines),
        frozenset({0, 1}),
        "Rejected steps",
    )


def _line(label: str, name: str, steps: int, rejected: int, crossings: int) -> tuple[str, ...]:
    rate = figure(rejected / crossings, 2) if crossings else "–"
    return label, name, counted(steps), counted(rejected), counted(crossings), rate
