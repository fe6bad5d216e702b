"""English that depends on a number or on the word that follows, and text in columns.

Takes numbers, nouns and cells; gives text to messages, notes, pages and terminals.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

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


def listed(names: Sequence[str], last: str = "and") -> str:
    """Return names as a list in a sentence: "a", "a and b", "a, b and c"; ``last`` stands before the last."""
    return f" {last} ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def columns(head: Sequence[str], rows: Iterable[Sequence[str]], words: Collection[int] = (0,)) -> str:
    """Return a table as lines: the columns of words aligned left, the others right, two spaces between.

    Args:
        head: titles of the columns; none of them: no line of titles.
        rows: cells, as long as ``head``.
        words: indices of the columns of words.
    """
    table = [*([list(head)] if any(head) else []), *(list(row) for row in rows)]
    widths = [max(len(row[k]) for row in table) for k in range(len(head))] if table else []
    lines = (
        "  ".join(cell.ljust(widths[k]) if k in words else cell.rjust(widths[k]) for k, cell in enumerate(row))
        for row in table
    )
    return "\n".join(line.rstrip() for line in lines)
