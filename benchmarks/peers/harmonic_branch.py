"""The backlash oscillator's branch by pyHarm, in an interpreter that has it: prints one line of JSON.

``python harmonic_branch.py HARMONICS``: alone, because pyHarm asks for other versions of packages than gearrattle. The
first run compiles; of the others the least time counts.
"""

from __future__ import annotations

import json
import logging
import sys
import warnings
from importlib.metadata import version
from time import process_time
from typing import Any

import numpy as np

LOWEST, HIGHEST = 0.3, 1.6
STEP = 0.02
SAMPLES = 50  # of a period, for each harmonic
REPEATS = 5


def branch(harmonics: int) -> tuple[list[list[float]], float]:
    """Return frequency, deflection and rate at the start of the period of every point, and the time they took [s]."""
    from pyHarm.Maestro import Maestro

    def force(order: int, harmonic: int, amplitude: float) -> dict[str, Any]:
        """A force that is the derivative of an order of a cosine."""
        where = {"connect": {"body": [0]}, "dirs": [0]}
        return {"type": "GOForcing", **where, "dto": order, "ho": harmonic, "amp": amplitude}

    one, none = np.ones((1, 1)), np.zeros((1, 1))
    matrices = {"M": one, "C": 0.1 * one, "G": none, "K": none}
    gap = {"type": "PenaltyBilateralGap", "connect": {"body": [0]}, "dirs": [0], "g": 1.0, "k": 1.0}
    steps = {"ds_max": STEP, "ds_min": 1e-6, "ds0": STEP, "sign_ds": 1}
    ends = {"puls_inf": LOWEST, "puls_sup": HIGHEST, "puls_start": LOWEST}
    maestro = Maestro(
        {
            "system": {"type": "Base", "nh": harmonics, "nti": max(256, SAMPLES * harmonics)},
            "substructures": {
                "body": {"matrix": matrices, "ndofs": 1, "nnodes": 1, "nmodes": 0, "matching": [0]},
            },
            "connectors": {"gap": gap, "mean": force(0, 0, 0.1), "error": force(2, 1, -0.05)},
            "analysis": {"branch": {"study": "frf", "solver": "scipyroot", "verbose": False, **steps, **ends}},
        }
    )
    start = np.zeros(2 * harmonics + 1)
    wave = 0.05 * LOWEST**2 / (1.0 - LOWEST**2 + 0.1j * LOWEST)  # in contact
    start[:3] = 1.1, wave.real, -wave.imag
    begin = process_time()
    maestro.operate(start)
    spent = process_time() - begin
    orders = np.arange(1, harmonics + 1)
    points = []
    for solution in maestro.nls["branch"].SolList:
        if solution.flag_accepted:
            frequency, cosine, sine = solution.x[-1], solution.x[1:-1:2], solution.x[2:-1:2]
            points.append([frequency, solution.x[0] + cosine.sum(), frequency * (orders * sine).sum()])
    return [[float(number) for number in point] for point in points], spent


def main() -> None:
    """Measure and print."""
    warnings.simplefilter("ignore")
    logging.disable(logging.CRITICAL)
    harmonics = int(sys.argv[1])
    branch(harmonics)
    points, spent = min((branch(harmonics) for _ in range(REPEATS)), key=lambda one: one[1])
    print(json.dumps({"version": version("pyHarm-os"), "points": points, "time": spent}))


if __name__ == "__main__":
    main()
