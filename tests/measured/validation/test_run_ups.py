"""Run-ups against closed forms: a free wheel moves as its torque over J, at every order and speed."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.recording import Channel, Recording
from gearrattle.report.plots.interactive import chart_json
from gearrattle.report.plots.run_up_validation_figures import run_up_charts
from gearrattle.report.plots.svg_charts import draw

RPM = np.pi / 30.0
MODEL = """
schema = 1
name = "wheel"
[[inertia]]
name = "wheel"
J = 2.0
[excitation]
sweep = { from = "600 rpm", to = "3000 rpm", over = "4 s" }
[[torque]]
on = "wheel"
harmonics = [
  { order = 1, amplitude = { speed = ["600 rpm", "1800 rpm", "3000 rpm"], value = [4.0, 20.0, 4.0] } },
  { order = 2, amplitude = 6.0, phase = 0.7 },
]
[simulation]
cycles = 110
discard = 0
samples_per_cycle = 64
"""


@pytest.fixture(scope="module")
def run() -> gr.Run:
    return gr.simulate(gr.loads(MODEL), audit=False)


def record(gain: float = 1.0, peak: float = 1800.0, *, noise: float = 0.0, seed: int = 0) -> Recording:
    """A slower run-up from 500 rpm on; order 1 has its largest amplitude elsewhere, order 2 a gain."""
    seconds, rate = 6.0, 4000.0
    time = np.arange(int(seconds * rate)) / rate
    speed = RPM * (500.0 + 2700.0 * time / seconds)
    angle = RPM * (500.0 * time + 1350.0 * time**2 / seconds)
    first = np.interp(speed, [RPM * n for n in (500.0, peak, 3200.0)], [2.0, 10.0, 2.0])
    values = first * np.sin(angle + 0.3) + 3.0 * gain * np.sin(2.0 * angle)
    values += noise * np.random.default_rng(seed).standard_normal(time.size)
    shaft = Channel("n", "speed", "", "rad/s", speed)
    return Recording(time, (Channel("a", "acceleration", "wheel", "rad/s^2", values), shaft), f"rig {seed}")


def test_amplitudes_over_speed_are_the_closed_forms(run: gr.Run) -> None:
    """Order 2 is 3 rad/s^2 simulated and a tenth more measured; order 1 peaks at 1800 and at 2100 rpm."""
    actual = gr.validate_run_up(run, record(1.1, 2100.0))
    assert [(t.channel, t.order) for t in actual.tracks] == [("a", 1.0), ("a", 2.0)]
    first, second = actual.tracks
    assert second.simulated == pytest.approx(3.0, rel=1e-2)
    assert second.measured == pytest.approx(3.3, rel=1e-2)
    assert second.sigma == pytest.approx(100.0 / 11.0, rel=0.02)
    inner = np.abs(first.speed / RPM - 1800.0) > 150.0  # blocks round the corner off
    expected = np.interp(first.speed, [RPM * n for n in (600.0, 1800.0, 3000.0)], [2.0, 10.0, 2.0])
    assert first.simulated[inner] == pytest.approx(expected[inner], rel=0.02)
    (at, size), (simulated_at, simulated_size) = first.peaks
    step = float(np.diff(first.speed).max())
    assert at == pytest.approx(2100.0 * RPM, abs=1.5 * step)
    assert simulated_at == pytest.approx(1800.0 * RPM, abs=1.5 * step)
    assert size == pytest.approx(10.0, rel=0.05)
    assert simulated_size == pytest.approx(10.0, rel=0.05)
    assert np.isnan(first.error).all()
    assert np.isnan(first.outside)
    assert "order 1" in actual.verdict
    assert actual["acceleration.wheel", 2.0] is second
    assert actual.to_dataframe().shape[0] == 2


def test_repeats_give_an_interval_that_holds(run: gr.Run) -> None:
    """Noise over blocks of a right model: Student's interval of five repeats leaves some one speed in twenty."""
    repeats = [record(noise=1.0, seed=seed) for seed in range(5)]
    actual = gr.validate_run_up(run, repeats, [2.0])
    (track,) = actual.tracks
    assert 0.0 <= track.outside < 0.25
    assert track.measured == pytest.approx(
        np.mean([gr.validate_run_up(run, r, [2.0]).tracks[0].measured for r in repeats], axis=0)
    )
    wrong = gr.validate_run_up(run, [record(1.3, noise=1.0, seed=seed) for seed in range(5)], [2.0])
    assert wrong.tracks[0].outside > 0.6


def test_what_stays_or_comes_back_is_left_out_and_told(run: gr.Run) -> None:
    """The run stays at 3000 rpm once it is there; a record that dwells first says the same as without."""
    actual = gr.validate_run_up(run, record(1.1), [2.0])
    assert any("longest rise or fall" in note for note in actual.notes)
    plain = record(1.1)
    still = np.arange(16_000)
    angle = RPM * 500.0 * still / 4000.0
    start = angle[-1] + RPM * 500.0 / 4000.0
    before = 3.3 * np.sin(2.0 * (angle - start)) + 2.0 * np.sin(angle - start + 0.3)
    time = np.arange(still.size + plain.time.size) / 4000.0
    shaft = np.concatenate([np.full(still.size, RPM * 500.0), plain["n"].values])
    channels = (
        Channel("a", "acceleration", "wheel", "rad/s^2", np.concatenate([before, plain["a"].values])),
        Channel("n", "speed", "", "rad/s", shaft),
    )
    dwelt = gr.validate_run_up(run, Recording(time, channels, "dwelt"), [2.0])
    assert dwelt.tracks[0].measured == pytest.approx(3.3, rel=0.02)
    assert any("dwelt" in note and "longest rise or fall" in note for note in dwelt.notes)


