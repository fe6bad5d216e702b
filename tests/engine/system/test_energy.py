"""The energy audit closes on true motions, gives closed forms, and fails on tampered ones."""

from typing import Any

import numpy as np
import pytest

from gearrattle.engine.solvers.exact import ExactMarch
from gearrattle.engine.system.energy_audit import Auditor, EnergyAudit, stored_energy
from gearrattle.outcome import Outcome
from tests.engine.solvers.tasks import GAP, oscillator, run, task
from tests.engine.system.drivelines import clearance, random_chain


def motion_of(seed: int, samples: int = 16):  # type: ignore[no-untyped-def]
    system = random_chain(seed)
    rng = np.random.default_rng(seed)
    return run(
        task(
            system,
            list(rng.normal(size=system.size) * 0.01),
            list(rng.normal(size=system.size)),
            cycles=3,
            samples=samples,
        )
    )


@pytest.mark.parametrize("seed", range(25))
def test_the_balance_closes_on_random_drivelines(seed: int) -> None:
    energy = motion_of(seed).energy
    assert energy.turnover > 0
    assert energy.relative_residual <= 1e-11


def test_free_vibration_through_a_gap_keeps_its_energy_and_loses_nothing() -> None:
    energy = run(task(oscillator(GAP), [1.25], [0.0], cycles=50)).energy
    assert energy.stored == pytest.approx((0.5 * 4.0 * 0.75**2,) * 2, rel=1e-13)
    assert (energy.torque_work.any(), energy.drag_loss.any(), energy.element_loss.any()) == (False, False, False)


def test_a_damper_that_stops_the_motion_has_taken_all_of_its_energy() -> None:
    energy = run(task(oscillator(drag=4.0), [0.3], [0.0], cycles=40)).energy
    assert energy.drag_loss[0] == pytest.approx(0.5 * 4.0 * 0.3**2, rel=1e-13)


def test_the_work_of_a_mean_torque_is_torque_times_angle() -> None:
    motion = run(task(oscillator(clearance(4.0, 0.3, 0.5), mean=1.5), [0.1], [0.0], cycles=6))
    assert motion.energy.torque_work[0] == pytest.approx(1.5 * (motion.angle[-1, 0] - 0.1), rel=1e-12)


def test_stored_energy_of_a_staged_law_is_the_area_under_it() -> None:
    law = clearance(10.0, 0.0, 0.5, 0.2)
    march = ExactMarch(task(oscillator(law), [0.0], [0.0]))
    fine = np.linspace(0, -1.3, 200_001)
    area = np.trapezoid([law.elastic(float(d)) for d in fine], fine)
    assert stored_energy(march.flow, np.array([-1.3]), np.array([2.0])) == pytest.approx(2.0 + area, rel=1e-9)


def with_samples(parts: dict[str, Any]) -> dict[str, Any]:
    """Arguments of an audit: sampled states as a function of their rows."""
    return {**parts, "samples": lambda rows: parts["samples"][rows], "count": len(parts["samples"])}


def tampered(**changes: object) -> EnergyAudit:
    problem = task(oscillator(clearance(4.0, 0.3, 0.5), force=3.0), [1.25], [0.0], cycles=6, samples=4)
    march = ExactMarch(problem)
    while march.advance():
        pass
    crossings = march.motion().crossings
    true = {
        "samples": march.sampled_z(),
        "per_cycle": 4,
        "time": crossings.time,
        "watch": crossings.clearance,
        "upward": (crossings.to_piece > crossings.from_piece).astype(np.int64),
        "memory": np.zeros((len(crossings.time), 0)),
    }
    first = march.slots.pieces[march.slots.slot_of((int(march.initial[0]),))]
    parts = {k: changes[k](v) if k in changes else v for k, v in true.items()}  # type: ignore[operator]
    auditor = Auditor(march.flow, first, **with_samples(parts))
    while not auditor.advance(3):
        assert 0 < auditor.fraction() < 1
    return auditor.result()


def test_the_audit_can_fail() -> None:
    assert tampered().relative_residual <= 1e-13
    late = {"time": lambda t: t + 1e-3}
    assert tampered(**late).relative_residual > 1e-6

    def nudged(states: np.ndarray) -> np.ndarray:
        states = states.copy()
        states[-1, 1] *= 1.001
        return states

    assert tampered(samples=nudged).relative_residual > 1e-6
    missed = {key: (lambda a: np.delete(a, [2, 3])) for key in ("time", "clearance", "piece")}
    assert tampered(**missed).relative_residual > 1e-6


