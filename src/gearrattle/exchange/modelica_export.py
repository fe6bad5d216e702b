"""A driveline as a Modelica model, with Modelica.Mechanics.Rotational of the Modelica Standard Library 4.

Linear elements are Spring, Damper and SpringDamper; a free gap whose damping is clipped, or that has none, is an
ElastoBacklash, which has the same law (Modelica 4.0.0, Components/ElastoBacklash.mo). A gear pair of such a law is an
IdealGear behind it. All other laws are a ``PiecewiseElement``, a class inside the model:

    delta = sum w_i phi_i - e(t),    F = K_r delta + C_r delta' + F_r,    torque w_i F on flange i
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator

import numpy as np

from gearrattle.assembly import Driveline, assemble, coordinate_names
from gearrattle.engine.system.law import PiecewiseLaw
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.errors import Problem
from gearrattle.exchange.right_hand_side import identifiers, not_in_equations
from gearrattle.model import DEFAULTS, Element, Model
from gearrattle.simulation.initial_state import start_of

ELEMENT = """
  model PiecewiseElement "F = K delta + C delta' + F_r in every piece; delta = sum of w phi, less an error"
    parameter Real w[:] "arm of every flange";
    parameter Real corner[:] = fill(0.0, 0) "deflections where the piece changes, ascending";
    parameter Real K[size(corner, 1) + 1] "stiffness of every piece, lowest deflection first";
    parameter Real C[size(corner, 1) + 1] "damping of every piece";
    parameter Real F[size(corner, 1) + 1] "force of every piece at zero deflection";
    parameter Boolean clipped = false "the damping part is limited to the elastic part";
    parameter Real errorAmplitude[:] = fill(0.0, 0);
    parameter Real errorOmega[size(errorAmplitude, 1)] = fill(0.0, size(errorAmplitude, 1));
    parameter Real errorPhase[size(errorAmplitude, 1)] = fill(0.0, size(errorAmplitude, 1));
    Modelica.Mechanics.Rotational.Interfaces.Flange_a flange[size(w, 1)];
    Real delta "deflection";
    Real rate "its rate";
    Real elastic "elastic part of the force";
    Real force;
    Integer piece "index of the piece";
  equation
    delta = w*flange.phi
      - sum(errorAmplitude[j]*sin(errorOmega[j]*time + errorPhase[j]) for j in 1:size(errorAmplitude, 1));
    rate = der(delta);
    piece = 1 + sum(if delta > corner[i] then 1 else 0 for i in 1:size(corner, 1));
    elastic = K[piece]*delta + F[piece];
    force = elastic + (if clipped then max(-abs(elastic), min(abs(elastic), C[piece]*rate)) else C[piece]*rate);
    flange.tau = w*force;
  end PiecewiseElement;
"""
MARK = "__gearrattle"
"""Name of the vendor's annotation: the parameter Omega is the reference speed; an element is a mesh."""
_PARTS = "Modelica.Mechanics.Rotational.Components"
_SOURCES = "Modelica.Mechanics.Rotational.Sources"
_KEYWORDS = frozenset(
    {
        "algorithm",
        "and",
        "annotation",
        "block",
        "break",
        "class",
        "connect",
        "connector",
        "constant",
        "constrainedby",
        "der",
        "discrete",
        "each",
        "else",
        "elseif",
        "elsewhen",
        "encapsulated",
        "end",
        "enumeration",
        "equation",
        "expandable",
        "extends",
        "external",
        "false",
        "final",
        "flow",
        "for",
        "function",
        "if",
        "import",
        "impure",
        "in",
        "initial",
        "inner",
        "input",
        "loop",
        "model",
        "not",
        "operator",
        "or",
        "outer",
        "output",
        "package",
        "parameter",
        "partial",
        "protected",
        "public",
        "pure",
        "record",
        "redeclare",
        "replaceable",
        "return",
        "stream",
        "then",
        "true",
        "type",
        "when",
        "while",
        "within",
        "time",
        "Omega",
        "housing",
    }
)


def not_in_modelica(model: Model) -> list[Problem]:
    """Return what of a model a Modelica text of ours does not hold."""
    rule = "Modelica.Mechanics.Rotational turns about fixed axes"
    problems = [
        Problem(f"inertia.{body.name}.mass", f"{body.mass:g}", rule) for body in model.inertias if body.mass is not None
    ]
    if model.units != "SI":
        problems.append(Problem("units", model.units, "Modelica's components are in SI units"))
    return [*not_in_equations(model), *problems]


