"""``gearrattle stream``: chunks on disk, Ctrl-C with exit code 130, and --resume."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import gearrattle as gr
from gearrattle.cli import background, main
from gearrattle.cli.background import Watch
from tests.simulation.test_store import content

LISTENING = "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
"""A shell's background jobs ignore SIGINT and hand that on to what they start."""
PROGRAM = (sys.executable, "-c", f"{LISTENING}from gearrattle.cli import main; sys.exit(main())")
SHORT = ("--cycles", "20", "--samples-per-cycle", "8", "--chunk", "6", "-o", "long")


def test_chunks_are_written_and_the_verdict_is_printed(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["stream", str(model), *SHORT]) == 0
    out, err = capsys.readouterr()
    run = gr.simulate(gr.load(model), cycles=20, samples_per_cycle=8, audit=False)
    verdict = gr.criteria(run)
    lines = out.splitlines()
    assert (lines[0], lines[-1]) == (f"{verdict.verdict}: {verdict.sentence}", "20 cycles kept in: long")
    assert [line.split()[0] for line in lines[3:-1]] == [part.name for part in verdict.parts]
    assert len(list(Path("long").glob("chunk-*.nc"))) == 4
    assert all(line.startswith(("note: ", "preparing", "simulating")) for line in err.splitlines())  # if it took long
    assert main(["criteria", "long"]) == 0
    assert capsys.readouterr().out.splitlines()[0] == out.splitlines()[0]


def test_json_and_the_default_folder(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["stream", str(model), *SHORT[:-2], "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert (printed["cycles"], printed["folder"], printed["window"]["cycles"]) == (20, "train-stream", 10)
    assert Path("train-stream/state.npz").exists()


def test_a_folder_in_use_is_refused_and_resume_of_a_finished_one_repeats_its_verdict(
    model: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["stream", str(model), *SHORT]) == 0
    first = capsys.readouterr().out
    assert main(["stream", str(model), *SHORT]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "long: holds 20 cycles of a run already (resume" in err
    assert main(["stream", str(model), *SHORT, "--resume"]) == 0
    assert capsys.readouterr().out == first
    assert main(["stream", str(model), *SHORT[:-4], "--chunk", "7", "-o", "long", "--resume"]) == 2
    assert "found chunk = 7; holds another motion, with chunk = 6" in capsys.readouterr().err


def test_a_stepping_algorithm_is_refused_before_anything_is_written(
    model: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["stream", str(model), *SHORT, "--algorithm", "rk4"]) == 2
    assert "rk4; cannot go on where it ended" in capsys.readouterr().err
    assert not Path("long").exists()


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
def test_ctrl_c_keeps_what_was_computed_and_resume_goes_on(model: Path) -> None:
    words = ["stream", str(model), "--cycles", "150", "--samples-per-cycle", "8", "--chunk", "10", "-o", "long"]
    with subprocess.Popen([*PROGRAM, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        while not Path("long/chunk-000002.nc").exists():
            assert process.poll() is None
            time.sleep(0.005)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
    assert process.returncode == 130
    assert out == b""
    assert b"Traceback" not in err
    done = int(err.splitlines()[-1].split()[1])
    assert err.splitlines()[-1].decode() == f"interrupted: {done} of 150 cycles are kept in long; --resume goes on"
    assert 10 <= done < 150
    chunks = list(gr.open_stream("long"))
    assert chunks[-1].trajectory.first_cycle + 10 == done
    assert main([*words, "--resume"]) == 0
    words[-1] = "whole"
    assert main(words) == 0
    assert content(Path("long")) == content(Path("whole"))


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
def test_ctrl_c_before_the_first_chunk_leaves_nothing(model: Path) -> None:
    words = ["stream", str(model), "--cycles", "900000", "--samples-per-cycle", "1", "--chunk", "900000", "-o", "long"]
    with subprocess.Popen([*PROGRAM, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        time.sleep(2.0)
        assert process.poll() is None
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=30)
    assert process.returncode == 130
    assert err.splitlines()[-1] == b"interrupted: nothing was written"
    assert not Path("long").exists()


def test_a_full_disk_says_what_is_kept(
    model: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from gearrattle.simulation import chunk_store

    save = chunk_store.np.savez

    def full_soon(*values: object, **arrays: object) -> None:
        if Path("long/chunk-000003.nc").exists():
            raise OSError(28, "No space left on device")
        save(*values, **arrays)

    monkeypatch.setattr(chunk_store.np, "savez", full_soon)
    assert main(["stream", str(model), *SHORT]) == 1
    message = capsys.readouterr().err.splitlines()[-1]
    assert message == (
        "error: the disk is full; 12 of 20 cycles are kept in long; --resume goes on when there is space again"
    )


def test_the_remaining_time_is_told_once_it_can_be_known(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [100.0]
    monkeypatch.setattr(background.time, "monotonic", lambda: clock[0])
    watch = Watch()
    assert watch.remaining() is None
    watch(0.25)  # a resumed run begins here
    assert watch.remaining() is None
    clock[0] = 110.0
    watch(0.35)
    assert watch.remaining() == pytest.approx(65.0)
    watch.enter("saving")
    assert watch.remaining() is None


def test_progress_lines_tell_the_remaining_time(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    watch = Watch()
    monkeypatch.setattr(Watch, "remaining", lambda _: 150.0)
    display = background._Display(watch)
    display._next = 0.0
    watch(0.5)
    display.update()
    assert capsys.readouterr().err == "simulating: 50 %, about 2 min left\n"
    assert [background._duration(s) for s in (9.6, 119, 121, 8000)] == ["10 s", "119 s", "2 min", "2 h"]
