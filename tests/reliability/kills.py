"""Commands killed at random times, over and over, and what is left of their results looked at each time.

    python -m tests.reliability.kills --number 1000
    python -m tests.reliability.kills --every 0.05      a study in processes: each signal at each 0.05 s of five seconds

writes benchmarks/reliability/kills.json: by attack, how many kills there were and how many failures of each kind. A
command is sent INT, TERM or KILL, alone or with its whole group, at a seeded time; half of the times lie in the last
third of what it takes undisturbed, where results are written. Then it is begun again in the same folder, with
``--resume`` where it has that. After every kill, and after what was begun again, all values that are there are
compared bit for bit with those of an undisturbed command. Failures:

    lost        results that an earlier look found whole are gone
    partial     results are shown that are not those of an undisturbed command, or a mixture of two
    processes   a process of the command lives five seconds later (on a machine that has time for it)
    folders     hidden files or folders are left after the next complete start
    answer      the exit code is not that of the signal, or an internal error is told

Linux: processes are found by a word in their environment, in /proc.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np

import gearrattle as gr
from gearrattle.errors import ModelError
from tests.reliability.serving import look_at_jobs, submit_jobs
from tests.reliability.values import (
    Look,
    content_of,
    look_at_figures,
    look_at_file,
    look_at_report,
    look_at_stream,
    look_at_study,
    values_of_file,
    values_of_run,
)
from tests.studies.clusters import dask
from tests.studies.drivelines import TOML

RESULTS = Path(__file__).parents[2] / "benchmarks" / "reliability" / "kills.json"
KINDS = ("lost", "partial", "processes", "folders", "answer")
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
MARK = "GEARRATTLE_ATTACK"
LEFT = 5.0
"""Seconds in which all processes of a killed command must end, where no others wait for the cores."""
MODELS = {"A": TOML, "B": TOML.replace("mean = 0.4", "mean = 0.5").replace("two bodies", "two others")}
PROGRAM = (
    "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
    "from gearrattle.cli import main; sys.exit(main())"
)
"""A shell's background jobs ignore SIGINT and hand that on to what they start."""
BASINS = """model = "A.toml"
kind = "basins"
cycles = 60
discard = 40
[over]
"deflection.joint" = { from = -0.01, to = 0.01, count = 4 }
"rate.joint" = { from = -1.0, to = 1.0, count = 4 }
"""
STUDY = 'model = "A.toml"\noutputs = ["TR rms", "verdict"]\n[axis]\n"{0}" = {{ from = 0.2, to = 1.2, count = {1} }}\n'


@dataclass
class Attack:
    """A command under attack.

    Attributes
    ----------
    name
        of the attack.
    commands
        words of the command, taken in turn; ``--resume`` is added where it resumes.
    output
        the folder it writes.
    look
        tells how much of the results is there, 0 to 1; raises AssertionError where it is wrong.
    drive
        asks a command for what it computes, in a thread of its own, and ends it when it has; takes the process and the
        file with what it printed.
    resumes
        whether what is there must never become less.
    took
        seconds that it takes undisturbed.
    begun
        how many starts there were.
    whole
        how much the last look found.
    """

    name: str
    commands: tuple[tuple[str, ...], ...]
    output: Path
    look: Look
    drive: Callable[[subprocess.Popen[bytes], Path], None] | None = None
    resumes: bool = False
    took: float = 0.0
    begun: int = 0
    whole: float = 0.0
    tried: int = 0
    failures: dict[str, int] = field(default_factory=lambda: dict.fromkeys(KINDS, 0))
    notes: list[str] = field(default_factory=list)

    def words(self) -> list[str]:
        """Return the words of the next start."""
        self.begun += 1
        more = ["--resume"] if self.resumes and self.output.exists() else []
        return [sys.executable, "-c", PROGRAM, *self.commands[self.begun % len(self.commands)], *more]

    def failed(self, kind: str, note: str) -> None:
        """Count a failure."""
        self.failures[kind] += 1
        self.notes.append(f"{kind}: {note}")


