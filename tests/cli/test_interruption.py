"""Ctrl-C and a full disk: answered at once, nothing left behind."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import gearrattle as gr
from gearrattle.cli import background, main
from gearrattle.cli.background import Watch, watched
from gearrattle.cli.failures import guarded
from gearrattle.compilation import Stopwatch
from gearrattle.errors import Cancelled
from gearrattle.report.saved import result_folder
from gearrattle.writing import Staging
from tests import synthetic
from tests.interruption import longest_deafness

LISTENING = "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
"""A shell's background jobs ignore SIGINT and hand that on to what they start."""
PROGRAM = (sys.executable, "-c", f"{LISTENING}from gearrattle.cli import main; sys.exit(main())")
ANSWER = 0.5
FULL = "the disk is full; nothing was written"


@pytest.fixture
def model(tmp_path: Path) -> Path:
    path = tmp_path / "train.toml"
    path.write_text(synthetic.MODEL, encoding="utf-8")
    return path


def interrupt(model: Path, delay: float, *words: str, by: signal.Signals = signal.SIGINT) -> tuple[int, float, bytes]:
    """Start a long run, press Ctrl-C a while after its start, or after its folder is made; return exit code, seconds
    to the end, stderr.
    """
    command = [*PROGRAM, "run", str(model), "--cycles", "100000", "--samples-per-cycle", "8", *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=model.parent) as process:
        while "-o" in words and process.poll() is None and not any(model.parent.glob(".gearrattle-*")):
            time.sleep(0.05)
        time.sleep(delay)
        assert process.poll() is None
        pressed = time.perf_counter()
        process.send_signal(by)
        _, errors = process.communicate(timeout=30)
        return process.returncode, time.perf_counter() - pressed, errors


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
@pytest.mark.parametrize("delay", [1.5, *(pytest.param(delay, marks=pytest.mark.long) for delay in (0.8, 4.0))])
def test_ctrl_c_is_answered_at_once_and_leaves_nothing(model: Path, delay: float) -> None:
    for _ in range(3):  # a busy machine may be late once, the program must not be
        code, took, errors = interrupt(model, delay)
        assert code == 130
        assert errors.splitlines()[-1] == b"interrupted: nothing was written"
        assert b"Traceback" not in errors
        assert [path.name for path in model.parent.iterdir()] == ["train.toml"]
        if took <= ANSWER:
            break
    assert took <= ANSWER


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
def test_sigterm_cleans_up_as_ctrl_c_does(model: Path) -> None:
    code, _, errors = interrupt(model, 0.5, "-o", "out", by=signal.SIGTERM)
    assert (code, errors.splitlines()[-1]) == (143, b"terminated: nothing was written")
    assert [path.name for path in model.parent.iterdir()] == ["train.toml"]


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
def test_what_sigkill_leaves_is_removed_by_the_next_start_into_the_same_place(model: Path) -> None:
    code, _, _ = interrupt(model, 0.5, "-o", "out", by=signal.SIGKILL)
    assert code == -signal.SIGKILL
    (left,) = (path.name for path in model.parent.iterdir() if path.name != "train.toml")
    assert left.startswith(".gearrattle-")
    with Staging(model.parent / "out"):
        assert left not in [path.name for path in model.parent.iterdir()]
    assert [path.name for path in model.parent.iterdir()] == ["train.toml"]


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
def test_sigterm_is_that_of_the_program_again_when_a_command_has_ended(model: Path) -> None:
    def terminate() -> None:
        signal.raise_signal(signal.SIGTERM)

    assert guarded(terminate) == 143
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    assert guarded(lambda: None) == 0
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


class Signalled:
    """Sends the process a signal while Python clears it away: what a handler raises then is lost."""

    def __init__(self, number: signal.Signals) -> None:
        self.number = number

    def __del__(self) -> None:
        signal.raise_signal(self.number)


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interruption_that_python_loses_is_raised_again(number: signal.Signals, code: int) -> None:
    reached = []

    def work() -> None:
        Signalled(number)
        reached.append(number)  # the exception was lost
        time.sleep(0.5)
        reached.append(number)

    hook, handler = sys.unraisablehook, signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        assert guarded(work) == code
    finally:
        signal.signal(signal.SIGINT, handler)  # a background job of a shell ignores it
    assert reached == [number]
    assert sys.unraisablehook is hook


def test_an_interruption_while_a_class_is_made_is_one() -> None:
    class Interrupted:
        def __set_name__(self, owner: type, name: str) -> None:
            raise KeyboardInterrupt

    def work() -> None:
        type("Made", (), {"part": Interrupted()})  # a RuntimeError before Python 3.12

    assert guarded(work) == 130


def test_an_interruption_before_the_work_has_begun_ends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(_: threading.Thread) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(threading.Thread, "start", interrupted)
    with pytest.raises(KeyboardInterrupt):
        watched(lambda watch: watch(1.0))


