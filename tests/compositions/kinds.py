"""Kinds of models, one small driveline of each: what a call or a command must either take or refuse with a reason."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

import gearrattle as gr

BASE = """
schema = 1
name = "three bodies"
inertia = [
  { name = "engine", J = 0.1, drag = 0.5 },
  { name = "hub", J = 0.01 },
  { name = "wheel", J = 0.004, drag = 0.01, drag_torque = 0.4 },
]
[[coupling]]
name = "joint"
between = ["engine", "hub"]
stiffness = 800.0
damping = 0.5
clearance = 0.01
[[mesh]]
name = "gear"
between = ["hub", "wheel"]
radii = [0.05, 0.04]
stiffness = 1.0e6
damping = 40.0
backlash = 2.0e-4
transmission_error = [ { order = 3, amplitude = 2.0e-6 } ]
[excitation]
speed = 80.0
[[torque]]
on = "engine"
mean = 0.5
harmonics = [ { order = 1, amplitude = 40.0 } ]
[simulation]
cycles = 12
discard = 3
samples_per_cycle = 64
"""

ONE_BODY = """
schema = 1
inertia = [{ name = "engine", J = 1.0, drag = 0.5 }]
excitation = { speed = 80.0 }
torque = [{ on = "engine", harmonics = [{ order = 1, amplitude = 40.0 }] }]
simulation = { cycles = 12, discard = 3, samples_per_cycle = 64 }
"""

DIMENSIONLESS = """
schema = 1
units = "dimensionless"
inertia = [{ name = "engine", J = 1 }, { name = "hub", J = 0.5, drag = 0.01 }, { name = "wheel", J = 0.1, drag = 0.1 }]
coupling = [
  { name = "joint", between = ["engine", "hub"], stiffness = 4, damping = 0.1, clearance = 1 },
  { name = "gear", between = ["hub", "wheel"], stiffness = 9, damping = 0.2, clearance = 0.5 },
]
torque = [{ on = "engine", harmonics = [{ order = 1, amplitude = 2 }] }]
excitation = { speed = 1.5 }
simulation = { cycles = 12, discard = 3, samples_per_cycle = 64 }
"""

RECORD: dict[str, Any] = {
    "time": np.linspace(0.0, 1.2, 61).tolist(),
    "value": (3.0 * np.sin(2.0 * np.pi * np.linspace(0.0, 12.0, 61))).tolist(),
}
SWEEP = {"excitation.speed": None, "excitation.sweep": {"from": 80.0, "to": 120.0, "over": 0.8}}
ANGLES = np.linspace(0.0, 720.0, 73)
ENGINE = {
    "cylinders": 4,
    "bore": "81 mm",
    "stroke": "95.5 mm",
    "rod": "144 mm",
    "mass": 0.75,
    "pressure": {
        "angle": np.deg2rad(ANGLES).tolist(),
        "value": (1e5 + 3e6 * np.exp(-((((ANGLES + 350.0) % 720.0 - 360.0) / 25.0) ** 2))).tolist(),
    },
}
SHORT = {"simulation.cycles": 4, "simulation.discard": 1}
FRICTION = {"coupling.joint.hysteresis": 2.0, "coupling.joint.stick_stiffness": 2000.0}
ALTERNATION = {"mesh.gear.alternation": {"order": 20, "share": 0.6, "fewer": 0.55}}
DRAG: dict[str, Any] = {
    "torque.0.mean": "balance",
    "oil": {"type": "70w-75w-gl4", "density": 845.0, "temperature": 60.0},
    "inertia.wheel.drag_parts": [
        {"kind": "needle-bearing", "on": "hub", "mean_diameter": 0.045},
        {"kind": "synchroniser", "on": "hub", "mean_radius": 0.03, "length": 0.008, "gap": 1e-4},
        {"kind": "shaft-seal", "shaft_diameter": 0.03},
    ],
}
OVER_SPEED = {"speed": [10.0, 400.0], "value": [0.4, 0.9]}
STAGES = [{"stiffness": 30.0, "until": 0.02, "damping": 0.1}, {"stiffness": 800.0, "damping": 0.5}]
LOOP = {"name": "bypass", "between": ["engine", "wheel"], "stiffness": 100.0, "damping": 0.1, "clearance": 0.02}


@dataclass(frozen=True)
class Kind:
    """A kind of model.

    Attributes
    ----------
    words
        what is special about it.
    make
        makes a small driveline of it.
    """

    words: str
    make: Callable[[], gr.Model]


def base(changes: Mapping[str, Any] | None = None) -> gr.Model:
    """Return three bodies, two clearances and one harmonic torque, with some values changed."""
    return gr.loads(BASE).with_(dict(changes or {}))


def _moved(*bodies: str) -> dict[str, Any]:
    """Changes that prescribe how bodies move."""
    torques = [] if "engine" in bodies else base().to_tables()["torque"]
    drags = {f"inertia.{name}.drag_torque": 0.0 for name in bodies}
    return {"torque": torques, "motion": [{"on": name, "speed": RECORD} for name in bodies], **drags}


def _sines(body: str) -> dict[str, Any]:
    """Changes that prescribe the angle of a body by harmonics."""
    sines = [{"order": 1, "amplitude": 0.05}, {"order": 2, "amplitude": 0.01, "phase": 0.4}]
    return {**_moved(body), "motion": [{"on": body, "harmonics": sines}]}


def _released() -> gr.Model:
    initial = {"angle": [0.0, 0.0, 0.0], "velocity": [2.0, 0.0, 0.0]}
    return base(
        {
            "torque": [],
            "mesh.gear.transmission_error": [],
            "inertia.wheel.drag_torque": 0.0,
            "simulation.initial": initial,
        }
    )


def _closed_loop() -> gr.Model:
    tables = base().to_tables()
    return base({"coupling": [*tables["coupling"], LOOP]})


def _staged() -> gr.Model:
    coupling = {"name": "joint", "between": ["engine", "hub"], "stages": STAGES, "preload": 0.3}
    return base({"coupling": [coupling]})


def _grounded() -> gr.Model:
    coupling = {"name": "mount", "between": ["ground", "engine"], "stiffness": 500.0, "damping": 1.0}
    return base({"coupling": [*base().to_tables()["coupling"], coupling]})


def _linear() -> gr.Model:
    return base({"coupling.joint.clearance": 0.0, "mesh.gear.backlash": 0.0})


def _chain() -> gr.Model:
    """64 bodies in a row, two of the couplings with a clearance."""
    bodies = ["engine", *(f"b{i}" for i in range(1, 63)), "wheel"]
    inertias = [{"name": name, "J": 0.01, "drag": 0.02, "drag_torque": 0.01} for name in bodies]
    couplings = [
        {"name": f"c{i}", "between": [a, b], "stiffness": 2000.0, "damping": 0.5}
        for i, (a, b) in enumerate(pairwise(bodies))
    ]
    for index, name in ((0, "joint"), (62, "gear")):
        couplings[index] |= {"name": name, "clearance": 0.005}
    return base({"inertia": inertias, "coupling": couplings, "mesh": [], "torque.0.mean": 0.64, **SHORT})


def _two_trains() -> gr.Model:
    """A second train that nothing joins to the first."""
    tables = base().to_tables()
    bodies = [*tables["inertia"], {"name": "fan", "J": 0.01, "drag": 0.1}, {"name": "rim", "J": 0.02}]
    belt = {"name": "belt", "between": ["fan", "rim"], "stiffness": 200.0, "damping": 0.2, "clearance": 0.01}
    return base({"inertia": bodies, "coupling": [*tables["coupling"], belt]})


def _planetary() -> gr.Model:
    """A planetary set on the hub, its ring on the ground."""
    bodies = [{"name": "arm", "J": 0.02, "drag": 0.05}, {"name": "p1", "J": 2e-4}, {"name": "p2", "J": 2e-4}]
    planetary = {
        "name": "set",
        "sun": "hub",
        "ring": "ground",
        "carrier": "arm",
        "planets": ["p1", "p2"],
        "radii": {"sun": 0.03, "planet": 0.02, "ring": 0.07},
        "stiffness": {"sun": 1e6, "ring": 1e6},
        "damping": {"sun": 30.0, "ring": 30.0},
        "backlash": {"sun": 1e-4, "ring": 1e-4},
        "transmission_error": {"sun": [{"order": 3, "amplitude": 1e-6}]},
    }
    return base({"inertia": [*base().to_tables()["inertia"], *bodies], "planetary": [planetary]})


def _sideways() -> gr.Model:
    """Both gears move sideways and have a weight, one of them with a clearance around the other."""
    held = {"stiffness": 2e7, "damping": 3000.0}
    bearings = [{"name": "front", "on": "hub", **held}]
    bearings.append({"name": "rear", "on": "wheel", "around": "hub", **held, "clearance": 1e-5, "faces": 4})
    masses = {"inertia.hub.mass": 2.0, "inertia.wheel.mass": 1.0}
    return base({**masses, "mesh.gear.pressure_angle": 0.35, "bearing": bearings, "gravity": {}})


KINDS: Mapping[str, Kind] = {
    "harmonics": Kind("a harmonic torque, a transmission error, a clearance, backlash", base),
    "no input": Kind("free vibration from an initial state", _released),
    "over speed": Kind("a mean torque that is a table over speed", lambda: base({"torque.0.mean": OVER_SPEED})),
    "engine": Kind("the gas torque of an engine", lambda: base({"torque": [{"on": "engine", "engine": ENGINE}]})),
    "run-up": Kind("a sweep of the speed", lambda: base(SWEEP)),
    "torque record": Kind("a torque over time", lambda: base({"torque.0.signal": RECORD})),
    "prescribed motion": Kind("the first body moves as prescribed", lambda: base(_moved("engine"))),
    "prescribed middle": Kind("a body in the middle moves as prescribed", lambda: base(_moved("hub"))),
    "two prescribed": Kind("both ends move as prescribed", lambda: base(_moved("engine", "wheel"))),
    "harmonic motion": Kind("the angle of the first body is a sum of harmonics", lambda: base(_sines("engine"))),
    "harmonic middle": Kind("the angle of a body in the middle is such a sum", lambda: base(_sines("hub"))),
    "friction": Kind("a coupling with hysteresis", lambda: base(FRICTION)),
    "clipped damping": Kind("contact that cannot pull", lambda: base({"mesh.gear.contact_damping": "clipped"})),
    "alternation": Kind("a mesh stiffness that alternates", lambda: base(ALTERNATION)),
    "stages": Kind("a staged coupling with preload", _staged),
    "planetary set": Kind("a planetary set, its ring on the ground", _planetary),
    "Hooke joint": Kind("a coupling with a Hooke joint", lambda: base({"coupling.joint.hooke": {"angle": 0.3}})),
    "closed loop": Kind("two paths between two bodies", _closed_loop),
    "grounded": Kind("a coupling to ground", _grounded),
    "drag parts": Kind("a bearing and a synchroniser between two bodies, a seal", lambda: base(DRAG)),
    "run-up with drag": Kind("a sweep, and drag parts", lambda: base({**SWEEP, **DRAG})),
    "two trains": Kind("two trains that nothing joins", _two_trains),
    "sideways": Kind("gears with masses and weights on bearings, one with clearance around the other", _sideways),
    "no clearance": Kind("linear elements alone", _linear),
    "dimensionless": Kind("numbers without units", lambda: gr.loads(DIMENSIONLESS)),
    "one body": Kind("no element at all", lambda: gr.loads(ONE_BODY)),
    "64 bodies": Kind("a chain of 64 bodies, two clearances", _chain),
    "run-up with all": Kind("a sweep, friction and alternation", lambda: base({**SWEEP, **FRICTION, **ALTERNATION})),
    "motion with all": Kind(
        "a prescribed motion, friction and alternation", lambda: base({**_moved("engine"), **FRICTION, **ALTERNATION})
    ),
}
"""Kinds by name."""
