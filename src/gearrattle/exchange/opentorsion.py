"""Shaft lines of openTorsion: assemblies, and its TORS files (JSON).

A TORS file lists components with their elements in order, and what joins the components. openTorsion reads them into
nodes one after the other: a disk or a gear sits on the present node, a shaft leads to the next, a gear with a parent
begins a new node. A rigid gear couples R_p theta_p + R_c theta_c = 0; an elastic gear has the stiffness k at its
parent, with the deflection theta_p + (R_c / R_p) theta_c. Lengths and radii are in mm.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from gearrattle.assembly import inertia_of
from gearrattle.errors import ModelError, Problem
from gearrattle.exchange.torsional_network import IdealGear, TorsionalNetwork, label_of
from gearrattle.model import GROUND, Element, Model

_SHEAR_MODULUS = 80e9  # Pa, of every shaft in a TORS file
_DENSITY = 8000.0  # kg/m^3, of shafts that state none
_MM = 1e-3
_LARGEST_FILE = 10_000  # elements of a file
_DEEPEST = 500  # components one after another


# --- an assembly ---


def is_assembly(source: object) -> bool:
    """Whether an object has the elements of an assembly."""
    return all(hasattr(source, name) for name in ("shaft_elements", "disk_elements", "gear_elements", "dofs"))


def network_of_assembly(assembly: Any, split: int) -> TorsionalNetwork:
    """Return the network of an assembly; ModelError for numbers that are none."""
    network = TorsionalNetwork("from openTorsion")
    for k, shaft in enumerate(_list(assembly, "shaft_elements")):
        where = f"shaft_elements[{k}]"
        # matrix of its own inertia is `mass` times [[2, 1], [1, 2]]
        values = {
            "stiffness": _number(shaft.k, where),
            "damping": _number(shaft.c, where),
            "inertia": 6.0 * _number(shaft.mass, where),
        }
        network.add_shaft(f"shaft_{k}", (_node(shaft.nl), _node(shaft.nr)), values, where, split)
    for k, disk in enumerate(_list(assembly, "disk_elements")):
        where = f"disk_elements[{k}]"
        network.add_inertia(_node(disk.node), _number(disk.I, where), f"disk_{disk.node}", _number(disk.c, where))
        if stiffness := _number(disk.k, where):
            table = {"name": f"disk_{k}_to_ground", "between": [_node(disk.node), GROUND], "stiffness": stiffness}
            network.components.append(("coupling", table, where))
    for k, gear in enumerate(_list(assembly, "gear_elements")):
        _add_gear(network, gear, f"gear_elements[{k}]", is_elastic=False)
    for k, gear in enumerate(_list(assembly, "elastic_gear_elements")):
        _add_gear(network, gear, f"elastic_gear_elements[{k}]", is_elastic=True)
    return network


def _list(assembly: Any, name: str) -> Sequence[Any]:
    return list(getattr(assembly, name, None) or ())


def _node(number: Any) -> str:
    return f"node_{number}"


def _number(value: Any, where: str) -> float:
    """A number; None counts as zero; ModelError for anything else."""
    try:
        number = 0.0 if value is None else float(value)
    except (TypeError, ValueError):
        number = math.nan
    if isinstance(value, bool) or not math.isfinite(number):
        raise ModelError(Problem(where, str(value)[:40], "must be a number"))
    return number


def _add_gear(network: TorsionalNetwork, gear: Any, where: str, *, is_elastic: bool) -> None:
    """Add a gear: its inertia, and the mesh or the constraint with its parent."""
    node = _node(gear.node)
    network.add_inertia(node, _number(gear.I, where), f"gear_{gear.node}")
    if gear.parent is None:
        return
    nodes = (_node(gear.parent.node), node)
    radii = _radii(_number(gear.parent.R, where), _number(gear.R, where), where)
    if is_elastic:
        _mesh(network, nodes, radii, (_number(gear.k, where), _number(gear.c, where)), where)
    else:
        network.gears.append(_constraint(nodes, radii, where))


def _radii(parent: float, child: float, where: str) -> tuple[float, float]:
    """Radii of a pair of gears; ModelError unless both are greater than zero."""
    if min(parent, child) <= 0.0:
        raise ModelError(Problem(where, f"{parent:g} and {child:g}", "radii of gears must be greater than zero"))
    return parent, child


def _constraint(nodes: tuple[str, str], radii: tuple[float, float], where: str) -> IdealGear:
    """R_p theta_p + R_c theta_c = 0."""
    return IdealGear(*nodes, -radii[1] / radii[0], where)


def _mesh(
    network: TorsionalNetwork,
    nodes: tuple[str, str],
    radii: tuple[float, float],
    law: tuple[float, float],
    where: str,
) -> None:
    """Add an elastic pair; law: stiffness and damping at the parent [N m/rad, N m s/rad].

    Its gears turn in opposite senses: a mesh of the model between them counts the child's angle the other way round.
    """
    parent, child = nodes
    first = radii[0] * _MM
    table: dict[str, Any] = {
        "name": label_of(f"mesh_{parent}_{child}"),
        "between": [parent, f"{child}/turned"],
        "radii": [first, radii[1] * _MM],
        "stiffness": law[0] / first**2,
    }
    if law[1]:
        table["damping"] = law[1] / first**2
    network.gears.append(IdealGear(f"{child}/turned", child, -1.0, where))
    network.components.append(("mesh", table, where))


# --- a TORS file ---


def is_tors(content: object) -> bool:
    """Whether the content of a JSON file is a system or a component of TORS."""
    return isinstance(content, Mapping) and isinstance(content.get("components"), list) and "structure" in content


def network_of_tors(content: Mapping[str, Any], split: int) -> tuple[TorsionalNetwork, list[Problem]]:
    """Return the network of a TORS file, and what it holds that a network does not.

    Raises
    ------
    ModelError
        names twice or missing, values that are no numbers, components that do not hang together.
    """
    network = TorsionalNetwork(str(content.get("name") or "from openTorsion")[:200])
    left_out = list[Problem]()
    node = 0
    parents: dict[tuple[str, str], tuple[int, float]] = {}
    for component, element in _in_order(content):
        name = f"{component}.{element.get('name')}"
        where = f"component {component}, element {element.get('name')}"
        kind = element.get("type")
        if kind == "Disk":
            damping = _value(element, "damping", where, 0.0)
            network.add_inertia(_node(node), _value(element, "inertia", where), label_of(name), damping)
        elif kind in ("ShaftDiscrete", "ShaftContinuous"):
            values = _shaft(element, where)
            network.add_shaft(label_of(name), (_node(node), _node(node + 1)), values, where, split)
            node += 1
        elif kind == "GearElement":
            radius = _value(element, "teeth" if "teeth" in element else "diameter", where)
            parent = parents.get((component, str(element.get("parent"))))
            if "parent" in element and parent is None:
                rule = "parent must be a gear before it in the same component"
                raise ModelError(Problem(where, str(element["parent"])[:40], rule))
            node += parent is not None
            network.add_inertia(_node(node), _value(element, "inertia", where), label_of(name))
            if parent is not None:
                radii = _radii(parent[1], radius, where)
                network.gears.append(_constraint((_node(parent[0]), _node(node)), radii, where))
            parents[component, str(element.get("name"))] = (node, radius)
        else:
            rule = "is no element of TORS: Disk, ShaftDiscrete, ShaftContinuous and GearElement are"
            raise ModelError(Problem(where, str(kind)[:40], rule))
        if "excitation" in element:
            rule = "openTorsion's excitations name no unit and no speed: write the torque as [[torque]]"
            left_out.append(Problem(where, "excitation", rule))
    return network, left_out


def _in_order(content: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield name of the component and element, in the order in which openTorsion reads them."""
    components = {}
    for k, component in enumerate(content["components"]):
        elements = component.get("elements") if isinstance(component, Mapping) else None
        if not isinstance(elements, list) or not all(isinstance(element, Mapping) for element in elements):
            raise ModelError(Problem(f"components[{k}]", "", "must be a table with a name and a list of elements"))
        components[str(component.get("name"))] = elements
    if sum(map(len, components.values())) > _LARGEST_FILE:
        raise ModelError(Problem("components", "", f"has more than {_LARGEST_FILE} elements"))
    joined, first = _structure(content["structure"], components)
    # a walk: after an element, the component that is joined to it
    walk: list[tuple[str, Iterator[Mapping[str, Any]]]] = [(first, iter(components[first]))]
    seen = {first}
    while walk:
        if len(walk) > _DEEPEST:
            raise ModelError(Problem("structure", "", f"joins more than {_DEEPEST} components one after another"))
        component, elements = walk[-1]
        element = next(elements, None)
        if element is None:
            walk.pop()
            continue
        yield component, element
        follower = joined.get((component, str(element.get("name"))))
        if follower is not None:
            if follower in seen:
                raise ModelError(Problem("structure", follower, "is joined twice: a component begins at one other"))
            seen.add(follower)
            walk.append((follower, iter(components[follower])))
    if missing := [name for name in components if name not in seen]:
        raise ModelError(Problem("structure", missing[0], "is not joined to the other components"))


