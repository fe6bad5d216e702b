"""Bifurcation diagrams: closed forms, Floquet multipliers where a period doubles, hysteresis, and the same bits."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.errors import Cancelled, ModelError
from gearrattle.studies import bifurcation_study
from gearrattle.studies.coexistence import hysteresis, stretches, sweeps_of
from tests.studies import oscillator
from tests.studies.clusters import dask
from tests.studies.drivelines import model as two_bodies
from tests.studies.oscillator import AMPLITUDE, DRAG, LIMIT, from_quiet, model, quiet

SHORT = {"cycles": 60, "discard": 40}


def leftmost(data: xr.Dataset) -> np.ndarray:
    return np.asarray(data["multiplier real"].min("multiplier").values)


@pytest.fixture(scope="module")
def doubling() -> xr.Dataset:
    """Upward through the first doubling of the period, finely."""
    values = [6.0, *np.arange(6.20, 6.345, 0.01).round(3).tolist(), 6.4]
    return gr.bifurcation(from_quiet(6.0), AMPLITUDE, values, direction="up", cycles=460, discard=400, workers=1)


def test_contact_is_kept_up_to_the_limit_of_the_closed_form() -> None:
    values = [LIMIT * x for x in (0.2, 0.5, 0.8, 0.95, 0.99, 0.995, 0.999, 1.001, 1.005)]
    actual = gr.bifurcation(model(), AMPLITUDE, values, direction="up", cycles=150, discard=130, phase=0.25)
    words = [("quiet", "single-sided", "double-sided")[code] for code in actual["verdict"].values[0]]
    assert words == ["quiet"] * 7 + ["single-sided"] * 2
    for i, value in enumerate(values[:7]):
        want = quiet(value, 0.25)
        settled = [float(actual[name][0, i, -1]) for name in ("deflection.flanks", "rate.flanks")]
        np.testing.assert_allclose(settled, want, rtol=0, atol=1e-7)  # the example's phase has seven decimals
    assert np.all(actual["period"].values[0, :7] == 1)


def test_multipliers_of_the_quiet_motion_are_those_of_the_closed_oscillator() -> None:
    """exp(lambda T), lambda = -d/2 +- i sqrt(k - d^2/4)."""
    actual = gr.bifurcation(model(), AMPLITUDE, [1.0, 2.0], direction="up", cycles=80, discard=40)
    want = np.exp(-DRAG / 2 + 1j * np.sqrt(oscillator.STIFFNESS - DRAG**2 / 4))
    actual = actual["multiplier real"].values + 1j * actual["multiplier imaginary"].values
    for one in actual[0]:
        np.testing.assert_allclose(np.sort_complex(one), np.sort_complex([want, want.conjugate()]), rtol=0, atol=1e-9)


def test_the_diagram_splits_where_a_multiplier_is_minus_one(doubling: xr.Dataset) -> None:
    up = doubling.isel(direction=0)
    values, period = up[AMPLITUDE].values, up["period"].values
    last = int(np.flatnonzero(period == 1)[-1])
    assert period[last + 1] == 2
    before = slice(last - 3, last + 1)
    assert np.all(np.diff(leftmost(up)[before]) < 0)
    line = np.polynomial.Polynomial.fit(leftmost(up)[before], values[before], 2)
    assert values[last] <= line(-1.0) <= values[last + 1]
    # beyond it the two points part as the square root of the distance, as at every supercritical doubling
    gap = np.ptp(up["rate.flanks"].values[last + 1 : last + 6, -2:], axis=1) ** 2
    zero = np.polynomial.Polynomial.fit(gap, values[last + 1 : last + 6], 2)(0.0)
    assert zero == pytest.approx(line(-1.0), abs=2e-3)


def test_multipliers_are_those_of_differences_of_the_stroboscopic_map(doubling: xr.Dataset) -> None:
    for i in (2, 15):
        one = doubling.isel(direction=0, **{AMPLITUDE: i})
        n = int(one["period"])
        start = [float(one["angle at the end"][0]), float(one["velocity at the end"][0])]
        changed = model(float(one[AMPLITUDE]))

        def mapped(state: list[float], changed: gr.Model = changed, n: int = n) -> np.ndarray:
            initial = {"angle": [state[0]], "velocity": [state[1]]}
            run = gr.simulate(changed, cycles=n, discard=0, samples_per_cycle=1, initial=initial, audit=False)
            return np.array([run.trajectory.angle[-1, 0], run.trajectory.velocity[-1, 0]])

        step = 1e-6
        columns = []
        for k in range(2):
            aside = [[x + sign * step * (j == k) for j, x in enumerate(start)] for sign in (1, -1)]
            columns.append((mapped(aside[0]) - mapped(aside[1])) / (2 * step))
        want = np.linalg.eigvals(np.column_stack(columns))
        actual = one["multiplier real"].values + 1j * one["multiplier imaginary"].values
        np.testing.assert_allclose(np.sort_complex(actual), np.sort_complex(want), rtol=0, atol=2e-5)
        assert float(one["largest Lyapunov exponent"]) == pytest.approx(np.log(np.abs(want).max()) / n, abs=1e-4)
        assert np.prod(actual) == pytest.approx(np.exp(-n * DRAG), rel=1e-9)  # Liouville: only the drag shrinks areas


def test_chaos_is_told_by_a_positive_exponent_and_by_no_period() -> None:
    light = {"torque.0.mean": 0.5}
    actual = gr.bifurcation(model(), AMPLITUDE, [2.0, 3.0], direction="up", cycles=500, discard=300, fixed=light)
    one = actual.isel(direction=0, **{AMPLITUDE: -1})
    assert [stretch.motion for stretch in stretches(actual.isel(direction=0))] == ["chaotic"]
    assert float(one["largest Lyapunov exponent"]) > 0.1
    assert np.isnan(float(one["period"]))
    assert np.ptp(one["rate.flanks"].values) > 0.3
    # another path to the exponent: how two neighbours part, over many starts along the cloud
    grown = []
    for x, v in zip(one["deflection.flanks"].values[::2], one["rate.flanks"].values[::2], strict=True):
        ends = [
            gr.simulate(
                model(3.0).with_(light),
                cycles=6,
                discard=0,
                samples_per_cycle=1,
                audit=False,
                initial={"angle": [x + aside], "velocity": [v]},
            ).trajectory
            for aside in (0.0, 1e-9)
        ]
        states = [np.array([t.angle[:, 0], t.velocity[:, 0] / (2 * np.pi)]) for t in ends]
        parted = np.linalg.norm(states[0] - states[1], axis=0)
        grown.append(np.log(parted[6] / parted[1]) / 5.0)
    assert np.mean(grown) == pytest.approx(float(one["largest Lyapunov exponent"]), abs=0.25)


def test_hysteresis_is_told_and_both_motions_are_motions() -> None:
    values = [1.0, 2.5, 4.0, 5.5, 7.0]
    actual = gr.bifurcation(model(), AMPLITUDE, values, cycles=160, discard=120, workers=1)
    assert actual["motions"].values.tolist() == [0, 1, 1, 1, 0]
    assert actual["verdict"].values.tolist() == [[0, 0, 0, 0, 2], [0, 1, 2, 2, 2]]
    for i in (0, 1):  # each settled motion, begun anew from its state, stays what it is
        one = actual.isel(direction=i, **{AMPLITUDE: 2})
        initial = {
            "angle": one["angle at the end"].values.tolist(),
            "velocity": one["velocity at the end"].values.tolist(),
        }
        run = gr.simulate(model(4.0), cycles=50, discard=0, samples_per_cycle=1, initial=initial, audit=False)
        np.testing.assert_allclose(run.trajectory.angle[:, 0], float(one["angle at the end"][0]), atol=1e-6)
    assert actual.attrs["kind"] == "bifurcation"


def test_every_value_begins_with_the_end_of_the_one_before() -> None:
    values = [3.0, 5.0, 7.0]
    actual = gr.bifurcation(model(), AMPLITUDE, values, cycles=8, discard=4, workers=1)
    for i, way in enumerate((values, values[::-1])):
        state: Any = "steady"
        for value in way:
            run = gr.simulate(model(value), cycles=8, discard=4, samples_per_cycle=1, initial=state, audit=False)
            one = actual.isel(direction=i).sel({AMPLITUDE: value})
            assert one["deflection.flanks"].values.tolist() == run.trajectory.deflection[5:, 0].tolist()
            state = {"angle": run.trajectory.angle[-1].tolist(), "velocity": run.trajectory.velocity[-1].tolist()}


def test_a_rate_is_the_derivative_of_the_deflection() -> None:
    error = {"mesh.gear.transmission_error": [{"order": 20, "amplitude": "5 um", "phase": 0.4}]}
    case = gr.load(oscillator.EXAMPLES / "paper" / "case2.toml").with_(error)
    names = ["deflection.gear", "rate.gear", "velocity.hub"]
    actual = gr.bifurcation(
        case,
        "torque.0.harmonics.0.amplitude",
        [200.0, 202.5],
        direction="up",
        cycles=4,
        discard=3,
        phase=0.3,
        section=names,
    )
    fine = gr.simulate(
        case.with_({"torque.0.harmonics.0.amplitude": 200.0}),
        cycles=4,
        discard=3,
        samples_per_cycle=200_000,
        audit=False,
    )
    delta = fine.data["deflection"].sel(clearance="gear")
    at = 3 * 200_000 + 60_000
    step = float(delta["time"][1] - delta["time"][0])
    slope = float(delta[at + 1] - delta[at - 1]) / (2 * step)
    one = actual.isel({"direction": 0, "torque.0.harmonics.0.amplitude": 0})
    assert float(one["deflection.gear"][-1]) == pytest.approx(float(delta[at]), rel=1e-9)
    assert float(one["rate.gear"][-1]) == pytest.approx(slope, rel=1e-5)
    assert float(one["velocity.hub"][-1]) == pytest.approx(
        float(fine.data["velocity"].sel(inertia="hub")[at]), rel=1e-9
    )
    assert actual["rate.gear"].attrs["units"] == "m/s"


def _stops_after(count: int) -> Callable[[float], None]:
    seen = []

    def progress(_: float) -> None:
        seen.append(1)
        if len(seen) > count:
            raise Cancelled("enough")

    return progress


@pytest.mark.parametrize("damage", [False, pytest.param(True, marks=pytest.mark.long)])
def test_stopped_within_a_sweep_it_goes_on_from_there_to_the_same_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, damage: bool
) -> None:
    values = {"from": 5.0, "to": 6.8, "count": 5}
    whole = gr.bifurcation(model(), AMPLITUDE, values, **SHORT, workers=1)
    monkeypatch.setattr(bifurcation_study, "_KEEP_EVERY", 0.0)
    with pytest.raises(Cancelled):
        gr.bifurcation(model(), AMPLITUDE, values, **SHORT, workers=1, output=tmp_path / "a", progress=_stops_after(3))
    (part,) = (tmp_path / "a" / "done").glob("*.part")
    if damage:
        part.write_bytes(part.read_bytes()[:-50])
    begun = []
    plain = bifurcation_study.simulate
    monkeypatch.setattr(bifurcation_study, "simulate", lambda *a, **k: (begun.append(1), plain(*a, **k))[1])
    again = gr.bifurcation(model(), AMPLITUDE, values, **SHORT, workers=1, output=tmp_path / "a", resume=True)
    assert again.identical(whole)
    assert len(begun) == 10 if damage else 5 < len(begun) < 10
    assert not list((tmp_path / "a" / "done").glob("*.part"))
    assert gr.open_study(tmp_path / "a").identical(whole)


@pytest.mark.slow
def test_further_axes_and_workers_change_nothing(tmp_path: Path) -> None:
    axes = {"inertia.gear.drag": [0.5, 0.6]}
    one = gr.bifurcation(model(), AMPLITUDE, [5.0, 6.0], axes=axes, **SHORT, workers=1)
    two = gr.bifurcation(model(), AMPLITUDE, [5.0, 6.0], axes=axes, **SHORT, workers=2, scheduler="threads")
    assert one.identical(two)
    assert [name for name, _ in sweeps_of(one)] == [
        f"drag of gear = {drag}, {way}" for drag in (0.5, 0.6) for way in ("up", "down")
    ]
    alone = gr.bifurcation(model(), AMPLITUDE, [5.0, 6.0], **SHORT, workers=1)
    assert alone["rate.flanks"].equals(one["rate.flanks"].sel({"inertia.gear.drag": 0.6}, drop=True))


@pytest.mark.long
def test_processes_and_a_cluster_give_the_same_bits(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    values = [5.0, 5.5, 6.0, 6.5]
    one = gr.bifurcation(model(), AMPLITUDE, values, **SHORT, workers=1)
    assert gr.bifurcation(model(), AMPLITUDE, values, **SHORT, workers=2).identical(one)
    with dask(tmp_path, 1) as cluster:
        far = gr.bifurcation(model(), AMPLITUDE, values, **SHORT, scheduler=cluster.address, output=tmp_path / "shared")
    assert far.identical(one)


def test_paths_swept_together_are_told_by_the_first_of_them() -> None:
    both = {AMPLITUDE: [1.0, 2.0], "torque.0.mean": [7.5, 7.6]}
    actual = gr.bifurcation(model(), "load", both, direction="up", **SHORT, workers=1)
    assert actual["load"].values.tolist() == [0, 1]
    (only,) = stretches(actual.isel(direction=0))
    assert (only.low, only.high, only.count) == (1.0, 2.0, 2)  # torque.0.harmonics comes before torque.0.mean


def test_a_case_that_fails_is_told_and_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, values = bifurcation_study.simulate, [1.0, 1.5, 2.0, 2.5]

    def fails(changed: gr.Model, **settings: Any) -> gr.Run:
        if changed.torques[0].harmonics[0].amplitude == 1.5:
            raise gr.ConvergenceError("lost")
        return plain(changed, **settings)

    monkeypatch.setattr(bifurcation_study, "simulate", fails)
    with pytest.warns(RuntimeWarning, match=r"goes on without 2 cases \(6 done, 2 did not converge\); .*: lost"):
        actual = gr.bifurcation(model(), AMPLITUDE, values, **SHORT, workers=1)
    monkeypatch.undo()
    assert actual["outcome"].values.tolist() == [[1, 3, 1, 1]] * 2
    assert actual["motions"].values[1] == -1
    assert "lost" in actual.attrs["failures"][0]
    without = gr.bifurcation(model(), AMPLITUDE, [1.0, 2.0, 2.5], **SHORT, workers=1)
    assert actual["rate.flanks"].sel({AMPLITUDE: [1.0, 2.0, 2.5]}).equals(without["rate.flanks"])
    one = gr.bifurcation(model(), AMPLITUDE, [1.0, 2.0], **SHORT, direction="down")
    assert hysteresis(one) is None


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"path": "torque.0.harmonic.0.amplitude"}, "did you mean"),
        ({"values": [2.0, 1.0]}, "ascend"),
        ({"values": [2.0]}, "two values"),
        ({"path": "simulation.algorithm", "values": ["exact", "rk4"]}, "must be a number"),
        ({"direction": "sideways"}, 'must be "both" or "up" or "down"'),
        ({"phase": 1.0}, "fraction of the period"),
        ({"phase": 0.123456}, "the nearest is"),
        ({"section": ["deflection.flank"]}, 'did you mean "deflection.flanks"'),
        ({"section": []}, "one quantity"),
        ({"tolerance": 0.5}, "below 0.1"),
        ({"axes": {AMPLITUDE: [1.0]}}, "varied twice"),
        ({"cycles": 10, "discard": 10}, "discard"),
        ({"outputs": ["noise"]}, "no such output"),
    ],
)
def test_wrong_arguments_are_refused(arguments: dict[str, Any], match: str) -> None:
    inputs = {"path": AMPLITUDE, "values": [1.0, 2.0], **arguments}
    with pytest.raises(ModelError, match=match):
        gr.bifurcation(model(), **inputs)


def test_a_driveline_without_clearances_is_refused() -> None:
    with pytest.raises(ModelError, match="no clearance"):
        gr.bifurcation(two_bodies().with_({"coupling.joint.clearance": None}), "torque.0.mean", [0.3, 0.6])
