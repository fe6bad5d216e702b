"""Sound against closed forms: spectra of trains, ringing modes, levels that keep their difference, loudness."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import wavfile

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.measured.readers import read_raw
from gearrattle.measured.readers.wav import wav_bytes
from gearrattle.recording import Channel, Recording
from gearrattle.report.sound.psychoacoustics import (
    STEP,
    adjustment_of,
    fast_level,
    largest_prominence,
    prominence,
    quality,
)
from gearrattle.report.sound.resample import resampled
from gearrattle.report.sound.transfer_path import sound_path
from gearrattle.signals import find_impacts
from gearrattle.signals.impact_sound import modal_path
from tests.architecture.places import EXAMPLES
from tests.laws.test_sideways import driven
from tests.signals.test_frequency_response import modal

RATE = 48_000.0


@pytest.fixture(scope="module")
def run() -> gr.Run:
    return gr.simulate(gr.load(EXAMPLES / "paper" / "case3.toml"), cycles=12, discard=2)


def test_impulses_through_a_mode_superpose_in_closed_form() -> None:
    """A recording of a force that is two impulses, against the sum of two ringings."""
    force = np.zeros(9600)
    force[[1000, 3000]] = np.array([2.0, -1.0]) * RATE
    record = Recording(np.arange(9600) / RATE, (Channel("f", "force", "gear", "N", force),), "made")
    sound = gr.listen(record, [(800.0, 0.05, 1.0)])
    omega, t = 2.0 * np.pi * 800.0, np.arange(9600) / RATE
    exact = np.zeros(9600)
    for at, size in ((1000, 2.0), (3000, -1.0)):
        s = t - at / RATE
        exact += size * np.exp(-0.05 * omega * s) * np.sin(omega * np.sqrt(1 - 0.05**2) * s) * (s >= 0)
    away = (np.abs(np.arange(9600) - 1000) > 20) & (np.abs(np.arange(9600) - 3000) > 20)
    assert np.abs(sound.pressure[0][:9600] - exact)[away].max() < 5e-3


def test_every_impact_of_a_run_is_heard_with_the_momentum_it_exchanges(run: gr.Run) -> None:
    """Pressures are the sum of the modes that ring from all impacts, those of the discarded cycles too."""
    modes = [(450.0, 0.02, 1.0), (900.0, 0.05, 0.5)]
    sound = gr.listen(run, modes)
    motion = run.trajectory
    impacts = find_impacts(motion)
    heard = impacts.clearance == motion.layout.clearance_names.index("gear")
    assert heard.sum() > 10
    start = 2 * motion.layout.period
    assert sound.pressure[0].size == round(10 * motion.layout.period * RATE)
    since = start + np.arange(sound.pressure[0].size)[:, None] / RATE - impacts.time[heard]
    rung = np.zeros(since.shape)
    for frequency, damping, gain in modes:
        omega = 2.0 * np.pi * frequency
        decay = gain * np.exp(-damping * omega * np.maximum(since, 0.0))
        rung += decay * np.sin(omega * np.sqrt(1 - damping**2) * since) * (since > 0.0)
    exact = rung @ impacts.exchanged[heard]
    assert np.abs(exact).max() > 0.0
    assert np.linalg.norm(sound.pressure[0] - exact) < 2e-3 * np.linalg.norm(exact)


def test_a_level_does_not_depend_on_the_length_of_a_run(run: gr.Run) -> None:
    """A periodic motion over two and eight of its cycles; a path whose ringing outlasts both."""
    model = gr.load(EXAMPLES / "manual_transmission.toml")
    path = [(300.0, 0.004, 1.0)]
    levels = [
        gr.listen(gr.simulate(model, cycles=cycles, discard=40, samples_per_cycle=64), path).levels["A"]
        for cycles in (44, 52)
    ]
    assert levels[0] == pytest.approx(levels[1], abs=0.3)


def test_two_designs_keep_their_difference(run: gr.Run, tmp_path: Path) -> None:
    """A sound half as strong beside it: factor 2 to 1e-6 in the files, 24 bits and 32; gain and path are one."""
    made = gr.listen(run, gain=1.0).pressure[0]
    time = np.arange(made.size) / RATE
    both = {
        name: Recording(time, (Channel("p", "sound pressure", "ear", "Pa", factor * made),), "made")
        for name, factor in (("A", 1.0), ("B", 0.5))
    }
    sound = gr.listen(both)
    assert sound.levels["A"] - sound.levels["B"] == pytest.approx(20 * np.log10(2.0), abs=1e-9)
    assert sound.save(tmp_path) == tmp_path / "report.html"
    paths = sorted(tmp_path.glob("*.wav"))
    assert [path.name for path in paths] == ["A.wav", "B.wav"]
    one, other = (read_raw(path).columns[0] for path in paths)
    assert one.time is not None
    assert one.time[4800] == 0.1
    one, other = one.values, other.values
    assert np.abs(one).max() == pytest.approx(0.5, rel=1e-6)
    assert np.linalg.norm(one) / np.linalg.norm(other) == pytest.approx(2.0, rel=1e-6)
    assert np.abs(one / sound.gain - made).max() < 1e-7 * np.abs(made).max()
    sound.save(tmp_path, 24)
    one, other = (read_raw(path).columns[0].values for path in paths)
    assert np.linalg.norm(one) / np.linalg.norm(other) == pytest.approx(2.0, rel=1e-6)


def test_a_run_of_other_impacts_differs_by_what_its_impulses_say(run: gr.Run) -> None:
    """Alone or beside another, at a stated gain, a design's file is the same."""
    alone = gr.listen({"x": run}, gain=0.01)
    others = gr.listen({"y": run, "x": run}, gain=0.01)
    assert alone.wav("x") == others.wav("x")


