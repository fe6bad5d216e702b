"""``gearrattle threshold`` and ``gearrattle remedy``."""

from __future__ import annotations

import json
import signal
import subprocess
import sys

import pytest

from gearrattle.cli import main
from tests.design.oscillator import LIMIT, loaded_gear

AMPLITUDE = "torque.0.harmonics.0.amplitude"


@pytest.fixture
def model(tmp_path):
    file = tmp_path / "model.toml"
    file.write_text(loaded_gear(1.5 * LIMIT).to_toml(), encoding="utf-8")
    return file


def run(capsys, *words):
    code = main([str(word) for word in words])
    out, err = capsys.readouterr()
    return code, out, err


def test_a_threshold_on_the_terminal_and_as_json(model, capsys):
    words = ["threshold", model, "--path", AMPLITUDE, "--range", "x0.3:x2"]
    code, out, _ = run(capsys, *words)
    assert code == 0
    assert "quiet up to" in out
    code, out, _ = run(capsys, *words, "--json", "--count", 4)
    assert code == 0
    answer = json.loads(out)
    low, high = sorted(answer["bracket"])
    assert low <= 1.0 / 1.5 <= high
    assert answer["own"] == 1.0


def test_a_remedy_file(model, tmp_path, capsys):
    file = tmp_path / "remedy.toml"
    file.write_text(
        f"""
        speeds = []
        [candidates]
        "{AMPLITUDE}" = {{ factor = {{ from = 0.3, to = 1.2 }}, cost = 2.0 }}
        "torque.0.mean" = {{ from = 5.0, to = 12.0 }}
        """,
        encoding="utf-8",
    )
    code, out, _ = run(capsys, "remedy", model, file, "--singles", "-o", tmp_path / "page", "--json")
    assert code == 0
    answer = json.loads(out)
    assert [remedy["certified"] for remedy in answer["remedies"]] == [True, True]
    assert answer["remedies"][0]["changes"]["torque.0.mean"] == pytest.approx(9.0, rel=0.03)
    assert (tmp_path / "page" / "report.html").exists()


@pytest.mark.parametrize(
    ("words", "location"),
    [
        (["threshold", "MODEL", "--path", AMPLITUDE, "--range", "1"], "--range"),
        (["threshold", "MODEL", "--path", AMPLITUDE, "--range", "x1:xmuch"], AMPLITUDE),
        (["threshold", "MODEL", "--path", AMPLITUDE, "--range", "1:2", "--until", "silent"], "--until"),
        (["threshold", "MODEL", "--path", "torque.0.no", "--range", "1:2"], "torque.0.no"),
        (["threshold", "MODEL", "--path", AMPLITUDE, "--range", "1:2", "--count", "2"], "--count"),
        (["remedy", "MODEL", "FILE"], "candidate"),
    ],
)
def test_what_is_wrong_is_said_with_its_option(model, tmp_path, capsys, words, location):
    file = tmp_path / "wrong.toml"
    file.write_text("candidate = 3\n", encoding="utf-8")
    chosen = [{"MODEL": model, "FILE": file}.get(word, word) for word in words]
    code, out, err = run(capsys, *chosen)
    assert code == 2
    assert location in err
    assert not out


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
def test_ctrl_c_tells_what_is_known(model, tmp_path):
    program = (
        "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
        "from gearrattle.cli import main; sys.exit(main())"
    )
    page = tmp_path / "page"
    words = ["threshold", model, "--path", AMPLITUDE, "--range", "x0.3:x2", "--count", "1000", "--cycles", "2000"]
    words = [sys.executable, "-c", program, *words, "-o", page]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        while not process.stderr.readline().startswith("simulating:"):
            assert process.poll() is None
        process.send_signal(signal.SIGINT)
        answer, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "torque amplitude" in answer.lower()
    assert "stopped before the end" in errors
    assert "nothing was written" not in errors
    assert (page / "report.html").exists()
