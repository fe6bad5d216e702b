"""What is published of a problem: its JSON, its model file, its right-hand side, its page."""

from __future__ import annotations

import json
from fractions import Fraction
from itertools import pairwise
from typing import Any

from mpmath import mp
from tests.oracles.driveline import Coupling, Mesh, Stage, differ

from benchmarks.benchmark_set.problems import Problem

FORMAT = "clearance benchmark 1"


def exact(number: Fraction) -> str:
    """A fraction as an exact decimal, or as p/q where it has none."""
    twos_and_fives = number.denominator
    for prime in (2, 5):
        while twos_and_fives % prime == 0:
            twos_and_fives //= prime
    if twos_and_fives != 1:
        return f"{number.numerator}/{number.denominator}"
    with mp.workdps(120):
        return mp.nstr(mp.mpf(number.numerator) / number.denominator, 60, strip_zeros=True).removesuffix(".0")


def statement(problem: Problem) -> dict[str, Any]:
    """Everything that a solver needs, in decimal strings and in the terms of no tool."""
    line = problem.driveline
    assert line.angle is not None
    assert line.velocity is not None
    loads = [
        {
            "body": body.name,
            "mean": exact(-Fraction(body.drag_torque)),
            "harmonics": [],
            "ramps": [],
        }
        for body in line.bodies
        if Fraction(body.drag_torque)
    ]
    loads += [
        {
            "body": torque.on,
            "mean": exact(Fraction(torque.mean)),
            "harmonics": [_harmonic(h) for h in torque.harmonics],
            "ramps": [{"at": r.at, "over": r.over, "to": r.to} for r in torque.ramps],
        }
        for torque in line.torques
    ]
    return {
        "format": FORMAT,
        "name": problem.name,
        "title": problem.title,
        "tests": problem.tests,
        "bodies": [
            {"name": b.name, "inertia": exact(Fraction(b.J)), "drag": exact(Fraction(b.drag))} for b in line.bodies
        ],
        "elements": [_element(e) for e in line.elements],
        "speed": line.speed,
        "loads": loads,
        "start": {"angle": list(line.angle), "velocity": list(line.velocity)},
        "samples": {"count": problem.samples, "per_turn": per_turn(problem)},
    }


def per_turn(problem: Problem) -> str:
    """Samples in a turn 2 pi / speed."""
    with mp.workdps(60):
        turns = problem.driveline.period * mp.mpf(Fraction(problem.driveline.speed).numerator)
        turns /= mp.mpf(Fraction(problem.driveline.speed).denominator) * 2 * mp.pi
        share = Fraction(int(mp.nint(turns * 5040)), 5040)
    return exact(problem.per_cycle / share)


def _harmonic(harmonic: Any) -> dict[str, str]:
    return {"order": harmonic.order, "amplitude": exact(Fraction(harmonic.amplitude)), "phase": harmonic.phase}


def _element(element: Coupling | Mesh) -> dict[str, Any]:
    """Corners and regions laid next to one another, from the coast side to the drive side."""
    drive, coast = element.sides
    preload = Fraction(element.preload)
    up, down = _side(drive, preload, 1), _side(coast, preload, -1)
    pieces = dict(enumerate(up)) | {-i: row for i, row in enumerate(down, 1)}
    if not differ(drive[0], coast[0]):  # one piece through zero
        pieces = dict(enumerate(up)) | {-i: row for i, row in enumerate(down) if i}
    order = sorted(pieces)
    # a corner is where the outer one of two neighbours begins
    corners = [pieces[max(pair, key=abs)][0] for pair in pairwise(order)]
    return {
        "name": element.name,
        "bodies": list(element.between),
        "factors": [exact(Fraction(element.radii[0])), exact(-Fraction(element.radii[1]))],
        "corners": [exact(corner) for corner in corners],
        "regions": [
            {
                "region": i,
                "stiffness": exact(pieces[i][1]),
                "damping": exact(pieces[i][2]),
                "offset": exact(pieces[i][3]),
            }
            for i in order
        ],
        "error": [_harmonic(h) for h in element.error],
    }


def _side(stages: tuple[Stage, ...], preload: Fraction, sign: int) -> list[tuple[Fraction, ...]]:
    """Return (inner end, stiffness, damping, offset) of every stage from the centre outward, F = k d + c d' + f."""
    rows, force, inner = [], preload, Fraction(0)
    for stage in stages:
        slope = Fraction(stage.stiffness)
        rows.append((inner, slope, Fraction(stage.damping), force - slope * inner))
        if stage.until is not None:
            outer = sign * Fraction(stage.until)
            force += slope * (outer - inner)
            inner = outer
    return rows


