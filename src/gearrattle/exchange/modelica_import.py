"""Drivelines of Modelica.Mechanics.Rotational: what components mean, and what joins them.

A connection joins flanges to one node. An Inertia is rigid: both its flanges are one node. Fixed is the ground. Ideal
gears couple nodes rigidly: phi_a = ratio phi_b; of an IdealPlanetary, (1 + ratio) phi_carrier = phi_sun + ratio
phi_ring, one shaft must be fixed. The torque of elements grows with phi_b - phi_a.
Everything that is not understood is a problem with its line.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.exchange.modelica_export import ELEMENT, MARK
from gearrattle.exchange.modelica_syntax import (
    Constants,
    Declaration,
    ModelicaClass,
    NotConstant,
    Value,
    class_of,
    tokens_of,
)
from gearrattle.exchange.torsional_network import IdealGear, TorsionalNetwork, label_of
from gearrattle.model import GROUND

_ROTATIONAL = "Modelica.Mechanics.Rotational."
_LIBRARY = {
    **{
        f"Components.{name}": name
        for name in (
            "Inertia",
            "Fixed",
            "Spring",
            "Damper",
            "SpringDamper",
            "ElastoBacklash",
            "IdealGear",
            "IdealPlanetary",
        )
    },
    **{f"Sources.{name}": name for name in ("Torque", "ConstantTorque")},
}
_BLOCKS = {"Modelica.Blocks.Sources.Sine": "Sine", "Modelica.Blocks.Sources.Constant": "Constant"}
_ELEMENT_NAME = "PiecewiseElement"
_NO_EFFECT = frozenset({"stateSelect", "useHeatPort", "T", "a", "a.start", "a.fixed", "phi_nominal", "animation"})
_STARTS = (
    "phi.start",
    "w.start",
    "phi.fixed",
    "w.fixed",
    "phi_rel.start",
    "w_rel.start",
    "phi_rel.fixed",
    "w_rel.fixed",
)
_SAME_ORDER = 1e-9
_LARGEST_DENOMINATOR = 64


@dataclass
class _Component:
    """A component with the values of its modifiers."""

    kind: str
    name: str
    line: int
    values: dict[str, Value] = field(default_factory=dict)
    is_mesh: bool = False

    def number(self, key: str, default: float | None = None) -> float:
        """A number among the values; NotConstant without one."""
        value = self.values.get(key, default)
        if isinstance(value, bool) or not isinstance(value, float):
            raise NotConstant(f"needs {key}")
        return value

    def numbers(self, key: str) -> list[float]:
        """An array of numbers; empty without one."""
        values = self.values.get(key, [])
        if not isinstance(values, list) or not all(type(value) is float for value in values):
            raise NotConstant(f"needs numbers as {key}")
        return [value for value in values if type(value) is float]


@dataclass
class ModelicaDriveline:
    """What a text says: the network, problems, and what does not belong to a driveline."""

    network: TorsionalNetwork
    excitation: dict[str, Any] | None = None
    refused: list[Problem] = field(default_factory=list)
    left_out: list[Problem] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def driveline_of_text(text: str) -> ModelicaDriveline:
    """Return the driveline of the first model of a Modelica text; ModelError for a text that is none."""
    made = class_of(text)
    read = ModelicaDriveline(TorsionalNetwork(made.name))
    constants = Constants(made)
    components = _components(made, constants, read)
    nodes = _nodes(made, components, read)
    _speed(made, constants, read)
    signals = {end: components[end[:-2]] for end in nodes.signals if end.endswith(".y") and end[:-2] in components}
    for component in components.values():
        try:
            _ADD[component.kind](component, nodes, signals, read)
        except NotConstant as reason:
            read.refused.append(Problem(f"line {component.line}", f"{component.kind} {component.name}", str(reason)))
    _first_sine(read)
    return read


# --- components ---


def _components(made: ModelicaClass, constants: Constants, read: ModelicaDriveline) -> dict[str, _Component]:
    """The components that are understood, by name; others are problems."""
    own = tokens_of(ELEMENT)
    texts = [token.text for token in own[:-1]]
    is_ours = [token.text for token in made.classes.get(_ELEMENT_NAME, [])] == texts
    components = {}
    for one in made.declarations:
        if {"parameter", "constant"} & one.prefixes:
            continue
        kind = _kind(one.type, made)
        where = f"line {one.line}"
        if one.type == _ELEMENT_NAME and is_ours:
            kind = _ELEMENT_NAME
        if kind == "sensor":
            read.left_out.append(Problem(where, f"{one.type} {one.name}", "a sensor is no part of a driveline"))
        elif not kind or "[]" in one.modifiers or "if" in one.modifiers:
            rule = "an array or a condition is not understood" if kind else "is no component that a model has"
            read.refused.append(Problem(where, f"{one.type} {one.name}", rule))
        else:
            components[one.name] = _with_values(kind, one, constants, read)
    for name, tokens in made.classes.items():
        if not (name == _ELEMENT_NAME and is_ours):
            read.left_out.append(Problem(f"line {tokens[0].line}", name, "a class inside the model is not read"))
    for line, statement in made.others:
        is_icon = statement.replace(" ", "").startswith("extendsModelica.Icons.")
        problem = Problem(f"line {line}", statement, "is not understood")
        (read.left_out if is_icon else read.refused).append(problem)
    return components


def _kind(type_name: str, made: ModelicaClass) -> str:
    """The kind of a component by its type; empty if it is not understood."""
    full = type_name
    head, dot, rest = type_name.partition(".")
    if head in made.imports:
        full = f"{made.imports[head]}{dot}{rest}"
    elif not type_name.startswith("Modelica.") and made.within.startswith("Modelica.Mechanics"):
        full = f"Modelica.Mechanics.{type_name}" if head == "Rotational" else f"{_ROTATIONAL}{type_name}"
    else:
        packages = [path for short, path in made.imports.items() if short.startswith("*")]
        candidates = [f"{package}.{type_name}" for package in packages]
        full = next((one for one in candidates if one.removeprefix(_ROTATIONAL) in _LIBRARY or one in _BLOCKS), full)
    if full.startswith(f"{_ROTATIONAL}Sensors."):
        return "sensor"
    return _BLOCKS.get(full) or _LIBRARY.get(full.removeprefix(_ROTATIONAL), "") * full.startswith(_ROTATIONAL)


def _with_values(kind: str, one: Declaration, constants: Constants, read: ModelicaDriveline) -> _Component:
    """A component with the values of its modifiers; those that are not understood are problems."""
    component = _Component(kind, one.name, one.line)
    component.is_mesh = MARK in [token.text for token in one.annotation]
    for key, tokens in one.modifiers.items():
        if key in _NO_EFFECT:
            continue
        if key in _STARTS:
            if not any("start of motion" in note for note in read.notes):
                read.notes.append("the start of motion is not taken over: simulation.initial says where a run begins")
            continue
        try:
            value = constants.value(tokens)
        except NotConstant as reason:
            words = f"{key} = {' '.join(token.text for token in tokens)[:60]}"
            read.refused.append(Problem(f"line {one.line}", f"{one.name}: {words}", str(reason)))
            continue
        if key == "useSupport" and value is False:
            continue
        if key not in _KEYS[kind]:
            read.refused.append(Problem(f"line {one.line}", f"{one.name}: {key}", "this modifier is not understood"))
            continue
        component.values[key] = value
    return component


# --- what joins them ---


class _Nodes:
    """Flanges that connections join to nodes, and signals."""

    def __init__(self) -> None:
        self._parent: dict[str, str] = {}
        self.signals: dict[str, list[str]] = {}

    def node(self, flange: str) -> str:
        """The node of a flange."""
        root = flange
        while (up := self._parent.setdefault(root, root)) != root:
            root = up
        while self._parent[flange] != root:
            self._parent[flange], flange = root, self._parent[flange]
        return root

    def join(self, a: str, b: str) -> None:
        """Make one node of two flanges; the ground stays the ground."""
        first, second = sorted((self.node(a), self.node(b)), key=lambda node: node != GROUND)
        self._parent[second] = first

    def flange(self, component: _Component, name: str) -> str:
        """The node of a component's flange."""
        return self.node(f"{component.name}.{name}")