@pytest.mark.parametrize("bits", [24, 32, 64])
def test_a_file_reads_back(bits: int) -> None:
    values = np.random.default_rng(3).uniform(-1, 1, 1000)
    rate, raw = wavfile.read(io.BytesIO(wav_bytes(values, 48_000, bits)))
    read = raw / 2.0**31 if bits == 24 else raw
    assert rate == 48_000
    assert np.abs(read - values).max() < (2.5e-7 if bits == 24 else 6e-8)


def test_resampling_keeps_a_tone() -> None:
    t = np.arange(44_100) / 44_100.0
    out = resampled(np.sin(2 * np.pi * 1000 * t), 44_100.0, RATE, "tone")
    exact = np.sin(2 * np.pi * 1000 * np.arange(out.size) / RATE)
    assert np.abs(out - exact)[2000:-2000].max() < 1e-3


def test_paths_from_files_are_the_modes_they_were_made_of(tmp_path: Path) -> None:
    made = modal_path([(900.0, 0.05, 2.0)], RATE, "made")
    top = np.abs(made.response).max()
    wav, table = tmp_path / "ir.wav", tmp_path / "ir.csv"
    wav.write_bytes(wav_bytes(made.response / top, 48_000, 32))
    rows = [f"{1e3 * k / RATE!r}, {v!r}" for k, v in enumerate(made.response.tolist())]
    table.write_text("\n".join(["time [ms], response [Pa/(N*s)]", *rows]), encoding="utf-8")
    for read in (sound_path(wav, RATE, float(top)), sound_path(table, RATE)):
        assert np.abs(read.response - made.response).max() < 1e-6 * top


def tone(frequency: float, level: float, seconds: float = 1.0) -> np.ndarray:
    t = np.arange(int(RATE * seconds)) / RATE
    return 2e-5 * 10.0 ** (level / 20.0) * np.sqrt(2.0) * np.sin(2 * np.pi * frequency * t)


def test_the_prominence_of_an_onset_is_that_of_the_formula() -> None:
    """1000 dB/s and 20 dB: 3 x 3 + 2 x 1.30103; the adjustment begins above 5."""
    assert prominence(1000.0, 20.0) == pytest.approx(11.60206, abs=1e-5)
    assert adjustment_of(prominence(1000.0, 20.0)) == pytest.approx(11.8837, abs=1e-4)
    assert adjustment_of(5.0) == adjustment_of(float("nan")) == 0.0


def test_the_onset_of_a_level_is_the_stretch_that_rises_by_ten_decibels_a_second() -> None:
    """A ramp of 200 dB/s over 20 dB between flat stretches; a slow rise is no onset, of two the larger counts."""
    ramp = np.concatenate([np.full(20, 40.0), 40.0 + 200.0 * STEP * np.arange(1, 11), np.full(20, 60.0)])
    assert largest_prominence(ramp) == pytest.approx(prominence(200.0, 20.0), rel=1e-12)
    assert np.isnan(largest_prominence(40.0 + 9.0 * STEP * np.arange(50)))
    small = 60.0 + 50.0 * STEP * np.arange(1, 6)
    assert largest_prominence(np.concatenate([small[::-1], small, ramp])) == largest_prominence(ramp)


