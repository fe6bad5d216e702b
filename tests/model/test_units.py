"""Strings with units: exact conversion, angle as a dimension, and no way to run code."""

from __future__ import annotations

import math
import subprocess
import sys
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gearrattle.model import units
from gearrattle.model.known_units import KNOWN_UNITS
from gearrattle.model.units import Dimension, UnitError, convert


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("0.05 mm", units.LENGTH, 5e-05),
        ("0.1 mm", units.LENGTH, 1e-4),
        ("5 um", units.LENGTH, 5e-6),
        ("5 µm", units.LENGTH, 5e-6),
        ("5 μm", units.LENGTH, 5e-6),
        ("50mm", units.LENGTH, 0.05),
        ("1 inch", units.LENGTH, 0.0254),
        ("20 us", units.TIME, 2e-5),
        ("1.5 kN*m/rad", units.TORSIONAL_STIFFNESS, 1500.0),
        ("1.5 kN m / rad", units.TORSIONAL_STIFFNESS, 1500.0),
        ("1.5 kN·m·rad⁻¹", units.TORSIONAL_STIFFNESS, 1500.0),
        ("3.5 N*m/deg", units.TORSIONAL_STIFFNESS, 200.53522829578813),
        ("2 N*m*s/rad", units.TORSIONAL_DAMPING, 2.0),
        ("3 N*m/(rad/s)", units.TORSIONAL_DAMPING, 3.0),
        ("0.3 kg*m**2", units.MOMENT_OF_INERTIA, 0.3),
        ("3000 kg cm²", units.MOMENT_OF_INERTIA, 0.3),
        ("0.3 N*m*s^2", units.MOMENT_OF_INERTIA, 0.3),
        ("-0.2 kN*m", units.TORQUE, -200.0),
        ("1500 rpm", units.ANGULAR_VELOCITY, 50.0 * math.pi),
        ("9000 deg/s", units.ANGULAR_VELOCITY, 50.0 * math.pi),
        ("150 rad/s", units.ANGULAR_VELOCITY, 150.0),
        ("180 deg", units.ANGLE, math.pi),
        ("90°", units.ANGLE, math.pi / 2.0),
        ("25 Hz", units.FREQUENCY, 25.0),
        ("0.025 kHz", units.FREQUENCY, 25.0),
        ("4500 N*s/m", units.LINEAR_DAMPING, 4500.0),
        ("4.5 kg/ms", units.LINEAR_DAMPING, 4500.0),
        ("7.2e8 N/m", units.LINEAR_STIFFNESS, 7.2e8),
        ("720 N/um", units.LINEAR_STIFFNESS, 7.2e8),
    ],
)
def test_converts_to_the_nearest_double(text: str, dimension: Dimension, value: float) -> None:
    assert convert(text, dimension) == value


@given(st.decimals(allow_nan=False, allow_infinity=False, places=9, min_value=-(10**6), max_value=10**6))
def test_conversion_rounds_once(number: object) -> None:
    assert convert(f"{number} mm", units.LENGTH) == float(Fraction(str(number)) / 1000)


@pytest.mark.parametrize(
    ("text", "dimension", "word"),
    [
        ("1500 N*m", units.TORSIONAL_STIFFNESS, "angle unit"),
        ("1500 J/rad", units.TORSIONAL_STIFFNESS, "energy"),
        ("1 N*m/rad^2", units.TORSIONAL_STIFFNESS, "N*m/rad"),
        ("1 N*m*rad/rad", units.TORSIONAL_STIFFNESS, "angle unit"),
        ("1 N*m*s", units.TORSIONAL_DAMPING, "angle unit"),
        ("10 N*m/rad", units.TORQUE, "not name an angle"),
        ("10 J", units.TORQUE, "energy"),
        ("10 mJ", units.TORQUE, "energy"),
        ("10 joule", units.TORQUE, "energy"),
        ("0.3 J*s^2", units.MOMENT_OF_INERTIA, "energy"),
        ("0.3 kg*m^2/rad", units.MOMENT_OF_INERTIA, "not name an angle"),
        ("1500 rpm", units.FREQUENCY, "Hz"),
        ("150 rad/s", units.FREQUENCY, "Hz"),
        ("1 MHz", units.FREQUENCY, "Hz"),
        ("25 Hz", units.ANGULAR_VELOCITY, "angular velocity"),
        ("25 Hz*rad", units.ANGULAR_VELOCITY, "angle"),
        ("5", units.ANGLE, "unit of angle"),
        ("5 degC", units.ANGLE, "degC"),
        ("5 dB", units.ANGLE, "angle"),
    ],
)
def test_refuses_what_is_another_dimension(text: str, dimension: Dimension, word: str) -> None:
    with pytest.raises(UnitError, match="must") as caught:
        convert(text, dimension)
    assert word in caught.value.rule


def _outcome(text: str, dimension: Dimension) -> float | str:
    """Return the value, or the rule that was broken; anything else raised is a fault."""
    try:
        return convert(text, dimension)
    except UnitError as error:
        return error.rule


@given(st.text(max_size=30))
def test_any_text_is_a_number_or_a_unit_error(text: str) -> None:
    outcome = _outcome("1 " + text, units.LENGTH)
    assert outcome.startswith("must") if isinstance(outcome, str) else math.isfinite(outcome)


@given(st.text(st.sampled_from("mNsrad/*^()-0123456789 .e_k²°"), max_size=40))
def test_any_unit_like_text_is_a_number_or_a_unit_error(text: str) -> None:
    outcome = _outcome("1 " + text, units.TORSIONAL_STIFFNESS)
    assert outcome.startswith("must") if isinstance(outcome, str) else math.isfinite(outcome)


EXPENSIVE = ["1 m**9999999", "1 " + "(" * 90 + "m", "1e999999999 m", "9" * 5000 + " m", "1 m" + "*m" * 200]


@pytest.mark.parametrize("text", EXPENSIVE, ids=range(len(EXPENSIVE)))
def test_expensive_texts_are_refused_at_once(text: str) -> None:
    with pytest.raises(UnitError):
        convert(text, units.LENGTH)


def test_what_is_too_small_for_a_double_is_zero_as_without_a_unit() -> None:
    assert convert("1e-999999999 m", units.LENGTH) == float("1e-999999999") == 0.0


@pytest.mark.parametrize("name", KNOWN_UNITS)
def test_what_is_known_is_what_pint_says(name: str) -> None:
    assert KNOWN_UNITS[name] == units._looked_up(name)


def test_all_that_is_suggested_is_known() -> None:
    assert set(units._COMMON) <= set(KNOWN_UNITS)


def test_pint_is_not_loaded_for_units_of_every_day() -> None:
    script = (
        "import sys\n"
        "from gearrattle.model import loads\n"
        'loads(\'schema = 1\\n[excitation]\\nspeed = "1500 rpm"\\n[[inertia]]\\nname = "a"\\nJ = "3 kg*cm^2"\')\n'
        "assert 'pint' not in sys.modules and 'numpy' not in sys.modules"
    )
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0
