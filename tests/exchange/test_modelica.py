"""Modelica text: round trips of the system, meaning of the library's components, and what is not understood."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from tests.exchange.drivelines import linear, tree
from tests.exchange.test_right_hand_side import model_of


def same_system(a: gr.Model, b: gr.Model) -> None:
    """Two models have the same equations of motion."""
    one, other = assemble(a).system, assemble(b).system
    order = [next(j for j, body in enumerate(b.inertias) if body.name == name) for name in names_of(a)]
    np.testing.assert_allclose(one.inertia, other.inertia[order], rtol=1e-14)
    np.testing.assert_allclose(one.drag, other.drag[order], rtol=1e-14)
    elements = {element.name: k for k, element in enumerate(b.elements)}
    for k, element in enumerate(a.elements):
        j = elements[element.name.replace("-", "_")]
        # the law over the deflection of a body at the first arm: a mesh may have other radii of the same ratio
        first = np.flatnonzero(one.rows[k])[0]
        scale = one.rows[k, first] / other.rows[j, order[first]]
        np.testing.assert_allclose(one.rows[k], scale * other.rows[j, order], rtol=1e-13)
        ours, theirs = one.laws[k], other.laws[j]
        np.testing.assert_allclose(ours.corners, scale * theirs.corners, rtol=1e-13)
        np.testing.assert_allclose(ours.stiffness * scale**2, theirs.stiffness, rtol=1e-13)
        np.testing.assert_allclose(ours.damping * scale**2, theirs.damping, rtol=1e-13)
        np.testing.assert_allclose(ours.offset * scale, theirs.offset, rtol=1e-13, atol=1e-13)
        assert (element.contact_damping == "clipped") <= (b.elements[j].contact_damping == "clipped")
        np.testing.assert_allclose(one.inputs.error_sine[k], scale * other.inputs.error_sine[j], rtol=1e-12, atol=1e-20)
    np.testing.assert_allclose(one.inputs.mean, other.inputs.mean[order], rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(one.inputs.torque_sine, other.inputs.torque_sine[order], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(one.inputs.torque_cosine, other.inputs.torque_cosine[order], rtol=1e-12, atol=1e-12)
    assert one.inputs.period == pytest.approx(other.inputs.period, rel=1e-14)


def names_of(model: gr.Model) -> list[str]:
    moving = {motion.on for motion in model.motions}
    return [body.name for body in model.inertias if body.name not in moving]


@pytest.mark.parametrize(
    "name",
    ["case3", "eight_dof", "manual_transmission", "driveline_lash", "clutch_staged"],
)
def test_the_system_survives_the_way_there_and_back(name: str, tmp_path: Path) -> None:
    model = model_of(name)
    path = gr.export_model(model, tmp_path / "a.mo").path
    back = gr.import_model(path)
    assert not back.left_out
    same_system(model, back.model)


def test_128_bodies_and_clipped_damping(tmp_path: Path) -> None:
    same_system(tree(), gr.import_model(gr.export_model(tree(), tmp_path / "a.mo").path).model)
    model = tree(12)
    clipped = model.with_({f"mesh.{mesh.name}.contact_damping": "clipped" for mesh in model.meshes if mesh.backlash})
    written = gr.export_model(clipped, tmp_path / "b.mo").path
    text = written.read_text()
    assert "ElastoBacklash" in text
    assert "PiecewiseElement" not in text
    same_system(clipped, gr.import_model(written).model)
    same_system(linear(tree(20)), gr.import_model(gr.export_model(linear(tree(20)), tmp_path / "c.mo").path).model)


LIBRARY = """
within Modelica.Mechanics.Rotational.Examples;
model First "a drive train"
  extends Modelica.Icons.Example;
  import SI = Modelica.Units.SI;
  import Modelica.Mechanics.Rotational.Components.SpringDamper;
  parameter SI.Torque amplitude = 10 "Amplitude of driving torque";
  parameter SI.Frequency f(displayUnit = "1/min") = 2*2.5 "Frequency";
  parameter Real ratio = 2*(3 + 2)/2;
  parameter Real k(unit = "N.m/rad") = 1.e4;
  Rotational.Components.Fixed fixed annotation(Placement(transformation(extent = {{38, -60}, {54, -44}})));
  Rotational.Sources.Torque torque(useSupport = false);
  Rotational.Components.Inertia inertia1(J = 1, phi(start = 0, fixed = true)) "motor";
  Components.IdealGear idealGear(ratio = ratio, useSupport = false);
  Modelica.Mechanics.Rotational.Components.Inertia inertia2(J = 2), inertia3(J = 0.5);
  Rotational.Components.Spring spring(c = k, phi_rel0 = 0.01);
  SpringDamper soft(c = k/10, d = 2);
  Rotational.Components.ElastoBacklash lash(c = 2*k, d = 3, b = Modelica.Constants.pi/100);
  Rotational.Components.Damper damper(d = 10);
  Modelica.Blocks.Sources.Sine sine(amplitude = amplitude, f = f, phase = Modelica.Units.Conversions.from_deg(30));
  Components.Inertia load(J = 3);