def processes(mark: str) -> list[int]:
    """Return the ids of the processes whose environment holds a mark."""
    actual = []
    for path in Path("/proc").glob("[0-9]*/environ"):
        try:
            if f"{MARK}={mark}".encode() in path.read_bytes() and "Z" not in path.with_name("stat").read_text():
                actual.append(int(path.parent.name))
        except OSError:
            continue
    return actual


def started(attack: Attack) -> tuple[subprocess.Popen[bytes], str]:
    """Start the command in a group of its own, with a mark."""
    mark = uuid4().hex
    environment = {**os.environ, MARK: mark}
    printed = attack.output.parent / f"printed-{mark}"
    with printed.open("wb") as target:
        process = subprocess.Popen(
            attack.words(),
            cwd=attack.output.parent,
            env=environment,
            stdout=target,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
    if attack.drive is not None:
        threading.Thread(target=attack.drive, args=(process, printed), daemon=True).start()
    return process, mark


def kill_once(attack: Attack, rng: np.random.Generator) -> None:
    """Start the command, kill it, and look at what is left."""
    number = SIGNALS[int(rng.integers(len(SIGNALS)))]
    early = rng.random() < 0.5
    delay = float(rng.uniform(0.0, 1.05) if early else rng.uniform(0.65, 1.05)) * attack.took
    group = number != signal.SIGKILL and rng.random() < 0.5
    strike(attack, number, delay, group=group)


def strike(attack: Attack, number: signal.Signals, delay: float, *, group: bool = False) -> None:
    """Start the command, send a signal after a while, and look at what is left."""
    process, mark = started(attack)
    try:
        process.wait(delay)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, number) if group else process.send_signal(number)
    about = f"{number.name}{' to the group' if group else ''} after {delay:.2f} s"
    deadline = time.monotonic() + LEFT
    while (left := processes(mark)) and time.monotonic() < deadline:
        time.sleep(0.05)
    attack.tried += 1
    if left:
        attack.failed("processes", f"{about}: {len(left)} left")
        for one in left:
            os.kill(one, signal.SIGKILL)
    errors = process.communicate()[1].decode(errors="replace")
    codes = {0, -number, {signal.SIGINT: 130, signal.SIGTERM: 143}.get(number, 0)}
    codes |= {130} if attack.drive else set()  # which may have interrupted it at the same time
    if process.returncode not in codes or "internal error" in errors:
        attack.failed("answer", f"{about}: exit code {process.returncode}: {errors[-300:]}")
    look(attack, about)
    if attack.resumes and process.returncode == 0:
        check_folders(attack, about)
        shutil.rmtree(attack.output)
        attack.whole = 0.0


def look(attack: Attack, about: str) -> None:
    """Look at the results, and see that they have not become less."""
    try:
        whole = attack.look(attack.output)
    except (AssertionError, LookupError, OSError, ValueError, ModelError) as error:
        attack.failed("partial", f"{about}: {type(error).__name__}: {error!s:.300}")
        return
    if whole < attack.whole:
        attack.failed("lost", f"{about}: {attack.whole:.3f} before, {whole:.3f} now")
    attack.whole = whole


def check_folders(attack: Attack, about: str) -> None:
    """See that nothing hidden is left; what a command in full leaves is what it was meant to."""
    patterns = (".gearrattle-*", ".handed-*", "*.partial", "*.begun")
    left = [path.name for pattern in patterns for path in attack.output.parent.rglob(pattern)]
    if left:
        attack.failed("folders", f"{about}: {left}")
    for printed in attack.output.parent.glob("printed-*"):
        printed.unlink()


