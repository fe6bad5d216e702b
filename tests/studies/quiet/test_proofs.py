"""Proofs of quiet against closed forms, against exact runs at random points, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.studies.quiet.branch_and_bound import OPEN, PROVEN, REFUTED
from tests.studies.quiet import drivelines
from tests.studies.quiet.drivelines import BOX, gearbox, on_quiet_motion, points_of, stays

SPEED = "excitation.speed"
MEAN = "torque.0.mean"


def amplitude(w: Any, inertia: Any = 1.0, stiffness: Any = 1.0, damping: Any = 0.1) -> Any:
    """Of the deflection of the oscillator with backlash in contact: e w^2 J / |K - J w^2 + i w C|."""
    return np.abs(0.05 * inertia * w**2 / (stiffness - inertia * w**2 + 1j * w * damping))


@pytest.fixture(scope="module")
def proof() -> gr.typing.QuietProof:
    return gr.prove_quiet(gearbox(), BOX, resolution=0.03)


@pytest.mark.parametrize("resolution", [0.1, 0.01, 0.001])
def test_shares_close_in_on_the_closed_form(resolution: float) -> None:
    """The oscillator is quiet where its amplitude is below its depth in contact, the mean load."""
    speeds = np.linspace(0.3, 0.7, 4001)
    exact = float(np.mean(np.clip((0.3 - amplitude(0.5 * (speeds[:-1] + speeds[1:]))) / 0.28, 0.0, 1.0)))
    ranges = {SPEED: (0.3, 0.7), MEAN: (0.02, 0.3)}
    actual = gr.prove_quiet(gr.example("backlash_oscillator"), ranges, resolution=resolution)
    assert actual.is_complete
    assert actual.open <= resolution
    assert actual.proven <= exact <= 1.0 - actual.refuted


def test_the_border_over_one_parameter_is_the_closed_form() -> None:
    actual = gr.prove_quiet(gr.example("backlash_oscillator"), {MEAN: (0.02, 0.3)}, resolution=1e-6).boxes
    proven = actual[actual["status"] == "proven"]
    refuted = actual[actual["status"] == "refuted"]
    border = float(amplitude(0.75))
    assert border <= proven[f"{MEAN} low"].min() <= border * (1.0 + 1e-4)
    assert border * (1.0 - 1e-4) <= refuted[f"{MEAN} high"].max() <= border
    assert set(refuted["element"]) == {"mesh"}


def test_four_parameters_with_a_product_of_two() -> None:
    """Inertia, damping, stiffness and mean together: the shares hold that of a million random points."""
    ranges = {
        "inertia.gear.J": (0.8, 1.3),
        MEAN: (0.02, 0.3),
        "coupling.mesh.damping": (0.05, 0.2),
        "coupling.mesh.stiffness": (1.1, 1.4),
    }
    actual = gr.prove_quiet(gr.example("backlash_oscillator"), ranges, resolution=0.1)
    sample = {path: np.random.default_rng(i).uniform(*ends, 10**6) for i, (path, ends) in enumerate(ranges.items())}
    inertia, mean, damping, stiffness = sample.values()
    exact = np.mean(amplitude(0.75, inertia, stiffness, damping) < mean / stiffness)
    assert actual.proven - 0.002 <= exact <= 1.0 - actual.refuted + 0.002
    assert actual.open <= 0.1


def test_parts_fill_the_box(proof: gr.typing.QuietProof) -> None:
    boxes = proof.boxes
    assert boxes["share"].sum() == pytest.approx(1.0, rel=1e-12)
    assert proof.proven > 0.2
    assert proof.refuted > 0.05
    assert proof.proven + proof.refuted + proof.open == pytest.approx(1.0, rel=1e-12)
    assert (boxes[f"{SPEED} low"] < boxes[f"{SPEED} high"]).all()


def _check_runs(proof: gr.typing.QuietProof, status: int, count: int) -> None:
    """Runs that begin on the linear motion cross no corner in proven boxes, and some in refuted ones."""
    for values in points_of(proof, status, count, seed=7):
        run = gr.simulate(on_quiet_motion(proof.model, values))
        crossed = len(run.events["time"])
        assert (crossed == 0) == (status == PROVEN), values


def test_no_run_of_a_proven_box_crosses_a_corner(proof: gr.typing.QuietProof) -> None:
    _check_runs(proof, PROVEN, 120)


def test_runs_of_refuted_boxes_do_not_stay(proof: gr.typing.QuietProof) -> None:
    _check_runs(proof, REFUTED, 40)


@pytest.mark.long
def test_none_of_ten_thousand_runs_crosses_a_corner(proof: gr.typing.QuietProof) -> None:
    _check_runs(proof, PROVEN, 10_000)


def test_the_linear_motion_agrees_at_many_points(proof: gr.typing.QuietProof) -> None:
    """By samples of a period, as a screening has it."""
    for values in points_of(proof, PROVEN, 400, seed=1):
        assert stays(proof.model.with_(values)), values
    for values in points_of(proof, REFUTED, 200, seed=2):
        assert not stays(proof.model.with_(values)), values


def test_a_stage_that_is_left_is_no_rattle_and_open(proof: gr.typing.QuietProof) -> None:
    assert ("stage", "damper") in proof.shares(OPEN)
    heavy = gr.prove_quiet(gearbox(), {"drag": drivelines.drag(1.5, 1.6)})
    assert heavy.open == pytest.approx(1.0)
    assert set(heavy.boxes["reason"]) == {"stage"}


def test_friction_that_sticks_is_proven_and_one_that_slips_is_open() -> None:
    """A stiff clutch with friction far above its torque sticks; with less than its torque it slips."""
    stages = [{"stiffness": 2000.0, "hysteresis": 60.0, "stick_stiffness": 2000.0}]
    model = gearbox(coupling__damper__stages=stages)
    ranges = {"drag": drivelines.drag(3.5, 4.0), "mesh.m5.backlash": ("50 um", "90 um")}
    sticking = gr.prove_quiet(model, ranges)
    assert sticking.proven == 1.0
    loose = gr.prove_quiet(model, {**ranges, "coupling.damper.stages.0.hysteresis": (0.5, 6.0)}, resolution=1e-3)
    assert 0.0 < loose.proven < 1.0
    assert loose.refuted == 0.0
    assert loose.shares(OPEN)["friction", "damper"] > 0.2
    border = loose.boxes.query("status == 'proven'")["coupling.damper.stages.0.hysteresis low"].min()
    at_border = model.with_({**{path: high for path, (_, high) in ranges["drag"].items()}})
    held = 0.5 * border / 2000.0  # what the spring of friction deflects where it slips
    linear = drivelines.stuck(at_border)
    reach = drivelines.reach_of(gr_system(at_border), linear)
    assert held == pytest.approx(max(-reach[0][0], reach[1][0]), rel=0.01)


def gr_system(model: gr.Model) -> Any:
    """The system of a model."""
    return drivelines.assemble(model).system


def test_drag_brings_a_train_to_a_steady_rate() -> None:
    """Means that do not balance are carried by viscous drag in the end."""
    model = gearbox(inertia__flywheel__drag=0.5, inertia__second__drag=0.1)
    actual = gr.prove_quiet(model, {MEAN: (2.3, 2.6)})
    assert any("do not balance" in note for note in actual.notes)
    means = 2.45 - 1.5 - 0.9 * 0.0222 / 0.0455 - 0.35 * 0.0372 / 0.0305
    rate = means / (0.5 + 0.1 * (0.0222 / 0.0455) ** 2)  # of the shaft; the fifth gear turns fastest
    assert any(f"{rate * 0.0372 / 0.0305:.3g} rad/s" in note for note in actual.notes)


def test_factors_at_a_pattern_are_the_values_they_make() -> None:
    model = gr.example("manual_transmission")
    paths = model.paths("inertia.*.drag_torque")
    plain = {"all": {path: (0.8 * model[path], 3.0 * model[path]) for path in paths}}
    one = gr.prove_quiet(model, plain)
    other = gr.prove_quiet(model, {"inertia.*.drag_torque": (gr.factor(0.8), gr.factor(3.0))})
    assert (one.proven, one.refuted, one.open) == (other.proven, other.refuted, other.open)
    shares = one.boxes["all low"].to_numpy()
    factors = other.boxes["inertia.*.drag_torque low"].to_numpy()
    assert factors == pytest.approx(0.8 + 2.2 * shares)


def test_a_driveline_in_which_not_all_decays_is_not_proven() -> None:
    """Without damping in its mesh the oscillator keeps swinging; where it loses contact is shown all the same."""
    model = gr.example("backlash_oscillator").with_({"coupling.mesh.damping": 0.0})
    actual = gr.prove_quiet(model, {MEAN: (0.02, 0.3)})
    assert actual.proven == 0.0
    assert actual.refuted > 0.1
    assert {reason for reason, _ in actual.shares(OPEN)} >= {"undamped"}


def test_a_body_that_floats_is_open() -> None:
    model = gearbox(inertia__fifth__drag_torque=0.0, torque__0__mean=1.5 + 0.9 * 0.0222 / 0.0455)
    actual = gr.prove_quiet(model, {"mesh.m2.backlash": ("50 um", "90 um")})
    assert actual.open == 1.0
    assert set(actual.boxes["reason"]) == {"gap"}


def test_it_ends_at_its_budget_and_at_a_cancellation_with_what_is_known() -> None:
    few = gr.prove_quiet(gearbox(), BOX, boxes=20)
    assert not few.is_complete
    assert few.looked_at == 20
    assert 0.0 < few.open < 1.0
    assert any("undecided" in note for note in few.notes)

    def cancel(share: float) -> None:
        if share > 0.3:
            raise gr.Cancelled("enough")

    stopped = gr.prove_quiet(gearbox(), BOX, resolution=0.0, progress=cancel)
    assert not stopped.is_complete
    assert stopped.proven + stopped.refuted > 0.2
    assert gr.prove_quiet(gearbox(), BOX, resolution=0.0, within="50 ms").open > 0.0


def test_progress_never_falls() -> None:
    shares: list[float] = []
    gr.prove_quiet(gearbox(), BOX, resolution=0.1, progress=shares.append)
    assert shares == sorted(shares)
    assert max(shares) <= 1.0


@pytest.mark.parametrize(
    ("ranges", "words"),
    [
        ({}, "one range at least"),
        ({"mesh.m2.radii.0": (0.01, 0.02)}, "linear in"),
        ({"mesh.m2.backlash": (2e-4, 1e-4)}, "below the upper"),
        ({"mesh.m2.backlash": 1e-4}, "must be a pair"),
        ({"mesh.m9.backlash": (1e-4, 2e-4)}, "no mesh is named m9"),
        ({"mesh.m2.backlash": (0.0, 2e-4)}, "begin above zero"),
        ({"torque.0.harmonics.0.phase": (0.0, 1.0)}, "linear in"),
        ({SPEED: (70.0, 80.0), "excitation.frequency": (11.0, 12.0)}, "one quantity"),
        ({"a": {MEAN: (1.0, 2.0)}, MEAN: (1.0, 2.0)}, "a range already"),
    ],
)
def test_wrong_ranges_are_refused(ranges: dict[str, Any], words: str) -> None:
    with pytest.raises(gr.ModelError, match=words):
        gr.prove_quiet(gearbox(), ranges)


def test_what_is_not_linear_is_refused() -> None:
    """Alternating stiffness, a sweep, tables over a speed that varies."""
    ranges = {"mesh.m2.stiffness": (3e8, 4e8)}
    alternating = gearbox(mesh__m2__alternation={"order": 20.0, "share": 0.5, "fewer": 0.7})
    with pytest.raises(gr.ModelError, match="linear in its state"):
        gr.prove_quiet(alternating, ranges)
    with pytest.raises(gr.ModelError, match="repeat every period"):
        gr.prove_quiet(gr.example("run_up"), {"inertia.fifth_gear.drag_torque": (0.05, 0.1)})
    table = {"speed": [50.0, 100.0], "value": [0.2, 0.4]}
    with pytest.raises(gr.ModelError, match="tables over the speed"):
        gr.prove_quiet(gearbox(inertia__fifth__drag_torque=table), {SPEED: (70.0, 80.0)})
