"""What friction, alternating stiffness, records and run-ups cost: ``python -m benchmarks.inputs`` (``make inputs``).

Every driveline runs with and without; the time is that of the run itself, ``run.cost.wall_time``, all regions built,
few samples and no audit: the least of some rounds. A run-up is set against steady runs at speeds spread evenly over it,
as long together: at a higher speed more happens in a second. Written to ``docs/reference/inputs.md``.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

import gearrattle as gr
from benchmarks.machine import machine

HERE = Path(__file__).resolve().parents[1]
PAGE = HERE / "docs" / "reference" / "inputs.md"
EXAMPLES = HERE / "examples"
ROUNDS = 5
CYCLES = 200
OVER = 10.0
SPEEDS = 6
RUN_UP = (800.0, 3000.0)
FOUR = 4.0  # a run with may cost so many times the run without


def tables(name: str, **simulation: Any) -> dict[str, Any]:
    """Return an example as tables, with few samples."""
    tables_of_file = gr.load(EXAMPLES / name).to_tables()
    tables_of_file["simulation"] = {"samples_per_cycle": 8, "discard": 0, **simulation}
    return tables_of_file


def model(content: dict[str, Any]) -> gr.Model:
    """Return the model of some tables."""
    return gr.Model.from_tables(content)


def seconds(made: gr.Model) -> float:
    """Return the least time of a run [s]."""
    return min(gr.simulate(made, audit=False).cost.wall_time for _ in range(ROUNDS))


def hysteresis() -> tuple[float, float]:
    """Return the time with and without hysteresis in three stages."""
    content = tables("clutch_friction.toml", cycles=CYCLES)
    with_ = seconds(model(content))
    for coupling in content["coupling"]:
        for stage in (*coupling.get("stages", ()), *coupling.get("coast_stages", ())):
            stage.pop("hysteresis", None)
            stage.pop("stick_stiffness", None)
    return with_, seconds(model(content))


def alternation() -> tuple[float, float]:
    """Return the time with and without a mesh stiffness that alternates."""
    content = tables("alternating_mesh.toml", cycles=CYCLES)
    with_ = seconds(model(content))
    for mesh in content["mesh"]:
        mesh.pop("alternation", None)
    return with_, seconds(model(content))


def record() -> tuple[float, float]:
    """Return the time of case 3 with and without a torque measured at 1 kHz."""
    content = tables("paper/case3.toml", cycles=CYCLES)
    without = seconds(model(content))
    end = CYCLES * 2.0 * np.pi / 150.0
    time = np.arange(0.0, end + 0.01, 1e-3)
    noise = np.random.default_rng(1).normal(0.0, 2.0, time.size)
    content["torque"].append(
        {"on": "flywheel", "signal": {"time": time.tolist(), "value": (noise - noise.mean()).tolist()}}
    )
    return seconds(model(content)), without


def run_up() -> tuple[float, float]:
    """Return the time of a run-up of case 3, and of steady runs over its speeds, as long together."""
    content = tables("paper/case3.toml")
    steady = 0.0
    for i in range(SPEEDS):
        speed = RUN_UP[0] + (i + 0.5) / SPEEDS * (RUN_UP[1] - RUN_UP[0])
        cycles = max(1, round(OVER / SPEEDS * speed / 60.0))
        at_speed = {**content, "excitation": {"speed": f"{speed!r} rpm"}}
        at_speed["simulation"] = {**content["simulation"], "cycles": cycles}
        steady += seconds(model(at_speed))
    sweep = {"from": f"{RUN_UP[0]!r} rpm", "to": f"{RUN_UP[1]!r} rpm", "over": OVER}
    return seconds(model({**content, "excitation": {"sweep": sweep}})), steady


CASES = {
    "hysteresis in three stages (clutch_friction)": hysteresis,
    "a mesh stiffness that alternates (alternating_mesh)": alternation,
    "a torque measured at 1 kHz (case 3)": record,
    f"a run-up, {RUN_UP[0]:.0f} to {RUN_UP[1]:.0f} rpm in {OVER:.0f} s (case 3)": run_up,
}


def rows() -> Iterator[str]:
    """Yield a row of the table for every kind of input."""
    for name, measure in CASES.items():
        with_, without = measure()
        yield f"| {name} | {1e3 * without:.1f} | {1e3 * with_:.1f} | {with_ / without:.2f} |"


def page() -> str:
    """Measure, and write the page."""
    load = os.getloadavg()[0]
    table = "\n".join(["| input | without [ms] | with [ms] | ratio |", "|---" * 4 + "|", *rows()])
    return f"""# What friction, alternation, records and run-ups cost

Written by `make inputs` on {datetime.now(UTC):%Y-%m-%d}; do not edit. {machine()};
others kept {load:.1f} of its cores busy before it began.

The least of {ROUNDS} runs by `exact`, few samples, no audit, all regions built; the aim is a ratio of {FOUR:.0f}
at most. {CYCLES} cycles, but for the run-up: that is set against steady runs at {SPEEDS} speeds spread evenly over
it, as long together.

{table}
"""


def main() -> None:
    """Measure and write."""
    text = page()
    PAGE.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
