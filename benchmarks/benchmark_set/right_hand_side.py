"""Write ``rhs.py`` of a problem: numbers first, then the same few functions of numpy for all problems."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

FUNCTIONS = '''

def _waves(t, rows):
    """amplitude sin(order speed t + phase) of columns (index, order, amplitude, phase), and the rates."""
    value, rate = np.zeros(rows.shape[1]), np.zeros(rows.shape[1])
    if rows.size:
        turn = rows[1] * SPEED
        angle = turn * t + rows[3]
        value, rate = rows[2] * np.sin(angle), rows[2] * turn * np.cos(angle)
    return value, rate


def deflection(t, y):
    """Deflections of the elements and their rates; y holds all angles, then all velocities."""
    n = INERTIA.size
    delta, rate = ROWS @ y[:n], ROWS @ y[n:]
    if ERROR.size:
        value, change = _waves(t, ERROR)
        index = ERROR[0].astype(int)
        delta = delta - np.bincount(index, value, len(ELEMENTS))
        rate = rate - np.bincount(index, change, len(ELEMENTS))
    return delta, rate


def torque(t):
    """Applied torques."""
    total = MEAN.copy()
    if HARMONICS.size:
        total += np.bincount(HARMONICS[0].astype(int), _waves(t, HARMONICS)[0], total.size)
    for body, begin, over, change in RAMPS:
        total[body] += change * min(max((t - begin) / over, 0.0), 1.0)
    return total


def region(t, y):
    """Index of the piece of every element's law; on a corner the rate decides, the inner piece where there is none."""
    delta, rate = deflection(t, y)
    index = np.sum(delta[:, None] > CORNERS, axis=1)
    for k, c in np.argwhere(delta[:, None] == CORNERS):
        inner = c if abs(FIRST[k] + c) < abs(FIRST[k] + c + 1) else c + 1
        index[k] = c + 1 if rate[k] > 0 else c if rate[k] < 0 else inner
    return index


def rhs(t, y, index=None):
    """Derivative of y. With ``index`` the laws are those of these pieces, whatever the deflections: smooth."""
    n = INERTIA.size
    delta, rate = deflection(t, y)
    if index is None:
        index = np.sum(delta[:, None] > CORNERS, axis=1)
    k, c, f = LAWS[:, ALL, index]
    force = k * delta + c * rate + f
    velocity = y[n:]
    return np.concatenate([velocity, (torque(t) - DRAG * velocity - ROWS.T @ force) / INERTIA])


def jacobian(t, y, index=None):
    """Derivative of rhs with respect to y; constant in a region."""
    n = INERTIA.size
    if index is None:
        index = np.sum(deflection(t, y)[0][:, None] > CORNERS, axis=1)
    k, c, _ = LAWS[:, ALL, index]
    matrix = np.zeros((2 * n, 2 * n))
    matrix[:n, n:] = np.eye(n)
    matrix[n:, :n] = -(ROWS.T * k) @ ROWS / INERTIA[:, None]
    matrix[n:, n:] = -((ROWS.T * c) @ ROWS + np.diag(DRAG)) / INERTIA[:, None]
    return matrix


def events(t, y):
    """Deflections less the corners of their elements, in the order of WATCHED: a change of sign is an event."""
    delta, _ = deflection(t, y)
    return delta[WATCHED[:, 0]] - CORNERS[WATCHED[:, 0], WATCHED[:, 1]]


ALL = np.arange(len(ELEMENTS))
WATCHED = np.argwhere(np.isfinite(CORNERS))  # rows (element, corner): between the pieces corner and corner + 1
KINKS = sorted({time for _, begin, over, _ in RAMPS for time in (begin, begin + over)})  # of the input
TIMES = 2.0 * np.pi * np.arange(SAMPLES + 1) / (SPEED * PER_TURN)
'''


def text(problem: dict[str, Any]) -> str:
    """The module."""
    names = [body["name"] for body in problem["bodies"]]
    elements = problem["elements"]
    pieces = max(len(e["regions"]) for e in elements)
    rows = [[0.0] * len(names) for _ in elements]
    for row, element in zip(rows, elements, strict=True):
        for name, factor in zip(element["bodies"], element["factors"], strict=True):
            if name != "ground":
                row[names.index(name)] = _float(factor)
    corners = [[_float(c) for c in e["corners"]] + ["np.inf"] * (pieces - 1 - len(e["corners"])) for e in elements]
    laws = [
        [[_float(r[key]) for r in e["regions"]] + [0.0] * (pieces - len(e["regions"])) for e in elements]
        for key in ("stiffness", "damping", "offset")
    ]
    errors = [(k, h) for k, e in enumerate(elements) for h in e["error"]]
    harmonics = [(names.index(load["body"]), h) for load in problem["loads"] for h in load["harmonics"]]
    mean = [0.0] * len(names)
    for i, name in enumerate(names):
        mean[i] = float(sum(Fraction(load["mean"]) for load in problem["loads"] if load["body"] == name))
    samples = problem["samples"]
    lines = [
        f'"""{problem["title"]}: right-hand side and events, made from problem.json. Needs numpy alone."""',
        "",
        "import numpy as np",
        "",
        f"NAME = {problem['name']!r}",
        f"BODIES = {names!r}",
        f"ELEMENTS = {[e['name'] for e in elements]!r}",
        f"SPEED = {_float(problem['speed'])!r}",
        f"INERTIA = np.array({[_float(b['inertia']) for b in problem['bodies']]!r})",
        f"DRAG = np.array({[_float(b['drag']) for b in problem['bodies']]!r})",
        f"MEAN = np.array({mean!r})  # torques",
        f"HARMONICS = np.array({_columns(harmonics)})  # body, order, amplitude, phase of torques",
        f"RAMPS = {_ramps(problem, names)!r}  # body, begin, duration, change of torque",
        f"ROWS = np.array({rows!r})  # deflections = ROWS @ angles - errors",
        f"ERROR = np.array({_columns(errors)})  # element, order, amplitude, phase of errors",
        f"CORNERS = np.array({_plain(corners)}).reshape({len(elements)}, {pieces - 1})",
        f"FIRST = {[e['regions'][0]['region'] for e in elements]!r}  # region of each element's first piece",
        f"LAWS = np.array({laws!r})  # stiffness, damping, offset; element; piece",
        f"START = np.array({[_float(x) for key in ('angle', 'velocity') for x in problem['start'][key]]!r})",
        f"SAMPLES, PER_TURN = {samples['count']}, {_float(samples['per_turn'])!r}",
    ]
    return "\n".join(lines) + FUNCTIONS


def _float(decimal: str) -> float:
    return float(Fraction(decimal))


def _plain(value: Any) -> str:
    return repr(value).replace("'np.inf'", "np.inf")


def _columns(rows: list[tuple[int, dict[str, str]]]) -> str:
    if not rows:
        return "[]).reshape(4, 0"
    return repr(
        [[float(i) for i, _ in rows], *([_float(h[key]) for _, h in rows] for key in ("order", "amplitude", "phase"))]
    )


def _ramps(problem: dict[str, Any], names: list[str]) -> list[tuple[int, float, float, float]]:
    ramps = []
    for load in problem["loads"]:
        before = Fraction(load["mean"])
        for ramp in load["ramps"]:
            change = Fraction(ramp["to"]) - before
            ramps.append((names.index(load["body"]), _float(ramp["at"]), _float(ramp["over"]), float(change)))
            before = Fraction(ramp["to"])
    return ramps