def _nodes(made: ModelicaClass, components: Mapping[str, _Component], read: ModelicaDriveline) -> _Nodes:
    """Join flanges by the connections; those of components that are not understood are problems."""
    nodes = _Nodes()
    for component in components.values():
        if component.kind == "Inertia":
            nodes.join(f"{component.name}.flange_a", f"{component.name}.flange_b")
        elif component.kind == "Fixed":
            nodes.join(f"{component.name}.flange", GROUND)
    for a, b, line in made.connections:
        unknown = [end for end in (a, b) if not _is_connector(end, components)]
        if unknown:
            owner = unknown[0].partition(".")[0]
            is_known_loss = any(owner in problem.value.split() for problem in (*read.left_out, *read.refused))
            target = read.left_out if is_known_loss else read.refused
            target.append(Problem(f"line {line}", f"connect({a}, {b})", f"{unknown[0]} is no connector that is known"))
        elif a.endswith((".y", ".tau")) or b.endswith((".y", ".tau")):
            nodes.signals.setdefault(a, []).append(b)
            nodes.signals.setdefault(b, []).append(a)
        else:
            nodes.join(a, b)
    return nodes


def _is_connector(end: str, components: Mapping[str, _Component]) -> bool:
    """Whether a component has this connector."""
    name, _, connector = end.partition(".")
    component = components.get(name)
    if component is None:
        return False
    if component.kind == _ELEMENT_NAME:
        return connector in [f"flange[{k + 1}]" for k in range(len(component.numbers("w")))]
    return connector in _CONNECTORS[component.kind]


