"""A torsional network as other tools describe it, and the model of it.

Nodes turn; they have inertia, drag, torques. Components act between them, and ideal gears couple them rigidly:
theta_a = ratio theta_b. Nodes that ideal gears couple are one body, whose angle is that of the node kept, theta_i =
rho_i theta_kept: inertias and drags add up with rho^2, torques with rho. A negative ratio turns the sense of all angles
beyond it, so that in the model positive angles are the kinematically consistent directions.

Shafts with an inertia of their own have the consistent matrix I/6 [[2, 1], [1, 2]] in finite elements; a driveline of
rigid bodies has I/2 at either end. ``lumping_note`` says what this does to the natural frequencies.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.linear.matrices import LinearSystem, linearised
from gearrattle.assembly import assemble
from gearrattle.errors import ModelError, Problem
from gearrattle.model import GROUND, Coupling, Mesh, Model
from gearrattle.model.components import COMPONENTS
from gearrattle.wording import counted

Node = str
Table = dict[str, Any]

_SAME_RATIO = 1e-9  # relative difference of two ratios that count as equal
_NO_SPEED = "excitation.speed is 1 rad/s: the source states no reference speed"
_NO_INERTIA = "has no inertia: a model needs one where elements meet"


@dataclass(frozen=True)
class IdealGear:
    """A rigid constraint theta_a = ratio theta_b; ``where`` is where the source states it."""

    a: Node
    b: Node
    ratio: float
    where: str


@dataclass
class TorsionalNetwork:
    """Nodes, components between them and ideal gears, in the order of the source.

    Attributes
    ----------
    title
        name of the model.
    inertia
        J by node [kg m^2]; a node may have none.
    names
        name of the body at a node, as the source calls it.
    drag
        viscous drag to ground by node [N m s/rad].
    grounded
        nodes that are held fast.
    components
        kind, table whose ``between`` holds nodes, and where the source states it.
    gears
        ideal gears.
    torques
        tables of torques, whose ``on`` is a node.
    own_inertia
        inertia of a shaft with a consistent mass matrix, by name of its coupling [kg m^2].
    """

    title: str = ""
    inertia: dict[Node, float] = field(default_factory=dict)
    names: dict[Node, str] = field(default_factory=dict)
    drag: dict[Node, float] = field(default_factory=dict)
    drag_torque: dict[Node, float] = field(default_factory=dict)
    grounded: set[Node] = field(default_factory=set)
    components: list[tuple[str, Table, str]] = field(default_factory=list)
    gears: list[IdealGear] = field(default_factory=list)
    torques: list[Table] = field(default_factory=list)
    own_inertia: dict[str, float] = field(default_factory=dict)

    def add_inertia(self, node: Node, inertia: float, name: str = "", drag: float = 0.0) -> None:
        """Add a rigid body to a node."""
        self.inertia[node] = self.inertia.get(node, 0.0) + inertia
        self.drag[node] = self.drag.get(node, 0.0) + drag
        if name:
            self.names.setdefault(node, name)

    def add_shaft(
        self, name: str, ends: tuple[Node, Node], values: Mapping[str, float], where: str, split: int
    ) -> None:
        """Add a shaft of stiffness, damping and own ``inertia``, in ``split`` equal parts with half their inertia at
        either end.
        """
        own = values.get("inertia", 0.0)
        parts = split if own else 1
        nodes = [ends[0], *(f"{ends[0]}/{name}/{k}" for k in range(1, parts)), ends[1]]
        for k in range(parts):
            part_name = name if parts == 1 else f"{name}_{k + 1}"
            table = {"name": part_name, "between": [nodes[k], nodes[k + 1]], "stiffness": values["stiffness"] * parts}
            if values.get("damping"):
                table["damping"] = values["damping"] * parts
            self.components.append(("coupling", table, where))
            for node in (nodes[k], nodes[k + 1]):
                self.add_inertia(node, 0.5 * own / parts, f"{name}_{k}" if "/" in node else "")
            if own:
                self.own_inertia[part_name] = own / parts


def label_of(text: str, taken: set[str] | None = None) -> str:
    """Return a text as a name of the model file, unique among those taken, which it joins."""
    label = re.sub(r"[^A-Za-z0-9_-]+", "_", text).strip("_") or "part"
    label = f"{label}_" if label == GROUND else label
    if taken is None:
        return label
    unique = label
    number = 2
    while unique in taken:
        unique = f"{label}_{number}"
        number += 1
    taken.add(unique)
    return unique


@dataclass(frozen=True)
class _Bodies:
    """The body of every node: the node kept for it, and the node's angle over that of the node kept.

    ``turned``: by node, -1 where the model counts angles in the opposite sense, else 1.
    """

    kept: dict[Node, Node]
    ratio: dict[Node, float]
    turned: dict[Node, float]


def model_of(network: TorsionalNetwork, excitation: Mapping[str, Any] | None) -> tuple[Model, tuple[str, ...]]:
    """Return the model of a network, and notes on it.

    Parameters
    ----------
    excitation
        the table of the reference speed; None: the source states none.

    Raises
    ------
    ModelError
        elements that meet where there is no inertia, gears that block each other, a law that no mesh can hold, and as
        ``Model.from_tables``.
    """
    bodies = _bodies(network)
    _check_inertia(network, bodies)
    # bodies, in the order of the nodes kept
    taken = set[str]()
    names = {GROUND: GROUND}
    rows = []
    for node in dict.fromkeys(bodies.kept.values()):
        members = [other for other, kept in bodies.kept.items() if kept == node]
        J = sum(network.inertia.get(m, 0.0) * bodies.ratio[m] ** 2 for m in members)
        if node == GROUND or J == 0.0:
            continue
        names[node] = label_of(network.names.get(node, node), taken)
        row: Table = {"name": names[node], "J": J}
        drag = sum(network.drag.get(m, 0.0) * bodies.ratio[m] ** 2 for m in members)
        drag_torque = sum(network.drag_torque.get(m, 0.0) * bodies.ratio[m] for m in members)
        rows.append(row | ({"drag": drag} if drag else {}) | ({"drag_torque": drag_torque} if drag_torque else {}))
    # components and torques between them
    tables: Table = {"schema": 1, **({"name": network.title} if network.title else {}), "inertia": rows}
    notes = list[str]()
    of_kind, dropped = _components(network, bodies, names)
    notes += dropped
    tables |= {kind: of_kind[kind] for kind in COMPONENTS if of_kind.get(kind)}
    tables["excitation"] = dict(excitation) if excitation is not None else {"speed": 1.0}
    if torques := _torques(network, bodies, names):
        tables["torque"] = torques
    # what the user must know
    if excitation is None:
        notes.append(_NO_SPEED)
    notes += [
        f"{network.names.get(node, node)} is one body with {names[bodies.kept[node]]}: an ideal gear couples them"
        for node in network.names
        if bodies.kept.get(node, node) not in (node, GROUND) and network.inertia.get(node)
    ]
    return Model.from_tables(tables), tuple(notes)


def _bodies(network: TorsionalNetwork) -> _Bodies:
    """The bodies that ideal gears make of the nodes, and the sense in which their angles count."""
    nodes = list(dict.fromkeys([*network.inertia, *_ends(network), *network.grounded]))
    # angle of every node over that of the first node of its group
    linked: dict[Node, list[tuple[Node, float, str]]] = {node: [] for node in nodes}
    for gear in network.gears:
        linked.setdefault(gear.a, []).append((gear.b, 1.0 / gear.ratio, gear.where))
        linked.setdefault(gear.b, []).append((gear.a, gear.ratio, gear.where))
    signed, group = _spread(linked, "gears block each other: two paths have different ratios")
    # sense of every group: components join nodes that turn in the same sense
    joined: dict[Node, list[tuple[Node, float, str]]] = {root: [] for root in dict.fromkeys(group.values())}
    for _, table, where in network.components:
        a, b = table["between"]
        if GROUND in (a, b) or {a, b} & network.grounded:
            continue
        sense = float(np.sign(signed[a] * signed[b]))
        joined[group[a]].append((group[b], sense, where))
        joined[group[b]].append((group[a], sense, where))
    senses, _ = _spread(joined, "closes a loop in which the gears turn it against itself")
    # the node kept: the first with an inertia
    kept = dict[Node, Node]()
    for root in dict.fromkeys(group.values()):
        members = [node for node in linked if group[node] == root]
        held = GROUND if set(members) & network.grounded else ""
        first = next((node for node in members if network.inertia.get(node)), root)
        kept |= dict.fromkeys(members, held or first)
    ratio = {node: 1.0 if kept[node] == GROUND else abs(signed[node] / signed[kept[node]]) for node in linked}
    turned = {node: senses[group[node]] * float(np.sign(signed[node])) for node in linked}
    return _Bodies({**kept, GROUND: GROUND}, {**ratio, GROUND: 1.0}, {**turned, GROUND: 1.0})


def _ends(network: TorsionalNetwork) -> list[Node]:
    return [node for _, table, _ in network.components for node in table["between"] if node != GROUND]


def _spread(
    linked: Mapping[Node, Sequence[tuple[Node, float, str]]], conflict: str
) -> tuple[dict[Node, float], dict[Node, Node]]:
    """Factor and root of every node: factors multiply along links; ModelError where two paths disagree."""
    factor = dict[Node, float]()
    root = dict[Node, Node]()
    for start in linked:
        if start in factor:
            continue
        factor[start] = 1.0
        root[start] = start
        waiting = [start]
        while waiting:
            node = waiting.pop()
            for other, times, where in linked[node]:
                value = factor[node] * times
                if other not in factor:
                    factor[other] = value
                    root[other] = start
                    waiting.append(other)
                elif abs(factor[other] - value) > _SAME_RATIO * abs(value):
                    raise ModelError(Problem(where, "", conflict, "check the ratios and signs of the gears"))
    return factor, root


def _check_inertia(network: TorsionalNetwork, bodies: _Bodies) -> None:
    """Refuse bodies without inertia at which elements or torques act (ModelError)."""
    turning = {bodies.kept[node] for node, J in network.inertia.items() if J > 0.0}
    acting = [(node, where) for _, table, where in network.components for node in table["between"]]
    acting += [(torque["on"], f"torque on {torque['on']}") for torque in network.torques]
    without = dict[Node, str]()
    for node, where in acting:
        kept = bodies.kept[node]
        if kept != GROUND and kept not in turning:
            without.setdefault(kept, where)
    if without:
        remedy = "give it one, or join the elements there into one"
        problems = [
            Problem(where, network.names.get(node, node), _NO_INERTIA, remedy) for node, where in without.items()
        ]
        raise ModelError(problems)


def _components(
    network: TorsionalNetwork, bodies: _Bodies, names: Mapping[Node, str]
) -> tuple[dict[str, list[Table]], list[str]]:
    """Tables of the components between the bodies kept, by kind, and notes on those within one body."""
    of_kind: dict[str, list[Table]] = {}
    notes = []
    problems = []
    taken = set[str]()
    for kind, written, where in network.components:
        table = {**written, "name": label_of(written["name"], taken)}
        a, b = table["between"]
        if bodies.kept[a] == bodies.kept[b]:
            notes.append(f"{where}: {written['name']} is left out: it acts within one rigid body")
            continue
        # a component whose ends count their angles in the opposite sense is seen from its other end
        is_turned = min(bodies.turned[end] for end in (a, b)) < 0.0
        if is_turned:
            a, b = b, a
            if "radii" in table:
                table["radii"] = table["radii"][::-1]
        to = {names[bodies.kept[end]]: end for end in (a, b)}
        table["between"] = list(to)
        if all(bodies.ratio[end] == 1.0 for end in (a, b)):
            of_kind.setdefault(kind, []).append(table)
            continue
        # between bodies that turn faster or slower than its ends
        component = (Mesh if kind == "mesh" else Coupling).model_validate(table, context={"dimensionless": False})
        if kind == "coupling" and not _is_simple(table) and bodies.ratio[a] != bodies.ratio[b] and GROUND not in to:
            rule = "acts between different speeds of one gear, and only a linear law or a free gap can be a mesh"
            problems.append(Problem(where, written["name"], rule, "give the gear an inertia on either side"))
            continue
        ratios = {name: (name, bodies.ratio[end]) for name, end in to.items()}
        new_kind, row = component.between_groups(ratios)
        of_kind.setdefault(new_kind, []).append(row)
    if problems:
        raise ModelError(problems)
    return of_kind, notes


def _is_simple(table: Table) -> bool:
    """Whether a coupling is linear or a free gap."""
    return not any(table.get(key) for key in ("stages", "preload", "stiffness_ratio", "damping_ratio"))


def _torques(network: TorsionalNetwork, bodies: _Bodies, names: Mapping[Node, str]) -> list[Table]:
    """One torque a body: means and sines of all that act on it."""
    by_body: dict[str, Table] = {}
    for torque in network.torques:
        if bodies.kept[torque["on"]] == GROUND:
            continue
        moved = _torque(torque, bodies, names)
        table = by_body.setdefault(moved["on"], {"on": moved["on"]})
        if "mean" in moved:
            table["mean"] = table.get("mean", 0.0) + moved["mean"]
        if "harmonics" in moved:
            table["harmonics"] = [*table.get("harmonics", ()), *moved["harmonics"]]
    return list(by_body.values())


def _torque(torque: Table, bodies: _Bodies, names: Mapping[Node, str]) -> Table:
    """A torque on the body kept for its node."""
    node = torque["on"]
    factor = bodies.ratio[node] * bodies.turned[node]
    moved: Table = {**torque, "on": names[bodies.kept[node]]}
    if "mean" in torque:
        moved["mean"] = factor * torque["mean"]
    if "harmonics" in torque:
        moved["harmonics"] = [{**sine, "amplitude": factor * sine["amplitude"]} for sine in torque["harmonics"]]
    return moved


def lumping_note(source: TorsionalNetwork, model: Model, split: int) -> tuple[str, ...]:
    """Return a note on the natural frequencies beside those of the consistent mass matrices; empty without any.

    Parameters
    ----------
    source
        the network with its shafts in one part.
    model
        its model, with the shafts in ``split`` parts.
    """
    if not source.own_inertia:
        return ()
    ours = _frequencies(model, {}, {})
    undivided, _ = model_of(source, {"speed": 1.0})
    stiffness = {table["name"]: table["stiffness"] for _, table, _ in source.components if "stiffness" in table}
    theirs = _frequencies(undivided, source.own_inertia, stiffness)
    count = min(ours.size, theirs.size)
    rigid = int(np.count_nonzero(theirs[:count] == 0.0))
    error = np.abs(ours[rigid:count] / theirs[rigid:count] - 1.0)
    if not error.size:
        return ()
    worst = int(np.argmax(error))
    hertz = theirs[rigid:count] / (2.0 * np.pi)
    parts = f" in {counted(split, 'part')} each" if split > 1 else ""
    remedy = "" if split > 1 else "; a larger split divides the shafts"
    return (
        f"the inertia of {counted(len(source.own_inertia), 'shaft')}{parts} is lumped at the ends: natural frequencies "
        f"differ from those of the source by {error[0]:.2g} (relative) at {hertz[0]:.6g} Hz, by at most "
        f"{error[worst]:.2g} at {hertz[worst]:.6g} Hz{remedy}",
    )


def _frequencies(model: Model, own: Mapping[str, float], stiffness: Mapping[str, float]) -> NDArray[np.float64]:
    """Natural frequencies, ascending [rad/s], with consistent mass matrices of the shafts named.

    own: inertia of shafts by name [kg m^2]; stiffness: theirs in the source, to refer the inertia to the model.
    """
    system = assemble(model).system
    slopes = np.array([law.stiffness[-1] for law in system.laws])
    linear = linearised(system, slopes, np.zeros_like(slopes))
    mass = linear.mass.copy()
    for k, element in enumerate(model.elements):
        if element.name in own:
            referred = own[element.name] * slopes[k] / stiffness[element.name]
            mass -= referred / 6.0 * np.outer(system.rows[k], system.rows[k])
    return LinearSystem(mass, linear.damping, linear.elastic).frequencies()
