"""Natural frequencies of geared rotors on bearings by ROSS, kept for ``tests/literature/test_ross.py``.

    python benchmarks/geared_rotors.py          # in an environment with ross-rotordynamics 2.3.0 and plotly < 7

ROSS (R. Timbo et al., J. Open Source Software 5 (2020) 2120; Apache 2) couples the lateral, axial and torsional motion
of two rotors by a gear mesh. Three drivelines, from equal models to what a model of rigid bodies leaves out:

- ``train``: motor, pinion, wheel and load, joined by couplings without mass or lateral stiffness, as gearrattle has it;
- ``pair``: two equal gears, each in the middle of a short shaft between two bearings, the shaft ever stiffer;
- ``shafts``: a pinion and a wheel on flexible steel shafts, 200 mm between bearings.

Of every mode the file has the frequency and the shares of its kinetic energy that are lateral, axial, torsional and of
tilting, by which the test chooses those modes that a plane model has.
"""

from __future__ import annotations

import datetime
import json
from pathlib import Path
from typing import Any

import numpy as np

TARGET = Path(__file__).parents[1] / "tests" / "literature" / "ross_frequencies.json"
ANGLE = np.radians(20.0)
STEEL = {"rho": 7810.0, "E": 2.11e11, "G_s": 8.12e10}
WEIGHTLESS = 1e-13  # kg, kg m^2: ROSS refuses couplings without any
AXIAL = 1e3  # N/m: holds axially, where a plane model has no direction

TRAIN = {
    "bodies": {
        "motor": {"J": 0.0043},
        "pinion": {"J": 0.00027, "m": 0.6, "d": 0.05638, "teeth": 20},
        "wheel": {"J": 0.0027, "m": 1.5, "d": 0.11276, "teeth": 40},
        "load": {"J": 0.0045},
    },
    "coupling": 1e5,
    "bearing": 1e8,
    "mesh": 2e8,
}
PAIR = {"J": 0.0365284, "m": 6.57, "d": 0.2, "teeth": 20, "bearing": 1e8, "mesh": 517925405.24}
SHAFTS = {
    "pinion": {"J": 4e-4, "m": 1.2, "d": 0.06, "teeth": 30},
    "wheel": {"J": 4e-3, "m": 3.5, "d": 0.12, "teeth": 60},
    "shaft": {"diameter": 0.04, "length": 0.2},
    "bearing": 2e8,
    "mesh": 3e8,
}


def gear(ross: Any, node: int, body: dict[str, float]) -> Any:
    """A gear with little tilting inertia, which no spur mesh couples to the plane."""
    size = {"n_teeth": body["teeth"], "pitch_diameter": body["d"], "pr_angle": ANGLE}
    return ross.GearElement(n=node, m=body["m"], Id=0.5 * body["J"], Ip=body["J"], **size)


def train(ross: Any, turn: float) -> Any:
    """Four bodies: ends without lateral motion of interest, joined to the gears in rotation alone."""
    bodies = TRAIN["bodies"]

    def side(first: Any, second: Any, stiffness: tuple[float, float]) -> Any:
        weightless = dict.fromkeys(("m_l", "m_r", "Ip_l", "Ip_r"), WEIGHTLESS)
        link = ross.CouplingElement(**weightless, kr_x=1e6, kr_y=1e6, kr_z=TRAIN["coupling"], L=0.1, o_d=0.05, n=0)
        light = ross.Material(name="light", **STEEL | {"rho": 1e-6})
        stub = ross.ShaftElement(L=0.02, idl=0.0, odl=0.05, material=light, n=1)  # ROSS wants one, at a free end
        held = [ross.BearingElement(n=n, kxx=k, kyy=k, kzz=AXIAL, cxx=0) for n, k in enumerate(stiffness)]
        return ross.Rotor([link, stub], [first, second], held)

    def end(node: int, name: str) -> Any:
        return ross.DiskElement(n=node, m=1.0, Id=bodies[name]["J"], Ip=bodies[name]["J"])

    driving = side(end(0, "motor"), gear(ross, 1, bodies["pinion"]), (1.0, TRAIN["bearing"]))
    driven = side(gear(ross, 0, bodies["wheel"]), end(1, "load"), (TRAIN["bearing"], 1.0))
    mesh = {"gear_mesh_stiffness": TRAIN["mesh"], "orientation_angle": turn}
    return ross.MultiRotor(driving, driven, coupled_nodes=(1, 0), **mesh)


