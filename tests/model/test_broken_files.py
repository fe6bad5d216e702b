"""Broken model files: each is refused with the line, the key and words a person can act on."""

from __future__ import annotations

import re
from typing import NamedTuple

import pytest

from gearrattle.errors import ModelError
from gearrattle.model import loads

SOUND = """\
schema = 1
name = "sound"
units = "SI"

[[inertia]]
name = "flywheel"
J = "0.3 kg*m^2"
drag = 1.5e-4

[[inertia]]
name = "hub"
J = 4.5e-4
drag_torque = "0.1 N*m"

[[coupling]]
name = "clutch"
between = ["flywheel", "hub"]
stiffness = "1500 N*m/rad"
damping = "0.225 N*m*s/rad"
clearance = "0.16 rad"
stiffness_ratio = 0.1

[[coupling]]
name = "damper"
between = ["hub", "ground"]
stages = [
  { stiffness = "30 N*m/rad", until = "4 deg", damping = 0.02 },
  { stiffness = 600, until = "12 deg" },
  { stiffness = "5 kN*m/rad" },
]

[[mesh]]
name = "gear"
between = ["flywheel", "hub"]
radii = ["50 mm", "50 mm"]
stiffness = "7.2e8 N/m"
damping = "4500 N*s/m"
backlash = "0.1 mm"
transmission_error = [ { order = 20, amplitude = "5 um", phase = "0 deg" } ]

[excitation]
speed = "1500 rpm"

[[torque]]
on = "flywheel"
mean = "10 N*m"
harmonics = [
  { order = 1, amplitude = "202 N*m" },
  { order = 2, amplitude = "81 N*m", phase = "30 deg" },
]

[simulation]
algorithm = "exact"
cycles = 20
discard = 10
step = "20 us"
"""


class Broken(NamedTuple):
    """One change to the sound file, and what the only message about it must say."""

    name: str
    old: str
    new: str
    line: int
    key: str
    words: tuple[str, ...]