def test_a_run_against_itself_agrees(run: gr.Run) -> None:
    from gearrattle.measured.validation.simulated_recording import recorded

    same = recorded(run)
    channels = (*same.channels, Channel("n", "speed", "", "rad/s", run.speed))
    actual = gr.validate_run_up(run, Recording(same.time, channels, "itself"), [1.0, 2.0])
    assert max(abs(track.sigma) for track in actual.tracks if track.partner.startswith("acceleration")) < 1e-6


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[str, str]:
    monkeypatch.chdir(tmp_path)
    Path("wheel.toml").write_text(MODEL, encoding="utf-8")
    gr.write(record(1.1), "rig.h5")
    gr.write(record(1.1, noise=0.1, seed=1), "again.h5")
    return "wheel.toml", "rig.h5"


def test_the_command_writes_a_page(files: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", *files, "--repeat", "again.h5", "-o", "out"]) == 0
    out = capsys.readouterr().out
    assert "look first at a, order" in out
    row = next(line.split() for line in out.splitlines() if line.split()[:2] == ["a", "2"])
    assert float(row[5]) == pytest.approx(9.09, abs=0.2)
    page = Path("out/report.html").read_text(encoding="utf-8")
    for words in ("Orders of a", "speed, rpm", "validation of a run-up", "rig.h5", "again.h5", "95 % limits"):
        assert words in page or words in Path("out/figures/orders_1.svg").read_text(encoding="utf-8")
    assert "<script" not in page
    content = json.loads(Path("out/summary.json").read_text(encoding="utf-8"))
    assert [track["order"] for track in content["tracks"]] == [1.0, 2.0]
    assert len(content["tracks"][0]["speed"]) == len(content["tracks"][0]["measured_over_speed"])


def test_a_saved_run_up_is_compared_too(
    files: tuple[str, str], run: gr.Run, capsys: pytest.CaptureFixture[str]
) -> None:
    run.save("wheel.nc")
    assert main(["validate", "wheel.nc", files[1], "--order", "2", "--json"]) == 0
    (track,) = json.loads(capsys.readouterr().out)["tracks"]
    assert track["sigma"] == pytest.approx(100.0 / 11.0, rel=0.02)
    assert track["outside"] is None


def test_charts_are_drawn_by_both_renderers(run: gr.Run) -> None:
    (chart,) = run_up_charts(gr.validate_run_up(run, [record(seed=1, noise=0.1), record(seed=2, noise=0.1)]))
    assert [panel.title for panel in chart.panels] == ["order 1", "order 2"]
    assert [line.name for line in chart.panels[0].lines] == ["95 % limit", "95 % limit", "simulated", "measured"]
    assert all(panel.x_title == "speed, rpm" and panel.unit == "rad/s²" for panel in chart.panels)
    ElementTree.fromstring(draw(chart, legend=True))
    json.dumps(chart_json(chart), allow_nan=False)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--calibration", "2"), "--calibration"),
        (("--threshold", "x=1"), "--threshold"),
        (("--order", "0.01"), "cannot be separated from each other"),
        (("--order", "900"), "at most"),
        (("--shaft", "x"), "no channel and no speed"),
        (("--turns", "0"), "turns"),
        (("--repeat", "nowhere.h5"), "nowhere.h5"),
        (("--match", "b=acceleration.wheel"), "is no channel"),
    ],
)
def test_bad_input_is_refused(
    files: tuple[str, str], words: tuple[str, str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["validate", *files, *words, "-o", "out"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert said in err
    assert not Path("out").exists()


def test_speeds_that_come_back_or_have_nothing_in_common_are_refused(run: gr.Run) -> None:
    up = record()
    there = up["n"].values
    wavy = 150.0 + 20.0 * up.time + 25.0 * np.sin(1.4 * np.pi * up.time)
    channels = (up["a"], Channel("n", "speed", "", "rad/s", wavy))
    with pytest.raises(gr.ModelError, match="over half of its range"):
        gr.validate_run_up(run, Recording(up.time, channels, "rig"), [1.0])
    faster = (up["a"], Channel("n", "speed", "", "rad/s", there + 400.0))
    with pytest.raises(gr.ModelError, match="in common"):
        gr.validate_run_up(run, Recording(up.time, faster, "rig"), [1.0])
    with pytest.raises(gr.ModelError, match="one run-up at least"):
        gr.validate_run_up(run, [], [1.0])
    with pytest.raises(gr.ModelError, match="validate_run_up"):
        gr.validate(run, up)


def test_options_of_run_ups_are_refused_at_one_speed(
    files: tuple[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    from tests.measured.validation import made

    Path("steady.toml").write_text(made.MODEL, encoding="utf-8")
    assert main(["validate", "steady.toml", files[1], "--order", "2"]) == 2
    assert "applies to run-ups" in capsys.readouterr().err