def modelica_text(model: Model, title: str) -> str:
    """Return a steady model as the text of a Modelica model of this name."""
    driveline = assemble(model)
    system = driveline.system
    words = _identifiers((*coordinate_names(model), *(element.name for element in model.elements)))
    bodies = words[: system.size]
    names = words[system.size :]
    initial = model.simulation.initial or DEFAULTS.initial
    angle, velocity, _ = start_of(initial, driveline)
    # declarations
    lines = [f"model {title} {_string(model.name or 'driveline')}"]
    lines.append(
        f"  parameter Modelica.Units.SI.AngularVelocity Omega = {model.excitation.omega!r} {_string('speed')};"
    )
    for i, body in enumerate(bodies):
        start = f"phi(start = {float(angle[i])!r}, fixed = true), w(start = {float(velocity[i])!r}, fixed = true)"
        lines.append(f"  {_PARTS}.Inertia {body}(J = {float(system.inertia[i])!r}, {start});")
    equations = list[str]()
    needs_element = False
    for k, (name, element) in enumerate(zip(names, model.elements, strict=True)):
        flanges = [
            f"{bodies[i]}.flange_{'b' if system.rows[k, i] > 0 else 'a'}" for i in np.flatnonzero(system.rows[k])
        ]
        parts = _standard(name, element, system, k, flanges)
        if parts is None:
            needs_element = True
            parts = _piecewise(name, element, driveline, k, flanges)
        lines += parts[0]
        equations += parts[1]
    for declaration, equation in _loads(driveline, words):
        lines += [declaration] if declaration else []
        equations.append(equation)
    if any("housing" in equation for equation in equations):
        lines.append(f"  {_PARTS}.Fixed housing;")
    # the class of piecewise laws, connections, annotation
    head = [lines[0], *(ELEMENT.strip("\n").split("\n") if needs_element else []), *lines[1:]]
    mark = f'  annotation(uses(Modelica(version = "4.0.0")), {MARK}(speed = Omega));'
    experiment = f"  // simulate from 0 to a few periods of {2.0 * math.pi / model.excitation.omega!r} s"
    return "\n".join([*head, "equation", *(f"  {text}" for text in equations), experiment, mark, f"end {title};", ""])


def _identifiers(names: tuple[str, ...]) -> tuple[str, ...]:
    """Names as identifiers of Modelica, each once."""
    plain = [f"{name}_" if name in _KEYWORDS else re.sub(r"^(?=[^A-Za-z_])", "x", name) for name in names]
    return identifiers(tuple(re.sub(r"[^A-Za-z0-9_]", "_", name) for name in plain))


def _string(text: str) -> str:
    """A text as a string of Modelica."""
    return '"' + " ".join(text.replace("\\", "/").replace('"', "'").split()) + '"'


Parts = tuple[list[str], list[str]]
"""Declarations and equations."""


def _standard(name: str, element: Element, system: PiecewiseSystem, k: int, flanges: list[str]) -> Parts | None:
    """The element as components of the library; None if they have another law."""
    law = system.laws[k]
    row = system.rows[k][np.flatnonzero(system.rows[k])]
    first = float(row[0])
    has_errors = bool(system.inputs.error_sine[k].any() or system.inputs.error_cosine[k].any())
    if has_errors or len(row) > 2 or element.preload or (not element.along_line and np.any(np.abs(row) != 1.0)):
        return None
    kind, values = _kind(law, element, abs(first))
    if not kind or (element.along_line and not (len(row) == 2 and first > 0.0 > row[1])):
        return None
    declarations = [f"  {_PARTS}.{kind} {name}({values});"]
    ends = [*flanges, "housing.flange"][:2]
    if not element.along_line:
        return declarations, [f"connect({ends[0]}, {name}.flange_a);", f"connect({name}.flange_b, {ends[1]});"]
    gear = f"{name}__gear"
    ratio = f"{abs(float(row[1]))!r}/{first!r}"
    declarations.append(f"  {_PARTS}.IdealGear {gear}(ratio = {ratio});")
    return declarations, [
        f"connect({ends[0]}, {name}.flange_a);",
        f"connect({name}.flange_b, {gear}.flange_a);",
        f"connect({gear}.flange_b, {ends[1]});",
    ]


