"""What sampling rattle metrics need: measured, and written beside their definitions.

    make metrics        rewrites docs/reference/metrics.md

The same exact motion is sampled at 512 to 4096 samples a cycle; every metric that is taken from samples changes with
it, what is taken from the log of crossings does not.
"""

from __future__ import annotations

import datetime
import math
import re
from pathlib import Path

import gearrattle as gr
from benchmarks.machine import machine
from gearrattle.quantities.quantity_table import METRICS

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "reference" / "metrics.md"
SAMPLES = (512, 1024, 2048, 4096)
CASES = (
    ("loaded", "paper/case1_loaded.toml", 40),
    ("rattling", "paper/case1.toml", 40),
    ("gearbox", "manual_transmission.toml", 60),
)
LIMIT = 1e-3

Changes = dict[tuple[str, str], dict[int, float]]


def measured(path: str, cycles: int) -> Changes:
    """Largest relative change over subjects against the finest sampling, by metric and quantity, by samples."""
    model = gr.load(ROOT / "examples" / path)
    tables = {}
    for samples in SAMPLES:
        run = gr.simulate(model, cycles=cycles, discard=cycles // 2, samples_per_cycle=samples)
        table = gr.metrics(run)
        tables[samples] = {(r.metric, r.quantity, r.subject): r.value for r in table.itertuples() if r.subject}
    finest = tables[SAMPLES[-1]]
    changed: Changes = {}
    for key, reference in finest.items():
        if not math.isfinite(reference) or reference == 0.0:
            continue
        quantity = re.sub(r" at order .*", " at an order", key[1])
        worst = changed.setdefault((key[0], quantity), dict.fromkeys(SAMPLES[:-1], 0.0))
        for samples in worst:
            worst[samples] = max(worst[samples], abs(tables[samples][key] / reference - 1.0))
    return changed


def sampling_table(cases: dict[str, Changes]) -> list[str]:
    """Rows by quantity: per cent of change from each sampling to the finest."""
    keys = list(dict.fromkeys(key for changes in cases.values() for key in changes))
    head = [f"{name} {samples}" for name in cases for samples in SAMPLES[:-1]]
    lines = [f"| quantity | {' | '.join(head)} |", f"|---|{'--:|' * len(head)}"]
    for metric, quantity in keys:
        cells = []
        for changes in cases.values():
            worst = changes.get((metric, quantity))
            cells += [_percent(worst[samples]) if worst else "" for samples in SAMPLES[:-1]]
        shown = quantity.replace("|", "\\|")
        lines.append(f"| {shown} | {' | '.join(cells)} |")
    return lines


def _percent(change: float) -> str:
    if change < 1e-12:
        return "0"
    shown = f"{100.0 * change:.1g}" if change < 0.09 else f"{100.0 * change:.0f}"
    return f"**{shown}**" if change > LIMIT else shown


def definitions() -> list[str]:
    """One entry a metric, from the table itself."""
    lines = []
    for metric in METRICS:
        lines += [
            f"`{metric.name}`: {metric.title}",
            f": `{metric.formula}`.",
            f"  *Unit* {metric.unit}.",
            f"  *Window* {metric.window}.",
            f"  *Needs* {', '.join(metric.needs)}.",
            f"  *Sampling* {metric.sampling}.",
            f"  *Source* {metric.source}.",
            "",
        ]
    return lines


TEXT = """# Rattle metrics

Written by `make metrics` on {date}; do not edit.

Machine: {machine}.

`gr.metrics` measures a run or a recording by every one of these; {{doc}}`../howto/metrics` shows how. Means of samples
are by the trapezoidal rule over the window: the steady part of a run, the last whole periods of a recording. Sums over
the log count contacts that begin in the steady part and end before the motion does.

## Definitions

{definitions}
## Where the formulas come from

The separation ratio, the restitution of impacts and the statistics are standard, and cited as commonly quoted: of the
sources above only the 1995 paper was at hand when this was written. Formulas were checked by derivation and against
hand-computed vectors (`tests/quantities/vectors.py`, 1e-9), not against the pages cited. The rattle level is practice
with constants of one gearbox each. A band "above the engine's orders" and the 5 % of the exceedance are usage without
an origin known to us. We know of no standard that defines gear rattle.

## How far sums over the log are the work of contacts

Over whole runs from rest the energy of impacts by the log and the work of contacts by the audit, two routes without a
common formula, differ by {energy} %. The exchanged momentum $m(1+e)|v|$ differs from the contact impulse (criterion
"impacts") by {impulse} %: where contacts are short the two agree; where they take much of the time, as in the
paper's case 1, the load pushes meanwhile, and a note says so.

| mesh | in contact | energy, log against audit | exchanged momentum against contact impulse |
|---|--:|--:|--:|
{routes}

## What sampling they need

Change in per cent, largest over all subjects and orders, from 512, 1024 and 2048 samples a cycle to 4096 of the *same*
exact motion; bold: more than 0.1 %. Quantities from the log and from the audit do not depend on sampling (0: below
1e-10 %). *loaded*: `paper/case1_loaded.toml`, no gap opens; *rattling*: `paper/case1.toml`; *gearbox*:
`manual_transmission.toml` at idle, {hit} impacts per cycle on its busiest mesh.

{table}

Peaks and moments are taken between the samples of an exact motion, and do not depend on them. Amplitudes at orders come
from angles where they are known, and change by far less than those of accelerations would. The band above
the engine's orders hangs on the spikes of contacts, which last {contact} of a cycle in the gearbox. Peaks of a
recording do as well: samples h apart miss up to $1-\\cos(\\pi h/2t_c)$ of the peak of a half-sine of length $t_c$:
0.1 % asks for 35 samples a contact, there {needed} a cycle. A note tells the error of such a peak.
"""


def routes() -> list[tuple[str, float, float, float]]:
    """By mesh of whole runs: share in contact; energy by log and audit, exchanged momentum and contact impulse."""
    rows = []
    for _, path, cycles in CASES[1:]:
        run = gr.simulate(gr.load(ROOT / "examples" / path), cycles=cycles, discard=0)
        value = gr.metrics(run).set_index(["quantity", "subject"]).value
        for part in gr.criteria(run).parts:
            if part.kind == "mesh" and part.mean_contact_impulse:
                name = part.name
                energy = value["impact loss rate", name] / value["contact work rate", name] - 1.0
                impulse = part.mean_exchanged_momentum / part.mean_contact_impulse - 1.0
                rows.append((f"{Path(path).stem}: {name}", part.contact_share, float(energy), float(impulse)))
    return rows


def _span(values: list[float]) -> str:
    low, high = min(map(abs, values)), max(map(abs, values))
    return f"{100.0 * low:.2g} to {100.0 * high:.2g}"


def main() -> None:
    """Measure and write."""
    cases = {name: measured(path, cycles) for name, path, cycles in CASES}
    run = gr.simulate(gr.load(ROOT / "examples" / CASES[-1][1]), cycles=60, discard=30)
    parts = [part for part in gr.criteria(run).parts if part.kind == "mesh"]
    busiest = max(parts, key=lambda part: part.impacts_per_cycle)
    contact, by_routes = busiest.contact_share / busiest.impacts_per_cycle, routes()
    PAGE.write_text(
        TEXT.format(
            date=datetime.datetime.now(datetime.UTC).date(),
            machine=machine(),
            definitions="\n".join(definitions()),
            energy=_span([energy for _, _, energy, _ in by_routes]),
            impulse=_span([impulse for _, _, _, impulse in by_routes]),
            routes="\n".join(
                f"| {name} | {100.0 * share:.3g} % | {100.0 * energy:+.2g} % | {100.0 * impulse:+.2g} % |"
                for name, share, energy, impulse in by_routes
            ),
            hit=f"{busiest.impacts_per_cycle:.1f}",
            table="\n".join(sampling_table(cases)),
            contact=f"{contact:.2g}",
            needed=f"{round(35.0 / contact, -3):.0f}",
        ),
        encoding="utf-8",
    )
    print(PAGE.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
