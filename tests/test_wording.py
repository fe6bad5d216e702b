"""Plurals, articles and lists in sentences."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import gearrattle as gr
from gearrattle.wording import counted, listed, with_article


@pytest.mark.parametrize(
    ("words", "want"),
    [
        (counted(1, "impact"), "1 impact"),
        (counted(0, "impact"), "0 impacts"),
        (counted(1.0, "cycle"), "1 cycle"),
        (counted(2.875, "cycle"), "2.88 cycles"),
        (counted(0.9999, "cycle"), "1 cycle"),
        (counted(2, "entry", "entries"), "2 entries"),
        (with_article("acceleration"), "an acceleration"),
        (with_article("torque"), "a torque"),
        (with_article("unit"), "a unit"),
        (with_article("hour"), "an hour"),
        (with_article("Inertia"), "an Inertia"),
        (listed(["a"]), "a"),
        (listed(["a", "b"]), "a and b"),
        (listed(["a", "b", "c"]), "a, b and c"),
        (listed([]), ""),
    ],
)
def test_numbers_and_articles_agree_with_their_nouns(words: str, want: str) -> None:
    assert words == want


def test_messages_of_the_package_say_an_acceleration_and_1_time() -> None:
    kinds = [with_article(kind) for kind in ("angle", "acceleration", "torque", "velocity", "inertia", "force")]
    assert kinds == ["an angle", "an acceleration", "a torque", "a velocity", "an inertia", "a force"]
    text = """
    schema = 1
    inertia = [{ name = "a", J = "1 rad" }]
    excitation = { speed = 8.0 }
    """
    with pytest.raises(gr.ModelError) as caught:
        gr.loads(text)
    assert " a inertia" not in str(caught.value)
    short = gr.simulate(gr.loads(text.replace('"1 rad"', "1.0")), cycles=1, discard=0, samples_per_cycle=8)
    assert "1 cycle, 0 crossings" in repr(short)


NOUNS = (
    "blocks|bodies|calls|cases|channels|chunks|crossings|cycles|designs|forecasts|gears|generations|harmonics|impacts|lines|"
    "meshes|modes|motions|orders|parts|periods|points|regions|rows|runs|samples|segments|steps|sweeps|values|workers"
)
"""What messages count."""
PLURAL = re.compile(
    r"\ba \{(\w+\.)*(quantity|measured|dimension\.name)\}"
    # a whole number in braces, which is no constant, before a plural that does not depend on it
    rf"|(?<!of the )(?<!the )\{{(?![^{{}}]*\b_?[A-Z]{{3}}|counted|noun_of)[^{{}}:]*\}} (?:[a-z]+ )?({NOUNS})\b(?! of)"
    r"|\w'?\{?'e?s' \*|\b(?!range|diag|len|float|time)[a-z]{3,}\((s|es)\)(?=[ ,.;\"])"
)
"""An article or a plural in a message that is joined to what it depends on, instead of made by ``wording``."""
MANY = (
    "== 1",
    "!= 1",
    "> 1",
    "len(able)",
    "most} regions",
    "len(labels)",
    "len(y)",
    "block.lines",
    "found.size",
    "length} samples in",
    "samples_per_cycle}",
    "count} combinations",
    "samples_needed",
    "numbers.size",
    "len(points)} fixed",
    "_rounded(calls)",
    "{need} steady",
    "{wanted} cycles",
    "count} runs are",
    "told.runs",
    "{CYCLES if",
    "parts them",
)
"""In lines where the number is known to be another than one."""


def joined_plurals(text: str) -> list[str]:
    """The lines of a source that write a plural by hand."""
    return [
        line.strip() for line in text.splitlines() if PLURAL.search(line) and not any(word in line for word in MANY)
    ]


@pytest.mark.parametrize(
    "line", ['f"{count} samples left"', 'f"{run.cycles} cycles"', "f\"{n} worker{'s' * (n != 2)}\"", '"sample(s) left"']
)
def test_a_plural_that_is_written_by_hand_is_found(line: str) -> None:
    assert joined_plurals(line) == [line]


def test_no_message_joins_an_article_or_a_plural_to_what_the_helpers_are_for() -> None:
    """In f-strings "a {quantity}" and "{...cycles} cycles" are wrong for an angle and for one cycle."""
    source = Path(gr.__file__).parent
    left_out = {source / "reproduction"}  # counts of the paper's runs, in thousands, by a helper of its own
    wrong = {
        str(path.relative_to(source)): actual
        for path in sorted(source.rglob("*.py"))
        if path.parent not in left_out and (actual := joined_plurals(path.read_text(encoding="utf-8")))
    }
    assert wrong == {}