def test_the_fast_level_of_a_tone_is_its_level_and_rises_with_its_time_constant() -> None:
    """A-weighting is 0 dB at 1 kHz, -19.1 dB at 100 Hz (IEC 61672-1); a tone rises as 1 - exp(-t / 125 ms)."""
    assert fast_level(tone(1000.0, 60.0), RATE)[20:] == pytest.approx(60.0, abs=0.05)
    assert fast_level(tone(100.0, 60.0), RATE)[50:90].mean() == pytest.approx(60.0 - 19.1, abs=0.1)
    assert np.isnan(largest_prominence(fast_level(tone(1000.0, 60.0), RATE)[10:]))
    burst = np.concatenate([np.zeros(int(RATE)), tone(1000.0, 70.0)])
    level = fast_level(burst, RATE)
    t = np.arange(51) * STEP
    before = 0.5 * np.exp(-1.0 / 0.125)  # the mean square of the whole is half that of the tone
    exact = 70.0 + 10.0 * np.log10(1.0 + (before - 1.0) * np.exp(-t / 0.125))
    assert level[102:150] == pytest.approx(exact[3:], abs=0.1)
    assert largest_prominence(level) == pytest.approx(largest_prominence(exact), abs=0.05)


@pytest.mark.slow
def test_a_tone_of_forty_decibels_is_one_sone_and_ten_more_double_it() -> None:
    """By the definition of the sone; ISO 532-1 allows 5 % or 0.1 sone."""
    pytest.importorskip("mosqito")
    actual = [quality(tone(1000.0, level, seconds=0.5), RATE) for level in (40.0, 50.0)]
    assert actual[0].loudness == pytest.approx(1.0, abs=0.1)
    assert actual[1].loudness == pytest.approx(2.0, rel=0.05)
    assert actual[0].roughness < 0.1


@pytest.mark.long
def test_an_asper_and_sharpness() -> None:
    """A 1 kHz tone of 60 dB, wholly modulated at 70 Hz, is 1 asper; higher tones are sharper."""
    pytest.importorskip("mosqito")
    t = np.arange(int(RATE)) / RATE
    rough = (1.0 + np.sin(2 * np.pi * 70.0 * t)) * tone(1000.0, 60.0)
    assert quality(
        rough * np.sqrt(np.mean(tone(1000.0, 60.0) ** 2) / np.mean(rough**2)), RATE
    ).roughness == pytest.approx(1.0, rel=0.17)
    low, high = (quality(tone(f, 60.0), RATE).sharpness for f in (1000.0, 6000.0))
    assert low == pytest.approx(1.0, abs=0.1)
    assert high > 2.0 * low


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"elements": ["gaer"]}, "no clearance of this name"),
        ({"path": [(30_000.0, 0.1, 1.0)]}, "between 0 and"),
        ({"path": "none.wav"}, "no such file"),
        ({"path": 3}, "rows of frequency"),
        ({"gain": -1.0}, "positive"),
        ({"rate": 10}, "8000"),
    ],
)
def test_bad_use_is_refused(run: gr.Run, options: dict[str, object], words: str) -> None:
    with pytest.raises(gr.ModelError, match=words):
        gr.listen(run, **options)


def test_a_dimensionless_run_is_refused() -> None:
    model = gr.load(EXAMPLES / "rattle_oscillator.toml")
    assert model.units == "dimensionless"
    with pytest.raises(gr.ModelError, match="no seconds"):
        gr.listen(gr.simulate(model, cycles=4, discard=0))


def test_recordings_without_sound_are_refused() -> None:
    record = Recording(np.arange(9.0), (Channel("v", "velocity", "hub", "rad/s", np.ones(9)),), "rig.csv")
    with pytest.raises(gr.ModelError, match="neither sound pressure nor a force"):
        gr.listen(record)
    with pytest.raises(gr.ModelError, match="full scale"):
        wav_bytes(np.array([2.0]), 48_000, 24)


