"""Torque-angle loops: the law that made them comes back; the regression against the package's own static loop."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.measured.identification.loop_data import read_loop
from gearrattle.measured.identification.loop_law import Regression, Shape
from tests.measured.identification.loops_made import DEGREE, damper, model_of, numbers, sampled

LAW = {
    "name": "damper",
    "stages": [
        {"stiffness": 400.0, "until": 5 * DEGREE, "hysteresis": 8.0, "stick_stiffness": 5000.0},
        {"stiffness": 1000.0, "hysteresis": 20.0, "stick_stiffness": 12000.0},
    ],
    "coast_stages": [
        {"stiffness": 600.0, "until": 4 * DEGREE, "hysteresis": 8.0, "stick_stiffness": 5000.0},
        {"stiffness": 1500.0, "hysteresis": 26.0, "stick_stiffness": 16000.0},
    ],
    "preload": 3.0,
}
LOW, HIGH = -9 * DEGREE, 12 * DEGREE


def written(path: Path, deflection: np.ndarray, torque: np.ndarray, head: str = "angle [deg], torque [N*m]") -> Path:
    rows = [f"{a:.6f}, {b:.6f}" for a, b in zip(deflection / DEGREE, torque, strict=True)]
    path.write_text("\n".join(["# a rig", head, *rows]) + "\n", encoding="utf-8")
    return path


def test_columns_are_the_packages_own_loop() -> None:
    """With all breaks and reaches given, the regression leaves nothing of the loop that ``torque_angle`` draws."""
    for seed in (4, 28):
        table, low, high = damper(seed)
        sides = {"drive": table["stages"], "coast": table["coast_stages"]}
        reach = {("centre", 0): 0.5 * table["stages"][0]["hysteresis"] / table["stages"][0]["stick_stiffness"]}
        for side, stages in sides.items():
            for i in range(1, len(stages)):
                more = stages[i]["hysteresis"] - stages[i - 1]["hysteresis"]
                reach[(side, i)] = 0.5 * more / stages[i]["stick_stiffness"]
        breaks = {side: tuple(s["until"] for s in stages[:-1]) for side, stages in sides.items()}
        parted = table["stages"][0]["stiffness"] != table["coast_stages"][0]["stiffness"]
        shape = Shape(breaks["drive"], breaks["coast"], parted, "", tuple(reach.items()))
        drawn = gr.torque_angle(model_of(table), "damper", low, high)
        legs = (slice(0, drawn.turn + 1), slice(drawn.turn, None))
        deflection, torque = [], []
        for leg in legs:
            x, y = drawn.deflection[leg], drawn.torque[leg]
            grid = np.linspace(x[0], x[-1], 701)
            away = np.min(np.abs(grid[:, None] - x[1:-1]), axis=1) > 1e-9
            order = slice(None, None, 1 if x[-1] > x[0] else -1)
            deflection.append(grid[away])
            torque.append(np.interp(grid[away], x[order], y[order]))
        regression = Regression(read_loop((np.concatenate(deflection), np.concatenate(torque))), 0, 1e-3)
        solved = regression.solve(shape)
        left = regression.torque - regression.table(shape, solved.labels) @ solved.coefficients
        assert np.abs(left).max() < 1e-6 * np.abs(regression.torque).max()


def test_a_loop_without_noise_gives_its_law_back() -> None:
    fit = gr.identification.fit_loop(sampled(LAW, LOW, HIGH, noise=0.0, seed=0, cycles=1))
    truth = numbers(LAW)
    assert set(fit.values) == set(truth)
    for name, value in truth.items():
        assert fit.values[name] == pytest.approx(value, rel=0.02 if "stick" in name else 2e-3), name


@pytest.mark.slow
def test_noisy_loops_come_back_within_the_errors_stated() -> None:
    """Two per cent noise: boundaries and slopes within 3 %, heights within 5 % of their own values; normal pulls."""
    pulls = []
    for seed in (0, 8):
        table, low, high = damper(seed)
        fit, truth = gr.identification.fit_loop(sampled(table, low, high, noise=0.02, seed=1000 + seed)), numbers(table)
        assert (len(fit.stages), len(fit.coast_stages)) == (len(table["stages"]), len(table["coast_stages"]))
        for name, value in truth.items():
            limit = {"stiffness": 0.03, "until": 0.03, "hysteresis": 0.05}.get(name.rpartition(".")[2])
            if limit is not None:
                assert fit.values[name] == pytest.approx(value, rel=limit), (seed, name)
                pulls.append((fit.values[name] - value) / fit.errors[name])
    assert 0.5 < np.sqrt(np.mean(np.square(pulls))) < 1.6


def test_stage_counts_may_be_told_and_resampling_agrees_with_the_covariance() -> None:
    fit = gr.identification.fit_loop(sampled(LAW, LOW, HIGH, noise=0.02, seed=5), (2, 2), bootstrap=12, seed=1)
    assert (len(fit.stages), len(fit.coast_stages)) == (2, 2)
    for name in ("stages.0.stiffness", "stages.1.stiffness", "coast_stages.1.hysteresis", "stages.0.hysteresis"):
        assert 0.4 < fit.bootstrap_errors[name] / fit.errors[name] < 2.2, name


def test_the_fitted_coupling_draws_the_measured_loop_and_stands_in_a_model_file() -> None:
    deflection, torque = sampled(LAW, LOW, HIGH, noise=0.01, seed=3, cycles=1)
    fit = gr.identification.fit_loop((deflection, torque))
    drawn = fit.drawn()
    up = slice(0, drawn.turn + 1)
    middle = slice(100, 1900)
    left = torque[middle] - np.interp(deflection[middle], drawn.deflection[up], drawn.torque[up])
    assert np.sqrt(np.mean(left**2)) < 1.1 * 0.01 * fit.full_scale
    assert tomllib.loads(fit.toml)["coupling"][0] == fit.coupling
    model = model_of(fit.coupling)
    assert model.couplings[0].drive_pieces[0].hysteresis == fit.stages[0].hysteresis
    assert drawn.loss == pytest.approx(gr.torque_angle(model_of(LAW), "damper", LOW, HIGH).loss, rel=0.02)


def test_friction_that_the_samples_do_not_resolve_has_the_default_stick_stiffness() -> None:
    law = {**LAW, "stages": [{"stiffness": 500.0, "hysteresis": 4.0, "stick_stiffness": 1e6}]}
    law.pop("coast_stages")
    fit = gr.identification.fit_loop(sampled(law, LOW, HIGH, noise=0.02, seed=2, cycles=1, samples=400))
    assert fit.stages[0].stick_stiffness is None
    assert any("stick stiffness" in note and "20 times" in note for note in fit.notes)
    assert fit.stages[0].hysteresis == pytest.approx(4.0, abs=4 * fit.errors["stages.0.hysteresis"])


def test_a_free_gap_and_a_linear_shaft_are_loops_too() -> None:
    gap = {
        "name": "damper",
        "preload": 0.0,
        "stages": [
            {"stiffness": 0.0, "until": 3 * DEGREE, "hysteresis": 6.0, "stick_stiffness": 4000.0},
            {"stiffness": 900.0, "hysteresis": 6.0},
        ],
    }
    fit = gr.identification.fit_loop(sampled(gap, LOW, HIGH, noise=0.01, seed=6))
    assert fit.stages[0].stiffness < 20.0
    assert fit.stages[0].until == pytest.approx(3 * DEGREE, rel=0.02)
    assert fit.stages[1].hysteresis == pytest.approx(6.0, rel=0.05)
    assert model_of(fit.coupling).couplings[0].stages is not None
    shaft = {"name": "damper", "preload": 1.0, "stages": [{"stiffness": 500.0}]}
    fit = gr.identification.fit_loop(sampled(shaft, LOW, HIGH, noise=0.01, seed=6))
    assert (len(fit.stages), len(fit.coast_stages)) == (1, 1)
    assert fit.stages[0].stiffness == pytest.approx(500.0, rel=0.01)
    assert fit.stages[0].hysteresis < 4 * max(fit.errors["stages.0.hysteresis"], 0.05)


@pytest.mark.slow
def test_correlated_noise_widens_the_errors() -> None:
    deflection, torque = sampled(LAW, LOW, HIGH, noise=0.0, seed=0)
    white = np.random.default_rng(7).standard_normal(torque.size)
    slow = np.convolve(white, np.ones(9) / 3.0, mode="same")
    one, other = (gr.identification.fit_loop((deflection, torque + 2.0 * noise), (2, 2)) for noise in (white, slow))
    assert one.tau == pytest.approx(1.0, abs=0.1)
    assert other.tau == pytest.approx(9.0, rel=0.3)
    assert 2.0 < other.errors["stages.1.stiffness"] / one.errors["stages.1.stiffness"] < 4.5


def test_one_cycle_that_begins_and_ends_at_zero_gives_the_same_stages() -> None:
    phase = np.linspace(0.0, 2.0 * np.pi, 1001)
    deflection, torque = 12.0 * DEGREE * np.sin(phase), 6.0 / DEGREE * 12.0 * DEGREE * np.sin(phase)
    torque = torque + 4.0 * np.sign(np.cos(phase)) + np.random.default_rng(0).normal(0.0, 0.05, phase.size)
    loop = read_loop((deflection, torque))
    assert loop.ends == pytest.approx((-12.0 * DEGREE, 12.0 * DEGREE), rel=1e-4)
    assert loop.deflection.size == 1002
    assert sorted(set(loop.leg.tolist())) == [0, 1]
    assert any("joined" in note for note in loop.notes)
    rubbing = loop.torque - 6.0 / DEGREE * loop.deflection
    assert np.mean(rubbing[loop.way > 0]) == pytest.approx(4.0, abs=0.05)
    assert np.mean(rubbing[loop.way < 0]) == pytest.approx(-4.0, abs=0.05)


def test_a_first_loading_is_no_part_of_a_closed_cycle() -> None:
    phase = np.linspace(0.0, 2.0 * np.pi, 1001)
    torque = 72.0 * np.sin(phase) + np.where(phase < 0.5 * np.pi, 0.0, 20.0 * np.sign(np.cos(phase)))
    with pytest.raises(gr.ModelError, match=r"not closed.*back to the first"):
        read_loop((12.0 * DEGREE * np.sin(phase), torque))


ANGLE = np.concatenate([np.linspace(-10, 10, 200), np.linspace(10, -10, 200)[1:]]) * DEGREE


@pytest.mark.parametrize(
    ("deflection", "torque", "words"),
    [
        (ANGLE[:30], ANGLE[:30], "too few points"),
        (ANGLE[:200], 10 * ANGLE[:200], "no reversal"),
        (ANGLE[:260], 10 * ANGLE[:260], "not closed"),
        (ANGLE, 10 * ANGLE + np.linspace(0, 3, ANGLE.size), "not closed"),
        (ANGLE + 0.5, 10 * ANGLE, "both sides of zero"),
        (ANGLE, ANGLE[:-1], "same length"),
        (ANGLE, np.full(ANGLE.size, np.nan), "finite"),
        (0 * ANGLE, ANGLE, "constant"),
    ],
)
def test_what_is_no_loop_is_refused(deflection: np.ndarray, torque: np.ndarray, words: str) -> None:
    with pytest.raises(gr.ModelError, match=words) as caught:
        gr.identification.fit_loop((deflection, torque))
    assert len(caught.value.problems) == 1


def test_draws_that_are_none_are_refused() -> None:
    with pytest.raises(gr.ModelError, match="from 2"):
        gr.identification.fit_loop((ANGLE, ANGLE), bootstrap=1)


def test_a_first_loading_cycles_of_unlike_ends_and_a_shaky_angle_are_borne() -> None:
    """As from a rig: it starts at rest, its turns differ by some tenths of a degree, and the angle is noisy."""
    random = np.random.default_rng(8)
    legs = []
    law = model_of(LAW)
    for low, high in ((LOW, HIGH), (LOW + 0.002, HIGH - 0.003), (LOW + 0.001, HIGH)):
        drawn = gr.torque_angle(law, "damper", low, high)
        up, down = slice(0, drawn.turn + 1), slice(drawn.turn, None)
        for x, y in ((drawn.deflection[up], drawn.torque[up]), (drawn.deflection[down], drawn.torque[down])):
            grid = np.linspace(x[0], x[-1], 2000)
            order = slice(None, None, 1 if x[-1] > x[0] else -1)
            legs.append((grid, np.interp(grid, x[order], y[order])))
    first = np.linspace(0.0, LOW, 500)
    deflection = np.concatenate([first, *(x for x, _ in legs)])
    torque = np.concatenate([np.full(500, -40.0), *(y for _, y in legs)])
    shaky = deflection + 0.01 * DEGREE * random.standard_normal(deflection.size)
    fit = gr.identification.fit_loop(
        (shaky, torque + 0.01 * np.abs(torque).max() * random.standard_normal(torque.size))
    )
    assert any("left out" in note for note in fit.notes)
    for name, value in numbers(LAW).items():
        limit = {"stiffness": 0.02, "until": 0.02, "hysteresis": 0.05}.get(name.rpartition(".")[2])
        if limit is not None:
            assert fit.values[name] == pytest.approx(value, rel=limit), name


@pytest.mark.slow
def test_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = written(tmp_path / "loop.csv", *sampled(LAW, LOW, HIGH, noise=0.01, seed=4, cycles=1, samples=2000))
    words = ["loop", str(data), "--stages", "2", "-o", str(tmp_path / "d.toml"), "--figure", str(tmp_path / "d.svg")]
    assert main([*words, "--between", "engine,gearbox"]) == 0
    printed = capsys.readouterr().out
    assert "2 drive-side and 2 coast-side stages" in printed
    assert "stages.1.hysteresis" in printed
    coupling = tomllib.loads((tmp_path / "d.toml").read_text(encoding="utf-8"))["coupling"][0]
    assert coupling["between"] == ["engine", "gearbox"]
    assert coupling["stages"][1]["stiffness"].endswith(" N*m/deg")
    assert coupling["stages"][0]["until"].endswith(" deg")
    assert "N m/deg" in printed
    stages = model_of(coupling).couplings[0].drive_pieces
    assert stages[1].stiffness == pytest.approx(1000.0, rel=0.03)
    assert (tmp_path / "d.svg").read_bytes().startswith(b"<svg")
    assert main([*words[:4], "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["values"]["stages.1.stiffness"] == pytest.approx(stages[1].stiffness, rel=1e-7)


def test_the_figure_s_ending_says_whether_it_is_for_print(tmp_path: Path) -> None:
    data = written(tmp_path / "loop.csv", ANGLE, 100 * ANGLE, "angle [deg], torque [N*m]")
    for ending, opening in ((".svg", b"<svg"), (".pdf", b"%PDF")):
        target = tmp_path / f"loop{ending}"
        assert main(["loop", str(data), "--stages", "1", "--figure", str(target)]) == 0
        assert target.read_bytes().startswith(opening)


@pytest.mark.parametrize(
    ("head", "more", "words"),
    [
        ("angle, torque [N*m]", [], "must name its unit of angle"),
        ("angle [mm], torque [N*m]", [], "angle"),
        ("phi [deg], torque [N*m]", [], "no column has this name"),
        ("angle [deg], torque [N*m]", ["--stages", "9"], "from 1 to 6"),
        ("angle [deg], torque [N*m]", ["--stages", "x"], "whole number"),
        ("angle [deg], torque [N*m]", ["--figure", "a.bmp"], ".svg"),
        ("angle [deg], torque [N*m]", ["--between", "a"], "two names"),
    ],
)
def test_bad_use_ends_with_two(
    head: str, more: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = written(tmp_path / "loop.csv", ANGLE, 100 * ANGLE, head)
    assert main(["loop", str(data), *more]) == 2
    assert words in capsys.readouterr().err
