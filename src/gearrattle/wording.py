"""English that depends on a number or on the word that follows: plurals and indefinite articles.

Takes numbers and nouns; gives text to messages, notes and pages.
"""

from __future__ import annotations

from collections.abc import Sequence

_SILENT_H = ("hour", "honest", "heir")
_Y_SOUND = ("uni", "use", "eu", "one")


def counted(number: float, noun: str, plural: str | None = None) -> str:
    """Return a number with its noun: "1 impact", "2 impacts", "0 impacts", "0.5 cycles".

    Args:
        number: shown as ``str`` for whole numbers, else with three digits.
        noun: singular.
        plural: where it is not the noun with an s.
    """
    shown = f"{number:.3g}" if isinstance(number, float) else str(number)
    return f"{shown} {noun_of(number, noun, plural)}"


def noun_of(number: float, noun: str, plural: str | None = None) -> str:
    """Return the noun in the number that goes with a number: singular for what is shown as 1.

    Args:
        number: how many.
        noun: singular.
        plural: where it is not the noun with an s.
    """
    return noun if f"{number:.3g}" == "1" else plural or f"{noun}s"


def with_article(noun: str) -> str:
    """Return a noun with "a" or "an", by its sound: "an acceleration", "a unit", "an hour"."""
    word = noun.lower()
    vowel = word.startswith(("a", "e", "i", "o", "u", *_SILENT_H)) and not word.startswith(_Y_SOUND)
    return f"{'an' if vowel else 'a'} {noun}"


def listed(names: Sequence[str]) -> str:
    """Return names as a list in a sentence: "a", "a and b", "a, b and c"."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
