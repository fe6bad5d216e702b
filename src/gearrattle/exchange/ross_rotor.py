"""The torsion of a rotor of ROSS: of a file that its method ``save`` wrote, or of the object.

Torsion is the sixth of the six degrees of freedom of a node. Of a shaft element, K = G J_p / L and the consistent
inertia is rho J_p L, with the mean J_p of both ends (ROSS 2.3.0, shaft_element.py); damping is alpha M + beta K.
Bending, bearings and point masses have no part in it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.exchange.torsional_network import TorsionalNetwork, label_of

_TORSION = 5  # index among the degrees of freedom of a node
_FAR = 11  # the same at the second node of an element
_COUPLED = 1e-9  # of the diagonal: a larger coupling of torsion with the other degrees of freedom counts
_NO_TORSION = ("BearingElement", "SealElement", "PointMass")
_MOST_ELEMENTS = 10_000
_ABOUT_FILE = frozenset({"parameters", "ross_version"})


def is_rotor_file(content: object) -> bool:
    """Whether the content of a TOML or JSON file is a rotor of ROSS."""
    return isinstance(content, Mapping) and "ross_version" in content


def is_rotor(source: object) -> bool:
    """Whether an object is a rotor of ROSS."""
    return all(hasattr(source, name) for name in ("shaft_elements", "disk_elements", "bearing_elements"))


def network_of_rotor_file(content: Mapping[str, Any], split: int) -> tuple[TorsionalNetwork, list[Problem], list[str]]:
    """Return the torsional network of a file, elements that are not understood, and notes.

    Raises
    ------
    ModelError
        values that are no numbers.
    """
    network = TorsionalNetwork("from ROSS")
    refused = list[Problem]()
    without_torsion = 0
    if len(content) > _MOST_ELEMENTS:
        raise ModelError(Problem("elements", "", f"a rotor of more than {_MOST_ELEMENTS} elements"))
    for key, values in content.items():
        if key in _ABOUT_FILE or key.startswith("_"):
            continue
        kind, _, tag = key.partition("_")
        if not isinstance(values, Mapping):
            refused.append(Problem(key, "", "is no element of a rotor"))
        elif kind == "ShaftElement":
            _add_shaft_of_file(network, tag, values, key, split)
        elif kind in ("DiskElement", "GearElement"):
            network.add_inertia(_node(values.get("n"), key), _value(values, "Ip", key), label_of(tag))
        elif kind == "CouplingElement":
            _add_coupling(network, tag, values, key)
        elif kind.endswith(_NO_TORSION):
            without_torsion += 1
        else:
            refused.append(Problem(key, kind, "is no element whose torsion is known"))
    notes = [f"bending is not imported, nor {without_torsion} bearings and masses without torsion"]
    return network, refused, notes


def _node(number: Any, where: str) -> str:
    if isinstance(number, bool) or not isinstance(number, int) or number < 0:
        raise ModelError(Problem(f"{where}: n", str(number)[:40], "must be the number of a node"))
    return f"node_{number}"


def _value(values: Mapping[str, Any], key: str, where: str, default: float | None = None) -> float:
    """A number of an element; ModelError if it is missing or none."""
    value = values.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ModelError(Problem(f"{where}: {key}", str(value)[:40], "must be a number"))
    return float(value)


def _ends(values: Mapping[str, Any], where: str) -> tuple[str, str]:
    first = values.get("n")
    return _node(first, where), _node(first + 1 if isinstance(first, int) else first, where)


def _add_shaft_of_file(network: TorsionalNetwork, tag: str, values: Mapping[str, Any], where: str, split: int) -> None:
    """Add a shaft element by its diameters and its material."""
    material = values.get("material")
    if not isinstance(material, Mapping):
        raise ModelError(Problem(f"{where}: material", str(material)[:40], "must be a table with rho and G_s"))
    length = _value(values, "L", where)
    # mean polar moment of area of both ends
    ends = [[_value(values, f"{which}d{end}", where) for which in "oi"] for end in "lr"]
    area = sum(math.pi * (outer**4 - inner**4) / 32.0 for outer, inner in ends) / 2.0
    if not (length > 0.0 and area > 0.0):
        raise ModelError(Problem(where, "", "a shaft needs a length, and outer diameters beyond the inner ones"))
    _add_shaft(
        network,
        tag,
        _ends(values, where),
        {
            "stiffness": _value(material, "G_s", where) * area / length,
            "inertia": _value(material, "rho", where) * area * length,
            "alpha": _value(values, "alpha", where, 0.0),
            "beta": _value(values, "beta", where, 0.0),
        },
        (where, split),
    )


def _add_shaft(
    network: TorsionalNetwork,
    tag: str,
    ends: tuple[str, str],
    values: Mapping[str, float],
    about: tuple[str, int],
) -> None:
    """Add a shaft with damping alpha M + beta K; about: where it stands, and number of parts."""
    damping = values["beta"] * values["stiffness"]
    law = {"stiffness": values["stiffness"], "damping": damping, "inertia": values["inertia"]}
    before = dict(network.inertia)
    network.add_shaft(label_of(tag), ends, law, *about)
    if values["alpha"]:
        for node, inertia in network.inertia.items():
            more = inertia - before.get(node, 0.0)
            network.drag[node] = network.drag.get(node, 0.0) + values["alpha"] * more


def _add_coupling(network: TorsionalNetwork, tag: str, values: Mapping[str, Any], where: str) -> None:
    """Add a coupling: stiffness and damping about the axis, an inertia at either end."""
    first, second = _ends(values, where)
    law = {"stiffness": _value(values, "kr_z", where), "damping": _value(values, "cr_z", where, 0.0)}
    network.add_inertia(first, _value(values, "Ip_l", where))
    network.add_inertia(second, _value(values, "Ip_r", where))
    network.add_shaft(label_of(tag), (first, second), law, where, 1)


def network_of_rotor(rotor: Any, split: int) -> tuple[TorsionalNetwork, list[Problem], list[str]]:
    """Return the torsional network of a rotor, what is not understood, and notes.

    Raises
    ------
    ModelError
        an element in which torsion and bending are coupled.
    """
    network = TorsionalNetwork("from ROSS")
    refused = list[Problem]()
    if getattr(rotor, "mesh", None) is not None:
        rule = "a pair of gears couples torsion and bending: import each rotor, and add a [[mesh]]"
        refused.append(Problem("mesh", type(rotor).__name__, rule))
    for k, shaft in enumerate(rotor.shaft_elements):
        where = f"shaft_elements[{k}]"
        mass = _uncoupled(shaft.M(), where)
        stiffness = _uncoupled(shaft.K(), where)
        ends = (f"node_{shaft.n_l}", f"node_{shaft.n_r}")
        tag = str(shaft.tag or f"shaft_{k}")
        alpha = float(getattr(shaft, "alpha", 0.0) or 0.0)
        beta = float(getattr(shaft, "beta", 0.0) or 0.0)
        # consistent part I/6 [[2, 1], [1, 2]]; a coupling has its inertia at the ends
        own = 6.0 * mass[0, 1]
        if own:
            values = {"stiffness": stiffness[0, 0], "inertia": own, "alpha": alpha, "beta": beta}
            _add_shaft(network, tag, ends, values, (where, split))
        else:
            network.add_inertia(ends[0], mass[0, 0])
            network.add_inertia(ends[1], mass[1, 1])
            law = {"stiffness": stiffness[0, 0], "damping": float(getattr(shaft, "cr_z", 0.0))}
            network.add_shaft(label_of(tag), ends, law, where, 1)
    for k, disk in enumerate(rotor.disk_elements):
        network.add_inertia(f"node_{disk.n}", float(disk.Ip), label_of(str(disk.tag or f"disk_{k}")))
    return network, refused, ["bending and bearings are not imported"]


def _uncoupled(matrix: Any, where: str) -> np.ndarray:
    """(2, 2) torsional block of an element's matrix; ModelError if it is coupled with the other degrees of freedom."""
    whole = np.asarray(matrix, dtype=float)
    own = [_TORSION, _FAR]
    others = [i for i in range(len(whole)) if i not in own]
    block = whole[np.ix_(own, own)]
    if np.abs(whole[np.ix_(own, others)]).max(initial=0.0) > _COUPLED * np.abs(block).max():
        raise ModelError(Problem(where, "", "couples torsion with bending"))
    return block
