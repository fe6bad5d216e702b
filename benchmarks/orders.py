"""Spectra and orders of a record of ten million samples: ``python -m benchmarks.orders`` (``make orders``).

A run-up from 13 to 50 turns a second, two orders and noise, 51.2 kHz: every call in a process of its own, so that its
memory is its own, together with the record's 0.24 GB. The kernel that resamples is compiled before. Written to
``docs/reference/orders.md``.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path
from time import perf_counter

import numpy as np

import gearrattle as gr
from benchmarks.machine import machine

PAGE = Path(__file__).resolve().parents[1] / "docs" / "reference" / "orders.md"
SAMPLES, RATE = 10_000_000, 51_200.0
FIRST, LAST = 13.0, 50.0
CALLS: dict[str, tuple[str, str, tuple[object, ...], dict[str, float]]] = {
    "order map": ("`gr.spectral.order_map`, 100 orders, blocks of 8 turns", "order_map", (), {"highest": 100.0}),
    "order cuts": ("`gr.spectral.order_cuts`, 4 orders fitted, blocks of 8 turns", "order_cuts", ([2, 4, 6, 20],), {}),
    "waterfall": ("`gr.spectral.waterfall`, segments of 5 s, half overlapping", "waterfall", (), {}),
    "psd": ("`gr.spectral.psd`, bins of 2 Hz", "psd", (), {"resolution": 2.0}),
    "coherence": ("`gr.spectral.coherence`, bins of 2 Hz", "coherence", ("b",), {"resolution": 2.0}),
}


def record(samples: int) -> gr.measured.Recording:
    """Return the run-up."""
    time = np.arange(samples) / RATE
    rise = (LAST - FIRST) / time[-1]
    angle = 2.0 * np.pi * (FIRST * time + 0.5 * rise * time**2)
    noise = np.random.default_rng(1).standard_normal(samples)
    wave = np.sin(2.0 * angle + 0.3) + 0.02 * np.sin(20.0 * angle) + 0.1 * noise
    channels = [
        gr.measured.Channel("a", "acceleration", "hub", "rad/s^2", wave),
        gr.measured.Channel("n", "speed", "", "rad/s", 2.0 * np.pi * (FIRST + rise * time)),
    ]
    return gr.measured.Recording(time, tuple(channels), "made")


def measure(call: str) -> None:
    """Print seconds and gigabytes of one call, and the error of an order it finds."""
    gr.spectral.order_map(record(200_000), "a")  # compiles
    signal = record(SAMPLES)
    if call == "coherence":
        other = gr.measured.Channel("b", "torque", "hub", "N m", signal["a"].values + signal["n"].values)
        signal = signal.with_(channels=(*signal.channels, other))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    begin = perf_counter()
    _, name, arguments, options = CALLS[call]
    result = getattr(gr, name)(signal, "a", *arguments, **options)
    took = perf_counter() - begin
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    error = "–"
    if call in ("order map", "order cuts"):
        error = f"{float(abs(result.amplitude.sel(order=2.0) - 1.0).max()):.1e}"
    print(f"| {took:.2f} | {before:.2f} | {peak:.2f} | {error} |")


def main() -> None:
    """Measure every call in a process of its own and write the page."""
    busy = os.getloadavg()[0]
    rows = []
    for call, (words, *_) in CALLS.items():
        command = [sys.executable, "-m", "benchmarks.orders", call]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        rows.append(f"| {words} {done.stdout.strip()}")
        print(rows[-1])
    lines = [
        "# Spectra and orders of long records",
        "",
        f"Written by `make orders` on {datetime.now(UTC):%Y-%m-%d}; do not edit. {machine()}, one thread;",
        f"others kept {busy:.1f} cores busy before it began: times are upper bounds.",
        "",
        f"A record of {SAMPLES:.0e} samples at {RATE / 1e3:g} kHz, {SAMPLES / RATE:.0f} s, going up",
        f"from {FIRST * 60:.0f} to {LAST * 60:.0f} rpm: order 2 of amplitude 1, order 20 of 0.02, noise of 0.1.",
        "*Before*: the process with the record made, *peak*: after the call, both at their largest so far. *Order 2*:",
        "largest error of its amplitude in any block, to which the noise adds.",
        "",
        "| call | time [s] | before [GB] | peak [GB] | order 2 |",
        "|---|---|---|---|---|",
        *rows,
        "",
        "The fit of orders evaluates a sine and a cosine of every order at every sample of two overlapping blocks; the",
        "map resamples once. Memory grows with the record and the map, not with the number of segments.",
        "",
    ]
    PAGE.write_text("\n".join(lines), encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        measure(sys.argv[1])
    else:
        main()
