"""V8, V9 and the eight-inertia transmission: published natural frequencies."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

import gearrattle as gr
from tests.architecture.places import EXAMPLES
from tests.oracles.driveline import Body, Coupling, Driveline, Mesh


def hertz(model: Driveline) -> np.ndarray:
    return np.asarray(gr.modes(gr.loads(model.toml())).frequencies) / (2 * pi)


def geared(stiffness: str) -> Driveline:
    """V8: motor and one rotor on the first gear's shaft, the other rotor on the second gear's (Friswell et al.)."""
    bodies = (
        Body("motor", "400e-6"),
        Body("gear1", "25e-6"),
        Body("gear2", "25e-6"),
        Body("rotor1", "700e-6"),
        Body("rotor2", "700e-6"),
    )
    shafts = (
        Coupling("motor_shaft", ("motor", "gear1"), "1e4"),
        Coupling("rotor_shaft1", ("gear1", "rotor1"), "5e3"),
        Coupling("rotor_shaft2", ("gear2", "rotor2"), "5e3"),
    )
    mesh = Mesh("mesh", ("gear1", "gear2"), ("1.0", "1.0"), stiffness)
    return Driveline("geared rotors", bodies, shafts, (mesh,), speed="100")


@pytest.mark.parametrize("stiffness", ["1e10", "1e12"])
def test_v8_geared_rotors(stiffness):
    actual = hertz(geared(stiffness))
    assert actual[0] == pytest.approx(0, abs=1e-3)
    assert actual[1:4] == pytest.approx([425.4, 634.1, 3247.2], abs=0.06)
    assert actual[4] > 1e6


def test_v9_chain():
    bodies = tuple(Body(f"d{i}", J) for i, J in enumerate(["3.5e-3", "3.5e-3", "3.5e-3", "0.15", "0.05"]))
    shafts = tuple(Coupling(f"s{i}", (f"d{i}", f"d{i + 1}"), k) for i, k in enumerate(["12e3", "12e3", "14e3", "10e3"]))
    actual = hertz(Driveline("chain", bodies, shafts, speed="100"))
    assert actual[0] == pytest.approx(0, abs=1e-4)
    assert actual[1:] == pytest.approx([81.21, 141.21, 378.95, 536.36], abs=0.006)


def test_eight_inertia_transmission():
    J = ["0.3612", "5.2193e-4", "1.4603e-3", "3.9481e-4", "3.481e-4", "2.6158e-4", "3.9368e-4", "2.1168e-4"]
    bodies = tuple(Body(f"I{i}", x) for i, x in enumerate(J, 1))
    shafts = tuple(
        Coupling(f"K{a}{b}", (f"I{a}", f"I{b}"), k)
        for a, b, k in [(1, 2, "430.77"), (2, 3, "27803"), (3, 5, "95795"), (5, 7, "82231")]
    )
    meshes = tuple(
        Mesh(f"K{a}{b}", (f"I{a}", f"I{b}"), ("1.0", "1.0"), k)
        for a, b, k in [(3, 4, "7.9521e5"), (5, 6, "3.1347e5"), (7, 8, "6.3723e5")]
    )
    modes = gr.modes(gr.loads(Driveline("eight", bodies, shafts, meshes, speed="150").toml()))
    assert modes.frequencies[0] == pytest.approx(0, abs=1e-2)
    printed = [346, 7412, 10134, 18526, 48442, 50869, 68632]
    assert modes.frequencies[1:] == pytest.approx(printed, rel=2e-3 / 10, abs=0.5)
    psi2, psi3 = modes.shapes[:, 1], modes.shapes[:, 2]
    assert psi2 / psi2[3] == pytest.approx([-0.01, 0.99, 1, 1, 1, 1, 1, 1], abs=0.0051)
    assert psi3 / psi3[1] == pytest.approx([0, 1, -0.02, -0.02, -0.29, -0.31, -0.50, -0.50], abs=0.0051)


def test_the_paper_s_example_file_has_the_printed_frequencies():
    """Padmanabhan et al. 1995, sec. 3, on the file a user runs; and its modes are where the paper says."""
    modes = gr.modes(gr.load(EXAMPLES / "paper" / "eight_dof.toml"))
    printed = [0, 346, 7412, 10134, 18526, 48442, 50869, 68632]
    assert modes.frequencies == pytest.approx(printed, rel=1e-5, abs=0.5)
    assert [next(iter(modes.works_in(mode))) for mode in (1, 2)] == ["clutch", "spline"]
    assert [next(iter(modes.works_in(mode))) for mode in (5, 6, 7)] == ["mesh_56", "mesh_34", "mesh_78"]
