"""Harmonic balance against shooting on the backlash oscillator: ``python -m benchmarks.harmonic_balance PYTHON``.

Writes docs/reference/harmonic_balance.md. PYTHON is an interpreter that has pyHarm, for the branches; without one they
are left out. The motion is a sum of harmonics; the force of the gap is sampled and turned into harmonics again, with
the exact gradient of that (alternating frequency and time). Newton's method starts from the samples of the exact
motion, so that only the truncation is left as an error.
"""

from __future__ import annotations

import json
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np
from numpy.typing import NDArray

import gearrattle as gr
from benchmarks.machine import machine
from benchmarks.peers.harmonic_branch import REPEATS

Array = NDArray[np.float64]

HERE = Path(__file__).resolve().parents[1]
PAGE = HERE / "docs" / "reference" / "harmonic_balance.md"
FREQUENCY = 0.75
HARMONICS = (1, 3, 5, 10, 20, 40, 80)
BRANCH_HARMONICS = (5, 10, 20)
ROUNDS = 20
RANGE = (0.3, 1.6)
STEP = 0.0125  # of frequency: about as many points as the peer's

HEAD = """\
# Harmonic balance beside shooting

Written by `make balance` on {date}; do not edit. Machine: {machine}. One thread, processor time.

The backlash oscillator (`examples/backlash_oscillator.toml`) at the frequency {frequency}, where three motions
repeat after one period. Error: of deflection and rate at the start of the period against `gr.periodic`, whose
residual is below 1e-14. Estimate: the modulus of the last harmonic.

| motion | harmonics | error | estimate | time [ms] |
|---|---|---|---|---|
"""
SHOOTING = """
Shooting, from the same start, with the exact gradient and the multipliers: {shooting:.2f} ms.
"""
BRANCHES = """
## Branches

The same oscillator over the frequency, from 0.3 to 1.6, in one run on one machine, compiled code warm, the least time
of {repeats}: `gr.continuation` with multipliers and all events located, and pyHarm {version}, alternating frequency
and time with pseudo-arclength, without stability and events. Error: the largest deviation of deflection or rate at the
start of the period from the exact motion at the same frequency; of gearrattle its own estimate, which tests hold
against 40 digits.
Folds of pyHarm: the frequencies at which its points turn back, by a parabola.

| | points | time a point [ms] | error | upper fold | lower fold |
|---|--:|--:|--:|--:|--:|
"""
FOOT = """
## What follows

So harmonic balance is **not part of gearrattle**. Where the motion leaves a corner, its harmonics fall off with a
power of their order, and the last one says little of the error. It gives no multipliers. A first approximation over
wide ranges, which it is good for, `gr.contact_ratio(..., method="describing")` gives with one harmonic.
"""


def force(deflection: Array) -> tuple[Array, Array]:
    """Force of the gap and its slope: half gap 1, stiffness 1."""
    outside = np.abs(deflection) > 1.0
    return np.where(outside, deflection - np.sign(deflection), 0.0), outside.astype(float)


def balanced(deflection: Array, harmonics: int) -> Array:
    """(1 + 2 H,) mean, cosines and sines of the motion near samples of a deflection over one period."""
    count = max(64, 16 * harmonics)
    phase = 2.0 * np.pi * np.arange(count) / count
    orders = np.arange(1, harmonics + 1)
    waves = np.outer(phase, orders)
    basis = np.column_stack([np.ones(count), np.cos(waves), np.sin(waves)])
    inverse = np.linalg.pinv(basis)
    linear = np.zeros((basis.shape[1], basis.shape[1]))
    cosine, sine = orders, orders + harmonics
    linear[cosine, cosine] = linear[sine, sine] = -((orders * FREQUENCY) ** 2)
    linear[cosine, sine], linear[sine, cosine] = 0.1 * orders * FREQUENCY, -0.1 * orders * FREQUENCY
    push = np.zeros(basis.shape[1])
    push[:2] = 0.1, 0.05 * FREQUENCY**2
    amplitudes = inverse @ np.interp(phase, 2.0 * np.pi * np.arange(len(deflection)) / len(deflection), deflection)
    for _ in range(60):
        values, slopes = force(basis @ amplitudes)
        residual = linear @ amplitudes + inverse @ values - push
        if np.linalg.norm(residual) < 1e-13:
            break
        amplitudes = amplitudes - np.linalg.solve(linear + inverse @ (slopes[:, None] * basis), residual)
    return np.asarray(amplitudes)


