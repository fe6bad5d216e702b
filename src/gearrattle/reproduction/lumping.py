"""Sec. 3: eight inertias lumped to four by what moves together below 75 Hz.

Inertias, stiffnesses and ratios of the eight-inertia model are inferred by least squares from the frequencies and
shapes the paper prints (examples/paper/eight_dof.toml is the same model with loads and clearances). No load is needed.

Takes nothing; gives a row.
"""

from __future__ import annotations

from gearrattle.calls.reduce import reduce
from gearrattle.calls.statics import modes
from gearrattle.model import Model
from gearrattle.reproduction.record import DIFFERS, REPRODUCED, Row, row

PRINTED = (346.0, 7937.0, 48091.0)
BAND = "75 Hz"
_J = (0.3612, 5.2193e-4, 1.4603e-3, 3.9481e-4, 3.481e-4, 2.6158e-4, 3.9368e-4, 2.1168e-4)
_COUPLINGS = (("clutch", 1, 2, 430.77), ("spline", 2, 3, 27803.0), ("shaft_35", 3, 5, 95795.0))
_SHAFT = ("shaft_57", 5, 7, 82231.0)
_MESHES = (("mesh_34", 3, 4, 7.9521e5), ("mesh_56", 5, 6, 3.1347e5), ("mesh_78", 7, 8, 6.3723e5))
_RADIUS = 0.05
_KEPT = ("clutch", "spline", "mesh_34")
"""What the paper's four-inertia model keeps."""


def eight_inertias() -> Model:
    """The transmission of Fig. 2(a), its clearances closed."""
    couplings = [
        {"name": name, "between": [f"body_{a}", f"body_{b}"], "stiffness": stiffness}
        for name, a, b, stiffness in (*_COUPLINGS, _SHAFT)
    ]
    meshes = [
        {"name": name, "between": [f"body_{a}", f"body_{b}"], "stiffness": stiffness / _RADIUS**2,
         "radii": [_RADIUS, _RADIUS]}
        for name, a, b, stiffness in _MESHES
    ]  # fmt: skip
    return Model.from_tables(
        {
            "schema": 1,
            "name": "Padmanabhan et al. (1995), eight inertias",
            "inertia": [{"name": f"body_{i}", "J": inertia} for i, inertia in enumerate(_J, start=1)],
            "coupling": couplings,
            "mesh": meshes,
            "excitation": {"speed": 150.0},
        }
    )


def lumping() -> Row:
    """Compare the lumped model's frequencies with those printed."""
    found = reduce(eight_inertias(), BAND, keep=list(_KEPT))
    frequencies = sorted(float(value) for value in modes(found.model).frequencies)
    elastic = [value for value in frequencies if value > 1e-3 * frequencies[-1]]
    same = len(elastic) == len(PRINTED) and all(abs(a - b) < 1.0 for a, b in zip(elastic, PRINTED, strict=True))
    told = ", ".join(f"{value:.0f}" for value in elastic)
    return row(
        f"Sec. 3, lumping eight inertias below {BAND}", "346, 7937, 48091 rad/s",
        f"{told} rad/s; largest frequency error in the band {100.0 * float(found.error.frequency):.2g} %",
        REPRODUCED if same else DIFFERS,
        "" if same else "the model behind the printed numbers is inferred",
        **{f"frequency_{i}": value for i, value in enumerate(elastic, start=1)},
    )  # fmt: skip