def _structure(structure: Any, components: Mapping[str, Any]) -> tuple[dict[tuple[str, str], str], str]:
    """By component and element, the component joined to it; and the component at which all begins."""
    joined = {}
    if not isinstance(structure, list):
        raise ModelError(Problem("structure", "", "must be a list of pairs"))
    for k, pair in enumerate(structure):
        ends = [str(end).split(".", 1) for end in pair] if isinstance(pair, list) and len(pair) == 2 else []
        if len(ends) != 2 or len(ends[0]) != 2 or any(end[0] not in components for end in ends):
            rule = 'must be a pair "COMPONENT.ELEMENT" of components of the file'
            raise ModelError(Problem(f"structure[{k}]", str(pair)[:60], rule))
        joined[ends[0][0], ends[0][1]] = ends[1][0]
    begins = [name for name in components if name not in set(joined.values())]
    if len(begins) != 1:
        rule = f"must join all components from one on; {len(begins)} begin a line"
        raise ModelError(Problem("structure", ", ".join(begins[:5]), rule))
    return joined, begins[0]


def _value(element: Mapping[str, Any], key: str, where: str, default: float | None = None) -> float:
    """A number of an element; ModelError if it is missing or none."""
    if key not in element and default is not None:
        return default
    value = element.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ModelError(Problem(f"{where}: {key}", str(value)[:40], "must be a number"))
    return float(value)