def test_command_line(run: gr.Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run.save(tmp_path / "one.nc")
    assert main(["listen", str(tmp_path / "one.nc"), "-o", str(tmp_path / "wav"), "--gain", "0.01", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["gain"] == 0.01
    values = read_raw(tmp_path / "wav" / "one.wav").columns[0].values
    level = 10.0 * np.log10(np.mean((values / 0.01) ** 2) / 4e-10)
    assert record["designs"]["one"]["level"] == pytest.approx(level, abs=1e-4)
    assert main(["listen"]) == 2
    assert main(["listen", str(tmp_path / "one.nc"), "--element", "x"]) == 2


def test_a_measured_pressure_is_heard_from_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A tone of 1 Pa rms is 94 dB re 20 uPa; a mapping is told from a model by what it holds."""
    time = np.arange(48_000) / 48_000.0
    values = np.sqrt(2.0) * np.sin(2.0 * np.pi * 1000.0 * time)
    mic = Channel("mic", "sound pressure", "bench", "Pa", values)
    gr.write(Recording(time, (mic,), "bench"), tmp_path / "bench.mat")
    (tmp_path / "mapping.toml").write_text(
        'schema = 1\nfile = "bench.mat"\n'
        '[[channel]]\nname = "mic"\nquantity = "sound pressure"\nof = "bench"\nscale = 2.0\nunit = "Pa"\n'
    )
    assert main(["listen", str(tmp_path / "bench.mat"), str(tmp_path / "mapping.toml"), "--json"]) == 0
    designs = json.loads(capsys.readouterr().out)["designs"]
    assert designs["bench"]["level"] == pytest.approx(20.0 * np.log10(1.0 / 20e-6), abs=1e-3)
    assert designs["mapping"]["level"] - designs["bench"]["level"] == pytest.approx(20.0 * np.log10(2.0), abs=1e-6)


@pytest.fixture(scope="module")
def held() -> gr.Run:
    """A driveline with bearings to the housing."""
    return gr.simulate(driven(), cycles=30, discard=20, samples_per_cycle=64)


def universal(functions: list[tuple[str, int, np.ndarray]], spacing: float, kind: int = 6, unit: str = "Pa") -> str:
    """Dataset 58 of complex responses to forces along a direction, in columns of E20.12 or E13.5."""
    columns, width = (4, "20.12E") if kind == 6 else (6, "13.5E")
    text = []
    for name, direction, values in functions:
        record = f"{4:5d}{1:10d}{1:5d}{0:10d} {'MIC':<10s}{7:10d}{0:4d} {'CASING':<10s}{3:10d}{direction:4d}"
        text += ["    -1", "    58", name, "NONE", "NONE", "NONE", "NONE", record]
        text += [f"{kind:10d}{values.size:10d}{1:10d}{0.0:13.5E}{spacing:13.5E}{0.0:13.5E}"]
        text += [f"{18:10d}{0:5d}{0:5d}{0:5d} {'Frequency':<20s} {'Hz':<20s}"]
        text += [f"{15:10d}{0:5d}{0:5d}{0:5d} {'Pressure':<20s} {unit:<20s}"]
        text += [f"{13:10d}{0:5d}{0:5d}{0:5d} {'Force':<20s} {'N' if unit else '':<20s}"]
        text += [f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20s} {'NONE':<20s}"]
        numbers = np.stack([values.real, values.imag], axis=1).ravel()
        for k in range(0, numbers.size, columns):
            text.append("".join(f"{float(x):{width}}" for x in numbers[k : k + columns]))
        text.append("    -1")
    return "\n".join(text) + "\n"


def test_a_response_sampled_from_the_modal_path_has_its_level(held: gr.Run, tmp_path: Path) -> None:
    """By parts, by magnitude and phase, and in universal files of both precisions, of both sources: 0.01 dB."""
    lines = np.arange(0.0, 20_000.0, 5.0)
    made = modal(lines)
    parts = "\n".join(f"{float(f)!r}, {h.real!r}, {h.imag!r}" for f, h in zip(lines, made.tolist(), strict=True))
    polar = "\n".join(
        f"{float(f) / 1e3!r}, {1e3 * abs(h)!r}, {float(np.degrees(np.angle(h)))!r}"
        for f, h in zip(lines, made.tolist(), strict=True)
    )
    files = {
        "parts.csv": f"frequency [Hz], real [Pa/N], imaginary [Pa/N]\n{parts}\n",
        "polar.csv": f"frequency [kHz], magnitude [mPa/N], phase [deg]\n{polar}\n",
        "double.unv": universal([("H", 1, made)], 5.0),
        "single.unv": universal([("H", 1, made)], 5.0, kind=5),
        "no_units.unv": universal([("H", 1, made)], 5.0, unit=""),
    }
    by_modes = {source: gr.listen(held, source=source).levels["A"] for source in ("casing", "impacts")}
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
        for source, level in by_modes.items():
            sound = gr.listen(held, tmp_path / name, source=source)
            assert sound.levels["A"] == pytest.approx(level, abs=0.01), name
            assert any("0 to 19995 Hz" in note for note in sound.notes)


def test_paths_of_single_bearings_add_up_to_that_of_their_sum(held: gr.Run) -> None:
    """The same path for all bearings along x is that of the whole force along x; opposite forces may have others."""
    path, other = [(850.0, 0.03, 1.2)], [(850.0, 0.03, -1.2)]
    whole = gr.listen(held, {"x": path})
    parts = gr.listen(held, {"at_pinion.x": path, "at_wheel.x": path})
    assert np.abs(parts.pressure[0] - whole.pressure[0]).max() < 1e-9 * np.abs(whole.pressure[0]).max()
    apart = gr.listen(held, {"at_pinion.x": path, "at_wheel.x": other})
    assert apart.levels["A"] != pytest.approx(whole.levels["A"], abs=1.0)


def test_a_universal_file_with_both_directions_adds_pressures(held: gr.Run, tmp_path: Path) -> None:
    """The response to a force against x has the other sign; the same as one path for x and one for y."""
    lines = np.arange(0.0, 20_000.0, 5.0)
    along, across = modal(lines), np.conj(modal(lines)) * np.exp(-2j * np.pi * lines * 0.05)
    both, x, y = (tmp_path / f"{name}.unv" for name in ("both", "x", "y"))
    both.write_text(universal([("HY", 2, across), ("HX", -1, -along)], 5.0), encoding="utf-8")
    x.write_text(universal([("HX", 1, along)], 5.0), encoding="utf-8")
    y.write_text(universal([("HY", 2, across)], 5.0), encoding="utf-8")
    together = gr.listen(held, both)
    apart = gr.listen(held, {"x": x, "y": y})
    assert together.levels["A"] == pytest.approx(apart.levels["A"], abs=1e-9)
    with pytest.raises(gr.ModelError, match="for those on the casing"):
        gr.listen(held, both, source="impacts")
    three = tmp_path / "three.unv"
    three.write_text(universal([("H1", 1, along), ("H2", 2, across), ("H3", 3, across)], 5.0), encoding="utf-8")
    with pytest.raises(gr.ModelError, match=r"H1, H2, H3.*one to a force along x"):
        gr.listen(held, three)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"source": "housing"}, "must be casing"),
        ({"source": "casing", "elements": ["gear"]}, "names elements"),
        ({"path": {"z": [(800.0, 0.1, 1.0)]}}, "no force on the casing.*at_pinion.x"),
        ({"path": {}}, "by the names"),
    ],
)
def test_bad_use_with_a_casing_is_refused(held: gr.Run, options: dict[str, object], words: str) -> None:
    with pytest.raises(gr.ModelError, match=words):
        gr.listen(held, **options)


def test_a_model_without_bearings_has_no_casing(run: gr.Run) -> None:
    with pytest.raises(gr.ModelError, match="no bearings to the housing"):
        gr.listen(run, source="casing")
    assert gr.listen(run).levels == gr.listen(run, source="impacts").levels


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("frequency [Hz], real [Pa/N]\n0, 1\n10, 1\n", "imaginary"),
        ("frequency [Hz], magnitude [dB], phase [deg]\n0, 1, 0\n10, 1, 0\n", "pressure per force"),
        ("frequency [Hz], real [Pa/N], imaginary [Pa/N]\n10, 1, 0\n0, 1, 0\n", "ascend"),
    ],
)
def test_bad_responses_are_refused(held: gr.Run, text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "h.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(gr.ModelError, match=words):
        gr.listen(held, path)


def test_the_command_takes_source_and_paths_by_direction(held: gr.Run, tmp_path: Path, capsys: Any) -> None:
    held.save(tmp_path / "run.nc")
    lines = np.arange(0.0, 20_000.0, 10.0)
    file = tmp_path / "h.unv"
    file.write_text(universal([("H", 1, modal(lines))], 10.0), encoding="utf-8")
    levels = {}
    for options in (
        [],
        ["--source", "impacts"],
        ["--path", str(file), "--path-y", str(file)],
    ):
        assert main(["listen", str(tmp_path / "run.nc"), "--json", *options]) == 0
        levels[" ".join(options[:2])[:12]] = json.loads(capsys.readouterr().out)["designs"]["run"]["level"]
    assert len({round(level, 3) for level in levels.values()}) == 3
    assert main(["listen", str(tmp_path / "run.nc"), "--path-y", str(file)]) == 2
    assert "along x" in capsys.readouterr().err