def finish(attack: Attack) -> None:
    """Let the command end undisturbed, and look once more."""
    for _ in attack.commands:
        process, _ = started(attack)
        errors = process.communicate()[1].decode(errors="replace")
        if process.returncode not in ((0, 130) if attack.drive else (0,)):
            attack.failed("answer", f"undisturbed: exit code {process.returncode}: {errors[-300:]}")
    look(attack, "undisturbed")
    if attack.whole != 1.0:
        attack.failed("lost", f"undisturbed: {attack.whole:.3f} at the end")
    check_folders(attack, "undisturbed")


def undisturbed(attack: Attack) -> float:
    """Run every command of an attack once; return the seconds of the last."""
    for _ in attack.commands:
        begun = time.monotonic()
        process, _ = started(attack)
        errors = process.communicate()[1].decode(errors="replace")
        if process.returncode not in (0, 130):
            raise RuntimeError(f"{attack.name}: {errors}")
        attack.took = time.monotonic() - begun
    return attack.took


@contextmanager
def attacks(home: Path, names: tuple[str, ...], cases: int = 24) -> Iterator[list[Attack]]:
    """Prepare attacks in a folder: each command is run undisturbed once, for its time and its results."""
    for name, text in MODELS.items():
        (home / f"{name}.toml").write_text(text, encoding="utf-8")
    torque = "torque.0.mean"
    (home / "study.toml").write_text(STUDY.format(torque, cases), encoding="utf-8")
    (home / "basins.toml").write_text(BASINS, encoding="utf-8")
    long = ("--cycles", "1000", "--samples-per-cycle", "32")
    study = ("study", "../study.toml", "-o", "out")
    over = ("--path", torque, "--range", "0.3:0.35")
    with dask(home, 1) if "cluster" in names else _nothing() as cluster:
        address = cluster.address if cluster is not None else ""
        known = {
            "run": tuple(("run", f"../{name}.toml", *long, "-o", "out") for name in MODELS),
            "simulate": tuple(("simulate", f"../{name}.toml", *long, "-o", "out.nc") for name in MODELS),
            "continue": (("continue", "../A.toml", *over, "-o", "out"),),
            "figures": tuple(("figures", f"../{name}-run", "-o", "out", "--as", "pdf,svg") for name in MODELS),
            "stream": (("stream", "../A.toml", "--cycles", "12000", "--chunk", "1000", "-o", "out"),),
            "threads": ((*study, "--scheduler", "threads", "--workers", "2"),),
            "processes": ((*study, "--scheduler", "local", "--workers", "2"),),
            "cluster": ((*study, "--scheduler", address),),
            "basins": (("study", "../basins.toml", "-o", "out", "--scheduler", "local", "--workers", "2"),),
            "serve": (("serve", "out", "--workers", "1"),),
        }
        if "figures" in names:
            for name in MODELS:
                words = [sys.executable, "-c", PROGRAM, "run", f"{name}.toml", "-o", f"{name}-run"]
                subprocess.run(words, cwd=home, check=True, capture_output=True)
        outputs = {"simulate": "out.nc"}
        made = [Attack(name, known[name], home / name / outputs.get(name, "out"), _nothing_there) for name in names]
        for attack in made:
            attack.output.parent.mkdir()
            attack.look = _reference(attack, home)
            _remove(attack.output)
            if attack.name == "serve":
                attack.output.mkdir()
        yield made


@contextmanager
def _nothing() -> Iterator[None]:
    yield None


def _nothing_there(_: Path) -> float:
    return 0.0


def _remove(path: Path) -> None:
    """Remove a file or a folder."""
    shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)


def _reference(attack: Attack, home: Path) -> Look:
    """Run a command undisturbed, and return what tells whether later results are those."""
    if attack.name == "serve":
        attack.output.mkdir()
        attack.drive = submit_jobs
        undisturbed(attack)
        return look_at_jobs(attack.output)
    if attack.name in ("run", "simulate", "figures", "continue"):
        return _reference_of_each(attack, home)
    undisturbed(attack)
    attack.resumes = True
    if attack.name == "stream":
        return look_at_stream([values_of_run(run) for run in gr.open_stream(attack.output)])
    return look_at_study(gr.open_study(attack.output).load())