@pytest.mark.parametrize(("late", "least", "most"), [(1e-4, 1e-5, 4e-5), (1e-6, 1e-7, 4e-7), (1e-8, 1e-9, 4e-9)])
def test_a_damped_crossing_that_is_late_shows_in_proportion(late: float, least: float, most: float) -> None:
    """One of five crossings, by a part of the period; the docs say what the audit can see."""
    for crossing in range(5):
        shift = late * (np.arange(5) == crossing)
        assert least < tampered(time=lambda t, shift=shift: t + shift).relative_residual < most


def audited(**changes: object) -> EnergyAudit:
    """A clutch with sliders and clipped damping; ``changes`` take the place of parts of its log."""
    import gearrattle as gr
    from gearrattle.simulation.simulate import prepare
    from tests.architecture.places import EXAMPLES

    model = gr.load(EXAMPLES / "clutch_friction.toml")
    march = ExactMarch(prepare(model, {"cycles": 3, "samples_per_cycle": 16, "discard": 0}, False).task)
    while march.advance():
        pass
    motion, system = march.motion(), march.flow.system
    auxiliaries, pieces = motion.auxiliaries, [0] * (len(system.laws) + len(system.auxiliaries))
    for position, piece in zip(system.places, (*motion.initial_piece, *auxiliaries.initial), strict=True):
        pieces[position] = int(piece)
    log = {
        "time": auxiliaries.passages.time / system.inputs.period,
        "watch": auxiliaries.passages.watch,
        "upward": auxiliaries.passages.upward,
        "memory": auxiliaries.passages.memory * march.flow.memory,
    }
    parts = {"samples": march.sampled_z(), "per_cycle": 16, **log, **changes}
    if "without" in parts:
        gone = np.flatnonzero(log["watch"] == parts.pop("without"))[:1]
        parts |= {name: np.delete(values, gone, axis=0) for name, values in log.items()}
    if "late" in parts:
        parts["time"] = np.sort(log["time"] + parts.pop("late") * (log["watch"] == 3))
    auditor = Auditor(march.flow, tuple(pieces), **with_samples(parts))
    while not auditor.advance():
        pass
    return auditor.result()


def test_the_balance_of_a_clutch_with_friction_closes() -> None:
    energy = audited()
    assert energy.relative_residual <= 1e-13
    assert energy.friction_loss[0] > 0.5 * energy.element_loss[0] > 0.0
    assert not energy.friction_loss[1:].any()


@pytest.mark.parametrize(
    "changes",
    [{"without": 3}, {"without": 4}, {"without": 8}, {"late": 1e-5}],
    ids=["slip", "outer", "clipping", "late"],
)
def test_a_switch_that_is_missing_or_late_shows(changes: dict[str, object]) -> None:
    assert audited(**changes).relative_residual > 1e-9


@pytest.mark.parametrize("seed", range(8))
def test_steps_of_any_length_give_the_same_works(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    long_ones = motion_of(seed, samples=1).energy
    monkeypatch.setattr("gearrattle.engine.system.state_moments.MOST_BYTES", 0)
    short_ones = motion_of(seed, samples=1).energy
    for name in ("torque_work", "drag_loss", "element_loss", "error_work"):
        apart = np.abs(getattr(long_ones, name) - getattr(short_ones, name)).max()
        assert 0.0 < apart + 1e-300 <= 1e-11 * short_ones.turnover


@pytest.mark.parametrize("seed", range(8))
def test_whole_intervals_give_the_works_of_their_steps(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    together = motion_of(seed, samples=64).energy
    monkeypatch.setattr("gearrattle.engine.system.energy_audit._UNCUT", -1.0)
    by_steps = motion_of(seed, samples=64).energy
    for name in ("torque_work", "drag_loss", "element_loss", "error_work"):
        apart = np.abs(getattr(together, name) - getattr(by_steps, name)).max()
        assert apart <= 1e-13 * by_steps.turnover


@pytest.mark.parametrize("damping", [1e6, 1e9, 1e12])
def test_a_mode_that_dies_out_at_once_does_not_hold_the_audit_up(damping: float) -> None:
    system = oscillator(clearance(4.0, damping, 0.5), force=3.0)
    march = ExactMarch(task(system, [1.25], [0.0], cycles=6, samples=4))
    while march.advance():
        pass
    assert march.auditor is not None
    assert march.auditor.steps.length.shape[1] > 20
    assert march.motion().energy.relative_residual <= 1e-11


def test_an_audit_of_millions_of_steps_an_interval_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gearrattle.engine.system.state_moments.MOST_BYTES", 0)
    march = ExactMarch(task(oscillator(clearance(4.0, 1e12, 0.5), force=3.0), [1.25], [0.0], cycles=2, samples=4))
    while (outcome := march.advance()) is Outcome.SLICE_SPENT:
        pass
    assert outcome is Outcome.AUDIT_TOO_LONG
    assert march.position().fastest == 0
