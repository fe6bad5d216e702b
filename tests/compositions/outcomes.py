"""What becomes of a call: it works, or it is refused with a reason. Everything else is an internal error, and raised.

Takes calls and commands; gives words.
"""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from unittest import mock

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.cli.failures import explain
from tests.compositions.calls import Call, Kit

WORKS = "works"


def outcome_of(call: Call, kit: Kit) -> str:
    """Return ``WORKS``, or why the call is refused.

    Raises
    ------
    Exception
        whatever is no error that the package raises on purpose.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        try:
            call(kit)
        except gr.GearRattleError as error:
            return reason_of(error)
    return WORKS


def outcome_of_command(words: Sequence[str]) -> str:
    """Return ``WORKS``, or why a command is refused.

    Raises
    ------
    AssertionError
        it ended with anything but an error that the package raises on purpose, or without a word.
    """
    raised: list[BaseException] = []

    def explained(error: BaseException) -> tuple[int, str]:
        raised.append(error)
        return explain(error)

    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err), mock.patch("gearrattle.cli.failures.explain", explained):
        code = main(list(words))
    typed = f"gearrattle {' '.join(words)}"
    if code == 0:
        assert out.getvalue(), f"{typed} printed nothing"
        return WORKS
    (error,) = raised
    assert isinstance(error, gr.GearRattleError), f"{typed}: {err.getvalue()}"
    assert code == (2 if isinstance(error, gr.ModelError) else 1), typed
    return reason_of(error)


def reason_of(error: gr.GearRattleError) -> str:
    """The rules that were broken, without numbers: these differ from driveline to driveline."""
    rules = [problem.rule for problem in error.problems] if isinstance(error, gr.ModelError) else [str(error)]
    return "; ".join(dict.fromkeys(_general(rule) for rule in rules))


def _general(text: str) -> str:
    first = text.partition("; try: ")[0].partition("\n")[0]
    return re.sub(r"\d+\.\d+(e[-+]?\d+)?|\d+e[-+]?\d+", "…", first).removesuffix(".")