def _shaft(element: Mapping[str, Any], where: str) -> dict[str, float]:
    """Stiffness, damping and own inertia of a shaft: K = G I_p / L and I = rho I_p L of a round one."""
    if element["type"] == "ShaftDiscrete":
        return {key: _value(element, key, where, 0.0 if key == "damping" else None) for key in ("stiffness", "damping")}
    length = _value(element, "length", where) * _MM
    inner = _value(element, "innerDiameter", where) * _MM
    outer = _value(element, "outerDiameter", where) * _MM
    density = _value(element, "density", where, _DENSITY)
    if not (length > 0.0 and outer > inner >= 0.0):
        raise ModelError(Problem(where, "", "a shaft needs a length, and an outer diameter beyond the inner one"))
    area = math.pi * (outer**4 - inner**4) / 32.0
    return {"stiffness": _SHEAR_MODULUS * area / length, "inertia": density * area * length}


# --- writing ---


def tors_text(model: Model) -> tuple[str, list[Problem], list[str]]:
    """Return the linear shaft line of a model as a TORS file, what the file leaves out, and notes.

    Every element is in contact, with its last drive stage. A mesh becomes a massless shaft of stiffness K R_a^2 and a
    rigid gear pair, which is the same; a branch begins with a gear pair of ratio 1.

    Raises
    ------
    ModelError
        a driveline that is no tree of two-ended elements, an element of zero stiffness.
    """
    left_out = _not_held(model)
    shafts, drags = _shafts(model)
    disks = {
        body.name: {"name": body.name, "type": "Disk", "inertia": J, "damping": drags[body.name]}
        for body, J in zip(model.inertias, inertia_of(model).tolist(), strict=True)
    }
    elements = _in_tors_order(model.inertias[0].name, list(shafts.values()), disks)
    if beyond := [name for name in disks if not any(element is disks[name] for element in elements)]:
        rule = "a TORS file holds one connected driveline"
        raise ModelError(Problem(f"inertia.{beyond[0]}", beyond[0], rule, "export each train on its own"))
    system = {
        "name": model.name or "gearrattle",
        "date": "",
        "components": [{"name": "driveline", "elements": elements}],
        "structure": [],
    }
    notes = ["every element counts as closed, with the stiffness and damping of its last drive stage"]
    notes += [f"the torque on {torque.on} is not in the file: TORS has no unit for it" for torque in model.torques]
    return json.dumps(system, indent=1, allow_nan=False) + "\n", left_out, notes


def _not_held(model: Model) -> list[Problem]:
    """What of a driveline a linear shaft line does not hold."""
    left_out = []
    for element in model.elements:
        held = {
            "a clearance or stages": len(element.drive) > 1 or element.drive != element.coast,
            "friction": element.rubs,
            "a preload": element.preload != 0.0,
            "errors": bool(element.errors),
            "a stiffness that alternates": element.alternation is not None,
            "clipped contact damping": element.contact_damping == "clipped",
        }
        for what, is_there in held.items():
            if is_there:
                left_out.append(Problem(element.path, what, "openTorsion's elements are linear"))
    for body in model.inertias:
        if body.drag_torque or body.drag_parts:
            left_out.append(Problem(f"inertia.{body.name}", "a drag torque", "openTorsion has viscous damping alone"))
        if body.mass is not None:
            left_out.append(Problem(f"inertia.{body.name}", "a mass", "openTorsion knows rotation alone"))
    left_out += [
        Problem(f"motion.{k}", f"a prescribed motion of {motion.on}", "openTorsion has free nodes alone")
        for k, motion in enumerate(model.motions)
    ]
    return left_out