CASES = [
    # units
    Broken("wrong dimension", '"0.3 kg*m^2"', '"0.3 kg*m"', 7, "inertia.flywheel.J", ('"0.3 kg*m"', "kg*m^2")),
    Broken("joule inertia", '"0.3 kg*m^2"', '"0.3 J*s^2"', 7, "inertia.flywheel.J", ("J is a unit of energy",)),
    Broken("inertia with angle", '"0.3 kg*m^2"', '"1 kg*m^2/rad"', 7, "inertia.flywheel.J", ("not name an angle",)),
    Broken("power without caret", '"0.3 kg*m^2"', '"1 kg*m2"', 7, "inertia.flywheel.J", ("m2", "kg*m^2")),
    Broken("stiffness without angle", '"1500 N*m/rad"', '"1500 N*m"', 18, "coupling.clutch.stiffness", ("N*m/rad",)),
    Broken("stiffness in joule", '"1500 N*m/rad"', '"1500 J/rad"', 18, "coupling.clutch.stiffness", ("energy",)),
    Broken("damping without angle", '"0.225 N*m*s/rad"', '"1 N*m*s"', 19, "coupling.clutch.damping", ("angle unit",)),
    Broken("newton metre run together", '"1500 N*m/rad"', '"1 Nm/rad"', 18, "coupling.clutch.stiffness", ("N*m",)),
    Broken("length for angle", '"0.16 rad"', '"5 mm"', 20, "coupling.clutch.clearance", ("angle", "mm is not")),
    Broken("angle for length", '"0.1 mm"', '"0.1 deg"', 38, "mesh.gear.backlash", ("length", "deg is not")),
    Broken("torque in joule", '"10 N*m"', '"10 J"', 46, "torque.0.mean", ('"10 J"', "energy", "N*m")),
    Broken("torque in kilojoule", '"10 N*m"', '"1 kJ"', 46, "torque.0.mean", ("kJ is a unit of energy",)),
    Broken("torque with angle", '"10 N*m"', '"10 N*m/rad"', 46, "torque.0.mean", ("must not name an angle",)),
    Broken("speed in hertz", '"1500 rpm"', '"25 Hz"', 42, "excitation.speed", ("Hz belongs to frequency",)),
    Broken("speed in hertz radian", '"1500 rpm"', '"25 Hz*rad"', 42, "excitation.speed", ("angle divided by",)),
    Broken("speed without angle", '"1500 rpm"', '"25 N/kg/m*s"', 42, "excitation.speed", ("angular velocity",)),
    Broken(
        "frequency in rpm", 'speed = "1500 rpm"', 'frequency = "1500 rpm"', 42, "excitation.frequency", ("Hz or kHz",)
    ),
    Broken("frequency in rad/s", 'speed = "1500 rpm"', 'frequency = "150 rad/s"', 42, "excitation.frequency", ("Hz",)),
    Broken("one over a minute", '"1500 rpm"', '"1500 1/min"', 42, "excitation.speed", ("'1'", "a speed in rpm")),
    Broken("unknown unit", '"1500 rpm"', '"1500 RPM"', 42, "excitation.speed", ("RPM", 'did you mean "rpm"')),
    Broken("number in quotes", '"0.16 rad"', '"0.16"', 20, "coupling.clutch.clearance", ("0.16 without quotes",)),
    Broken("unit alone", '"0.16 rad"', '"rad"', 20, "coupling.clutch.clearance", ("decimal number",)),
    Broken("decimal comma", '"0.16 rad"', '"0,16 rad"', 20, "coupling.clutch.clearance", ("decimal point",)),
    Broken("empty string", '"0.16 rad"', '""', 20, "coupling.clutch.clearance", ("decimal number",)),
    Broken("huge exponent", '"0.16 rad"', '"1e999999999 rad"', 20, "coupling.clutch.clearance", ("range",)),
    Broken("huge power", '"0.16 rad"', '"1 rad^99"', 20, "coupling.clutch.clearance", ("whole powers",)),
    Broken("code", '"0.16 rad"', "\"__import__('os').abort()\"", 20, "coupling.clutch.clearance", ("decimal",)),
    Broken("code in unit", '"0.16 rad"', '"1 rad.__class__()"', 20, "coupling.clutch.clearance", ("unit",)),
    Broken("time in metres", '"20 us"', '"20 um"', 56, "simulation.step", ("time", "um is not")),
    # values
    Broken("negative inertia", '"0.3 kg*m^2"', '"-0.3 kg*m^2"', 7, "inertia.flywheel.J", ("-0.3", "greater than zero")),
    Broken("zero inertia", '"0.3 kg*m^2"', "0", 7, "inertia.flywheel.J", ("greater than zero",)),
    Broken("not a number", '"0.3 kg*m^2"', "nan", 7, "inertia.flywheel.J", ("found nan", "finite")),
    Broken("infinite", '"0.3 kg*m^2"', "inf", 7, "inertia.flywheel.J", ("found inf", "finite")),
    Broken("overflowing number", '"0.3 kg*m^2"', "1e999", 7, "inertia.flywheel.J", ("finite",)),
    Broken("overflowing whole", '"0.3 kg*m^2"', "1" + "0" * 400, 7, "inertia.flywheel.J", ("beyond the range",)),
    Broken("truth value", '"0.3 kg*m^2"', "true", 7, "inertia.flywheel.J", ("found true", "plain number")),
    Broken("date", '"0.3 kg*m^2"', "1979-05-27", 7, "inertia.flywheel.J", ("1979-05-27", "plain number")),
    Broken("table for a value", '"0.3 kg*m^2"', "{ value = 3 }", 7, "inertia.flywheel.J", ("plain number",)),
    Broken("negative drag", "1.5e-4", "-1.5e-4", 8, "inertia.flywheel.drag", ("not be negative",)),
    Broken("negative drag torque", '"0.1 N*m"', '"-0.1 N*m"', 13, "inertia.hub.drag_torque", ("not be negative",)),
    Broken("negative stiffness", '"1500 N*m/rad"', "-1500", 18, "coupling.clutch.stiffness", ("not be negative",)),
    Broken("negative clearance", '"0.16 rad"', "-0.16", 20, "coupling.clutch.clearance", ("not be negative",)),
    Broken("negative ratio", "stiffness_ratio = 0.1", "stiffness_ratio = -1", 21, "stiffness_ratio", ("negative",)),
    Broken("ratio in quotes", "stiffness_ratio = 0.1", 'stiffness_ratio = "10 %"', 21, "ratio", ("without unit",)),
    Broken("zero radius", '["50 mm", "50 mm"]', '["50 mm", 0]', 35, "mesh.gear.radii.1", ("greater than zero",)),
    Broken("one radius", '["50 mm", "50 mm"]', '["50 mm"]', 35, "mesh.gear.radii", ("two base radii",)),
    Broken("radius no array", '["50 mm", "50 mm"]', '"50 mm"', 35, "mesh.gear.radii", ("two base radii",)),
    Broken(
        "negative order",
        "order = 20",
        "order = -20",
        39,
        "transmission_error.0.order",
        ("greater than zero", "constant error"),
    ),
    Broken("error of order 0", "order = 20", "order = 0", 39, "transmission_error.0.order", ("constant error",)),
    Broken("torque of order 0", "order = 2,", "order = 0.0,", 49, "harmonics.1.order", ("greater than zero", "mean")),
    Broken("no amplitude", 'order = 1, amplitude = "202 N*m"', "order = 1", 48, "harmonics.0.amplitude", ("required",)),
    Broken("phase in metres", '"30 deg"', '"30 m"', 49, "torque.0.harmonics.1.phase", ("angle",)),
    Broken("zero speed", '"1500 rpm"', "0", 42, "excitation.speed", ("greater than zero",)),
    # names
    Broken("blank in name", '"flywheel"\nJ', '"fly wheel"\nJ', 6, "inertia", ("letters", "digits, _ and -")),
    Broken("reserved name", 'name = "hub"\n', 'name = "ground"\n', 11, "inertia.ground.name", ("reserved",)),
    Broken("dangling coupling", '["hub", "ground"]', '["hubb", "ground"]', 25, "coupling.damper.between", ('"hub"',)),
    Broken("dangling torque", 'on = "flywheel"', 'on = "flywhel"', 45, "torque.0.on", ('did you mean "flywheel"',)),
    Broken("torque on ground", 'on = "flywheel"', 'on = "ground"', 45, "torque.0.on", ("no inertia has this name",)),
    Broken("to itself", '["hub", "ground"]', '["hub", "hub"]', 25, "coupling.damper.between", ("two different",)),
    Broken("three ends", '["hub", "ground"]', '["hub", "flywheel", "ground"]', 25, "between", ("two names",)),
    Broken("name twice", 'name = "gear"', 'name = "clutch"', 33, "mesh.clutch.name", ("unique", "coupling.0")),
    # keys
    Broken("unknown key", "drag_torque =", "dragtorque =", 13, "inertia.hub.dragtorque", ('"drag_torque"',)),
    Broken("unknown table", "[simulation]", "[simulaton]", 52, "simulaton", ('did you mean "simulation"',)),
    Broken("unknown stage key", "damping = 0.02", "dampin = 0.02", 27, "stages.0.dampin", ('"damping"',)),
    Broken("missing inertia", 'J = "0.3 kg*m^2"\n', "", 5, "inertia.flywheel.J", ("required",)),
    Broken("missing schema", "schema = 1\n", "", 0, "schema", ("required",)),
    Broken("missing excitation", '[excitation]\nspeed = "1500 rpm"\n', "", 0, "excitation", ("required",)),
    Broken("empty excitation", 'speed = "1500 rpm"\n', "", 41, "excitation", ("speed or frequency", "period")),
    Broken("speed and frequency", '"1500 rpm"', '"1500 rpm"\nfrequency = 25', 43, "excitation.frequency", ("exclude",)),
    Broken("single brackets", "[[torque]]", "[torque]", 44, "torque", ("[[torque]]", "double brackets")),
    Broken("value for a table", '[excitation]\nspeed = "1500 rpm"', "[x]", 0, "excitation", ("required",)),
    # forms
    Broken(
        "both forms", 'name = "damper"', 'name = "damper"\nclearance = 0.1', 25, "clearance", ("exclude each other",)
    ),
    Broken("neither form", 'stiffness = "1500 N*m/rad"\n', "", 15, "coupling.clutch", ("needs stiffness",)),
    Broken("stages out of order", '"12 deg"', '"3 deg"', 28, "stages.1.until", ("out of order", "0.0698132")),
    Broken("stage without end", ', until = "12 deg"', "", 28, "stages.1", ("every stage but the last",)),
    Broken("last stage ends", '"5 kN*m/rad"', '"5 kN*m/rad", until = 1', 29, "stages.2.until", ("last stage",)),
    Broken("stage of nothing", '"5 kN*m/rad"', '"5 kN*m/rad" }, {', 29, "stages", ("stiffness", "required")),
    Broken("coast without drive", "stiffness_ratio = 0.1", "coast_stages = [{stiffness = 1}]", 21, "coast_stages", ()),
    Broken("hysteresis", "damping = 0.02", "hysteresis = 2", 28, "stages.1.hysteresis", ("must not fall", "2 N m")),
    Broken("friction on a flat", '"5 kN*m/rad"', "0, hysteresis = 3", 29, "stages.2.hysteresis", ("stick_stiffness",)),
    Broken("stick stiffness", "damping = 0.02", "stick_stiffness = 0", 27, "stick_stiffness", ("greater than zero",)),
    Broken("clipped, no gap", 'backlash = "0.1 mm"', 'contact_damping = "clipped"', 38, "contact_damping", ("gap",)),
    Broken("signal", 'mean = "10 N*m"', 'signal = { file = "t.csv" }', 46, "torque.0.signal", ("time is required",)),
    Broken(
        "mesh on ground", 'between = ["flywheel", "hub"]\nradii', 'between = ["ground", "hub"]\nradii', 34, "gear", ()
    ),
    # simulation
    Broken("unknown algorithm", '"exact"', '"exakt"', 53, "simulation.algorithm", ('did you mean "exact"',)),
    Broken("all discarded", "discard = 10", "discard = 20", 55, "simulation.discard", ("less than cycles (20)",)),
    Broken("fractional cycles", "cycles = 20", "cycles = 20.5", 54, "simulation.cycles", ("whole number",)),
    Broken("no cycles", "cycles = 20", "cycles = 0", 54, "simulation.cycles", ("whole number from 1",)),
    Broken("start word", "cycles", 'initial = "stattic"\ncycles', 54, "initial", ('did you mean "static"',)),
    Broken(
        "start length",
        "cycles",
        "initial = { angle = [1], velocity = [0, 0] }\ncycles",
        54,
        "simulation.initial.angle",
        ("one entry for each of the 2 inertias",),
    ),
    Broken("start incomplete", "cycles", "initial = { angle = [1, 2] }\ncycles", 54, "velocity", ("required",)),
    Broken("zero step", '"20 us"', "0", 56, "simulation.step", ("greater than zero",)),
    # versions and syntax
    Broken("future schema", "schema = 1", "schema = 2\ncolour = 3", 1, "schema", ("newer gearrattle",)),
    Broken("schema in words", "schema = 1", 'schema = "1"', 1, "schema", ("version of the file format",)),
    Broken("unknown units", '"SI"', '"imperial"', 3, "units", ('"SI" or "dimensionless"',)),
    Broken("syntax", "drag = 1.5e-4", "drag 1.5e-4", 8, "", ("not valid TOML", "'='")),
    Broken("key twice", "drag = 1.5e-4", "drag = 1.5e-4\ndrag = 2", 9, "", ("not valid TOML", "overwrite")),
    Broken("open string", '"sound"', '"sound', 2, "", ("not valid TOML",)),
    Broken("control character", '"sound"', '"so\x00und"', 2, "", ("not valid TOML",)),
    Broken("endless digits", "drag = 1.5e-4", "drag = " + "9" * 5000, 8, "", ("digits",)),
]