def _on_a_disk(options: str, folder: Path, words: list[str]) -> subprocess.CompletedProcess[str]:
    """Run the program with a disk of its own mounted on a folder, in a private mount namespace."""
    script = f'mount -t tmpfs -o {options} tmpfs "$0" || exit 99; "$@"; code=$?; ls -A "$0"; exit $code'
    command = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c", script, str(folder), *PROGRAM, *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    if done.returncode not in (0, 1, 2):
        pytest.skip(f"no private mounts on this machine: {done.stderr.strip()}")
    return done


@pytest.mark.skipif(shutil.which("unshare") is None, reason="no unshare(1) on this machine")
@pytest.mark.parametrize(
    ("output", "options", "message"),
    [
        pytest.param("run -o disk/out", "size=256k", FULL, marks=pytest.mark.long),
        pytest.param("simulate -o disk/o.nc", "size=256k", FULL, marks=pytest.mark.long),
        ("simulate -o disk/o.nc", "ro", "choose another place with -o"),
        pytest.param("run -o disk/out", "ro", "choose another place with -o", marks=pytest.mark.long),
        pytest.param("simulate -o disk/o.csv", "size=256k", FULL, marks=pytest.mark.long),
        pytest.param("simulate -o disk/o.csv", "ro", "choose another place with -o", marks=pytest.mark.long),
    ],
)
def test_a_disk_that_takes_nothing(
    model: Path, output: str, options: str, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(model.parent)
    disk = model.parent / "disk"
    disk.mkdir()
    command, *position = output.split()
    done = _on_a_disk(options, disk, [command, str(model), "--cycles", "12", "--discard", "4", *position])
    assert done.returncode == 1
    assert done.stdout == ""
    last = done.stderr.splitlines()[-1]
    assert last.startswith("error: ")
    assert message in last


def test_work_in_the_background_returns_or_raises() -> None:
    assert watched(lambda watch: (watch(0.5), threading.current_thread().name)[1]) == "gearrattle-worker"

    def fail(_: Watch) -> None:
        raise ZeroDivisionError("inside")

    with pytest.raises(ZeroDivisionError, match="inside"):
        watched(fail)


def test_a_stopped_watch_cancels_the_work() -> None:
    watch = Watch()
    watch(0.25)
    assert (watch.phase, watch.fraction) == ("simulating", 0.25)
    watch.enter("saving")
    assert (watch.phase, watch.fraction) == ("saving", 0.0)
    watch.stop()
    with pytest.raises(Cancelled):
        watch(0.5)


def test_progress_is_plain_lines_away_from_a_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(background, "_PATIENCE", 0.0)
    monkeypatch.setattr(background, "_LINE_EVERY", 0.0)

    def work(watch: Watch) -> None:
        watch(0.5)
        time.sleep(0.3)

    watched(work)
    out, err = capsys.readouterr()
    assert out == ""
    assert set(err.splitlines()) <= {"preparing", "simulating: 50 %"}
    assert err.splitlines().count("simulating: 50 %") == 1


def test_a_forecast_leaves_compilation_out_and_progress_names_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    monkeypatch.setattr(background, "COMPILATION", stopwatch := Stopwatch())
    watch = Watch()
    watch.enter("simulating")
    with stopwatch:
        now[0] += 60.0
        assert watch.remaining() is None
        background._Display(watch)._print()
    now[0] += 3.0
    watch(0.25)
    assert watch.remaining() == pytest.approx(9.0)
    background._Display(watch)._print()
    assert capsys.readouterr().err.splitlines() == [
        "simulating (compiling, once after an installation)",
        "simulating: 25 %, about 9 s left",
    ]


def test_what_is_not_known_is_not_told(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    watch = Watch()
    watch.enter("screening")
    watch.expect(float("nan"))
    now[0] += 60.0
    watch(0.01)
    assert watch.remaining() is None
    watch.expect(30.0)
    now[0] += 10.0
    assert watch.remaining() == pytest.approx(20.0)


def test_short_work_shows_no_progress(capsys: pytest.CaptureFixture[str]) -> None:
    watched(lambda watch: watch(1.0))
    assert capsys.readouterr().err == ""


def test_a_page_whose_replacement_was_cut_short_is_completed_and_replaced(tmp_path: Path) -> None:
    new = tmp_path / ".gearrattle-left" / "new"
    (new / "figures").mkdir(parents=True)
    (new / "report.html").write_text("new")
    (tmp_path / "summary.json").write_text("new")
    with result_folder(tmp_path):
        assert (tmp_path / "report.html").read_text() == "new"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["figures", "report.html", "summary.json"]


@pytest.mark.long
@pytest.mark.parametrize(
    "words",
    [("criteria",), ("metrics",), ("spectra", "--channel", "acceleration.hub"), ("orders", "acceleration.hub")],
    ids=lambda words: words[0],
)
def test_a_command_on_a_long_motion_looks_at_signals_many_times_a_second(
    words: tuple[str, ...], long_motion: Path
) -> None:
    command, *more = words
    longest, where = longest_deafness(lambda: main([command, str(long_motion), *more]))
    assert longest < ANSWER, where


@pytest.fixture(scope="module")
def long_motion(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A saved motion of 1.5 million samples."""
    path = tmp_path_factory.mktemp("long") / "long.nc"
    gr.simulate(gr.example("case3"), cycles=1500, audit=False).save(path)
    return path
