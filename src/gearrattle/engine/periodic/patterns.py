"""Patterns of crossings: the order in which watched quantities cross their bounds, independent of the start of the
period.

A crossing is a letter, a motion is a word, and its pattern is the smallest rotation of that word. Comparing and
rotating words takes much less time than lists of pairs.
"""

from __future__ import annotations

from collections import Counter
from itertools import product

from gearrattle.engine.system.crossings_in_order import Passages

Pattern = tuple[tuple[int, int], ...]
"""Crossings in order, as pairs (watch, 1 for the upper bound)."""
_AT_ONCE = 2  # most lone crossings that appear at once: one in each half of a symmetric motion


def word_of(crossings: Passages) -> str:
    """Return the word of crossings; those at one instant are in the order of the watched quantities."""
    crossings = crossings.in_order()
    letters = (2 * crossings.watch + crossings.upward).tolist()
    return "".join(map(chr, letters))


def watch_of(letter: str) -> int:
    """Return the index of the watched quantity that crosses."""
    return ord(letter) // 2


def is_upward(letter: str) -> int:
    """Return 1 if the quantity crosses its upper bound, else 0."""
    return ord(letter) % 2


def pairs_of(word: str) -> Pattern:
    """Return the crossings of a word as pairs."""
    return tuple((watch_of(letter), is_upward(letter)) for letter in word)


def rotated(word: str) -> str:
    """Return the smallest rotation of a word: a pattern does not depend on where a period begins."""
    least = min(word, default="")
    return min((word[i:] + word[:i] for i, letter in enumerate(word) if letter == least), default=word)


def is_rotation(one: str, other: str) -> bool:
    """Return whether two words have the same pattern."""
    return len(one) == len(other) and one in other + other


def without(word: str, i: int) -> str | None:
    """Return a word without crossings i and the next, if these cross one bound out and back; else None."""
    j = (i + 1) % len(word)
    if ord(word[i]) ^ 1 != ord(word[j]):
        return None
    return word[1:-1] if j == 0 else word[:i] + word[j + 1 :]


def exchanged(word: str, i: int) -> str:
    """Return a word with crossing i and the next exchanged."""
    j = (i + 1) % len(word)
    letters = list(word)
    letters[i], letters[j] = letters[j], letters[i]
    return "".join(letters)


def touches(fewer: str, more: str) -> list[int]:
    """Return the indices i for which ``more`` without crossings i and i + 1 has the pattern of ``fewer``."""
    if len(more) != len(fewer) + 2:
        return []
    return [i for i in range(len(more)) if (rest := without(more, i)) is not None and is_rotation(rest, fewer)]


def swaps(one: str, other: str) -> list[int]:
    """Return the indices i for which ``one`` with crossings i and i + 1 exchanged has the pattern of ``other``.

    The two crossings are of different quantities: one quantity cannot exchange its crossings up and down.
    """
    if sorted(one) != sorted(other):
        return []
    neighbours = [i for i in range(len(one)) if watch_of(one[i]) != watch_of(one[(i + 1) % len(one)])]
    return [i for i in neighbours if is_rotation(exchanged(one, i), other)]


def lone(fewer: str, more: str) -> str:
    """Return the letters that occur more often in ``more`` than in ``fewer``, and whose crossings back do not.

    They are crossings of sliders: a slider that is released before it slips has one crossing less.
    """
    letters = "".join((Counter(more) - Counter(fewer)).elements())
    return "".join(letter for letter in letters if chr(ord(letter) ^ 1) not in letters)


def is_lone_change(fewer: str, more: str) -> bool:
    """Return whether ``more`` without its lone letters, one or two, has the pattern of ``fewer``.

    In a symmetric motion two sliders are released at once.
    """
    letters = lone(fewer, more)
    if not 0 < len(letters) <= _AT_ONCE or len(more) != len(fewer) + len(letters):
        return False
    kept = (
        "".join(letter for i, letter in enumerate(more) if i not in left_out)
        for left_out in product(*([i for i, other in enumerate(more) if other == letter] for letter in letters))
    )
    return any(is_rotation(word, fewer) for word in kept)


def is_one_change(one: str, other: str) -> bool:
    """Return whether two patterns are the same, or differ by one touch, one exchange or one lone crossing."""
    if is_rotation(one, other) or touches(one, other) or touches(other, one) or swaps(one, other):
        return True
    return is_lone_change(one, other) or is_lone_change(other, one)