equation
  connect(inertia1.flange_b, idealGear.flange_a);
  connect(idealGear.flange_b, inertia2.flange_a); // rigid
  connect(inertia2.flange_b, spring.flange_a);
  connect(spring.flange_b, inertia3.flange_a);
  connect(inertia3.flange_b, lash.flange_a);
  connect(lash.flange_b, load.flange_a);
  connect(inertia3.flange_b, soft.flange_a);
  connect(soft.flange_b, fixed.flange);
  connect(damper.flange_a, inertia2.flange_b);
  connect(damper.flange_b, fixed.flange);
  connect(sine.y, torque.tau);
  connect(torque.flange, inertia1.flange_a);
  annotation(experiment(StopTime = 1.0));
end First;
"""


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "a.mo"
    path.write_text(text)
    return path


def test_components_of_the_library_mean_what_it_says(tmp_path: Path) -> None:
    imported = gr.import_model(write(tmp_path, LIBRARY.replace(", phi_rel0 = 0.01", "")))
    model = imported.model
    # inertia1 turns five times as fast as inertia2, and is kept; what is at inertia2 is a mesh of 1/5 : 1
    assert [body.name for body in model.inertias] == ["inertia1", "inertia3", "load"]
    assert pytest.approx(1 + 2 / 25) == model["inertia.inertia1"].J
    assert model["inertia.inertia1"].drag == pytest.approx(10 / 25)
    assert model["coupling.soft"].between == ("inertia3", "ground")
    assert (model["coupling.soft"].stiffness, model["coupling.soft"].damping) == (1e3, 2.0)
    lash = model["coupling.lash"]
    assert (lash.stiffness, lash.damping, lash.contact_damping) == (2e4, 3.0, "clipped")
    assert lash.clearance == pytest.approx(np.pi / 200)
    assert model.torques[0].harmonics[0].amplitude == pytest.approx(10.0)
    assert model.torques[0].harmonics[0].phase == pytest.approx(np.pi / 6)
    assert model.excitation.omega == pytest.approx(2 * np.pi * 5)
    assert "first sine" in " ".join(imported.notes)
    assert [problem.value[:7] for problem in imported.left_out] == ["extends"]


def test_a_preload_at_different_speeds_is_refused_and_at_one_speed_kept(tmp_path: Path) -> None:
    with pytest.raises(gr.ModelError, match="acts between different speeds"):
        gr.import_model(write(tmp_path, LIBRARY))
    text = LIBRARY.replace("ratio = ratio", "ratio = 1")
    model = gr.import_model(write(tmp_path, text)).model
    assert model["coupling.spring"].preload == pytest.approx(1e4 * 0.01)
    # torque c (phi_b - phi_a - phi_rel0) is zero where phi_b is ahead by phi_rel0
    assert assemble(model).system.laws[0].elastic(-0.01) == pytest.approx(0.0, abs=1e-12)


def test_a_gear_that_turns_the_sense_and_a_planetary_set(tmp_path: Path) -> None:
    text = """
    model P
      import Modelica.Mechanics.Rotational.Components.*;
      Inertia motor(J = 1); Inertia wheel(J = 4); Inertia pinion(J = 0.1);
      IdealPlanetary set(ratio = 100/50); Fixed fixed; IdealGear back(ratio = -2);
      Spring shaft(c = 1e4); SpringDamper end(c = 2e4, d = 1); Inertia last(J = 2);
      Modelica.Mechanics.Rotational.Sources.ConstantTorque load(tau_constant = -7);
    equation
      connect(motor.flange_b, set.sun); connect(set.carrier, wheel.flange_a); connect(set.ring, fixed.flange);
      connect(wheel.flange_b, shaft.flange_a); connect(shaft.flange_b, pinion.flange_a);
      connect(pinion.flange_b, back.flange_a); connect(back.flange_b, end.flange_a);
      connect(end.flange_b, last.flange_a); connect(load.flange, last.flange_b);
    end P;
    """.replace("end(c", "tail(c").replace("end.flange", "tail.flange")
    model = gr.import_model(write(tmp_path, text), speed="600 rpm").model
    assert [body.name for body in model.inertias] == ["motor", "pinion", "last"]
    assert pytest.approx(1 + 4 / 9) == model["inertia.motor"].J
    # by hand: motor = 3 wheel; pinion = -2 (end of the gear): energies in motor, pinion, last
    M = np.diag([1 + 4 / 9, 0.1, 2.0])
    a, b = np.array([1 / 3, -1, 0]), np.array([0, -1 / 2, -1])
    K = 1e4 * np.outer(a, a) + 2e4 * np.outer(b, b)
    omega = np.sqrt(np.abs(np.linalg.eigvals(np.linalg.solve(M, K))))
    np.testing.assert_allclose(gr.modes(model).frequencies[1:], np.sort(omega)[1:], rtol=1e-12)
    assert [(torque.on, abs(torque.mean)) for torque in model.torques] == [("last", 7.0)]
    assert model.torques[0].mean == 7.0  # its angle counts in the opposite sense
    assert model.excitation.omega == pytest.approx(20 * np.pi)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("Components.Inertia load(J = 3)", "Components.Clutch load(fn_max = 3)", "no component that a model has"),
        ("Components.Inertia load(J = 3)", "Other.Inertia load(J = 3)", "no component that a model has"),
        ("c = 2*k", "c = 2*unknown", "no parameter with a value"),
        ("c = 2*k", "c = 2*k*k[3]", "no part of a constant"),
        ("= 2*(3 + 2)/2", "= 2*k2", "no parameter with a value"),
        ("b = Modelica", "b = Modelica.Constants.pi, phi_rel0 = 0.1 + 0*Modelica", "not about zero"),
        ("  connect(sine.y, torque.tau);", "  torque.tau = 3*sin(time);", "is not understood"),
        ("J = 0.5", "J = 0.5, bearing = true", "this modifier is not understood"),
        ("amplitude = amplitude", "amplitude = amplitude, startTime = 2", "begins later"),
        ("ratio = ratio", "ratio = 0", "other than zero"),
        ("lash.flange_b, load", "lash.flange_c, load", "no connector that is known"),
    ],
)
def test_what_is_not_understood_is_listed_with_its_line(old: str, new: str, words: str, tmp_path: Path) -> None:
    assert old in LIBRARY
    text = LIBRARY.replace(old, new, 1)
    # the line of the component that uses the parameter or the source
    used = {"= 2*k2": "idealGear(ratio", "amplitude = amplitude, startTime = 2": "Torque torque("}.get(new, new)
    line = text[: text.index(used)].count("\n") + 1
    path = write(tmp_path, text)
    with pytest.raises(gr.ModelError) as caught:
        gr.import_model(path)
    problems = [problem for problem in caught.value.problems if words in problem.rule]
    assert problems
    assert problems[0].place == f"{path}: line {line}"


def test_a_part_is_left_out_only_on_demand_and_listed(tmp_path: Path) -> None:
    text = LIBRARY.replace("Components.Inertia load(J = 3)", "Components.Clutch load(fn_max = 3)")
    text = text.replace(", phi_rel0 = 0.01", "")
    text = text.replace("equation\n", "  Modelica.Mechanics.Rotational.Sensors.SpeedSensor sensor;\nequation\n", 1)
    text = text.replace("equation\n", "equation\n  connect(sensor.flange, inertia1.flange_b);\n", 1)
    path = write(tmp_path, text.replace("  connect(lash.flange_b, load.flange_a);\n", ""))
    with pytest.raises(gr.ModelError, match="Clutch"):
        gr.import_model(path)
    with pytest.raises(gr.ModelError, match="has no inertia"):
        gr.import_model(path, partial=True)
    path = write(tmp_path, text.replace("lash.flange_b, load.flange_a", "lash.flange_b, fixed.flange"))
    imported = gr.import_model(path, partial=True)
    values = " ".join(problem.value for problem in imported.left_out)
    assert "Clutch load" in values
    assert "SpeedSensor sensor" in values
    assert "connect(sensor.flange" in values
    assert "left out: line" in imported.to_toml()
    assert gr.loads(imported.to_toml()).inertias == imported.model.inertias


@pytest.mark.parametrize(
    "text",
    [
        "",
        "model",
        "model A",
        "model A Real",
        "package P end P;",
        "model A\n  Real x = $;\nend A;",
        "model A equation connect(a.b); end A;",
        "model A parameter Real a = " + "(" * 500 + "1" + ")" * 500 + "; end A;",
        "model A Modelica.Mechanics.Rotational.Components.Inertia i(J = a); parameter Real a = b, b = a; end A;",
        "model A Modelica.Mechanics.Rotational.Components.Inertia i(J = 9^9^9^9); end A;",
        "model A Modelica.Mechanics.Rotational.Components.Inertia i(J = 10^999); end A;",
        "model A Modelica.Mechanics.Rotational.Components.Inertia i(J = (-8)^0.5); end A;",
        "model A Modelica.Mechanics.Rotational.Components.Inertia i(J = 1/0); end A;",
        "model A " + "(" * 90_000,
        "model A Modelica.Mechanics.Rotational.Components.Inertia i" + "(a" * 400 + ")" * 400 + "; end A;",
        "model A " + "".join(f"parameter Real a{k} = a{k + 1};" for k in range(500)) + " parameter Real a500 = 1; "
        "Modelica.Mechanics.Rotational.Components.Inertia i(J = a0); end A;",
    ],
)
def test_hostile_text_ends_in_one_error(text: str, tmp_path: Path) -> None:
    with pytest.raises(gr.ModelError):
        gr.import_model(write(tmp_path, text))


def test_what_modelica_does_not_hold_is_refused(tmp_path: Path) -> None:
    for name, words in (("clutch_friction", "friction"), ("bearing_clearance", "fixed axes"), ("run_up", "sweep")):
        with pytest.raises(gr.ModelError, match=words):
            gr.export_model(gr.example(name), tmp_path / "a.mo")


def test_a_planetary_set_goes_out_and_does_not_come_back(tmp_path: Path) -> None:
    path = gr.export_model(gr.example("planetary_set"), tmp_path / "a.mo").path
    assert path.read_text().count("PiecewiseElement") > 4
    with pytest.raises(gr.ModelError, match=r"\[\[planetary\]\]"):
        gr.import_model(path)
