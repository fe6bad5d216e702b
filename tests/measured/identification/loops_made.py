"""Loops of known dampers, drawn by the package's own static law and sampled with noise.

Two to four stages a side, each as wide as 4 to 8 degrees, slopes growing by 1.6 to 2.4 from stage to stage; friction of
the centre 5 to 10 % of full scale, 4 to 8 % more in each stage beyond; sides of different numbers of stages, widths,
slopes and heights. Three cycles of 4000 samples, noise of 2 % of full scale (one standard deviation).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import gearrattle as gr
from gearrattle.model.toml_text import toml_text

Array = NDArray[np.float64]

DEGREE = np.pi / 180.0
SCALE = 200.0


def model_of(coupling: dict[str, Any]) -> gr.Model:
    """One body before the coupling."""
    tables = {
        "schema": 1,
        "units": "SI",
        "inertia": [{"name": "x", "J": 1.0}],
        "coupling": [{**coupling, "between": ["x", "ground"]}],
        "excitation": {"speed": 1.0},
    }
    return gr.loads(toml_text(tables))


def damper(seed: int) -> tuple[dict[str, Any], float, float]:
    """A coupling's table and the ends of its loop [rad]."""
    random = np.random.default_rng(seed)
    inner, parted = random.uniform(5, 10), random.random() < 0.5
    sides: list[list[dict[str, float]]] = []
    for side in range(2):
        slope = random.uniform(1.4, 1.8) if parted and side else 1.0
        loop = inner
        end = 0.0
        stages = []
        for i in range(int(random.integers(2, 5))):
            if i:
                slope, loop = slope * random.uniform(1.6, 2.4), loop + random.uniform(4, 8)
            end += random.uniform(4, 8)
            stick = slope * random.uniform(8, 20)
            stages.append({"stiffness": slope, "until": end, "hysteresis": loop, "stick_stiffness": stick})
        sides.append(stages)
    ends = [stages[-1].pop("until") for stages in sides]
    top = max(_torque(stages, end) for stages, end in zip(sides, ends, strict=True))
    for stages in sides:
        for stage in stages:
            stage["hysteresis"] *= SCALE / 100.0
            stage["until"] = stage["until"] * DEGREE if "until" in stage else None  # type: ignore[assignment]
            stage["stiffness"] *= SCALE / top / DEGREE
            stage["stick_stiffness"] *= SCALE / top / DEGREE
    preload = float(random.uniform(-0.02, 0.02)) * SCALE
    kept = [[{k: float(v) for k, v in stage.items() if v is not None} for stage in stages] for stages in sides]
    table = {"name": "damper", "stages": kept[0], "coast_stages": kept[1], "preload": preload}
    return table, float(-ends[1] * DEGREE), float(ends[0] * DEGREE)


def _torque(stages: list[dict[str, float]], end: float) -> float:
    edges = [0.0, *(s["until"] for s in stages[:-1]), end]
    return sum(s["stiffness"] * (b - a) for s, a, b in zip(stages, edges[:-1], edges[1:], strict=True))


def sampled(
    coupling: dict[str, Any], low: float, high: float, *, noise: float, seed: int, cycles: int = 3, samples: int = 4000
) -> tuple[Array, Array]:
    """Deflection [rad] and torque [N m]; noise over full scale."""
    loop = gr.torque_angle(model_of(coupling), coupling["name"], low, high)
    turn = loop.turn
    up = np.linspace(low, high, samples // 2 + 1)[:-1]
    down = np.linspace(high, low, samples // 2 + 1)[:-1]
    rise = np.interp(up, loop.deflection[: turn + 1], loop.torque[: turn + 1])
    fall = np.interp(down, loop.deflection[turn:][::-1], loop.torque[turn:][::-1])
    deflection = np.append(np.tile(np.concatenate([up, down]), cycles), low)
    torque = np.append(np.tile(np.concatenate([rise, fall]), cycles), rise[0])
    full = float(np.abs(torque).max())
    return deflection, torque + noise * full * np.random.default_rng(seed).standard_normal(torque.size)


def numbers(coupling: dict[str, Any]) -> dict[str, float]:
    """The table's numbers by name, as ``LoopFit.values`` has them.

    First stages with the same height share a slider, which has the spring of the drive side
    (``assembly.friction_sliders``).
    """
    actual = {"preload": coupling["preload"]}
    for key in ("stages", "coast_stages"):
        actual |= {f"{key}.{i}.{k}": v for i, stage in enumerate(coupling[key]) for k, v in stage.items()}
    spring, heights = "{}.0.stick_stiffness", [actual.get(f"{key}.0.hysteresis") for key in ("stages", "coast_stages")]
    if spring.format("stages") in actual and heights[0] == heights[1]:
        actual[spring.format("coast_stages")] = actual[spring.format("stages")]
    return actual
