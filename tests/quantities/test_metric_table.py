"""Laws that every metric of the table obeys, on simulated and on recorded signals."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.errors import ModelError
from gearrattle.quantities.evaluation import judge, rows_of
from gearrattle.quantities.metric_inputs import Inputs
from gearrattle.quantities.metric_sources import inputs_of_motion, inputs_of_recording, recording_of
from gearrattle.quantities.quantity import Quantity
from gearrattle.quantities.quantity_table import METRICS
from gearrattle.recording import Channel, Recording
from tests import synthetic
from tests.signals.handmade import trajectory

ids = [metric.name for metric in METRICS]
ENGINE = np.array([1.0, 2.0])
EXACT = {metric.name for metric in METRICS if {"gaps", "energy"} & set(metric.needs)}
"""What only a log of crossings or an audit gives."""


def simulated(kind: str = "double-sided") -> Inputs:
    return inputs_of_motion(synthetic.trajectory(kind), ENGINE)


def recorded(kind: str = "double-sided") -> Inputs:
    motion = synthetic.trajectory(kind)
    return inputs_of_recording(recording_of(motion), motion.layout, motion.layout.omega, ENGINE)


@pytest.mark.parametrize("metric", METRICS, ids=ids)
def test_a_metric_tells_what_it_is_and_whence(metric: Quantity[Inputs]) -> None:
    """Frozen, with words for everything a reader asks."""
    assert dataclasses.is_dataclass(metric)
    with pytest.raises(dataclasses.FrozenInstanceError):
        metric.name = "other"
    for words in (
        metric.name,
        metric.title,
        metric.formula,
        metric.unit,
        metric.source,
        metric.window,
        metric.sampling,
    ):
        assert words
    assert metric.needs


def test_names_and_quantities_are_unique_and_no_criterion_has_them() -> None:
    """A study finds an output by its quantity alone."""
    assert len(set(ids)) == len(METRICS)
    owner: dict[str, str] = {}
    for row in rows_of(simulated()):
        assert owner.setdefault(row.quantity, row.name) == row.name
    assert not set(owner) & {entry.quantity for entry in judge(synthetic.trajectory()).entries}


@pytest.mark.parametrize("kind", synthetic.DEFLECTIONS)
def test_every_row_has_a_unit_and_what_there_is_not_has_a_note(kind: str) -> None:
    """And no quantity is said twice of one subject."""
    rows = rows_of(simulated(kind))
    for row in rows:
        assert row.unit
        assert row.source
        assert row.window
        assert math.isfinite(row.value) or row.note
    keys = [(row.subject, row.quantity) for row in rows]
    assert len(keys) == len(set(keys))


@pytest.mark.parametrize("kind", synthetic.DEFLECTIONS)
def test_a_recording_of_a_motion_says_what_the_motion_says(kind: str) -> None:
    """To the last digit but those of time, wherever samples suffice; the rest is told, never guessed."""
    of_motion = {(r.subject, r.quantity): r.value for r in rows_of(simulated(kind)) if r.name != "contact_sides"}
    rows = rows_of(recorded(kind))
    assert {row.name for row in rows if "needs" in row.note} == EXACT
    shared = [row for row in rows if row.name not in EXACT | {"contact_sides"}]
    assert len(shared) > 20
    for row in shared:
        want = of_motion[row.subject, row.quantity]
        assert row.value == pytest.approx(want, rel=1e-9, abs=1e-9 * max(1.0, abs(want)), nan_ok=True), row


@pytest.mark.parametrize("samples", [256, 4096])
def test_sides_from_samples_come_near_those_from_the_log(samples: int) -> None:
    """Every crossing is displaced by less than one sample: shares by at most crossings / samples of a cycle.

    Of the first impact of a recording nobody knows which flank was before: it may count on the wrong side of two.
    """
    motion = synthetic.trajectory(samples=samples)
    exact = {(r.subject, r.quantity): r.value for r in rows_of(inputs_of_motion(motion, ENGINE))}
    rows = rows_of(inputs_of_recording(recording_of(motion), motion.layout, synthetic.OMEGA, ENGINE))
    actual = [row for row in rows if row.name == "contact_sides"]
    assert actual
    for row in actual:
        assert "from samples" in row.note
        slack = 8.0 / samples if "share" in row.quantity else 1.0 / 8.0 + 1e-9  # of 8 cycles
        assert abs(row.value - exact[row.subject, row.quantity]) <= slack
    for subject in {row.subject for row in actual}:
        rates = [
            (r.value, exact[r.subject, r.quantity]) for r in actual if r.subject == subject and "per" in r.quantity
        ]
        assert sum(value for value, _ in rates) == pytest.approx(sum(want for _, want in rates), rel=1e-9)


def test_without_a_model_only_what_needs_none_is_measured() -> None:
    """Speeds and forces speak for themselves; the rest says what it needs."""
    time = np.arange(1001) * 1e-3
    shaft = 100.0 + 2.0 * np.sin(2.0 * 100.0 * time)
    rig = Recording(time, (Channel("n", "speed", "input", "rad/s", shaft),), "rig.csv")
    rows = rows_of(inputs_of_recording(rig, None, None, (2.0,)))
    reported = {row.name: row.note for row in rows if row.subject == ""}
    assert set(reported) == set(ids) - {"irregularity"}
    one_shaft = reported.pop("order_transmissibility")
    assert "nothing of the kind" in one_shaft
    assert all("needs" in note for note in reported.values())
    (swing,) = [row.value for row in rows if row.quantity == "peak-to-peak speed at order 2"]
    assert swing == pytest.approx(4.0, rel=1e-4)  # the last 15 revolutions, to a sample


def test_ill_recordings_are_refused_with_a_remedy() -> None:
    """Uneven samples and gaps."""
    time = np.array([0.0, 1.0, 3.0])
    with pytest.raises(ModelError, match=r"rig.*uniform.*resample"):
        inputs_of_recording(Recording(time, (), "rig"), None, None, ())
    holes = Channel("n", "speed", "input", "rad/s", np.array([1.0, np.nan, 1.0]))
    with pytest.raises(ModelError, match=r"rig.*n.*finite"):
        inputs_of_recording(Recording(np.arange(3.0), (holes,), "rig"), None, None, ())


def test_rounded_times_are_uniform_with_a_note() -> None:
    """Six decimals of a millisecond are no gap; the values are those of exact times."""
    time = np.arange(1001) * (0.4 * np.pi / 1000)
    channel = Channel("n", "speed", "input", "rad/s", 100.0 + np.sin(2.0 * 100.0 * time))
    values = {}
    for times in (time, np.round(time, 6)):
        inputs = inputs_of_recording(Recording(times, (channel,), "rig"), None, 100.0, (2.0,))
        values[len(inputs.notes)] = [row.value for row in rows_of(inputs) if row.name == "irregularity"]
    assert values[1] == pytest.approx(values[0], rel=1e-5)


def test_one_sample_a_cycle_does_not_fail() -> None:
    """What such samples cannot show is NaN with a note."""
    for row in rows_of(inputs_of_motion(trajectory(cycles=3, samples=1), ENGINE)):
        assert math.isfinite(row.value) or row.note


def test_the_public_call_gives_a_table_by_name() -> None:
    """Columns as documented; only the metrics that are asked for; calibration makes the note go."""
    run = gr.simulate(gr.load("examples/paper/case1.toml"), cycles=6, discard=3)
    table = gr.metrics(run, names=["separation", "rattle_level"], base_level=40.0, kappa=1.0)
    columns = ["metric", "subject", "quantity", "value", "unit", "window", "source", "note", "error"]
    assert table.columns.tolist() == columns
    assert table.metric.unique().tolist() == ["separation", "rattle_level"]
    assert not table.note.str.contains("calibrated").any()
    entries = gr.criteria(run).of("loose_gear", "gear")
    (margin,) = [entry.value for entry in entries if entry.quantity == "margin"]
    said = table[table.quantity == "separation margin"].value.item()
    assert said == pytest.approx(margin, rel=1e-12)  # products of other shapes round otherwise


def test_wrong_arguments_are_refused() -> None:
    """All wrong names at once; a run has its own model."""
    run = gr.simulate(gr.load("examples/paper/case1.toml"), cycles=2)
    with pytest.raises(ModelError, match=r"seperation.*separation.*separation"):
        gr.metrics(run, names=["seperation"])
    with pytest.raises(ModelError, match="its own model"):
        gr.metrics(run, run.model)
    with pytest.raises(ModelError, match="kappa"):
        gr.metrics(run, kappa=-1.0)
    with pytest.raises(ModelError, match="speed"):
        gr.metrics(recording_of(run.trajectory), speed=0.0)


def test_a_model_without_units_gives_values_without() -> None:
    """Every unit but those of pure numbers reads "1"."""
    run = gr.simulate(gr.load("examples/rattle_oscillator.toml"), cycles=4)
    assert run.model.units == "dimensionless"
    assert set(gr.metrics(run).unit) <= {"1", "1/cycle", "dB"}


def test_energy_by_the_log_is_the_work_that_the_audit_finds() -> None:
    """Velocities at crossings against quadrature of the damping's power, over whole runs of contacts short as blows.

    What drives the gears during a contact does work that the log does not know: an eighth of it, as contacts of 64
    times the stiffness and the same restitution last an eighth. Motions are chaotic, so several are looked at.
    """
    model = gr.load("examples/manual_transmission.toml")
    meshes, inertia = model.to_tables()["mesh"], model.to_tables()["inertia"][1]
    stiff = {f"mesh.{mesh['name']}.stiffness": 64.0 * mesh["stiffness"] for mesh in meshes}
    stiff |= {f"mesh.{mesh['name']}.damping": 8.0 * mesh["damping"] for mesh in meshes}
    for change in (0.0, 1e-13, 1e-12):
        begun_nearby = stiff | {f"inertia.{inertia['name']}.J": inertia["J"] * (1.0 + change)}
        run = gr.simulate(model.with_(begun_nearby), cycles=60, discard=0)
        value = gr.metrics(run).set_index(["quantity", "subject"]).value
        for mesh in ("second_mesh", "fifth_mesh"):
            assert value["impact loss rate", mesh] == pytest.approx(value["contact work rate", mesh], rel=1e-2)
            (part,) = [part for part in gr.criteria(run).parts if part.name == mesh]
            assert part.mean_exchanged_momentum == pytest.approx(part.mean_contact_impulse, rel=2e-3)
            exchanged = part.mean_exchanged_momentum * part.impacts_per_second
            assert value["mean impact intensity", mesh] == pytest.approx(exchanged, rel=1e-10)


def test_orders_do_not_depend_on_sampling() -> None:
    """From 512 to 4096 samples a cycle of the same exact motion amplitudes at orders change by less than 0.1 %."""
    tables = []
    for samples in (512, 4096):
        run = gr.simulate(gr.load("examples/paper/case1.toml"), cycles=20, discard=10, samples_per_cycle=samples)
        tables.append(gr.metrics(run, names=["order_transmissibility", "harmonic_separation", "contact_sides"]))
    coarse, fine = tables
    assert coarse.quantity.tolist() == fine.quantity.tolist()
    assert coarse.value.to_numpy() == pytest.approx(fine.value.to_numpy(), rel=1e-3)


def test_every_metric_is_in_the_reference_with_its_formula_and_source() -> None:
    """The page is written from the table; a new metric that is not on it fails here."""
    page = (Path(__file__).parents[2] / "docs" / "reference" / "metrics.md").read_text(encoding="utf-8")
    for metric in METRICS:
        assert f"`{metric.name}`: {metric.title}" in page
        assert metric.formula in page
        assert metric.source in page


def test_speeds_of_two_shafts_have_a_transmissibility() -> None:
    """Means included: a quarter of the fluctuation at twice the speed is a quarter."""
    time = np.arange(2001) * (0.1 * np.pi / 2000)  # ten revolutions at 200 rad/s
    swing = np.sin(2.0 * 200.0 * time + 0.3)
    channels = (
        Channel("in", "speed", "input", "rad/s", 200.0 + 2.0 * swing),
        Channel("out", "speed", "output", "rad/s", 400.0 + 0.5 * swing),
    )
    rows = rows_of(inputs_of_recording(Recording(time, channels, "rig.csv"), None, 200.0, (2.0,)))
    (actual,) = [row for row in rows if row.name == "order_transmissibility"]
    assert (actual.subject, actual.value) == ("output", pytest.approx(0.25, rel=1e-9))


@pytest.mark.parametrize("example", ["run_up", "measured_flywheel", "clutch_friction", "alternating_mesh"])
def test_every_kind_of_drive_is_measured(example: str) -> None:
    """Run-ups have no order values, prescribed motions no reduced inertia of their own; the rest is there."""
    model = gr.load(f"examples/{example}.toml")
    run = gr.simulate(model, cycles=4, discard=0, samples_per_cycle=64)
    table = gr.metrics(run)
    ill = table[~np.isfinite(table.value)]
    assert (ill.note != "").all()
    by_order = table[table.quantity.str.contains(" at order ")]
    assert len(by_order) == 0 or model.excitation.sweep is None
