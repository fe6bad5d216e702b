"""Attack readers and the workbench until inputs or time run out: ``make fuzz``, or ``python -m tests.fuzz --help``.

Every target runs in a process of its own, so that a crash or a hang in a library is one find and not the end. Where
atheris is installed (``pip install atheris``) half of the inputs of a target are chosen by the coverage they reach.
Inputs follow from the seed, and another day has another seed. Inputs, seconds and finds of every target are told in
the end, and go into benchmarks/reliability/fuzz.json; finds go into a folder. Ctrl-C ends with what there is so far;
a target that it interrupts counts as far as it came.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import random
import resource
import signal
import sys
import tempfile
import time
from datetime import date
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from tests.fuzz.attack import Attack
from tests.fuzz.mutations import LARGEST, mutated
from tests.fuzz.target import ROOT
from tests.fuzz.targets import TARGETS

COUNTS = ROOT / "benchmarks" / "reliability" / "fuzz.json"
_PATIENCE, _MOST_DATA = 60.0, 3_000_000_000  # seconds without an answer; bytes that a process may ask for
_TOLD = 10.0  # seconds between two lines of progress


def attacked(name: str, folder: Path, count: int, seed: int, shared: Any, *, guided: bool) -> None:
    """Attack one target in this process; ``shared`` gets the number of inputs, the answers go into the folder."""
    resource.setrlimit(resource.RLIMIT_DATA, (_MOST_DATA, _MOST_DATA))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    attack = Attack(TARGETS[name], folder)

    def stop(*_: Any) -> None:
        _write(attack, folder)
        os._exit(0)

    def before(number: int, _: bytes) -> None:
        shared.value += 1
        if number % 100 == 0 or number > count - 2:
            _write(attack, folder)

    signal.signal(signal.SIGTERM, stop)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C ends the campaign, which ends this
    if guided:
        _guided(attack, count, seed, before)
    else:
        attack.run(count, seed, before)
    _write(attack, folder)


def _write(attack: Attack, folder: Path) -> None:
    finds = {reported: data.hex() for reported, data in attack.result.finds.items()}
    (folder / "result.json").write_text(json.dumps({"refused": attack.result.refused, "finds": finds}))


def _guided(attack: Attack, count: int, seed: int, before: Any) -> None:
    """Let atheris choose the inputs; it counts the branches that the readers take."""
    import atheris

    for module in [name for name in sys.modules if name.startswith("gearrattle.") and "kernels" not in name]:
        for value in list(vars(sys.modules[module]).values()):
            if getattr(value, "__module__", "") == module and hasattr(value, "__code__"):
                atheris.instrument_func(value)
    corpus = attack.home.parent / "corpus"
    corpus.mkdir()
    for number, data in enumerate(attack.seeds):
        (corpus / str(number)).write_bytes(data)

    def one(data: bytes) -> None:
        before(attack.result.tried, data)
        attack.note(attack.tells(data), data)

    def mutator(data: bytes, _size: int, choice: int) -> bytes:
        return mutated(data, random.Random(choice), kind=attack.target.kind)

    arguments = [
        "fuzz",
        f"-runs={count}",
        f"-seed={seed + 1}",
        f"-max_len={LARGEST}",
        "-timeout=100",
        "-rss_limit_mb=0",
    ]
    with attack.opened():
        attack.read_sound_files()
        atheris.Setup([*arguments, "-rss_limit_mb=0", "-verbosity=0", str(corpus)], one, custom_mutator=mutator)
        atheris.Fuzz()  # leaves the process


def campaign(name: str, count: int, seed: int, seconds: float, keep: Path, *, guided: bool) -> dict[str, Any]:
    """Attack one target in processes of their own until all inputs are tried, or the time is up, or Ctrl-C."""
    shared = multiprocessing.Value("q", 0)
    begun = time.monotonic()
    refused = 0
    is_interrupted = False
    finds = dict[str, bytes]()
    while shared.value < count and time.monotonic() - begun < seconds and not is_interrupted:
        with tempfile.TemporaryDirectory(prefix="fuzz-", dir=_fast()) as held:
            folder = Path(held)
            first = shared.value
            share = min(count - first, 20_000)
            arguments = (name, folder, share, seed + first, shared)
            process = multiprocessing.Process(target=attacked, args=arguments, kwargs={"guided": guided})
            process.start()
            try:
                ended = _watched(process, shared, begun + seconds, f"{name}: {{}} of {count} inputs")
            except KeyboardInterrupt:
                is_interrupted = True
                ended = ""
                process.terminate()
                process.join()
            content: dict[str, Any] = (
                json.loads(text) if (text := _text(folder / "result.json")) else {"refused": 0, "finds": {}}
            )
            refused += content["refused"]
            finds |= {what: bytes.fromhex(data) for what, data in content["finds"].items()}
            if ended:
                finds[ended] = (folder / "attacked" / TARGETS[name].file).read_bytes()
            elif shared.value == first and time.monotonic() - begun < seconds and not is_interrupted:
                raise SystemExit(f"{name}: no input was tried")
    for what, data in finds.items():
        keep.mkdir(parents=True, exist_ok=True)
        position = keep / "".join(c if c.isalnum() else "-" for c in f"{name} {what}")[:200]
        position.write_bytes(data)
    return {
        "tried": shared.value,
        "refused": refused,
        "failures": len(finds),
        "seconds": round(time.monotonic() - begun),
        "finds": sorted(finds),
        "interrupted": is_interrupted,
    }


def _watched(process: Any, shared: Any, end: float, words: str) -> str:
    """Wait for a process and tell how far it is; return what is wrong with its end, empty if nothing is."""
    last = shared.value
    since = time.monotonic()
    last_line = time.monotonic()
    while process.is_alive():
        process.join(1.0)
        if shared.value != last:
            last = shared.value
            since = time.monotonic()
        if time.monotonic() - last_line > _TOLD:
            last_line = time.monotonic()
            print(words.format(last), file=sys.stderr, flush=True)
        if time.monotonic() > end and process.is_alive():
            process.terminate()
            process.join()
            return ""
        if time.monotonic() - since > _PATIENCE and process.is_alive() and last:  # before the first it may compile
            process.kill()
            process.join()
            return "hang"
    return f"killed by {signal.Signals(-process.exitcode).name}" if (process.exitcode or 0) < 0 else ""


def _fast() -> str | None:
    """A folder in memory, where there is one."""
    return "/dev/shm" if os.access("/dev/shm", os.W_OK) else None


def _text(path: Path) -> str:
    return path.read_text() if path.exists() else ""


def arguments() -> argparse.Namespace:
    """Read the command line."""
    ask = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    ask.add_argument("targets", nargs="*", help=f"some of: {', '.join(TARGETS)}")
    ask.add_argument("--inputs", type=int, default=4_000, help="of every target")
    ask.add_argument("--seconds", type=float, default=300.0, help="at most, for every target")
    ask.add_argument("--seed", type=int, default=date.today().toordinal(), help="default: the number of this day")
    ask.add_argument("--finds", type=Path, default=ROOT / "out" / "fuzz", help="folder for inputs that show a fault")
    ask.add_argument("--counts", type=Path, default=COUNTS, help="file for the counts")
    ask.add_argument("--add", action="store_true", help="add the counts to those of earlier campaigns")
    asked = ask.parse_args()
    unknown = [name for name in asked.targets if name not in TARGETS]
    if unknown:
        ask.error(f"no such target: {', '.join(unknown)}; there are: {', '.join(TARGETS)}")
    return asked


def attack_target(name: str, asked: argparse.Namespace) -> tuple[dict[str, Any], bool]:
    """Attack one target by every means there is; return its counts, and whether somebody interrupted."""
    row: dict[str, Any] = {"attack": f"damaged input: {name}", "tried": 0, "failures": 0, "refused": 0, "guided": 0}
    row["seconds"] = 0
    rounds = (False, True) if find_spec("atheris") else (False,)
    for guided in rounds:
        share = (asked.inputs // len(rounds), asked.seed, asked.seconds / len(rounds), asked.finds)
        actual = campaign(name, *share, guided=guided)
        row |= {key: row[key] + actual[key] for key in ("tried", "failures", "refused", "seconds")}
        row["guided"] += actual["tried"] * guided
        for find in actual["finds"]:
            print(f"{name}{', guided' * guided}: {find}", file=sys.stderr, flush=True)
        if actual["interrupted"]:
            return row, True
    return row, False


def _keep(row: dict[str, Any], asked: argparse.Namespace) -> None:
    """Write the counts of a target beside those of the others."""
    kept = {other["attack"]: other for other in json.loads(_text(asked.counts) or '{"rows": []}')["rows"]}
    earlier = kept.get(row["attack"]) if asked.add else None
    if earlier:
        row = row | {key: value + earlier.get(key, 0) for key, value in row.items() if isinstance(value, int)}
    kept[row["attack"]] = row | {"seed": asked.seed, "date": f"{date.today()}"}
    asked.counts.parent.mkdir(parents=True, exist_ok=True)
    asked.counts.write_text(json.dumps({"date": f"{date.today()}", "rows": list(kept.values())}, indent=1) + "\n")


def main() -> int:
    """Run the campaigns asked for."""
    asked = arguments()
    names = asked.targets or list(TARGETS)
    print(f"{len(names)} targets, at most {asked.inputs} inputs and {asked.seconds:g} s each, seed {asked.seed}")
    line = "{:48} {:>8} {:>8} {:>8} {:>6}"
    print(line.format("target", "inputs", "refused", "seconds", "finds"), flush=True)
    rows: list[dict[str, Any]] = []
    is_interrupted = False
    for name in names:
        row, is_interrupted = attack_target(name, asked)
        rows.append(row)
        _keep(row, asked)
        print(line.format(name, row["tried"], row["refused"], row["seconds"], row["failures"]), flush=True)
        if is_interrupted:
            break
    sums = {key: sum(row[key] for row in rows) for key in ("tried", "refused", "seconds", "failures")}
    print(line.format("all", *sums.values()))
    if sums["failures"]:
        print(f"inputs that show a fault: {asked.finds}")
    if is_interrupted:
        print(f"interrupted: {len(names) - len(rows)} targets were not attacked", file=sys.stderr)
        return 130
    return 1 if sums["failures"] else 0


if __name__ == "__main__":
    raise SystemExit(main())
