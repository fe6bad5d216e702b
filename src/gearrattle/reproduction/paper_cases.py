"""The paper's cases 1 to 3 under any mean load: half-widths and ratios from its Table 2, the rest inferred or assumed.

Inertias, stiffnesses, damping and radii are inferred from Table 1 (omega = 150 rad/s, R = 50 mm, half-backlash 50 um).
The loads are assumed, because the paper prints none: harmonics 30 x (1, 0.4, 0.25, 0.12, 0.06) in units of
J_1 omega^2 psi_c = 6.75 N m on the flywheel, and a mean of ratio x 202.5 N m on the flywheel. *Rattling*: the output
gear is loose, with a drag torque of 0.5 N m; the hub has a drag torque of 2 % of the mean, and the input gear has the
remaining drag torque. *Loaded*: hub and input gear have 2 % each, and the output gear has the remaining drag torque. At
ratio 0.05 the models are those of examples/paper/case*.toml, except for the start: runs begin in the static
equilibrium, as the paper's counts of steps require.
"""

from __future__ import annotations

from typing import Any

from gearrattle.model import Model

SPEED = 150.0
HALF_GAP = 5e-5
LOOSE_DRAG = 0.5
HUB_SHARE = 0.02
LARGEST_HARMONIC = 202.5

J = {"flywheel": 0.3, "hub": 4.5e-4, "input_gear": 1.05e-2, "output_gear": 1.5e-3}
DRAG = {"flywheel": 1.5e-4, "hub": 1.35e-4, "input_gear": 1.5e-4, "output_gear": 3.75e-5}
STIFFNESS = {"clutch": 1500.0, "spline": 15e3, "gear": 7.2e8}
DAMPING = {"clutch": 0.225, "spline": 0.0075, "gear": 4500.0}
RADIUS = 0.05
_HARMONICS = ((1, 202.5), (2, 81.0), (3, 50.625), (4, 24.3), (5, 12.15))
_CLUTCH = {1: (0.10, 0.25), 2: (0.01, 0.025), 3: (0.001, 0.01)}  # Table 2: alpha, beta
# Table 2 in units of psi_c = 1e-3 rad
_CLUTCH_WIDTH = 0.16
_SPLINE_WIDTH = 0.05867
_ERROR = {"order": 20, "amplitude": 5e-6, "phase": 0.0}  # Table 2: 0.1 half-gaps; sec. 9: order 20


def load_case(case: int, ratio: float = 0.05, *, loaded: bool = False) -> Model:
    """Return a case of Table 2 under a mean load, ``ratio`` times the largest harmonic: 0.05 is the paper's light load,
    0.5 its moderate one.
    """
    # means and drag torques that balance
    mean = _decimal(ratio * LARGEST_HARMONIC)
    share = _decimal(HUB_SHARE * mean)
    drags = {"hub": share, "input_gear": share} if loaded else {"hub": share, "output_gear": LOOSE_DRAG}
    bearer = "output_gear" if loaded else "input_gear"
    rest = _decimal(sum(drags.values()) - mean)
    # inertias, and harmonics on the flywheel
    inertias = [{"name": name, "J": inertia, "drag": DRAG[name]} for name, inertia in J.items()]
    for table in inertias:
        if table["name"] in drags:
            table["drag_torque"] = drags[str(table["name"])]
    harmonics = [{"order": order, "amplitude": amplitude} for order, amplitude in _HARMONICS]
    kind = f"a {'loaded' if loaded else 'loose'} output gear, mean {ratio:g}"
    # the case as a model
    return Model.from_tables(
        {
            "schema": 1,
            "name": f"Padmanabhan et al. (1995), case {case}: {kind}",
            "inertia": inertias,
            "coupling": [_clutch(case), _spline(case)],
            "mesh": [_mesh(case)],
            "excitation": {"speed": SPEED},
            "torque": [{"on": "flywheel", "mean": mean, "harmonics": harmonics}, {"on": bearer, "mean": rest}],
            "simulation": {"initial": "static"},
        }
    )


def _decimal(value: float) -> float:
    """Round to the short decimal that was meant."""
    return round(value, 9)


def _element(name: str, between: tuple[str, str]) -> dict[str, Any]:
    return {"name": name, "between": list(between), "stiffness": STIFFNESS[name], "damping": DAMPING[name]}


def _clutch(case: int) -> dict[str, Any]:
    alpha, beta = _CLUTCH[case]
    ratios = {"clearance": _CLUTCH_WIDTH, "stiffness_ratio": alpha, "damping_ratio": beta}
    return {**_element("clutch", ("flywheel", "hub")), **ratios}


def _spline(case: int) -> dict[str, Any]:
    """Linear in case 1."""
    return {**_element("spline", ("hub", "input_gear")), **({} if case == 1 else {"clearance": _SPLINE_WIDTH})}


def _mesh(case: int) -> dict[str, Any]:
    error = {} if case == 1 else {"transmission_error": [_ERROR]}
    gears = _element("gear", ("input_gear", "output_gear"))
    return {**gears, "radii": [RADIUS, RADIUS], "backlash": 2.0 * HALF_GAP, **error}