Shaft = tuple[str, str, str, dict[str, float], tuple[float, float]]
"""Name, first and second body, stiffness and damping at the first, base radii."""


def _shafts(model: Model) -> tuple[dict[frozenset[str], Shaft], dict[str, float]]:
    """By pair of bodies, what joins them; and the viscous drag of every body [N m s/rad]."""
    shafts = dict[frozenset[str], Shaft]()
    drags = {body.name: body.drag for body in model.inertias}
    for element in model.elements:
        a, b = element.between
        values = _linear(element)
        if len(element.arms) > 2 or not any(element.radii):
            raise ModelError(Problem(element.path, "", "openTorsion's elements join two nodes", "leave it out"))
        if GROUND in (a, b):
            if values["stiffness"]:
                rule = "TORS has no stiffness to ground"
                raise ModelError(Problem(element.path, element.name, rule, "leave it out"))
            drags[a if b == GROUND else b] += values["damping"]
            continue
        pair = frozenset((a, b))
        if pair in shafts:
            other = shafts[pair]
            if element.along_line or other[4] != (1.0, 1.0):
                raise ModelError(Problem(element.path, element.name, "is parallel to a gear pair: TORS has no loops"))
            for key in values:
                other[3][key] += values[key]
            continue
        shafts[pair] = (element.name, a, b, values, element.radii)
    for name, _, _, values, _ in shafts.values():
        if values["stiffness"] == 0.0:
            raise ModelError(Problem(name, "zero stiffness", "a shaft of openTorsion needs one", "give it a stiffness"))
    return shafts, drags


def _linear(element: Element) -> dict[str, float]:
    """Stiffness and damping of the last drive stage, referred to the first body."""
    last = element.drive[-1]
    radius = element.radii[0]
    return {"stiffness": last.stiffness * radius**2, "damping": last.damping * radius**2}


def _in_tors_order(start: str, shafts: Sequence[Shaft], disks: Mapping[str, dict[str, Any]]) -> list[dict[str, Any]]:
    """The elements of the tree from a body on: along one line, then the branches, each from a gear of its own.

    disks: by body, its disk.
    """
    at: dict[str, list[Shaft]] = {body: [] for body in disks}
    for shaft in shafts:
        for end in shaft[1:3]:
            at[end].append(shaft)
    elements = list[dict[str, Any]]()
    used = set[str]()
    reached = set[str]()

    def arrive(body: str) -> list[tuple[str, Shaft]]:
        """Write the disk of a body, with a gear if branches begin there; return the shafts that lead on."""
        reached.add(body)
        elements.append(disks[body])
        onward = [(body, shaft) for shaft in reversed(at[body]) if shaft[0] not in used]
        if len(onward) > 1:
            elements.append(_gear(f"{body}_branch", 1.0))
        return onward

    here = start
    waiting = arrive(start)
    while waiting:
        body, (name, a, b, values, radii) = waiting.pop()
        other = b if body == a else a
        if name in used:
            continue
        used.add(name)
        if other in reached:
            rule = "closes a loop, and TORS holds trees alone"
            raise ModelError(Problem(name, f"{a}, {b}", rule, "leave one of the elements of the loop out"))
        if here != body:
            elements.append(_gear(f"{body}_branch_{name}", 1.0, f"{body}_branch"))
        # the shaft, referred to this end, then the gears
        own, far = radii if body == a else radii[::-1]
        referred = {key: value * (own / radii[0]) ** 2 for key, value in values.items()}
        elements.append({"name": name, "type": "ShaftDiscrete", **referred})
        if radii != (1.0, 1.0):
            elements.append(_gear(f"{name}_{body}", own / _MM))
            elements.append(_gear(f"{name}_{other}", far / _MM, f"{name}_{body}"))
        here = other
        waiting += arrive(other)
    return elements


def _gear(name: str, radius: float, parent: str = "") -> dict[str, Any]:
    about = {"name": name, "type": "GearElement", "inertia": 0.0, "diameter": radius}
    return about | ({"parent": parent} if parent else {})
