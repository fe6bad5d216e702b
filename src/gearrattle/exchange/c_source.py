"""The equations of motion as C text (C99)."""

from __future__ import annotations

from gearrattle.exchange.right_hand_side import Equations, Formula

_HEAD = """/* Equations of motion: {title}.

   Written by gearrattle. The state y is {coordinates}, then their rates.

   right_hand_side   the rates of the state; pieces holds the piece of every clearance, NULL: by the deflections
   surfaces          deflection less corner, for every corner: a root is an event
   crossed           changes the pieces at a root: rising != 0 where the function grows, else 0
*/
#include <math.h>
#include <stddef.h>

enum {{ COORDINATES = {count}, STATES = {states}, CLEARANCES = {clearances}, SURFACES = {surfaces} }};
"""
_PIECE_OF = """
static int piece_of(double deflection, const double corners[], int count)
{
    int piece = 0;
    for (int i = 0; i < count; i++)
        piece += deflection >= corners[i];
    return piece;
}
"""
_FORCE = """
/* F = K delta + C delta' + F_r in a piece */
static double force(int piece, double deflection, double rate, const double stiffness[], const double damping[],
                    const double offset[])
{
    return stiffness[piece] * deflection + damping[piece] * rate + offset[piece];
}
"""
_CLIPPED = """
/* the same, the damping part limited to the elastic part */
static double clipped_force(int piece, double deflection, double rate, const double stiffness[],
                            const double damping[], const double offset[])
{
    double elastic = stiffness[piece] * deflection + offset[piece];
    double limit = fabs(elastic);
    return elastic + fmax(-limit, fmin(limit, damping[piece] * rate));
}
"""
_CROSSED = """
/* clearance and corner of every surface */
static const int SURFACE_CLEARANCE[] = {clearances};
static const int SURFACE_CORNER[] = {corners};

void crossed(int pieces[], int surface, int rising)
{{
    pieces[SURFACE_CLEARANCE[surface]] = SURFACE_CORNER[surface] + (rising ? 1 : 0);
}}
"""


def c_text(equations: Equations) -> str:
    """Return the equations as a C source file."""
    names = ", ".join(name for name, _ in equations.coordinates)
    count = len(equations.coordinates)
    what = "angles [rad]" if equations.is_si else "angles"
    lines = [
        _HEAD.format(
            title=equations.title.replace("*/", "* /"),
            coordinates=f"{what} of {names}",
            count=count,
            states=2 * count,
            clearances=len(equations.laws),
            surfaces=len(equations.surfaces),
        )
    ]
    # constants, and tables of the laws with corners
    for heading, numbers in equations.numbers:
        lines.append(f"/* {heading} */")
        lines += [f"static const double {number.name} = {number.value!r}; /* {number.meaning} */" for number in numbers]
        lines.append("")
    for law in equations.laws:
        lines.append(f"/* {law.name}: regions {', '.join(map(str, law.labels))} */")
        tables = (("CORNERS", law.corners), ("K", law.stiffness), ("C", law.damping), ("F", law.offset))
        lines += [f"static const double {letter}_{law.name}[] = {_array(table)};" for letter, table in tables]
    lines += ["", "const double PERIOD = " + repr(equations.period) + ";"]
    lines.append(f"const double START[] = {_array(equations.start)};")
    lines.append(f"const int START_PIECES[] = {_array(equations.start_pieces or (0,))};")
    clipped = {law.name for law in equations.laws} & equations.clipped
    functions = _PIECE_OF * bool(equations.laws) + _FORCE * (len(clipped) < len(equations.laws))
    head = "\n".join(lines) + "\n" + functions + _CLIPPED * bool(clipped)
    return f"{head}{_right_hand_side(equations)}{_surfaces(equations)}"


def _array(values: list[float] | tuple[float, ...] | tuple[int, ...] | list[int]) -> str:
    return "{" + ", ".join(map(repr, values)) + "}"


def _states(equations: Equations, formulas: tuple[Formula, ...]) -> list[str]:
    """Lines that name the states which the formulas use."""
    count = len(equations.coordinates)
    text = " ".join(formula.text for formula in formulas)
    used = set(text.replace("(", " ").replace(")", " ").split())
    named = [(f"theta_{word}", i) for i, (_, word) in enumerate(equations.coordinates)]
    named += [(f"omega_{word}", count + i) for i, (_, word) in enumerate(equations.coordinates)]
    return [f"    const double {name} = y[{i}];" for name, i in named if name in used]


def _lines(formulas: tuple[Formula, ...]) -> list[str]:
    return [f"    const double {formula.name} = {formula.text};" for formula in formulas]


def _right_hand_side(equations: Equations) -> str:
    count = len(equations.coordinates)
    lines = ["", "void right_hand_side(double t, const double y[], const int pieces[], double rates[])", "{"]
    lines += _states(equations, (*equations.before, *equations.accelerations))
    lines += ["    /* deflections and their rates */", *_lines(equations.before), "    /* forces */"]
    for law in equations.laws:
        looked_up = f"piece_of(delta_{law.name}, CORNERS_{law.name}, {len(law.corners)})"
        lines.append(f"    const int piece_{law.name} = pieces ? pieces[{law.clearance}] : {looked_up};")
    lines += [*_lines(equations.forces), "    /* rates: speeds, then accelerations */"]
    lines += [f"    rates[{i}] = y[{count + i}];" for i in range(count)]
    lines += [f"    rates[{count + i}] = {formula.text};" for i, formula in enumerate(equations.accelerations)]
    lines += ["    (void)t;", "    (void)pieces;", "}", ""]
    return "\n".join(lines)


def _surfaces(equations: Equations) -> str:
    known = {f"delta_{law.name}" for law in equations.laws}
    deflections = tuple(formula for formula in equations.before if formula.name in known)
    lines = ["", "void surfaces(double t, const double y[], double values[])", "{"]
    lines += [*_states(equations, deflections), *_lines(deflections)]
    lines += [
        f"    values[{i}] = delta_{surface.name} - CORNERS_{surface.name}[{surface.corner}];"
        for i, surface in enumerate(equations.surfaces)
    ]
    lines += ["    (void)t;", "    (void)y;", "    (void)values;", "}", ""]
    crossed = _CROSSED.format(
        clearances=_array([surface.clearance for surface in equations.surfaces]),
        corners=_array([surface.corner for surface in equations.surfaces]),
    )
    return "\n".join(lines) + crossed * bool(equations.surfaces)
