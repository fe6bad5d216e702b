"""Exact data give the parameters back; what they cannot give is told; units and seeds behave."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from tests.measured.identification import made

OMEGA = np.concatenate([np.linspace(150.0, 3000.0, 40), np.linspace(3200.0, 30000.0, 60)])
CHAIN = ["inertia.hub.J", "inertia.wheel.J", "coupling.clutch.stiffness", "coupling.spline.stiffness"]
SCALE = [*CHAIN, "inertia.flywheel.J", "inertia.gear.J", "mesh.mesh.stiffness"]
DAMPED = [*SCALE, "coupling.clutch.damping", "coupling.spline.damping", "mesh.mesh.damping", "inertia.wheel.drag"]


def shapes(model: gr.Model) -> list[dict]:
    return [made.shape_row(model, number) for number in (2, 3, 4)]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_frequencies_and_shapes_give_parameters_back(seed: int) -> None:
    truth = made.train()
    data = {"mode": [*made.mode_rows(truth, [2, 3, 4]), *shapes(truth)]}
    free = [path for path in SCALE if path != "inertia.flywheel.J"]
    actual = gr.identification.fit(made.off(truth, free, seed), data, free, starts=4)
    assert [p.path for p in actual.parameters] == free
    for p in actual.parameters:
        assert p.value == pytest.approx(made.value(truth, p.path), rel=1e-8)
    assert not [c for c in actual.undetermined if c.structural]
    assert actual.chi_square < 1e-12
    assert actual.degrees_of_freedom == 3 + 3 * 4 - 3 - 6


@pytest.mark.parametrize("seed", [1, 2])
def test_responses_give_all_parameters_back(seed: int) -> None:
    truth = made.train()
    rows = [made.response_row(truth, at, "gear", OMEGA) for at in ("flywheel", "wheel", "gear")]
    actual = gr.identification.fit(made.off(truth, DAMPED, seed), {"response": rows}, DAMPED, starts=6)
    for p in actual.parameters:
        assert p.value == pytest.approx(made.value(truth, p.path), rel=1e-8)
    assert [(dict(c.exponents), c.structural) for c in actual.undetermined] == [({"inertia.wheel.drag": 1.0}, False)]
    assert actual.degrees_of_freedom == 6 * OMEGA.size - len(DAMPED)


def test_frequencies_alone_never_fix_the_scale() -> None:
    truth = made.train()
    data = {"mode": [*made.mode_rows(truth, [2, 3, 4]), *shapes(truth)]}
    start = made.off(truth, SCALE, 4)
    actual = gr.identification.fit(start, data, SCALE, starts=3)
    (only,) = [c for c in actual.undetermined if c.structural]
    assert only.exponents == dict.fromkeys(SCALE, 1.0)
    assert "by the same factor changes nothing: only their ratios are determined" in only.words
    assert all(np.isinf(p.standard_error) for p in actual.parameters)
    assert any("leave one known inertia out of free" in note for note in actual.notes)
    ratios = [p.value / made.value(truth, p.path) for p in actual.parameters]
    assert ratios == pytest.approx([ratios[0]] * len(ratios), rel=1e-8)
    moves = [np.log(p.value / p.start) for p in actual.parameters]
    assert np.sum(moves) == pytest.approx(0.0, abs=1e-9)  # what is open stays where the start had it


def test_more_stiffnesses_than_frequencies() -> None:
    truth = made.train()
    free = ["coupling.clutch.stiffness", "coupling.spline.stiffness", "mesh.mesh.stiffness", "mesh.mesh.damping"]
    actual = gr.identification.fit(truth, {"mode": made.mode_rows(truth, [2])}, free, starts=1)
    structural = [c for c in actual.undetermined if c.structural]
    assert len(structural) == 3
    assert structural[0].words == "mesh.mesh.damping: no datum depends on it"
    for c in structural[1:]:  # tangents of a surface of equal frequency: a small step is not noticed, to second order
        assert "as long as s is near 1" in c.words
        changes = []
        for s in (1.02, 1.01):
            moved = actual.model.with_({p: made.value(actual.model, p) * s**power for p, power in c.exponents.items()})
            changes.append(gr.modes(moved).frequencies[1] / gr.modes(actual.model).frequencies[1] - 1)
        assert abs(changes[0]) < 0.02**2
        assert changes[0] / changes[1] == pytest.approx(4.0, rel=0.05)


def test_a_product_is_told_as_such() -> None:
    """In the first stage the clutch's slope is stiffness times ratio: only the product can be seen."""
    truth = made.train()
    row = {"number": 2, "omega": 200.0, "region": {"clutch": 0}}
    free = ["coupling.clutch.stiffness", "coupling.clutch.stiffness_ratio"]
    actual = gr.identification.fit(truth, {"mode": [row]}, free, starts=2)
    assert actual.undetermined[0].exponents == {free[0]: 1.0, free[1]: -1.0}
    assert "only their products are determined" in actual.undetermined[0].words
    seen = gr.modes(actual.model, region={"clutch": 0}).frequencies[1]
    assert seen == pytest.approx(200.0, rel=1e-9)


