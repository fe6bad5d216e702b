"""Drivelines that move sideways, solved by plain steps of DOP853 from the equations themselves, and random ones.

The equations are written from the tables of the model file, body by body, without rows, laws or regions of the source:

    n_d = (sin a, cos a), n_c = (sin a, -cos a), both turned by the angle of the line of centres
    delta_d =   r1 th1 - r2 th2 + n_d . (u1 - u2) - e - B/2,       m1 u1'' = -F_d n_d - F_c n_c + F_b1
    delta_c = -(r1 th1 - r2 th2) + n_c . (u1 - u2) + e - B/2,      J1 th1'' = T1 - r1 (F_d - F_c)

and of the second body with the opposite signs. What is in contact is a list of switches, one a corner; SciPy's
integrator goes on until one of them is met, and begins anew.
"""

from __future__ import annotations

import random
from dataclasses import dataclass, field
from math import cos, pi, sin
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp


@dataclass
class Contact:
    """A spring with a damper that acts while ``delta = row . q - e - begin`` is positive, on -row F."""

    part: str
    label: int  # of the region that it leads into, on its side
    row: np.ndarray
    begin: float
    stiffness: float
    damping: float
    error: tuple[float, float, float] = (0.0, 0.0, 0.0)  # amplitude, frequency, phase
    two_sided: bool = False  # it never opens


@dataclass
class Motion:
    """What the oracle saw."""

    samples: np.ndarray
    crossings: list[tuple[float, str, int]] = field(default_factory=list)  # time, part, region entered


@dataclass
class Sums:
    """Masses, drags and loads of all coordinates."""

    inertia: np.ndarray
    drag: np.ndarray
    mean: np.ndarray
    waves: list[tuple[int, float, float, float]]  # coordinate, amplitude, frequency, phase


def contacts_of(tables: dict[str, Any]) -> list[Contact]:
    """Every spring of a model of bodies, couplings, meshes and bearings; coordinates th, x, y of every body."""
    names = [body["name"] for body in tables["inertia"]]
    speed = tables["excitation"]["speed"]
    size = 3 * len(names)
    contacts = []
    for table in tables.get("coupling", ()):
        row = np.zeros(size)
        a, b = (names.index(end) for end in table["between"])
        row[3 * a], row[3 * b] = 1.0, -1.0
        contacts += _sides(table, row, table.get("clearance", 0.0), table["stiffness"], table["name"])
    for table in tables["mesh"]:
        a, b = (names.index(end) for end in table["between"])
        angle, turn = table.get("pressure_angle", 0.0), table.get("centre_line", 0.0)
        gap = table.get("backlash", 0.0) / 2.0
        for flank, way in (("drive", 1.0), ("coast", -1.0)):
            normal = np.array([sin(angle), way * cos(angle)])
            normal = np.array([[cos(turn), -sin(turn)], [sin(turn), cos(turn)]]) @ normal
            row = np.zeros(size)
            row[3 * a], row[3 * b] = way * table["radii"][0], -way * table["radii"][1]
            row[3 * a + 1 : 3 * a + 3] = normal
            row[3 * b + 1 : 3 * b + 3] = -normal
            sines = table.get("transmission_error", ())
            error = (way * sines[0]["amplitude"], sines[0]["order"] * speed, sines[0]["phase"]) if sines else (0, 0, 0)
            label = int(way)
            part = f"{table['name']}-{flank}" if gap else table["name"]
            contacts.append(
                Contact(part, label, row, gap, table["stiffness"], table["damping"], error, two_sided=not gap)
            )
            if not gap:
                break
    for table in tables["bearing"]:
        around = names.index(table["around"]) if "around" in table else None
        contacts += _bearing(table, names.index(table["on"]), around, size)
    return contacts


