"""Dimensionless and back: tables, motions, and refusals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly.scaled import KINDS, dimensional
from gearrattle.assembly.written_out import written_out
from gearrattle.model import ASSUMED_ENERGY, Model
from gearrattle.model.ramps import Ramp
from gearrattle.model.value_kinds import Quantity

EXAMPLES = Path(__file__).parents[2] / "examples"
FILES = sorted(path for path in EXAMPLES.rglob("*.toml") if path.parent.name not in ("measured", "studies", "remedies"))
PLAIN = {"phase", "frequency", "pressure_angle", "centre_line", "direction"}
"""Angles of waves and of directions stay in radians; a frequency becomes a speed."""


def close(a: Any, b: Any) -> bool:
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(close(a[k], b[k]) for k in a)
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(map(close, a, b))
    return a == b if isinstance(a, str | int) or a is None else abs(a - b) <= 4e-16 * max(abs(a), abs(b)) * 4


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
@pytest.mark.parametrize("scales", [{}, {"frequency": 77.7, "length": 3.3e-5, "radius": 0.123}], ids=["own", "given"])
def test_there_and_back_to_rounding(path: Path, scales: dict[str, float]) -> None:
    model = gr.load(path)
    if model.units != "SI":
        pytest.skip("has no dimensions")
    if model.motions:
        with pytest.raises(gr.ModelError, match="needs every inertia free"):
            gr.nondimensionalize(model, **scales)
        return
    scaled = gr.nondimensionalize(model, **scales)
    assert scaled.model.units == "dimensionless"
    swept = model.excitation.sweep is not None
    there = {**written_out(model, at_speed=not swept), "units": "SI"}
    if not swept:
        there["excitation"] = {"speed": model.excitation.omega, **model.excitation.stated("duration")}
    # the threshold that is assumed in SI is written where there are no units
    there.setdefault("criteria", {"negligible": {"impact_energy": ASSUMED_ENERGY}})
    assert close(Model.from_tables(there).to_tables(), dimensional(scaled.model, scaled.scales).to_tables())


def quantities(table: Any, path: tuple[str, ...] = ()) -> set[tuple[str, ...]]:
    """Every dimensional key of the model file, from the annotations."""
    actual = set()
    for name, field in table.model_fields.items():
        here = (*path, field.alias or name)
        marks = [m for m in field.metadata if isinstance(m, Quantity)]
        text = repr(field.annotation)
        if marks or "Quantity" in text:
            actual.add(here)
    return actual


def leaves(kinds: dict[str, Any], path: tuple[str, ...] = ()) -> dict[tuple[str, ...], str]:
    actual: dict[tuple[str, ...], str] = {}
    for key, kind in kinds.items():
        actual |= leaves(kind, (*path, key)) if isinstance(kind, dict) else {(*path, key): kind}
    return actual


def test_every_dimensional_key_has_a_kind() -> None:
    from gearrattle.model import Coupling, Excitation, Harmonic, Inertia, Initial, Mesh, Simulation, Stage, Torque
    from gearrattle.model.components import Bearing
    from gearrattle.model.gravity import Gravity

    tables = {
        ("inertia",): Inertia,
        ("coupling",): Coupling,
        ("coupling", "stages"): Stage,
        ("mesh",): Mesh,
        ("bearing",): Bearing,
        ("gravity",): Gravity,
        ("mesh", "transmission_error"): Harmonic,
        ("torque",): Torque,
        ("torque", "harmonics"): Harmonic,
        ("torque", "ramps"): Ramp,
        ("excitation",): Excitation,
        ("simulation",): Simulation,
        ("simulation", "initial"): Initial,
    }
    wanted = {key for path, table in tables.items() for key in quantities(table, path) if key[-1] not in PLAIN}
    assert wanted
    assert wanted <= set(leaves(KINDS))
    assert set(leaves(KINDS).values()) <= set(gr.nondimensionalize(gr.load(FILES[-1])).scales.units())


def test_an_event_restored_is_that_of_the_original() -> None:
    model = gr.example("tip_in")
    scaled = gr.nondimensionalize(model)
    back = scaled.restore(gr.simulate(scaled.model))
    np.testing.assert_allclose(back.events["time"], gr.simulate(model).events["time"], rtol=1e-9)


def test_a_run_restored_is_the_run_of_the_original() -> None:
    model = gr.load(EXAMPLES / "paper" / "case1_loaded.toml")
    scaled = gr.nondimensionalize(model)
    plain, back = gr.simulate(model, cycles=6), scaled.restore(gr.simulate(scaled.model, cycles=6))
    ours, theirs = plain.trajectory, back.trajectory
    assert len(ours.events) == len(theirs.events) > 10
    assert ours.time == pytest.approx(theirs.time, rel=1e-13)
    assert ours.events.time == pytest.approx(theirs.events.time, rel=1e-10)
    for name in ("angle", "velocity", "acceleration", "deflection", "force", "element_torque"):
        a, b = getattr(ours, name), getattr(theirs, name)
        assert np.abs(a - b).max() <= 1e-8 * np.abs(a).max(), name
    for name in ("velocity", "force_integral"):
        a, b = getattr(ours.events, name), getattr(theirs.events, name)
        assert np.abs(a - b).max() <= 1e-8 * np.abs(a).max(), name
    assert theirs.energy is not None
    assert theirs.energy.stored == pytest.approx(ours.energy.stored, rel=1e-8)
    assert back.cost.average_step == pytest.approx(plain.cost.average_step, rel=1e-6)
    assert gr.criteria(back).verdict == gr.criteria(plain).verdict
    assert back.model.units == "SI"


def test_refusals() -> None:
    model = gr.load(EXAMPLES / "paper" / "case1.toml")
    scaled = gr.nondimensionalize(model)
    with pytest.raises(gr.ModelError, match="no dimensions"):
        gr.nondimensionalize(scaled.model)
    with pytest.raises(gr.ModelError, match="length: found -1; must be positive"):
        gr.nondimensionalize(model, length=-1.0)
    with pytest.raises(gr.ModelError, match="a run of this dimensionless model"):
        scaled.restore(gr.simulate(model, cycles=1))


def test_contact_ratios_may_multiply_the_damping_too() -> None:
    """Two bodies: s^2 + Gamma c s / m + Gamma k / m = 0, m the reduced inertia."""
    train = """
    schema = 1
    inertia = [ { name = "a", J = 2.0 }, { name = "b", J = 3.0 } ]
    coupling = [ { name = "s", between = ["a", "b"], stiffness = 600.0, damping = 2.4, clearance = 0.1 } ]
    excitation = { speed = 1.0 }
    """
    reduced, ratio = 2.0 * 3.0 / 5.0, 0.25
    for both, factor in ((False, 1.0), (True, ratio)):
        actual = gr.stiffness(gr.loads(train), {"s": ratio}, with_damping=both).eigenvalues
        roots = np.roots([1.0, factor * 2.4 / reduced, ratio * 600.0 / reduced])
        np.testing.assert_allclose(np.sort_complex(actual), np.sort_complex(roots), rtol=1e-12)
        damped = gr.modes(gr.loads(train), {"s": ratio}, with_damping=both).damping_ratios[1]
        assert damped == pytest.approx(-roots[0].real / abs(roots[0]), rel=1e-12)


def _last_bits(table: Any, random: np.random.Generator, key: str = "") -> Any:
    """Return tables whose numbers are off by no more than the last bit, as those of any change of units are."""
    if isinstance(table, dict):
        return {name: _last_bits(value, random, name) for name, value in table.items()}
    if isinstance(table, list | tuple):
        return [_last_bits(value, random, key) for value in table]
    exact = not isinstance(table, float) or key in ("order", "share", "time", "angle")
    return table if exact else table * (1.0 + 2.0**-52 * int(random.integers(-1, 2)))


_KEPT = ("schema", "name", "units", "excitation", "simulation")
_QUANTITIES = ("angle", "velocity", "acceleration", "deflection", "force", "element_torque")


def _apart(a: gr.Run, b: gr.Run) -> dict[str, float]:
    """Return the largest deviation of every quantity, as a share of the largest value of its body or element."""
    actual = {}
    for name in _QUANTITIES:
        one, other = getattr(a.trajectory, name), getattr(b.trajectory, name)
        size = np.abs(one).max(axis=0, initial=0.0)
        actual[name] = float((np.abs(one - other) / np.where(size > 0.0, size, 1.0)).max(initial=0.0))
    return actual


@pytest.mark.parametrize(
    "name", ["clutch_friction", "driveline_lash", "dual_mass_flywheel", "alternating_mesh", "case1", "case2_loaded"]
)
def test_a_motion_comes_back_to_what_the_last_bits_of_its_parameters_leave(name: str) -> None:
    """Scaling rounds every parameter once. What that does to a motion is no error of the way back."""
    model = gr.load(next(path for path in FILES if path.stem == name))
    settings = {"cycles": 1, "discard": 0, "samples_per_cycle": 64, "audit": False}
    run, scaled = gr.simulate(model, **settings), gr.nondimensionalize(model)
    back = _apart(run, scaled.restore(gr.simulate(scaled.model, **settings)))
    random, tables = np.random.default_rng(3), model.to_tables()
    others = []
    for _ in range(6):
        changed = {key: value if key in _KEPT else _last_bits(value, random) for key, value in tables.items()}
        others.append(_apart(run, gr.simulate(Model.from_tables(changed), **settings)))
    for quantity in _QUANTITIES:
        assert back[quantity] <= 1e-14 + 10.0 * max(other[quantity] for other in others), quantity


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_model_without_dimensions_has_the_coefficients_of_its_original(path: Path) -> None:
    """Each coefficient is a quotient of like quantities, so scaling again with scales of one changes none of them."""
    model = gr.load(path)
    if model.units != "SI" or model.motions:
        pytest.skip("has no dimensions, or prescribed motions")
    scaled = gr.nondimensionalize(model)
    tables = {**scaled.model.to_tables(), "units": "SI"}
    excitation = tables["excitation"]
    tables["excitation"] = {"speed" if key == "frequency" else key: value for key, value in excitation.items()}
    again = gr.nondimensionalize(Model.from_tables(tables), frequency=1.0, length=1.0, radius=1.0)
    assert scaled.coefficients.keys() == again.coefficients.keys()
    for name, value in scaled.coefficients.items():
        assert again.coefficients[name] == pytest.approx(value, rel=1e-12), name