def test_contact_ratio_of_the_call_is_the_default_of_the_data() -> None:
    truth = made.train()
    rows = [
        {k: v for k, v in row.items() if k != "contact_ratio"}
        for row in made.mode_rows(truth, [2, 3, 4], contact_ratio={"clutch": 0.1})
    ]
    free = ["coupling.clutch.stiffness", "coupling.spline.stiffness", "mesh.mesh.stiffness"]
    actual = gr.identification.fit(
        made.off(truth, free, 1), {"mode": rows}, free, contact_ratio={"clutch": 0.1}, starts=2
    )
    for p in actual.parameters:
        assert p.value == pytest.approx(made.value(truth, p.path), rel=1e-8)


def test_other_units_of_the_same_driveline() -> None:
    """Inertia times a, time times b: stiffness times a / b^2; the fit must be the same in the new units."""
    truth = made.train()
    a = 50.0
    b = 1e3
    power = {"J": a, "stiffness": a / b**2, "damping": a / b, "drag": a / b}
    data = {"mode": [*made.mode_rows(truth, [2, 3, 4]), *shapes(truth)[:2]]}
    data["mode"][0]["omega"] *= 1.01  # not exact: the best fit is a compromise
    start = made.off(truth, CHAIN, 7, 1.3)
    paths = [p for p in start.paths() if p.split(".")[-1] in power and p.count(".") == 2]
    scaled = start.with_({p: made.value(start, p) * power[p.split(".")[-1]] for p in paths})
    rows = [{**row, "omega": row["omega"] / b} if "omega" in row else row for row in data["mode"]]
    one, other = (gr.identification.fit(m, d, CHAIN, starts=3) for m, d in ((start, data), (scaled, {"mode": rows})))
    assert one.chi_square > 1e-3
    assert other.chi_square == pytest.approx(one.chi_square, rel=1e-8)
    for p, q in zip(one.parameters, other.parameters, strict=True):
        assert q.value == pytest.approx(p.value * power[p.path.split(".")[-1]], rel=1e-7)
        assert q.relative_error == pytest.approx(p.relative_error, rel=1e-6)


def test_the_seed_decides_and_a_repetition_is_the_same() -> None:
    truth = made.train()
    data = {"mode": [*made.mode_rows(truth, [2, 3, 4]), *shapes(truth)]}
    start = made.off(truth, CHAIN, 3)
    first, again, other = (gr.identification.fit(start, data, CHAIN, starts=4, seed=seed) for seed in (1, 1, 2))
    assert first.to_dict() == again.to_dict()
    assert first.model == again.model
    assert other.chi_square == pytest.approx(first.chi_square, abs=1e-12)