def json_text(data: dict[str, Any]) -> str:
    """JSON with one line for each body, element, load."""
    lines = []
    for key, value in data.items():
        if isinstance(value, list) and value and isinstance(value[0], dict | list):
            rows = ",\n".join("  " + json.dumps(row) for row in value)
            lines.append(f' "{key}": [\n{rows}\n ]')
        else:
            lines.append(f' "{key}": {json.dumps(value)}')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def model_file(problem: Problem) -> str:
    """The model file of gearrattle."""
    cycles = -(-problem.samples // problem.per_cycle)
    settings = f"cycles = {cycles}\ndiscard = 0\nsamples_per_cycle = {problem.per_cycle}\n"
    return problem.driveline.toml().rstrip("\n") + "\n" + settings


def page(problem: Problem, stated: dict[str, Any], data: dict[str, Any]) -> str:
    """The page of a problem: what it tests, its equations, its numbers, its first events."""
    laws = [
        f"| {e['name']} | {r['region']} | {_range(e, i)} | {r['stiffness']} | {r['damping']} | {r['offset']} |"
        for e in stated["elements"]
        for i, r in enumerate(e["regions"])
    ]
    elements = [f"| {e['name']} | {_deflection(e)} |" for e in stated["elements"]]
    bodies = [
        f"| {b['name']} | {b['inertia']} | {b['drag']} | {a} | {v} |"
        for b, a, v in zip(stated["bodies"], stated["start"]["angle"], stated["start"]["velocity"], strict=True)
    ]
    events = [f"| {t} | {name} | {a} -> {b} | {rate} |" for t, name, a, b, rate in data["events"][:6]]
    lines = [
        f"# {problem.title}",
        "",
        f"`{problem.name}`. **What it tests.** {problem.tests}",
        "",
        problem.equation,
        "",
        "In full, with the law of the [front page](../../README.md):",
        "",
        "| body | inertia J | drag d | angle at 0 | velocity at 0 |",
        "|---|---|---|---|---|",
        *bodies,
        "",
        "| element | deflection |",
        "|---|---|",
        *elements,
        "",
        "| element | region | deflections | stiffness k | damping c | offset f |",
        "|---|---|---|---|---|---|",
        *laws,
        "",
        *(
            ["| torque on | |", "|---|---|", *(f"| {load['body']} | {_load(load)} |" for load in stated["loads"]), ""]
            if stated["loads"]
            else ["No torque is applied.", ""]
        ),
        f"Speed W = {stated['speed']}; {problem.samples + 1} samples at "
        f"t = 2 pi k/({stated['samples']['per_turn']} W). {len(data['events'])} events; horizon {data['horizon']:.6g} "
        "(up to there an error grows less than a million times). The two methods agree to "
        f"{data['digits']['events']} digits in the events and {data['digits']['states']} in the states.",
        "",
        "| first events: time | element | region | rate of the deflection |",
        "|---|---|---|---|",
        *events,
    ]
    return "\n".join(lines) + "\n"


def _range(element: dict[str, Any], piece: int) -> str:
    corners = element["corners"]
    low = corners[piece - 1] if piece else "-inf"
    return f"{low} to {corners[piece] if piece < len(corners) else 'inf'}"


def _deflection(element: dict[str, Any]) -> str:
    terms = []
    for name, factor in zip(element["bodies"], element["factors"], strict=True):
        if name != "ground":
            sign = "-" if factor.startswith("-") else "+"
            size = factor.lstrip("-")
            terms.append(f"{sign} {'' if size == '1' else size + ' '}{name}")
    terms += [f"- {h['amplitude']} {_sine(h)}" for h in element["error"]]
    return " ".join(terms).removeprefix("+ ")


def _sine(harmonic: dict[str, str]) -> str:
    phase = "" if Fraction(harmonic["phase"]) == 0 else f" + {harmonic['phase']}"
    return f"sin({harmonic['order']} W t{phase})"


def _load(load: dict[str, Any]) -> str:
    terms = [load["mean"], *(f"{h['amplitude']} {_sine(h)}" for h in load["harmonics"])]
    ramps = [f"; from t = {r['at']} to {r['to']} within {r['over']}" for r in load["ramps"]]
    return " + ".join(terms) + "".join(ramps)
