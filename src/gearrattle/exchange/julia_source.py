"""The equations of motion as Julia text, for DifferentialEquations.jl with a VectorContinuousCallback."""

from __future__ import annotations

from gearrattle.exchange.right_hand_side import Equations, Formula

_HEAD = """# Equations of motion: {title}.
#
# Written by gearrattle. The state y is {coordinates}, then their rates.
#
#   right_hand_side!(rates, y, pieces, t)   pieces: the piece of every clearance, from 1; nothing: by the deflections
#   surfaces!(values, y, t, integrator)     deflection less corner, for every corner: a root is an event
#   solve_motion(finish)                    the motion from START, with DifferentialEquations.jl

module Driveline
"""
_LAWS = """
piece_of(deflection, corners) = 1 + count(corner -> deflection >= corner, corners)

# F = K delta + C delta' + F_r in a piece
force(piece, deflection, rate, stiffness, damping, offset) =
    stiffness[piece] * deflection + damping[piece] * rate + offset[piece]
"""
_CLIPPED = """
# the same, the damping part limited to the elastic part
function clipped_force(piece, deflection, rate, stiffness, damping, offset)
    elastic = stiffness[piece] * deflection + offset[piece]
    limit = abs(elastic)
    return elastic + max(-limit, min(limit, damping[piece] * rate))
end
"""
_TAIL = """
# the piece beyond a surface: rising, then falling
rises!(integrator, surface) = integrator.p[SURFACE_CLEARANCE[surface]] = SURFACE_CORNER[surface] + 1
falls!(integrator, surface) = integrator.p[SURFACE_CLEARANCE[surface]] = SURFACE_CORNER[surface]

end # module

using DifferentialEquations

function solve_motion(finish = Driveline.PERIOD; options...)
    problem = ODEProblem(Driveline.right_hand_side!, copy(Driveline.START), (0.0, finish), copy(Driveline.START_PIECES))
    corners = VectorContinuousCallback(
        Driveline.surfaces!, Driveline.rises!, Driveline.falls!, length(Driveline.SURFACE_CORNER);
        save_positions = (true, true),
    )
    return solve(problem, Vern9(); callback = corners, abstol = 1e-12, reltol = 1e-10, options...)
end
"""


def julia_text(equations: Equations) -> str:
    """Return the equations as a Julia source file."""
    names = ", ".join(name for name, _ in equations.coordinates)
    what = "angles [rad]" if equations.is_si else "angles"
    lines = [_HEAD.format(title=" ".join(equations.title.split()), coordinates=f"{what} of {names}")]
    # constants, and tables of the laws with corners
    for heading, numbers in equations.numbers:
        lines.append(f"# {heading}")
        lines += [f"const {number.name} = {number.value!r} # {number.meaning}" for number in numbers]
        lines.append("")
    for law in equations.laws:
        lines.append(f"# {law.name}: regions {', '.join(map(str, law.labels))}")
        tables = (("CORNERS", law.corners), ("K", law.stiffness), ("C", law.damping), ("F", law.offset))
        lines += [f"const {letter}_{law.name} = {table!r}" for letter, table in tables]
    # names, surfaces and start; indices from 1
    lines += ["", f"const PERIOD = {equations.period!r}", f"const START = {list(equations.start)!r}"]
    lines.append(f"const START_PIECES = {_integers([piece + 1 for piece in equations.start_pieces])}")
    lines.append(f"const SURFACE_CLEARANCE = {_integers([one.clearance + 1 for one in equations.surfaces])}")
    lines.append(f"const SURFACE_CORNER = {_integers([one.corner + 1 for one in equations.surfaces])}")
    clipped = _CLIPPED * bool(equations.clipped)
    head = "\n".join(lines) + "\n" + _LAWS
    return f"{head}{clipped}{_right_hand_side(equations)}{_surfaces(equations)}{_TAIL}"


def _integers(values: list[int]) -> str:
    return "Int[" + ", ".join(map(str, values)) + "]"


def _states(equations: Equations) -> list[str]:
    """Lines that name the state."""
    count = len(equations.coordinates)
    angles = [f"    theta_{word} = y[{i + 1}]" for i, (_, word) in enumerate(equations.coordinates)]
    return angles + [f"    omega_{word} = y[{count + i + 1}]" for i, (_, word) in enumerate(equations.coordinates)]


def _lines(formulas: tuple[Formula, ...]) -> list[str]:
    return [f"    {formula.name} = {formula.text}" for formula in formulas]


def _right_hand_side(equations: Equations) -> str:
    count = len(equations.coordinates)
    lines = ["", "function right_hand_side!(rates, y, pieces, t)", *_states(equations)]
    lines += ["    # deflections and their rates", *_lines(equations.before), "    # forces"]
    for law in equations.laws:
        looked_up = f"piece_of(delta_{law.name}, CORNERS_{law.name})"
        lines.append(f"    piece_{law.name} = pieces === nothing ? {looked_up} : pieces[{law.clearance + 1}]")
    lines += [*_lines(equations.forces), "    # rates: speeds, then accelerations"]
    lines += [f"    rates[{i + 1}] = omega_{word}" for i, (_, word) in enumerate(equations.coordinates)]
    lines += [f"    rates[{count + i + 1}] = {formula.text}" for i, formula in enumerate(equations.accelerations)]
    return "\n".join([*lines, "    return nothing", "end", ""])


def _surfaces(equations: Equations) -> str:
    known = {f"delta_{law.name}" for law in equations.laws}
    deflections = tuple(formula for formula in equations.before if formula.name in known)
    lines = ["", "function surfaces!(values, y, t, integrator)", *_states(equations), *_lines(deflections)]
    lines += [
        f"    values[{i + 1}] = delta_{surface.name} - CORNERS_{surface.name}[{surface.corner + 1}]"
        for i, surface in enumerate(equations.surfaces)
    ]
    return "\n".join([*lines, "    return nothing", "end", ""])