def between_bearings(ross: Any, body: dict[str, float], bearing: float, shaft: dict[str, float]) -> Any:
    """A gear in the middle of a shaft between two bearings."""
    material = ross.Material(name="shaft", rho=shaft["rho"], E=shaft["E"], G_s=shaft["G_s"])
    count = 2 * int(shaft["halves"])
    length = shaft["length"] / count
    pieces = [ross.ShaftElement(L=length, idl=0.0, odl=shaft["diameter"], material=material) for _ in range(count)]
    half = 0.5 * bearing
    held = [ross.BearingElement(n=n, kxx=half, kyy=half, kzz=AXIAL, cxx=0) for n in (0, count)]
    return ross.Rotor(pieces, [gear(ross, count // 2, body)], held)


def pair(ross: Any, stiffer: float) -> Any:
    """Two equal gears on shafts without mass, of steel times a factor."""
    shaft = {"diameter": 0.05, "length": 0.04, "halves": 1, "rho": 1e-3}
    shaft |= {"E": stiffer * STEEL["E"], "G_s": stiffer * STEEL["G_s"]}
    sides = [between_bearings(ross, PAIR, PAIR["bearing"], shaft) for _ in range(2)]
    return ross.MultiRotor(*sides, coupled_nodes=(1, 1), gear_mesh_stiffness=PAIR["mesh"])


def shafts(ross: Any) -> Any:
    """Pinion and wheel on flexible steel shafts."""
    halves = 4
    shaft = {**SHAFTS["shaft"], **STEEL, "halves": halves}
    sides = [between_bearings(ross, SHAFTS[name], SHAFTS["bearing"], shaft) for name in ("pinion", "wheel")]
    return ross.MultiRotor(*sides, coupled_nodes=(halves, halves), gear_mesh_stiffness=SHAFTS["mesh"])


def modes(rotor: Any) -> list[dict[str, float]]:
    """Frequencies below 20 kHz [Hz], and shares of kinetic energy by kind of motion, from the matrices of ROSS."""
    from scipy.linalg import eigh

    mass = rotor.M(0)
    shift = (2.0 * np.pi * 100.0) ** 2  # makes the stiffness of free motions positive
    inverses, shapes = eigh(mass, rotor.K(0) + shift * mass)
    listed = []
    for inverse, shape in zip(inverses[::-1], shapes.T[::-1], strict=True):
        hertz = float(np.sqrt(max(1.0 / inverse - shift, 0.0)) / (2.0 * np.pi)) if inverse > 0.0 else np.inf
        if hertz > 2e4:
            break
        energy = shape * (mass @ shape)
        by_direction = energy.reshape(-1, 6).sum(axis=0) / energy.sum()
        x, y, z, tilt_x, tilt_y, turn = by_direction.tolist()
        shares = {"lateral": x + y, "axial": z, "tilting": tilt_x + tilt_y, "torsional": turn}
        listed.append({"hertz": hertz} | {name: round(share, 6) for name, share in shares.items()})
    return listed


def main() -> None:
    """Compute all drivelines and write the file."""
    import ross

    answers = {
        "ross": ross.__version__,
        "date": datetime.datetime.now(tz=datetime.UTC).date().isoformat(),
        "train": {"data": TRAIN, "turns": {str(turn): modes(train(ross, turn)) for turn in (0.0, 0.7)}},
        "pair": {"data": PAIR, "stiffer": {str(times): modes(pair(ross, times)) for times in (1, 2, 4)}},
        "shafts": {"data": SHAFTS | {"steel": STEEL}, "modes": modes(shafts(ross))},
    }
    TARGET.write_text(json.dumps(answers, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
