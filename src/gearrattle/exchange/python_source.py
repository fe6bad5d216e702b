"""The equations of motion as Python text, with event functions for ``scipy.integrate.solve_ivp``."""

from __future__ import annotations

from gearrattle.exchange.right_hand_side import Equations, Formula

_HEAD = '''"""Equations of motion: {title}.

Written by gearrattle. State y = [{coordinates}], then their rates; t in {time}.

    right_hand_side(t, y, pieces)   y'; pieces holds the piece of every clearance, None: by the deflections
    events(pieces)                  functions of (t, y) for solve_ivp: the corners of these pieces
    crossed(pieces, event)          the pieces beyond a corner
    solve(end)                      the motion from START, piece by piece
"""

from math import cos, sin
'''
_LAWS = '''

def piece_of(deflection, corners):
    """Index of the piece at a deflection: the number of corners up to it."""
    return sum(deflection >= corner for corner in corners)


def force(piece, deflection, rate, stiffness, damping, offset):
    """F = K delta + C delta' + F_r in a piece."""
    return stiffness[piece] * deflection + damping[piece] * rate + offset[piece]


def clipped_force(piece, deflection, rate, stiffness, damping, offset):
    """The same, the damping part limited to the elastic part."""
    elastic = stiffness[piece] * deflection + offset[piece]
    limit = abs(elastic)
    return elastic + max(-limit, min(limit, damping[piece] * rate))
'''
_EVENTS = '''

def surfaces(t, y):
    """Deflection less corner, for every corner in SURFACES."""
{deflections}
    return [{values}]


def events(pieces):
    """Event functions of solve_ivp: the upper corner of every piece, rising, and its lower corner, falling."""
    return [
        _event(index, clearance, rising)
        for index, (clearance, corner) in enumerate(SURFACES)
        for rising in (True, False)
        if pieces[clearance] == corner + (not rising)
    ]


def _event(index, clearance, rising):
    def event(t, y):
        return surfaces(t, y)[index]

    event.terminal = True
    event.direction = 1.0 if rising else -1.0
    event.clearance = clearance
    return event


def crossed(pieces, event):
    """The pieces after an event."""
    beyond = list(pieces)
    beyond[event.clearance] += 1 if event.direction > 0.0 else -1
    return beyond


def solve(end, start=START, pieces=START_PIECES, **options):
    """The motion from t = 0 to the end: times, states (one a row), and the events (t, clearance, piece entered)."""
    from scipy.integrate import solve_ivp

    settings = {{"method": "DOP853", "rtol": 1e-10, "atol": 1e-12, "max_step": PERIOD / 1000, **options}}
    times = [0.0]
    states = [list(start)]
    log = []
    while times[-1] < end:
        watched = events(pieces)
        functions = [_after(one, times[-1]) for one in watched]
        part = solve_ivp(right_hand_side, (times[-1], end), states[-1], args=(pieces,), events=functions, **settings)
        times += part.t[1:].tolist()
        states += part.y.T[1:].tolist()
        for event, found in zip(watched, part.t_events or ()):
            if found.size:
                pieces = crossed(pieces, event)
                log.append((times[-1], CLEARANCES[event.clearance], pieces[event.clearance]))
        if part.status == -1:
            raise RuntimeError(part.message)
    return times, states, log


def _after(event, begin):
    """An event function with the arguments of the right-hand side; the corner just crossed is no root at the start."""

    def function(t, y, _pieces):
        return event(t, y) if t > begin else -event.direction * max(abs(event(t, y)), 1e-300)

    function.terminal = True
    function.direction = event.direction
    return function


if __name__ == "__main__":
    times, states, log = solve({end!r})
    print(f"{{len(log)}} events up to t = {{times[-1]:g}}")
    for name, value in zip(COORDINATES, states[-1]):
        print(f"{{name:<20}} {{value: .12e}}")
'''


def python_text(equations: Equations) -> str:
    """Return the equations as a Python module."""
    names = [name for name, _ in equations.coordinates]
    what = "angles [rad]" if equations.is_si else "angles"
    about = f"{what} of {', '.join(names)}"
    time = "s" if equations.is_si else "the model's unit"
    lines = [_HEAD.format(title=_quoted(equations.title), coordinates=about, time=time)]
    # constants, and tables of the laws with corners
    for heading, numbers in equations.numbers:
        lines += [f"\n# {heading}"]
        lines += [f"{number.name} = {number.value!r}  # {number.meaning}" for number in numbers]
    lines.append("\n# laws with corners, lowest deflection first: K, C and F of every piece")
    for law in equations.laws:
        lines.append(f"# {law.name}: regions {', '.join(map(str, law.labels))}")
        lines.append(f"CORNERS_{law.name} = {law.corners!r}")
        tables = (("K", law.stiffness), ("C", law.damping), ("F", law.offset))
        lines += [f"{letter}_{law.name} = {table!r}" for letter, table in tables]
    lines.append("\n# names; clearance and corner of every switching surface; the start")
    lines.append(f"COORDINATES = {names!r}")
    lines.append(f"CLEARANCES = {[law.name for law in equations.laws]!r}")
    lines.append(f"SURFACES = {[(surface.clearance, surface.corner) for surface in equations.surfaces]!r}")
    lines.append(f"PERIOD = {equations.period!r}")
    lines.append(f"START = {list(equations.start)!r}")
    lines.append(f"START_PIECES = {list(equations.start_pieces)!r}")
    laws = _LAWS if equations.clipped else _LAWS[: _LAWS.index("\n\ndef clipped")] + "\n"
    head = "\n".join(lines)
    return f"{head}\n{laws}{_right_hand_side(equations)}{_events(equations)}"


def _quoted(title: str) -> str:
    """A title that a docstring can hold."""
    return " ".join(title.replace("\\", "/").replace('"', "'").split())


def _states(equations: Equations) -> list[str]:
    """Lines that name the state."""
    count = len(equations.coordinates)
    angles = [f"    theta_{word} = y[{i}]" for i, (_, word) in enumerate(equations.coordinates)]
    return angles + [f"    omega_{word} = y[{count + i}]" for i, (_, word) in enumerate(equations.coordinates)]


def _lines(formulas: tuple[Formula, ...]) -> list[str]:
    return [f"    {formula.name} = {formula.text}" for formula in formulas]


def _right_hand_side(equations: Equations) -> str:
    lines = ["", "", "def right_hand_side(t, y, pieces=None):"]
    lines += ['    """Rates of the state."""', *_states(equations)]
    lines += ["    # deflections and their rates", *_lines(equations.before)]
    lines.append("    # forces")
    for law in equations.laws:
        looked_up = f"piece_of(delta_{law.name}, CORNERS_{law.name})"
        lines.append(f"    piece_{law.name} = {looked_up} if pieces is None else pieces[{law.clearance}]")
    lines += [*_lines(equations.forces), "    # rates: speeds, then accelerations", "    return ["]
    lines += [f"        omega_{word}," for _, word in equations.coordinates]
    lines += [f"        {formula.text}," for formula in equations.accelerations]
    return "\n".join([*lines, "    ]", ""])


def _events(equations: Equations) -> str:
    known = {f"delta_{law.name}" for law in equations.laws}
    deflections = [formula for formula in equations.before if formula.name in known]
    values = [f"delta_{surface.name} - CORNERS_{surface.name}[{surface.corner}]" for surface in equations.surfaces]
    body = "\n".join([*_states(equations), *_lines(tuple(deflections))])
    return _EVENTS.format(deflections=body, values=", ".join(values), end=equations.period)
