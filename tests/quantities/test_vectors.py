"""Every metric against values known by hand, to 1e-9."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gearrattle.quantities.contact import ContactSides
from gearrattle.quantities.force import ForceStatistics
from gearrattle.quantities.intensity import ImpactIntensity
from gearrattle.quantities.loose_motion import LooseMotion
from gearrattle.quantities.metric_sources import inputs_of_recording
from gearrattle.quantities.quantity_table import METRICS
from gearrattle.quantities.rattle_level import RattleLevel
from gearrattle.quantities.separation import SeparationRatio
from gearrattle.quantities.transmissibility import OrderTransmissibility
from gearrattle.recording import Channel, Recording
from tests.quantities.vectors import MASS, OMEGA, ROWS, VECTORS, Vector, inputs, rig
from tests.signals.handmade import chain, layout, sine, staged, still, trajectory


@pytest.mark.parametrize("vector", VECTORS, ids=lambda vector: vector.metric.name)
def test_a_metric_says_what_is_known_by_hand(vector: Vector) -> None:
    """Closed forms of sines, sums over logs written by hand."""
    said = {(v.subject, v.quantity): v.value for v in vector.metric.rows(vector.inputs)}
    for key, value in vector.known.items():
        assert said[key] == pytest.approx(value, rel=1e-9, abs=1e-12), key


def test_every_metric_has_a_vector() -> None:
    """A new metric without one fails here."""
    assert {metric.name for metric in METRICS} == {vector.metric.name for vector in VECTORS}


def test_the_margin_of_a_still_driver_is_minus_infinity() -> None:
    """log 0."""
    ratio, margin = SeparationRatio().rows(inputs(trajectory(accelerations=(still, sine(1e6)))))
    assert ratio.value == 0.0
    assert margin.value == -math.inf


def test_a_contact_that_the_end_cuts_short_is_told_and_has_not_rebounded() -> None:
    """Intensity counts its m |v|, with a note; restitution is that of the three completed ones."""
    rows = [*ROWS, (3.9, 0, 0, 1, 0.3, 0.0)]
    values = {v.quantity: v for v in ImpactIntensity().rows(inputs(trajectory(rows=rows)))}
    assert values["mean impact intensity"].value == pytest.approx(MASS * 2.8 / 4.0, rel=1e-12)
    assert "ends within a contact" in values["mean impact intensity"].note


def test_no_impacts_make_no_mean_but_no_intensity_either() -> None:
    """0 is an intensity; a mean of nothing is none, and says so."""
    values = {v.quantity: v for v in ImpactIntensity().rows(inputs(trajectory()))}
    assert values["mean impact intensity"].value == 0.0
    assert math.isnan(values["mean restitution"].value)
    assert "no impact" in values["mean restitution"].note


def test_stages_of_a_damper_are_no_impacts() -> None:
    """A spring that changes its stage gives no restitution."""
    plate = staged([-1.0, 1.0], -1, [5.0, 1.0, 5.0])
    assert ImpactIntensity().rows(inputs(trajectory(plate, chain([0, 1, 0], [1.0, 2.0])))) == []


def test_the_level_adds_powers() -> None:
    """Without impacts L_0 itself; 3.01 dB more where kappa I is as much as the rest."""
    level = RattleLevel(40.0, 1.0)
    assert level.level(0.0) == pytest.approx(40.0, rel=1e-12)
    assert level.level(1e4) - 40.0 == pytest.approx(10.0 * math.log10(2.0), rel=1e-12)
    assert RattleLevel().rows(inputs(trajectory(rows=ROWS)))[0].note.count("not calibrated") == 1


def test_a_first_contact_follows_the_side_the_motion_begins_on() -> None:
    """Begun on the coast flank, a drive impact changes flanks; discarded impacts still tell the flank before."""
    rows = chain([-1, 0, 1, 0, 1], [0.5, 1.5, 2.0, 2.5])
    sides = {v.quantity: v.value for v in ContactSides().rows(inputs(trajectory(rows=rows, initial=[-1], discard=1)))}
    assert sides["double-sided impacts per cycle"] == pytest.approx(1.0 / 3.0, rel=1e-12)
    assert sides["single-sided impacts per cycle"] == pytest.approx(1.0 / 3.0, rel=1e-12)
    assert sides["drive-side share"] == pytest.approx((0.5 + 1.5) / 3.0, rel=1e-12)


def test_the_band_above_keeps_nothing_of_the_engine() -> None:
    """A sine at the engine's highest order, mean included, vanishes to rounding."""
    motion = trajectory(accelerations=(still, sine(3.0, 2.0, 0.2, mean=5.0)))
    values = {v.quantity: v.value for v in LooseMotion().rows(inputs(motion, 1.0, 2.0))}
    assert values["rms acceleration"] == pytest.approx(3.0 / math.sqrt(2.0), rel=1e-12)
    assert values["peak acceleration above the engine orders"] < 1e-12


def test_an_order_is_transmitted_alike_by_angle_and_by_acceleration() -> None:
    """At one order d^2/dt^2 is a factor: a reference known by its angle serves as well."""
    time = np.arange(257) / 64
    two = rig(sine(0.5)(time), "angle", "driver", "rad")
    other = Channel("another", "acceleration", "loose", "rad/s^2", sine(2.0)(time))
    two = two.with_(channels=(*two.channels, other))
    (actual,) = OrderTransmissibility().rows(inputs_of_recording(two, layout(), OMEGA, (1.0,)))
    assert actual.value == pytest.approx(2.0 / (0.5 * OMEGA**2), rel=1e-9)


def test_without_a_model_forces_that_are_not_in_newton_are_left_out_with_a_note() -> None:
    """A torque of a coupling in N m is no mesh force; one in N is measured."""
    time = np.arange(257) / 64
    units = {"coupling": "N m", "unknown": "N*m or N", "gear": "N"}
    channels = tuple(Channel(name, "force", name, unit, sine(7.0)(time)) for name, unit in units.items())
    values = ForceStatistics().rows(inputs_of_recording(Recording(time, channels, "by hand"), None, OMEGA, ()))
    measured = {value.subject for value in values if np.isfinite(value.value)}
    assert measured == {"gear"}
    notes = {value.subject: value.note for value in values if not np.isfinite(value.value)}
    assert set(notes) == {"coupling", "unknown"}
    assert all("give a model" in note for note in notes.values())
