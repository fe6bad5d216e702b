"""Differences of two records.

A record is read from the folders that ``record`` wrote. What differs between two records of one tree (times, numbers
of processes) is compared without its numbers.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import zip_longest
from pathlib import Path

import numpy as np

SHOWN = 12
"""Lines that are shown of one difference between texts."""


@dataclass(frozen=True)
class Answers:
    """Texts and arrays by key."""

    texts: dict[str, str]
    arrays: dict[str, np.ndarray]

    @cached_property
    def keys(self) -> set[str]:
        """All keys."""
        return {*self.texts, *self.arrays}


def read(folder: Path) -> Answers:
    """Read all parts of a record."""
    texts: dict[str, str] = {}
    arrays: dict[str, np.ndarray] = {}
    for part in sorted(path for path in folder.iterdir() if path.is_dir()):
        texts |= json.loads((part / "texts.json").read_text(encoding="utf-8"))
        keys = json.loads((part / "keys.json").read_text(encoding="utf-8"))
        with np.load(part / "arrays.npz") as stored:
            arrays |= {key: stored[f"arr_{i}"] for i, key in enumerate(keys)}
    return Answers(texts, arrays)


def unsteady(one: Answers, other: Answers) -> set[str]:
    """Return the keys whose values differ between two records of one tree, or that only one of them has."""
    return {key for key in one.keys | other.keys if _difference(one, other, key) is not None}


def differences(base: Answers, head: Answers, ignored: set[str]) -> Iterator[tuple[str, str]]:
    """Yield the key and the description of every difference, in the order of keys.

    Parameters
    ----------
    base, head
        the records.
    ignored
        keys whose numbers are not compared.
    """
    for key in sorted(base.keys | head.keys):
        if key in ignored:
            one, other = (_without_numbers(answers.texts.get(key, "")) for answers in (base, head))
            difference = None if one == other else _of_texts(one, other)
        else:
            difference = _difference(base, head, key)
        if difference is not None:
            yield key, difference


def _without_numbers(text: str) -> str:
    """A text with every number, and all blanks that align them, as one mark."""
    without_folders = re.sub(r"/tmp/tmp\w+", "FOLDER", text)
    return re.sub(r"[ \t]+", " ", re.sub(r"\d+([.,:]\d+)*(e[-+]?\d+)?", "#", without_folders))


def _difference(base: Answers, head: Answers, key: str) -> str | None:
    """What differs; None if nothing does."""
    if key not in head.keys:
        return f"gone; was {_short(base, key)}"
    if key not in base.keys:
        return f"new: {_short(head, key)}"
    if key in base.arrays and key in head.arrays:
        return _of_arrays(base.arrays[key], head.arrays[key])
    if key in base.arrays or key in head.arrays:
        return f"{_short(base, key)} became {_short(head, key)}"
    one, other = base.texts[key], head.texts[key]
    return None if one == other else _of_texts(one, other)


def _short(answers: Answers, key: str) -> str:
    """One line about a value."""
    if key in answers.texts:
        return repr(answers.texts[key][:80])
    array = answers.arrays[key]
    return f"{array.dtype} {array.shape}" if array.size > 4 else str(array.tolist())


def _of_arrays(one: np.ndarray, other: np.ndarray) -> str | None:
    """How far two arrays are apart; None if all bits are the same."""
    if one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes():
        return None
    if one.shape != other.shape or one.dtype.kind not in "fc" or other.dtype.kind not in "fc":
        return f"{one.dtype} {one.shape} {one.ravel()[:4]} became {other.dtype} {other.shape} {other.ravel()[:4]}"
    same = (one == other) | (np.isnan(one) & np.isnan(other))
    if np.any(np.isfinite(one) != np.isfinite(other)):
        return f"{np.sum(~same)} of {one.size} numbers, some of them not finite in one tree only"
    off, size = np.abs(one - other)[~same], float(np.abs(one[np.isfinite(one)]).max(initial=0.0))
    largest = float(off.max(initial=0.0))
    return f"{off.size} of {one.size} numbers, by {largest:.3g} at most; the largest number is {size:.6g}"


def _of_texts(one: str, other: str) -> str:
    """The lines that only one of them has; in time linear in their number, as summaries have 100 000 lines."""
    before, after = Counter(one.splitlines()), Counter(other.splitlines())
    gone, new = ((first - second).elements() for first, second in ((before, after), (after, before)))
    changed = [
        line
        for pair in zip_longest((f"-{line}" for line in gone), (f"+{line}" for line in new))
        for line in pair
        if line
    ]
    if not changed:
        return "the same lines in another order"
    more = [f"... and {len(changed) - SHOWN} more lines"] if len(changed) > SHOWN else []
    return "\n".join([line[:200] for line in changed[:SHOWN]] + more)