def _reference_of_each(attack: Attack, home: Path) -> Look:
    """Run each command of an attack whose result is replaced, undisturbed."""
    commands = attack.commands
    contents: list[Any] = []
    for command in commands:
        attack.commands = (command,)
        undisturbed(attack)
        if attack.name == "simulate":
            contents.append(values_of_file(attack.output))
        elif attack.name == "figures":
            contents.append(content_of(attack.output))
        else:
            contents.append((set(content_of(attack.output)), values_of_file(attack.output / "results.nc")))
        _remove(attack.output)
    attack.commands = commands
    if attack.name == "simulate":
        return look_at_file(contents)
    if attack.name == "figures":
        return look_at_figures(contents)
    titles = [gr.load(home / f"{name}.toml").name for name in MODELS]
    return look_at_report(dict(zip(titles, contents, strict=False)))


def main() -> int:
    """Attack, and write what came out."""
    names = ("run", "simulate", "figures", "continue", "stream", "threads", "processes", "cluster", "basins", "serve")
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--number", type=int, default=1000)
    parser.add_argument("--every", type=float, help="kill a study in processes at all multiples of so many seconds")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="stop earlier after so long")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", choices=names, action="append")
    parser.add_argument("--output", type=Path, default=RESULTS)
    parser.add_argument("--add", action="store_true", help="add the counts to those of earlier campaigns")
    asked = parser.parse_args()
    rng = np.random.default_rng(asked.seed)
    earlier = json.loads(asked.output.read_text(encoding="utf-8"))["rows"] if asked.add else []
    if asked.every is not None:
        asked.only = ["processes"]
        times = np.arange(asked.every, 5.0 + 1e-9, asked.every)
        planned = [(number, float(after)) for after in rng.permutation(times) for number in SIGNALS]
        asked.number = len(planned)
    with tempfile.TemporaryDirectory() as home, attacks(Path(home), tuple(asked.only or names)) as made:
        deadline = time.monotonic() + 60.0 * asked.minutes
        for i in range(asked.number):
            if time.monotonic() > deadline:
                break
            attack = made[i % len(made)]
            before = len(attack.notes)
            if asked.every is None:
                kill_once(attack, rng)
            else:
                strike(attack, *planned[i])
            for note in attack.notes[before:]:
                print(f"{attack.name}: {note}", file=sys.stderr, flush=True)
            if (i + 1) % 20 == 0:
                print(f"{i + 1} kills", file=sys.stderr, flush=True)
                _write(made, asked, earlier)
        for attack in made:
            finish(attack)
            print(f"{attack.name}: {attack.tried} kills, failures {attack.failures}", file=sys.stderr, flush=True)
        _write(made, asked, earlier)
    return int(any(sum(attack.failures.values()) for attack in made))


def _write(made: list[Attack], asked: argparse.Namespace, earlier: list[dict[str, Any]]) -> None:
    """Write the counts, added to earlier ones of the same name; at all multiples of a time is an attack of its own."""
    which = "" if asked.every is None else f", each signal every {asked.every:g} s of the first five"
    rows = {row["attack"]: row for row in earlier}
    for attack in made:
        name = f"kills: {attack.name}{which}"
        before = rows.get(name, {"tried": 0, "failures": 0, "kinds": {}, "notes": []})
        rows[name] = {
            "attack": name,
            "tried": before["tried"] + attack.tried,
            "failures": before["failures"] + sum(attack.failures.values()),
            "kinds": {kind: before["kinds"].get(kind, 0) + count for kind, count in attack.failures.items()},
            "notes": [*before["notes"], *attack.notes],
        }
    asked.output.parent.mkdir(parents=True, exist_ok=True)
    content = {"date": time.strftime("%Y-%m-%d"), "seed": asked.seed, "rows": list(rows.values())}
    asked.output.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    raise SystemExit(main())