def test_the_prior_holds_what_the_data_leave_open() -> None:
    truth = made.train()
    actual = gr.identification.fit(truth, {"mode": made.mode_rows(truth, [2, 3, 4])}, SCALE, prior=0.2, starts=1)
    errors = [p.relative_error for p in actual.parameters]
    assert all(0.0 < error <= 0.2 * (1 + 1e-9) for error in errors)
    assert [c for c in actual.undetermined if c.structural]  # the data still do not say


def test_twins_that_the_data_do_not_tell_apart_are_reported() -> None:
    """The frequencies of a chain of three equal bodies do not say which spring is the stiffer one."""
    text = """
    schema = 1
    [[inertia]]
    name = "left"
    J = 1.0
    [[inertia]]
    name = "middle"
    J = 1.0
    [[inertia]]
    name = "right"
    J = 1.0
    [[coupling]]
    name = "one"
    between = ["left", "middle"]
    stiffness = 1.0
    [[coupling]]
    name = "two"
    between = ["middle", "right"]
    stiffness = 1.5
    [excitation]
    speed = 1.0
    """
    truth = gr.loads(text)
    data = {"mode": made.mode_rows(truth, [2, 3])}
    free = ["coupling.one.stiffness", "coupling.two.stiffness"]
    actual = gr.identification.fit(
        truth.with_({"coupling.one.stiffness": 1.2, "coupling.two.stiffness": 1.3}), data, free
    )
    answers = sorted(tuple(round(v, 6) for v in m.values.values()) for m in actual.minima if m.chi_square < 1e-9)
    assert answers == [(1.0, 1.5), (1.5, 1.0)]
    assert any("fit as well" in note for note in actual.notes)


STAR = """
schema = 1
inertia = [{ name = "hub", J = 1.0 }, { name = "a", J = 0.1 }, { name = "b", J = 0.1 }, { name = "c", J = 0.1 }]
coupling = [
  { name = "ka", between = ["hub", "a"], stiffness = 100.0 },
  { name = "kb", between = ["hub", "b"], stiffness = 100.0 },
  { name = "kc", between = ["hub", "c"], stiffness = 100.0 },
]
excitation = { speed = 1.0 }
"""
SPRINGS = ["coupling.ka.stiffness", "coupling.kb.stiffness", "coupling.kc.stiffness"]


def test_modes_of_equal_frequency_are_not_taken_for_an_open_direction() -> None:
    actual = gr.identification.fit(
        gr.loads(STAR), {"mode": made.mode_rows(gr.loads(STAR), [2, 3, 4])}, SPRINGS, starts=2
    )
    assert not any(c.structural for c in actual.undetermined)
    assert any("not noticed to first order" in c.words for c in actual.undetermined)


def test_shapes_without_numbers_find_modes_whose_order_has_changed() -> None:
    truth = gr.loads(STAR).with_({SPRINGS[0]: 150.0, SPRINGS[1]: 60.0})
    omega = gr.modes(truth).frequencies
    rows = [
        {**made.shape_row(truth, n, numbered=False), "omega": float(omega[n - 1]), "relative_error": 1e-3}
        for n in (4, 2, 3)
    ]
    start = gr.loads(STAR).with_({SPRINGS[0]: 70.0, SPRINGS[1]: 140.0})
    actual = gr.identification.fit(start, {"mode": rows}, SPRINGS, starts=1)
    assert [p.value for p in actual.parameters] == pytest.approx([150.0, 60.0, 100.0], rel=1e-8)


def test_a_bound_that_is_reached_is_told() -> None:
    truth = made.train()
    path = "coupling.clutch.stiffness"
    actual = gr.identification.fit(
        truth.with_({path: 1000.0}), {"mode": made.mode_rows(truth, [2])}, [path], bounds={path: (900, 1200)}
    )
    (only,) = actual.parameters
    assert (only.value, only.at_bound) == (1200.0, "upper")
    assert np.isnan(only.standard_error)
    assert any("on a bound" in note for note in actual.notes)
    assert any("residuals are larger than the standard errors allow" in note for note in actual.notes)