# --- meaning ---

Add = Callable[[_Component, _Nodes, Mapping[str, _Component], ModelicaDriveline], None]


def _inertia(component: _Component, nodes: _Nodes, _signals: object, read: ModelicaDriveline) -> None:
    network = read.network
    node = nodes.flange(component, "flange_a")
    J = component.number("J")
    if node == GROUND:
        read.notes.append(f"line {component.line}: {component.name} is held fast")
        return
    if network.inertia.get(node):
        read.notes.append(f"line {component.line}: {component.name} is one body with {network.names[node]}")
    network.add_inertia(node, J, component.name)


def _fixed(component: _Component, _nodes: _Nodes, _signals: object, _read: ModelicaDriveline) -> None:
    if component.number("phi0", 0.0):
        raise NotConstant("is fixed at an angle other than zero (phi0)")


def _nothing(_component: _Component, _nodes: _Nodes, _signals: object, _read: ModelicaDriveline) -> None:
    """Blocks act through what is connected to them."""


def _compliant(component: _Component, nodes: _Nodes, _signals: object, read: ModelicaDriveline) -> None:
    """Spring, Damper, SpringDamper, ElastoBacklash."""
    kind = component.kind
    ends = [nodes.flange(component, "flange_a"), nodes.flange(component, "flange_b")]
    stiffness = 0.0 if kind == "Damper" else component.number("c")
    damping = 0.0 if kind == "Spring" else component.number("d", None if kind == "Damper" else 0.0)
    turned = component.number("phi_rel0", 0.0)
    backlash = component.number("b", 0.0)
    if kind == "Damper" and GROUND in ends and ends != [GROUND, GROUND]:
        body = next(end for end in ends if end != GROUND)
        read.network.drag[body] = read.network.drag.get(body, 0.0) + damping
        return
    table: dict[str, Any] = {"name": label_of(component.name), "between": ends, "stiffness": stiffness}
    table |= {"damping": damping} if damping else {}
    if backlash:
        if turned:
            raise NotConstant("has a gap that is not about zero (phi_rel0)")
        table["clearance"] = 0.5 * backlash
        table |= {"contact_damping": "clipped"} if damping else {}
    elif turned:
        # torque c (phi_b - phi_a - phi_rel0), and delta = phi_a - phi_b
        table["preload"] = stiffness * turned
    read.network.components.append(("coupling", table, f"line {component.line}"))


def _ideal_gear(component: _Component, nodes: _Nodes, _signals: object, read: ModelicaDriveline) -> None:
    ratio = component.number("ratio")
    _add_gear(component, (nodes.flange(component, "flange_a"), nodes.flange(component, "flange_b")), ratio, read)


def _ideal_planetary(component: _Component, nodes: _Nodes, _signals: object, read: ModelicaDriveline) -> None:
    ratio = component.number("ratio")
    sun, carrier, ring = (nodes.flange(component, name) for name in ("sun", "carrier", "ring"))
    fixed = [name for name, node in (("sun", sun), ("carrier", carrier), ("ring", ring)) if node == GROUND]
    if len(fixed) != 1:
        raise NotConstant("couples three shafts rigidly: one of them must be fixed; [[planetary]] has elastic meshes")
    pairs = {
        "ring": ((sun, carrier), 1.0 + ratio),
        "carrier": ((sun, ring), -ratio),
        "sun": ((ring, carrier), (1.0 + ratio) / ratio if ratio else 0.0),
    }
    _add_gear(component, *pairs[fixed[0]], read)


def _add_gear(component: _Component, pair: tuple[str, str], ratio: float, read: ModelicaDriveline) -> None:
    if ratio == 0.0:
        raise NotConstant("needs a ratio other than zero")
    if GROUND in pair:
        raise NotConstant("is blocked: one of its shafts is fixed")
    read.network.gears.append(IdealGear(*pair, ratio, f"line {component.line}"))


