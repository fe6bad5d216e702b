"""Every public call and every command works with every kind of model, or says why not; the manual's table is true."""

from __future__ import annotations

import inspect

import pytest

from gearrattle.cli import COMMANDS
from gearrattle.studies.kinds import KINDS as STUDY_KINDS
from tests.architecture.public import FUNCTIONS
from tests.compositions import calls, commands
from tests.compositions.kinds import KINDS
from tests.compositions.outcomes import WORKS
from tests.compositions.table import HARDEST, LARGE, PAGE, ROWS, kept, outcomes, page, quick_rows


def test_every_public_function_has_a_row() -> None:
    assert {row.partition(":")[0] for row in calls.CALLS} | calls.WITHOUT_MODEL == set(FUNCTIONS)
    assert not {row.partition(":")[0] for row in calls.CALLS} & calls.WITHOUT_MODEL


def test_every_command_has_a_row() -> None:
    typed = {row.split()[0].removesuffix(":") for row in commands.COMMAND_LINES}
    assert typed | commands.WITHOUT_MODEL == set(COMMANDS)
    assert set(commands.STUDIES) == set(STUDY_KINDS)


def test_calls_without_a_row_take_no_model() -> None:
    takes = {name: list(inspect.signature(FUNCTIONS[name]).parameters) for name in calls.WITHOUT_MODEL}
    assert [name for name, words in takes.items() if {"model", "run", "source", "result"} & set(words)] == []


def test_the_manual_tells_every_row_and_kind_as_computed() -> None:
    reported = kept()
    assert list(reported) == list(ROWS)
    assert all(list(by_kind) == list(KINDS) for by_kind in reported.values())
    assert PAGE.read_text(encoding="utf-8") == page(reported)
    assert all(reported[row]["harmonics"] == WORKS for row in ROWS if not row.startswith(("validate_run_up",)))


ALWAYS = (
    "one body",
    LARGE,
    *(pytest.param(kind, marks=pytest.mark.long) for kind in (*HARDEST, "run-up with all")),
)
"""Kinds whose quick rows are always computed; long tests compute those of the hardest, and every row of every kind."""


@pytest.mark.slow
@pytest.mark.parametrize("kind", ALWAYS)
def test_quick_calls_and_commands_work_or_say_why_not(kind: str) -> None:
    rows, reported = quick_rows(kind), kept()
    assert outcomes(kind, rows) == {row: reported[row][kind] for row in rows}


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_all_calls_and_commands_work_or_say_why_not(kind: str) -> None:
    reported = kept()
    assert outcomes(kind, ROWS) == {row: reported[row][kind] for row in ROWS}