def _bearing(table: dict[str, Any], body: int, around: int | None, size: int) -> list[Contact]:
    gap = table.get("clearance", 0.0)
    faces = table.get("faces", 16)
    if not gap:
        directions = [("-x", 1.0, 0.0), ("-y", 0.0, 1.0)]
    else:
        directions = [(f"-{i}", cos(2 * pi * i / faces), sin(2 * pi * i / faces)) for i in range(faces // 2)]
    contacts = []
    for name, x, y in directions:
        row = np.zeros(size)
        row[3 * body + 1 : 3 * body + 3] = x, y
        if around is not None:
            row[3 * around + 1 : 3 * around + 3] = -x, -y
        contacts += _sides(table, row, gap, table["stiffness"], table["name"] + name)
        if gap and faces > 4:
            # beyond the second corner a face has 4/N of its slope: a negative spring is added
            until = gap * (faces - pi) / (faces - 4)
            for side in (1, -1):
                less = 4.0 / faces - 1.0
                contacts.append(
                    Contact(
                        table["name"] + name,
                        2 * side,
                        side * row,
                        until,
                        less * table["stiffness"],
                        less * table.get("damping", 0.0),
                    )
                )
    return contacts


def _sides(table: dict[str, Any], row: np.ndarray, gap: float, stiffness: float, part: str) -> list[Contact]:
    damping = table.get("damping", 0.0)
    if not gap:
        return [Contact(part, 0, row, 0.0, stiffness, damping, two_sided=True)]
    return [Contact(part, side, side * row, gap, stiffness, damping) for side in (1, -1)]


def solved(tables: dict[str, Any], start: np.ndarray, period: float, cycles: int, samples: int) -> Motion:
    """Integrate from a start (2, 3 n) of coordinates and rates; a body without a mass keeps its place."""
    bodies = tables["inertia"]
    contacts = contacts_of(tables)
    of = _sums(tables)
    rows = np.array([contact.row for contact in contacts])
    free = np.array([True if i % 3 == 0 else "mass" in bodies[i // 3] for i in range(3 * len(bodies))])
    size = len(free)

    def gap_and_rate(t: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        a, w, p = np.array([contact.error for contact in contacts], dtype=float).T
        begin = np.array([contact.begin for contact in contacts])
        delta = rows @ y[:size] - a * np.sin(w * t + p) - begin
        return delta, rows @ y[size:] - a * w * np.cos(w * t + p)

    stiffness = np.array([contact.stiffness for contact in contacts])
    damping = np.array([contact.damping for contact in contacts])
    linear = np.array([contact.two_sided for contact in contacts])

    def slope(t: float, y: np.ndarray, closed: np.ndarray) -> np.ndarray:
        delta, rate = gap_and_rate(t, y)
        force = np.where(closed, stiffness * delta + damping * rate, 0.0)
        load = of.mean.copy()
        for coordinate, amplitude, frequency, phase in of.waves:
            load[coordinate] += amplitude * sin(frequency * t + phase)
        acceleration = (load - of.drag * y[size:] - rows.T @ force) / of.inertia
        return np.concatenate([y[size:], np.where(free, acceleration, 0.0)])

    # from corner to corner
    y = start.ravel().copy()
    closed = linear | (gap_and_rate(0.0, y)[0] > 0.0)
    grid = period * np.arange(cycles * samples + 1) / samples
    out = np.empty((len(grid), 2 * size))
    motion = Motion(out)
    time = 0.0
    left = -1
    watched = [i for i in range(len(contacts)) if not linear[i]]
    while True:
        end = grid[-1] if left < 0 else min(grid[-1], time + 1e-6 * period)  # away from the corner that was met
        events = [_watch(gap_and_rate, i) for i in watched if i != left]
        of_event = [i for i in watched if i != left]
        part = solve_ivp(
            slope, (time, end), y, "DOP853", dense_output=True, events=events, rtol=3e-14, atol=1e-16, args=(closed,)
        )
        assert part.success, part.message
        inside = (grid >= time) & (grid <= part.t[-1])
        if inside.any():
            out[inside] = part.sol(grid[inside]).T
        time = float(part.t[-1])
        y = part.y[:, -1]
        met = [i for i, times in zip(of_event, part.t_events, strict=True) if times.size]
        if not met:
            if time >= grid[-1]:
                return motion
            left = -1
            continue
        (left,) = met
        closed = closed.copy()
        closed[left] = not closed[left]
        contact = contacts[left]
        side = 1 if contact.label > 0 else -1
        entered = contact.label if closed[left] else contact.label - side
        motion.crossings.append((time, contact.part, entered))


def _watch(gap_and_rate: Any, index: int) -> Any:
    def delta(t: float, y: np.ndarray, _closed: np.ndarray) -> float:
        return float(gap_and_rate(t, y)[0][index])

    delta.terminal = True  # type: ignore[attr-defined]
    return delta


def _sums(tables: dict[str, Any]) -> Sums:
    bodies = tables["inertia"]
    names = [body["name"] for body in bodies]
    inertia = np.array([x for body in bodies for x in (body["J"], body.get("mass", 1.0), body.get("mass", 1.0))])
    drag = np.array([x for body in bodies for x in (body.get("drag", 0.0), 0.0, 0.0)])
    mean = np.array([x for body in bodies for x in (-body.get("drag_torque", 0.0), 0.0, 0.0)])
    waves = []
    for table in tables.get("torque", ()):
        at = 3 * names.index(table["on"])
        mean[at] += table.get("mean", 0.0)
        speed = tables["excitation"]["speed"]
        sines = table.get("harmonics", ())
        waves += [(at, sine["amplitude"], sine["order"] * speed, sine["phase"]) for sine in sines]
    if gravity := tables.get("gravity"):
        for i, body in enumerate(bodies):
            weight = body.get("mass", 0.0) * gravity["acceleration"]
            mean[3 * i + 1] = weight * cos(gravity["direction"])
            mean[3 * i + 2] = weight * sin(gravity["direction"])
    return Sums(inertia, drag, mean, waves)


def random_tables(seed: int) -> dict[str, Any]:
    """A chain of two to four bodies of which some move sideways; the same for the same seed, on any machine."""
    rng = random.Random(f"sideways/{seed}")
    count = rng.randint(2, 4)
    bodies = [{"name": f"b{i}", "J": _between(rng, 0.4, 2.0), "drag": _between(rng, 0.01, 0.05)} for i in range(count)]
    bearings = []
    meshes = []
    couplings = []
    for i in range(count - 1):
        if i and rng.random() < 0.3:
            clearance = {"clearance": _between(rng, 0.02, 0.1)} if rng.random() < 0.5 else {}
            spring = {"stiffness": _between(rng, 5.0, 60.0), "damping": _between(rng, 0.02, 0.2)}
            couplings.append({"name": f"c{i}", "between": [f"b{i}", f"b{i + 1}"], **spring, **clearance})
            continue
        mesh = {
            "name": f"m{i}",
            "between": [f"b{i}", f"b{i + 1}"],
            "radii": [_between(rng, 0.6, 1.4), _between(rng, 0.6, 1.4)],
            "stiffness": _between(rng, 20.0, 150.0),
            "damping": _between(rng, 0.05, 0.5),
            "pressure_angle": _between(rng, 0.25, 0.5),
            "centre_line": _between(rng, -3.0, 3.0),
        }
        if rng.random() < 0.8:
            mesh["backlash"] = _between(rng, 0.03, 0.3)
        if rng.random() < 0.5:
            sine = {"order": 2.0, "amplitude": _between(rng, 0.005, 0.05), "phase": _between(rng, -3.0, 3.0)}
            mesh["transmission_error"] = [sine]
        meshes.append(mesh)
    geared = {end for mesh in meshes for end in mesh["between"]}
    for body in bodies:
        first_geared = body["name"] == meshes[0]["between"][0]
        if body["name"] in geared and (first_geared or rng.random() < 0.7):
            body["mass"] = _between(rng, 0.5, 3.0)
            bearings.append(_random_bearing(rng, body["name"]))
    heavy = {body["name"] for body in bodies if "mass" in body}
    for mesh in meshes:
        if not heavy & set(mesh["between"]):
            del mesh["pressure_angle"], mesh["centre_line"]
    meshes_sideways = [mesh for mesh in meshes if "pressure_angle" in mesh]
    for mesh in meshes:
        if mesh not in meshes_sideways:  # a mesh of fixed centres: the oracle has it as two flanks of angle zero
            mesh.pop("backlash", None)
    harmonics = [{"order": 1.0, "amplitude": _between(rng, 0.3, 2.0), "phase": _between(rng, -3.0, 3.0)}]
    return {
        "schema": 1,
        "name": f"sideways {seed}",
        "inertia": bodies,
        "coupling": couplings,
        "mesh": meshes,
        "bearing": bearings,
        "excitation": {"speed": _between(rng, 1.0, 3.0)},
        "torque": [{"on": "b0", "mean": _between(rng, -0.3, 0.3), "harmonics": harmonics}],
    }


def nested_tables(seed: int) -> dict[str, Any]:
    """A driveline as ``random_tables`` makes, with a weight; some bearings lie around the body before it that has a
    mass, and one more body hangs on the last.
    """
    tables = random_tables(seed)
    rng = random.Random(f"nested/{seed}")
    heavy = [body["name"] for body in tables["inertia"] if "mass" in body]
    for bearing in tables["bearing"]:
        at = heavy.index(bearing["on"])
        if at and rng.random() < 0.7:
            bearing["around"] = heavy[at - 1]
    tables["inertia"].append({"name": "loose", "J": 1.0, "drag": 0.05, "mass": _between(rng, 0.5, 3.0)})
    spring = {"stiffness": _between(rng, 5.0, 60.0), "damping": _between(rng, 0.02, 0.2)}
    tables["coupling"].append({"name": "hold", "between": [heavy[-1], "loose"], **spring})
    tables["bearing"].append({**_random_bearing(rng, "loose"), "around": heavy[-1]})
    tables["gravity"] = {"direction": _between(rng, -3.0, 3.0), "acceleration": _between(rng, 0.05, 0.5)}
    return tables


def _random_bearing(rng: random.Random, on: str) -> dict[str, Any]:
    bearing = {
        "name": f"h{on}",
        "on": on,
        "stiffness": _between(rng, 30.0, 300.0),
        "damping": _between(rng, 0.05, 0.6),
    }
    if rng.random() < 0.75:
        bearing["clearance"] = _between(rng, 0.02, 0.2)
        bearing["faces"] = rng.choice([4, 6, 8, 12])
    return bearing


def _between(rng: random.Random, low: float, high: float) -> float:
    return float(f"{rng.uniform(low, high):.4g}")