def _constant_torque(component: _Component, nodes: _Nodes, _signals: object, read: ModelicaDriveline) -> None:
    torque = {"on": nodes.flange(component, "flange"), "mean": component.number("tau_constant")}
    read.network.torques.append(torque)


def _torque(component: _Component, nodes: _Nodes, signals: Mapping[str, _Component], read: ModelicaDriveline) -> None:
    """A torque whose signal is a Sine or a Constant."""
    joined = nodes.signals.get(f"{component.name}.tau", [])
    sources = [signals[end] for end in joined if end in signals]
    if len(joined) != 1 or len(sources) != 1:
        raise NotConstant("needs one Sine or one Constant at tau")
    source = sources[0]
    node = nodes.flange(component, "flange")
    if source.kind == "Constant":
        read.network.torques.append({"on": node, "mean": source.number("k")})
        return
    if source.number("startTime", 0.0) > 0.0:
        raise NotConstant(f"{source.name} begins later than zero (startTime)")
    frequency = source.number("f" if "f" in source.values else "freqHz")
    # sin(2 pi f (t - startTime) + phase)
    phase = source.number("phase", 0.0) - 2.0 * math.pi * frequency * source.number("startTime", 0.0)
    sine = {"frequency": frequency, "amplitude": source.number("amplitude", 1.0), "phase": phase}
    torque = {"on": node, "harmonics": [sine]}
    read.network.torques.append(torque | ({"mean": source.number("offset")} if "offset" in source.values else {}))


def _piecewise(component: _Component, nodes: _Nodes, _signals: object, read: ModelicaDriveline) -> None:
    """The class that our own export writes."""
    w = component.numbers("w")
    ends = [nodes.flange(component, f"flange[{k + 1}]") for k in range(len(w))]
    table: dict[str, Any] = {"name": label_of(component.name)}
    amplitudes, omegas, phases = (component.numbers(f"error{key}") for key in ("Amplitude", "Omega", "Phase"))
    sines = [
        {"frequency": omega / (2.0 * math.pi), "amplitude": amplitude, "phase": phase}
        for amplitude, omega, phase in zip(amplitudes, omegas, phases, strict=True)
    ]
    stages = [component.numbers(key) for key in ("corner", "K", "C", "F")]
    if component.is_mesh:
        if len(w) != 2 or not w[0] > 0.0 > w[1]:
            raise NotConstant("is a mesh of other than two gears: [[planetary]] has those of a planet")
        table |= {"between": ends, "radii": [w[0], -w[1]], **_mesh_law(*stages)}
        table |= {"transmission_error": sines} if sines else {}
    else:
        if sorted(w, reverse=True) not in ([1.0, -1.0], [1.0], [-1.0]):
            raise NotConstant("is a torsional element with arms other than 1 and -1")
        ends = [end for _, end in sorted(zip(w, ends, strict=True), reverse=True)]
        ends = ends if len(w) == 2 else [*ends, GROUND] if w[0] > 0.0 else [GROUND, *ends]
        table |= {"between": ends, **_coupling_law(*stages)}
        table |= {"kinematic_error": sines} if sines else {}
    if component.values.get("clipped") is True:
        table["contact_damping"] = "clipped"
    read.network.components.append(("mesh" if component.is_mesh else "coupling", table, f"line {component.line}"))


def _mesh_law(corner: list[float], K: list[float], C: list[float], F: list[float]) -> dict[str, float]:
    """Keys of a mesh with these pieces; NotConstant if it has other ones."""
    if not corner and len(K) == 1 and F == [0.0]:
        return {"stiffness": K[0], "damping": C[0]}
    if len(corner) == 2 and corner[0] == -corner[1] and [K[1], C[1], F[1]] == [0.0] * 3 and K[0] == K[2]:
        return {"stiffness": K[2], "damping": C[2], "backlash": 2.0 * corner[1]}
    raise NotConstant("is a mesh with a law other than a free gap between equal flanks")


def _coupling_law(corner: list[float], K: list[float], C: list[float], F: list[float]) -> dict[str, Any]:
    """Keys of a coupling with these pieces."""
    if not len(K) == len(C) == len(F) == len(corner) + 1 or sorted(corner) != corner:
        raise NotConstant("needs ascending corners, and one K, C and F more than corners")
    if not corner:
        return {"stiffness": K[0], "damping": C[0]} | ({"preload": F[0]} if F[0] else {})
    if (
        len(corner) == 2
        and corner[0] == -corner[1]
        and [K[1], C[1], F[1]] == [0.0] * 3
        and K[0] == K[2]
        and C[0] == C[2]
    ):
        return {"stiffness": K[2], "damping": C[2], "clearance": corner[1]}
    upper = sum(at < 0.0 for at in corner)
    lower = upper
    above = [at for at in corner if at > 0.0]
    below = [-at for at in reversed(corner) if at < 0.0]
    upper += 0.0 in corner
    drive = _stages(above, K[upper:], C[upper:])
    coast = _stages(below, K[lower::-1], C[lower::-1])
    return {"stages": drive, "coast_stages": coast} | ({"preload": F[upper]} if F[upper] else {})


