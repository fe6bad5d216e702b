"""Seconds of every public call on gearboxes of growing size, and what they treat: ``models.gearbox``."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from typing import Any

import gearrattle as gr
from benchmarks.growth.models import gearbox
from gearrattle.analysis.stiffness import regions, regions_visited

SIZES = ((4, 2), (16, 8), (64, 20), (128, 64))
CYCLES = 32

Call = Callable[[gr.Model, gr.Run], Any]


def _reported(model: gr.Model, _: gr.Run) -> None:
    with tempfile.TemporaryDirectory() as folder:
        gr.run(model, cycles=CYCLES).save(folder)


def _channel(model: gr.Model) -> str:
    return f"velocity.{model.inertias[-1].name}"


CALLS: dict[str, Call] = {
    "simulate": lambda model, _: gr.simulate(model),
    "simulate, rk4, 1 cycle": lambda model, _: gr.simulate(model, "rk4", cycles=1, discard=0),
    "equilibrium": lambda model, _: gr.equilibrium(model),
    "modes": lambda model, _: gr.modes(model),
    "campbell": lambda model, _: gr.campbell(model),
    "nondimensionalize": lambda model, _: gr.nondimensionalize(model),
    "reduce": lambda model, _: gr.reduce(model, "80 Hz"),
    "stiffness": lambda model, _: gr.stiffness(model),
    "regions of stiffness": lambda model, _: regions(model),
    "regions visited": lambda _, run: regions_visited(run),
    "contact_ratio of a model": lambda model, _: gr.contact_ratio(model),
    "contact_ratio of a run": lambda _, run: [
        gr.contact_ratio(run, m) for m in ("mean-slope", "describing", "spectral")
    ],
    "largest exponent and horizon": lambda _, run: (run.largest_lyapunov_exponent, run.predictability_horizon),
    "criteria": lambda _, run: gr.criteria(run),
    "metrics": lambda _, run: gr.metrics(run),
    "psd": lambda model, run: gr.spectral.psd(run, _channel(model)),
    "order_map": lambda model, run: gr.spectral.order_map(run, _channel(model)),
    "figures": lambda _, run: gr.figures(run),
    "advise": lambda model, _: gr.advise(model),
    "periodic": lambda model, _: gr.periodic(model),
    "the whole procedure, with its report": _reported,
}
"""By name; each gets a fresh model, so that nothing is kept from the call before, and a fresh run of it."""


def timed(call: Call, n: int, clearances: int) -> float:
    """Processor seconds of one call, the simulation it may need left out."""
    model = gearbox(n, clearances, CYCLES)
    run = gr.simulate(model)
    model = gearbox(n, clearances, CYCLES)
    begin = time.process_time()
    call(model, run)
    return time.process_time() - begin


def measure(say: Callable[[Any], None] = print, sizes: tuple[tuple[int, int], ...] = SIZES) -> list[dict[str, Any]]:
    """Seconds of every call, by size; one call on the smallest before, which loads and compiles."""
    rows = []
    for name, call in CALLS.items():
        timed(call, *sizes[0])
        rows.append({"call": name, "seconds": [timed(call, *size) for size in sizes]})
        say(rows[-1])
    return rows
