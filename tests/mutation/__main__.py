"""``python -m tests.mutation``: try mutants of the kernels and print those that no test notices and nothing explains.

Without ``--count`` all are tried, which takes days; a seed draws the same ones again.
"""

from __future__ import annotations

import argparse
import os
import random
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import Queue

from tests.architecture.places import ROOT
from tests.mutation.explained import EXPLAINED
from tests.mutation.mutants import Mutant, mutants_of
from tests.mutation.trials import KERNELS, Covering, copied, covering, is_noticed

NOT_TRIED = {
    "_jit.py",
    "_late.py",
    "_loading.py",
    "_intrinsics.py",
    "_llvm.py",
    "callbacks.py",
    "multistep.py",
    "variants_march.py",
}
"""Files that need compiled code, or libraries that call it."""


def drawn(count: int | None, seed: int) -> list[Mutant]:
    """Some mutants of the kernels, or all of them."""
    files = sorted(path for path in (ROOT / "src" / KERNELS).glob("*.py") if path.name not in NOT_TRIED)
    mutants = [mutant for path in files for mutant in mutants_of(path)]
    random.Random(seed).shuffle(mutants)
    return mutants[:count]


def survivors(mutants: Sequence[Mutant], tests: Covering, folder: Path) -> Iterator[tuple[Mutant, bool | None]]:
    """Yield each mutant and whether it survives; None where no test runs its line."""
    workers = os.cpu_count() or 1
    sources: Queue[Path] = Queue()
    for k in range(workers):
        sources.put(copied(folder / str(k)))

    def tried(mutant: Mutant) -> tuple[Mutant, bool | None]:
        chosen = tests.of(mutant)
        if not chosen:
            return mutant, None
        source = sources.get()
        try:
            return mutant, not is_noticed(mutant, chosen, source)
        finally:
            sources.put(source)

    with ThreadPoolExecutor(workers) as pool:
        yield from pool.map(tried, mutants)


def main() -> None:
    """Try mutants; print who survives as they come, and how many at the end."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutation", description=__doc__)
    parser.add_argument("--count", type=int, help="how many mutants are drawn (default: all)")
    parser.add_argument("--seed", type=int, default=0, help="which ones (default: 0)")
    parser.add_argument("--tests", nargs="+", default=["tests/engine"], help="what shall notice them")
    arguments = parser.parse_args()
    mutants = drawn(arguments.count, arguments.seed)
    noticed = survived = explained = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for mutant, lives in survivors(mutants, covering(folder, arguments.tests), folder):
            noticed, survived = noticed + (lives is False), survived + (lives is True)
            if lives and mutant.name in EXPLAINED:
                explained += 1
            elif lives is not False:
                print(f"{'survives' if lives else 'no test'}: line {mutant.line}: {mutant.name}", flush=True)
    untested = len(mutants) - noticed - survived
    print(f"{noticed} noticed, {survived} survive ({explained} explained), {untested} are in lines that no test runs")


if __name__ == "__main__":
    main()