def _stages(ends: list[float], K: list[float], C: list[float]) -> list[dict[str, float]]:
    """Stages from the centre outward."""
    until: list[dict[str, float]] = [{"until": end} for end in ends]
    return [{"stiffness": k, "damping": c, **end} for k, c, end in zip(K, C, [*until, {}], strict=True)]


_ADD: Mapping[str, Add] = {
    "Inertia": _inertia,
    "Fixed": _fixed,
    "Sine": _nothing,
    "Constant": _nothing,
    "Spring": _compliant,
    "Damper": _compliant,
    "SpringDamper": _compliant,
    "ElastoBacklash": _compliant,
    "IdealGear": _ideal_gear,
    "IdealPlanetary": _ideal_planetary,
    "ConstantTorque": _constant_torque,
    "Torque": _torque,
    _ELEMENT_NAME: _piecewise,
}
_TWO = frozenset({"flange_a", "flange_b"})
_CONNECTORS: Mapping[str, frozenset[str]] = {
    **dict.fromkeys(("Inertia", "Spring", "Damper", "SpringDamper", "ElastoBacklash", "IdealGear"), _TWO),
    "Fixed": frozenset({"flange"}),
    "IdealPlanetary": frozenset({"sun", "carrier", "ring"}),
    "ConstantTorque": frozenset({"flange"}),
    "Torque": frozenset({"flange", "tau"}),
    "Sine": frozenset({"y"}),
    "Constant": frozenset({"y"}),
}
_KEYS: Mapping[str, frozenset[str]] = {
    "Inertia": frozenset({"J"}),
    "Fixed": frozenset({"phi0"}),
    "Spring": frozenset({"c", "phi_rel0"}),
    "Damper": frozenset({"d"}),
    "SpringDamper": frozenset({"c", "d", "phi_rel0"}),
    "ElastoBacklash": frozenset({"c", "d", "b", "phi_rel0"}),
    "IdealGear": frozenset({"ratio"}),
    "IdealPlanetary": frozenset({"ratio"}),
    "ConstantTorque": frozenset({"tau_constant"}),
    "Torque": frozenset(),
    "Sine": frozenset({"amplitude", "f", "freqHz", "phase", "offset", "startTime"}),
    "Constant": frozenset({"k"}),
    _ELEMENT_NAME: frozenset({"w", "corner", "K", "C", "F", "clipped", "errorAmplitude", "errorOmega", "errorPhase"}),
}


# --- speed and orders ---


def _speed(made: ModelicaClass, constants: Constants, read: ModelicaDriveline) -> None:
    """Take the reference speed of our own export."""
    if MARK in [token.text for token in made.annotation]:
        try:
            read.excitation = {"speed": constants.number(next(d.value for d in made.declarations if d.name == "Omega"))}
        except (NotConstant, StopIteration):
            read.notes.append("the reference speed of the export, Omega, has no value any more")


def _first_sine(read: ModelicaDriveline) -> None:
    """Take the first sine as the reference speed where the text states none."""
    sines = _sines(read.network)
    if any(sine["frequency"] <= 0.0 for sine in sines):
        raise ModelError(Problem("Sine", "f", "a frequency must be greater than zero"))
    if sines and read.excitation is None:
        read.excitation = {"frequency": sines[0]["frequency"]}
        read.notes.append("the frequency of the first sine is the reference speed (order 1); speed sets another")


def with_orders(network: TorsionalNetwork, omega: float) -> None:
    """Express the frequencies of all sines as orders of the model's reference speed [rad/s]."""
    for sine in _sines(network):
        order = 2.0 * math.pi * sine.pop("frequency") / omega
        whole = float(Fraction(order).limit_denominator(_LARGEST_DENOMINATOR))
        sine["order"] = whole if abs(order - whole) <= _SAME_ORDER * order else order


def _sines(network: TorsionalNetwork) -> list[dict[str, float]]:
    """The sines of torques and errors."""
    sines = [sine for torque in network.torques for sine in torque.get("harmonics", ())]
    for _, table, _ in network.components:
        sines += [*table.get("kinematic_error", ()), *table.get("transmission_error", ())]
    return sines