@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_refused_with_line_key_and_words(case: Broken) -> None:
    assert case.old in SOUND
    with pytest.raises(ModelError) as caught:
        loads(SOUND.replace(case.old, case.new, 1), "car.toml")
    expected = f"car.toml:{case.line}" if case.line else "car.toml: "
    reported = [str(problem) for problem in caught.value.problems if problem.place.startswith(expected)]
    fitting = [text for text in reported if case.key in text and all(word in text for word in case.words)]
    assert fitting, f"wanted {expected} {case.key} {case.words}, got:\n{caught.value}"
    assert all("\n" not in str(problem) for problem in caught.value.problems)


def test_the_sound_file_is_sound() -> None:
    assert loads(SOUND).name == "sound"


def test_one_fault_gives_one_problem() -> None:
    faults = [
        case for case in CASES if case.name in {"negative inertia", "dangling torque", "unknown key", "hysteresis"}
    ]
    for case in faults:
        with pytest.raises(ModelError) as caught:
            loads(SOUND.replace(case.old, case.new, 1))
        assert len(caught.value.problems) == 1


def test_all_problems_at_once_in_file_order() -> None:
    text = SOUND
    chosen = ["negative inertia", "unknown key", "stiffness without angle", "stages out of order", "name twice"]
    chosen += ["speed in hertz", "dangling torque", "phase in metres", "unknown algorithm"]
    for case in (case for case in CASES if case.name in chosen):
        text = text.replace(case.old, case.new, 1)
    with pytest.raises(ModelError) as caught:
        loads(text, "car.toml")
    lines = [int(problem.place.split(":")[1]) for problem in caught.value.problems]
    assert len(lines) == len(chosen)
    assert lines == sorted(lines)


def test_dimensionless_model_refuses_units() -> None:
    with pytest.raises(ModelError) as caught:
        loads(SOUND.replace('"SI"', '"dimensionless"'), "car.toml")
    quoted = len(re.findall(r'"[\d.e]+ [^"]+"', SOUND))
    assert len(caught.value.problems) == quoted
    assert all("dimensionless" in problem.rule for problem in caught.value.problems)
