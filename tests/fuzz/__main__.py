"""Attack readers until inputs or time run out: ``make fuzz``, or ``python -m tests.fuzz --help``.

Every target runs in a process of its own, so that a crash or a hang in a library is one find and not the end. Where
atheris is installed (``pip install atheris``) half of the inputs of a target are chosen by the coverage they reach.
The counts go into benchmarks/reliability/fuzz.json, finds into a folder.
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

from tests.fuzz.attack import Attack, quiet
from tests.fuzz.mutations import LARGEST, mutated
from tests.fuzz.targets import ROOT, TARGETS

COUNTS = ROOT / "benchmarks" / "reliability" / "fuzz.json"
_PATIENCE, _MOST_DATA = 60.0, 3_000_000_000  # seconds without an answer; bytes that a process may ask for


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
    corpus = attack.path.parent / ".corpus"
    corpus.mkdir()
    for number, data in enumerate(attack.seeds):
        (corpus / str(number)).write_bytes(data)

    def one(data: bytes) -> None:
        before(attack.result.tried, data)
        attack.note(attack.tells(data), data)

    def mutator(data: bytes, _size: int, choice: int) -> bytes:
        return mutated(data, random.Random(choice), text=attack.target.text)

    arguments = [
        "fuzz",
        f"-runs={count}",
        f"-seed={seed + 1}",
        f"-max_len={LARGEST}",
        "-timeout=100",
        "-rss_limit_mb=0",
    ]
    with quiet(), attack.target.while_open():
        atheris.Setup([*arguments, "-rss_limit_mb=0", "-verbosity=0", str(corpus)], one, custom_mutator=mutator)
        atheris.Fuzz()  # leaves the process


def campaign(name: str, count: int, seed: int, seconds: float, keep: Path, *, guided: bool) -> dict[str, Any]:
    """Attack one target in processes of their own until all inputs are tried or the time is up."""
    shared = multiprocessing.Value("q", 0)
    begun = time.monotonic()
    refused = 0
    finds = dict[str, bytes]()
    while shared.value < count and time.monotonic() - begun < seconds:
        with tempfile.TemporaryDirectory(prefix="fuzz-", dir=_fast()) as held:
            folder, first = Path(held), shared.value
            share = min(count - first, 20_000)
            arguments = (name, folder, share, seed + first, shared)
            process = multiprocessing.Process(target=attacked, args=arguments, kwargs={"guided": guided})
            process.start()
            ended = _watched(process, shared, begun + seconds)
            content = json.loads(text) if (text := _text(folder / "result.json")) else {"refused": 0, "finds": {}}
            refused += content["refused"]
            finds |= {what: bytes.fromhex(data) for what, data in content["finds"].items()}
            if ended:
                finds[ended] = (folder / TARGETS[name].file).read_bytes()
            elif shared.value == first and time.monotonic() - begun < seconds:
                raise SystemExit(f"{name}: no input was tried")
    for what, data in finds.items():
        keep.mkdir(parents=True, exist_ok=True)
        position = keep / "".join(c if c.isalnum() else "-" for c in f"{name} {what}")
        position.write_bytes(data)
    return {"tried": shared.value, "refused": refused, "failures": len(finds), "finds": sorted(finds)}


def _watched(process: Any, shared: Any, end: float) -> str:
    """Wait for a process; return what is wrong with its end, empty if nothing is."""
    last, since = shared.value, time.monotonic()
    while process.is_alive():
        process.join(1.0)
        if shared.value != last:
            last, since = shared.value, time.monotonic()
        if time.monotonic() > end and process.is_alive():
            process.terminate()
            process.join()
            return ""
        if time.monotonic() - since > _PATIENCE and process.is_alive():
            process.kill()
            process.join()
            return "hang"
    return f"killed by {signal.Signals(-process.exitcode).name}" if (process.exitcode or 0) < 0 else ""


def _fast() -> str | None:
    """A folder in memory, where there is one."""
    return "/dev/shm" if os.access("/dev/shm", os.W_OK) else None


def _text(path: Path) -> str:
    return path.read_text() if path.exists() else ""


def main() -> int:
    """Run the campaigns asked for."""
    ask = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    ask.add_argument("targets", nargs="*", help=f"some of: {', '.join(TARGETS)}")
    ask.add_argument("--inputs", type=int, default=20_000, help="of every target")
    ask.add_argument("--seconds", type=float, default=1800.0, help="at most, for every target")
    ask.add_argument("--seed", type=int, default=0)
    ask.add_argument("--finds", type=Path, default=ROOT / "out" / "fuzz", help="folder for inputs that show a fault")
    ask.add_argument("--add", action="store_true", help="add the counts to those of earlier campaigns")
    asked = ask.parse_args()
    kept = {row["attack"]: row for row in json.loads(_text(COUNTS) or '{"rows": []}')["rows"]}
    failed = 0
    for name in asked.targets or TARGETS:
        rounds = (False, True) if find_spec("atheris") else (False,)
        row: dict[str, Any] = {"attack": f"damaged input: {name}", "tried": 0, "failures": 0, "refused": 0, "guided": 0}
        for guided in rounds:
            share = (asked.inputs // len(rounds), asked.seed, asked.seconds / len(rounds), asked.finds)
            actual = campaign(name, *share, guided=guided)
            print(f"{name}{', guided' * guided}: {actual}", flush=True)
            row |= {key: row[key] + actual[key] for key in ("tried", "failures", "refused")}
            row["guided"] += actual["tried"] * guided
        failed += row["failures"]
        earlier = kept.get(row["attack"]) if asked.add else None
        if earlier:
            row |= {key: value + earlier[key] for key, value in row.items() if isinstance(value, int)}
        kept[row["attack"]] = row | {"date": f"{date.today()}"}
        COUNTS.parent.mkdir(parents=True, exist_ok=True)
        COUNTS.write_text(json.dumps({"date": f"{date.today()}", "rows": list(kept.values())}, indent=1) + "\n")
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
