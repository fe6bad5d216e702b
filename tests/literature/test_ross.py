"""Geared rotors on bearings against ROSS, whose numbers ``benchmarks/geared_rotors.py`` has computed and kept."""

from __future__ import annotations

import json
from math import cos, pi, radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr

ANSWERS = json.loads((Path(__file__).parent / "ross_frequencies.json").read_text(encoding="utf-8"))
ANGLE = radians(20.0)
RIGID = 100.0  # Hz; ROSS holds what a plane model does not have softly, below this


def theirs(modes: list[dict[str, float]], tilting: float = 1e-3) -> np.ndarray:
    """Frequencies of the modes that a plane model has [Hz]: in rotation and across the axes, next to no tilting."""
    plane = [m for m in modes if m["hertz"] > RIGID and m["axial"] < 1e-3 and m["tilting"] < tilting]
    return np.array([m["hertz"] for m in plane])


def ours(tables: dict[str, Any]) -> np.ndarray:
    frequencies = gr.modes(gr.Model.from_tables({"schema": 1, "excitation": {"speed": 100.0}, **tables})).frequencies
    return np.asarray(frequencies)[1:] / (2.0 * pi)


def gears(pair: dict[str, dict[str, float]], mesh: float, turn: float = 0.0) -> dict[str, Any]:
    """Tables of two gears on bearings: of each J, mass m, pitch diameter d and the bearing's stiffness k."""
    radii = [0.5 * body["d"] * cos(ANGLE) for body in pair.values()]
    mated = {"name": "gear", "between": list(pair), "radii": radii, "stiffness": mesh}
    return {
        "inertia": [{"name": name, "J": body["J"], "mass": body["m"]} for name, body in pair.items()],
        "mesh": [mated | {"pressure_angle": ANGLE, "centre_line": turn}],
        "bearing": [{"name": f"at_{name}", "on": name, "stiffness": body["k"]} for name, body in pair.items()],
    }


def shaft_stiffness(length: float, diameter: float, young: float, shear: float) -> float:
    """Stiffness in the middle of a simply supported shaft [N/m], with Cowper's shear coefficient as ROSS has it."""
    nu = young / (2.0 * shear) - 1.0
    coefficient = 6.0 * (1.0 + nu) / (7.0 + 6.0 * nu)
    bending = length**3 / (48.0 * young * pi * diameter**4 / 64.0)
    return 1.0 / (bending + length / (4.0 * shear * coefficient * pi * diameter**2 / 4.0))


def in_series(one: float, other: float) -> float:
    return one * other / (one + other)


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_a_train_on_bearings_has_the_frequencies_of_ross(turn: float) -> None:
    data = ANSWERS["train"]["data"]
    bodies = data["bodies"]
    pair = {name: bodies[name] | {"k": data["bearing"]} for name in ("pinion", "wheel")}
    tables = gears(pair, data["mesh"], turn)
    tables["inertia"] += [{"name": name, "J": bodies[name]["J"]} for name in ("motor", "load")]
    links = {"input": ["motor", "pinion"], "output": ["wheel", "load"]}
    tables["coupling"] = [{"name": n, "between": ends, "stiffness": data["coupling"]} for n, ends in links.items()]
    expected = theirs(ANSWERS["train"]["turns"][str(turn)])
    assert expected.size == 7
    assert ours(tables) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("stiffer", [1, 2, 4])
def test_a_short_shaft_is_in_series_with_its_bearings(stiffer: int) -> None:
    """ROSS differs from gears right on their bearings by the give of the shaft, and by nothing else."""
    data = ANSWERS["pair"]["data"]
    steel = ANSWERS["shafts"]["data"]["steel"]
    expected = theirs(ANSWERS["pair"]["stiffer"][str(stiffer)])
    assert expected.size == 5
    shaft = shaft_stiffness(0.04, 0.05, stiffer * steel["E"], stiffer * steel["G_s"])

    def tables(k: float) -> dict[str, Any]:
        return gears({name: data | {"k": k} for name in "ab"}, data["mesh"])

    assert ours(tables(in_series(data["bearing"], shaft))) == pytest.approx(expected, rel=1e-7)
    off = np.max(np.abs(ours(tables(data["bearing"])) / expected - 1.0))
    assert off * stiffer == pytest.approx(4.56e-3, rel=0.01)


def test_rigid_bodies_stand_for_gears_on_flexible_shafts() -> None:
    """Lateral modes within 0.5 % by Rayleigh's share of the shaft; the mesh's mode 12 % high, for shafts twist."""
    data = ANSWERS["shafts"]["data"]
    steel = data["steel"]
    shaft = data["shaft"]
    stiffness = shaft_stiffness(shaft["length"], shaft["diameter"], steel["E"], steel["G_s"])
    mass = steel["rho"] * pi / 4.0 * shaft["diameter"] ** 2 * shaft["length"]
    bent = data["bearing"] / (data["bearing"] + stiffness)
    share = (1.0 - bent) ** 2 + 2.0 * bent * (1.0 - bent) * 5.0 / 8.0 + bent**2 * 17.0 / 35.0
    pair = {
        name: {
            "J": data[name]["J"] + mass * shaft["diameter"] ** 2 / 8.0,
            "m": data[name]["m"] + share * mass,
            "d": data[name]["d"],
            "k": in_series(data["bearing"], stiffness),
        }
        for name in ("pinion", "wheel")
    }
    expected = theirs(ANSWERS["shafts"]["modes"], tilting=0.01)[:5]
    off = ours(gears(pair, data["mesh"])) / expected - 1.0
    assert np.max(np.abs(off[:4])) < 5e-3
    assert off[4] == pytest.approx(0.1226, abs=1e-3)