def _kind(law: PiecewiseLaw, element: Element, radius: float) -> tuple[str, str]:
    """Component and modifiers with the same law, referred to a shaft at this radius; empty without one."""
    square = "" if radius == 1.0 else f"*{radius!r}^2"
    if law.pieces == 1:
        stiffness = float(law.stiffness[0])
        damping = float(law.damping[0])
        if law.offset[0]:
            return "", ""
        if stiffness and damping:
            return "SpringDamper", f"c = {stiffness!r}{square}, d = {damping!r}{square}"
        if stiffness:
            return "Spring", f"c = {stiffness!r}{square}"
        return "Damper", f"d = {damping!r}{square}"
    is_gap = law.pieces == 3 and law.stiffness[1] == law.damping[1] == law.offset[1] == 0.0
    is_even = is_gap and law.corners[0] == -law.corners[1] and law.stiffness[0] == law.stiffness[2] > 0.0
    damping = float(law.damping[-1])
    if not is_even or law.damping[0] != damping or (damping and element.contact_damping != "clipped"):
        return "", ""
    over = "" if radius == 1.0 else f"/{radius!r}"
    gap = f"b = {2.0 * float(law.corners[1])!r}{over}"
    return "ElastoBacklash", f"c = {float(law.stiffness[2])!r}{square}, d = {damping!r}{square}, {gap}"


def _piecewise(name: str, element: Element, driveline: Driveline, k: int, flanges: list[str]) -> Parts:
    """The element as a PiecewiseElement."""
    system = driveline.system
    orders = driveline.layout.orders
    law = system.laws[k]
    row = system.rows[k][np.flatnonzero(system.rows[k])]
    modifiers = [f"w = {_array(row)}"]
    if law.corners.size:
        modifiers.append(f"corner = {_array(law.corners)}")
    modifiers += [f"K = {_array(law.stiffness)}", f"C = {_array(law.damping)}", f"F = {_array(law.offset)}"]
    if element.contact_damping == "clipped":
        modifiers.append("clipped = true")
    sines = list(_sines(orders, system.inputs.error_sine[k], system.inputs.error_cosine[k]))
    if sines:
        modifiers.append("errorAmplitude = {" + ", ".join(repr(amplitude) for _, amplitude, _ in sines) + "}")
        modifiers.append("errorOmega = {" + ", ".join(f"{order!r}*Omega" for order, _, _ in sines) + "}")
        modifiers.append("errorPhase = {" + ", ".join(repr(phase) for _, _, phase in sines) + "}")
    mesh = f" annotation({MARK}(mesh = true))" if element.along_line else ""
    declaration = f"  PiecewiseElement {name}({', '.join(modifiers)}){mesh};"
    return [declaration], [f"connect({flange}, {name}.flange[{i + 1}]);" for i, flange in enumerate(flanges)]


def _array(values: np.ndarray) -> str:
    return "{" + ", ".join(map(repr, values.tolist())) + "}"


def _sines(orders: Iterable[float], sine: np.ndarray, cosine: np.ndarray) -> Iterator[tuple[float, float, float]]:
    """Order, amplitude and phase of every sine that is there."""
    for order, s, c in zip(map(float, orders), sine.tolist(), cosine.tolist(), strict=True):
        if s or c:
            yield order, math.hypot(s, c), math.atan2(c, s)


def _loads(driveline: Driveline, words: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """Yield declaration and equation of drags, mean torques and sines."""
    system = driveline.system
    orders = driveline.layout.orders
    inputs = system.inputs

    def free(name: str) -> str:
        """A name that no body and no element has."""
        return free(f"{name}_") if name in words or f"{name}_sine" in words else name

    for i, body in enumerate(words[: system.size]):
        flange = f"{body}.flange_a"
        if system.drag[i]:
            name = free(f"{body}_drag")
            yield f"  {_PARTS}.Damper {name}(d = {float(system.drag[i])!r});", f"connect({flange}, {name}.flange_a);"
            yield "", f"connect({name}.flange_b, housing.flange);"
        if inputs.mean[i]:
            name = free(f"{body}_mean_torque")
            declaration = f"  {_SOURCES}.ConstantTorque {name}(tau_constant = {float(inputs.mean[i])!r});"
            yield declaration, f"connect({name}.flange, {flange});"
        for j, (order, amplitude, phase) in enumerate(_sines(orders, inputs.torque_sine[i], inputs.torque_cosine[i])):
            name = free(f"{body}_torque_{j}")
            frequency = f"{order!r}*Omega/(2*Modelica.Constants.pi)"
            values = f"amplitude = {amplitude!r}, f = {frequency}, phase = {phase!r}"
            yield f"  Modelica.Blocks.Sources.Sine {name}_sine({values});", f"connect({name}_sine.y, {name}.tau);"
            yield f"  {_SOURCES}.Torque {name};", f"connect({name}.flange, {flange});"