def row(orbit: gr.typing.Orbit, harmonics: int) -> str:
    """One line of the table."""
    deflection = orbit.run.data["deflection"].values[:-1, 0]
    rate = orbit.state["velocity"][0]  # the kinematic error has no rate at the start
    begin = process_time()
    amplitudes = balanced(deflection, harmonics)
    spent = process_time() - begin
    orders = np.arange(1, harmonics + 1)
    start = amplitudes[0] + amplitudes[1 : harmonics + 1].sum()
    error = max(abs(start - deflection[0]), abs(FREQUENCY * (orders * amplitudes[harmonics + 1 :]).sum() - rate))
    last = np.hypot(amplitudes[harmonics], amplitudes[-1])
    name = f"{'stable' if orbit.stable else 'unstable'}, peak-to-peak {np.ptp(deflection):.3f}"
    return f"| {name} | {harmonics} | {error:.1e} | {last:.1e} | {1e3 * spent:.2f} |"


def peer_row(python: str, harmonics: int, model: gr.Model) -> tuple[str, str]:
    """One line of the table of branches, and the peer's version."""
    script = HERE / "benchmarks" / "peers" / "harmonic_branch.py"
    command = [Path(python).absolute(), script, str(harmonics)]
    with TemporaryDirectory() as folder:  # it writes where it runs
        done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=folder)
    answer = json.loads(done.stdout.splitlines()[-1])
    points = np.array(answer["points"])
    errors = []
    for frequency, deflection, rate in points:
        start = {"angle": [deflection + 0.05], "velocity": [rate]}  # the kinematic error at t = 0 is 0.05
        try:
            exact = gr.periodic(model.with_({"excitation.frequency": float(frequency)}), start=start).state
        except gr.ConvergenceError:  # beyond a fold
            continue
        errors.append(max(abs(exact["angle"][0] - start["angle"][0]), abs(exact["velocity"][0] - rate)))
    spent = 1e3 * answer["time"] / len(points)
    upper, lower = folds(points[:, 0])
    name = f"pyHarm, {harmonics} harmonics"
    return f"| {name} | {len(points)} | {spent:.2f} | {max(errors):.1e} | {upper:.6f} | {lower:.6f} |", answer[
        "version"
    ]


def folds(frequencies: Array) -> tuple[float, float]:
    """The first maximum and the first minimum of a branch's frequency, by parabolas through three points."""
    steps = np.sign(np.diff(frequencies))
    turns = np.flatnonzero(steps[1:] != steps[:-1]) + 1
    values = []
    for i in turns[:2]:
        curve = np.polynomial.Polynomial.fit([-1.0, 0.0, 1.0], frequencies[i - 1 : i + 2], 2)
        values.append(float(curve(curve.deriv().roots()[0])))
    return values[0], values[1]


def own_row(model: gr.Model) -> str:
    """The line of gearrattle in the table of branches; its error is the residual over the distance to a fold."""
    gr.continuation(model, "excitation.frequency", RANGE, step_limit=STEP).events  # noqa: B018 - compiles
    times = []
    for _ in range(REPEATS):
        begin = process_time()
        branch = gr.continuation(model, "excitation.frequency", RANGE, step_limit=STEP)
        values = branch.events.value[branch.events.kind == "fold"].to_numpy()
        stable = branch.data["stable"]
        times.append(process_time() - begin)
    spent = 1e3 * min(times) / len(stable)
    error = float(branch.data["error"].max())
    return f"| gearrattle | {len(stable)} | {spent:.2f} | {error:.0e} | {values[0]:.6f} | {values[1]:.6f} |"


def main() -> None:
    """Measure, and write the page."""
    model = gr.example("backlash_oscillator").with_({"excitation.frequency": FREQUENCY})
    orbits = gr.periodic(model, every=True)
    rows = [row(orbit, harmonics) for orbit in orbits for harmonics in HARMONICS]
    begin = process_time()
    for _ in range(ROUNDS):
        gr.periodic(model, start=orbits[-1]).multipliers  # noqa: B018 - worked out when asked for
    shooting = 1e3 * (process_time() - begin) / ROUNDS
    head = HEAD.format(date=datetime.now(UTC).date(), machine=machine(), frequency=FREQUENCY)
    text = head + "\n".join(rows) + "\n" + SHOOTING.format(shooting=shooting)
    if len(sys.argv) > 1:
        peers = [peer_row(sys.argv[1], harmonics, model) for harmonics in BRANCH_HARMONICS]
        lines = [own_row(model), *(line for line, _ in peers)]
        text += BRANCHES.format(version=peers[0][1], repeats=REPEATS) + "\n".join(lines) + "\n"
    PAGE.write_text(text + FOOT, encoding="utf-8")


if __name__ == "__main__":
    main()
