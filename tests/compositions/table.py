"""The table of outcomes: computed, kept as numbers beside the manual, and written as its page.

``python -m tests.compositions`` computes the whole and writes both files.

Takes kinds, calls and commands; gives outcomes by row and kind, and text.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.architecture.places import DOCS
from tests.compositions.calls import CALLS, Kit
from tests.compositions.commands import COMMAND_LINES
from tests.compositions.kinds import KINDS
from tests.compositions.outcomes import WORKS, outcome_of, outcome_of_command

DATA = DOCS / "reference" / "compositions.json"
PAGE = DOCS / "reference" / "compositions.md"
COMMAND = "gearrattle "
ROWS = (*CALLS, *(COMMAND + name for name in COMMAND_LINES))
"""Calls by their names, commands by what is typed."""

_SLOW_CALLS = (
    "contact_ratio: model",
    "periodic",
    "continuation",
    "optimize",
    "bifurcation",
    "basins",
    "advise",
    "figures: run",
    "figures: study",
    "study: Sobol'",
    "studies.rattle_probability",
    "studies.regime_boundary",
    "studies.sensitivities",
    "spectral.coherence",
    "spectra",
    "open_stream",
)
_SLOW_COMMANDS = (
    "figures",
    "periodic",
    "periodic -o",
    "continue",
    "compare -o",
    "study: optimization",
    "study: bifurcation",
    "study: basins",
    "run",
    "stream",
    "spectra -o",
    "validate -o",
    "screen --simulate -o",
    "advise",
)
HEAVY = frozenset((*_SLOW_CALLS, *(COMMAND + name for name in _SLOW_COMMANDS)))
"""Rows that take seconds; the tests of ``quick_rows`` compute them for ``HARDEST`` alone."""
HARDEST = ("prescribed middle",)
LONG = (f"{COMMAND}figures",)
"""Rows that take more than ten seconds, which the quick tests leave out."""
LARGE = "64 bodies"
LONGEST = ("continuation", f"{COMMAND}continue")
"""Rows that take more than a quarter of an hour on the large driveline, where they are not tried."""
UNTRIED = "not tried: a branch of fifty motions takes more than a quarter of an hour"

Outcomes = Mapping[str, Mapping[str, str]]


def outcomes(kind: str, rows: Iterable[str]) -> dict[str, str]:
    """Return what becomes of calls and commands on one kind of model, by row.

    Raises
    ------
    AssertionError
        one of them ended with an internal error; it says which.
    """
    actual = {}
    with TemporaryDirectory() as name:
        kit = Kit(KINDS[kind].make(), Path(name))
        for number, row in enumerate(rows):
            try:
                if kind == LARGE and row in LONGEST:
                    actual[row] = UNTRIED
                elif row in CALLS:
                    actual[row] = outcome_of(CALLS[row], kit)
                else:
                    words = COMMAND_LINES[row.removeprefix(COMMAND)](kit, kit.folder / f"out-{number}")
                    actual[row] = outcome_of_command(words)
            except Exception as error:
                raise AssertionError(f"{row} on {kind}: {type(error).__name__}: {error}") from error
    return actual


def quick_rows(kind: str) -> list[str]:
    """Rows that the quick tests compute for a kind of model."""
    if kind == LARGE:
        return [row for row in ROWS if row in ("modes", "simulate", "criteria", "study: 2 cases", f"{COMMAND}check")]
    return [row for row in ROWS if row not in HEAVY or (kind in HARDEST and row not in LONG)]


def kept() -> dict[str, dict[str, str]]:
    """Return the outcomes that the manual tells."""
    actual: dict[str, dict[str, str]] = json.loads(DATA.read_text(encoding="utf-8"))
    return actual


def page(actual: Outcomes) -> str:
    """Return the page of the manual.

    Parameters
    ----------
    found
        outcomes of all rows, by row and kind.
    """
    lines = [*_HEAD.splitlines(), "", "| kind of model | what it has |", "|---|---|"]
    lines += [f"| {name} | {kind.words} |" for name, kind in KINDS.items()]
    for title, rows in (
        ("Calls", [row for row in ROWS if row in CALLS]),
        ("Commands", [row for row in ROWS if row not in CALLS]),
    ):
        lines += ["", f"## {title}", "", f"| {title[:-1].lower()} | refused for | because |", "|---|---|---|"]
        for row in rows:
            lines += _lines(row, actual[row])
    return "\n".join(lines) + "\n"


def _lines(row: str, by_kind: Mapping[str, str]) -> list[str]:
    reasons: dict[str, list[str]] = {}
    for kind in KINDS:
        if by_kind[kind] != WORKS:
            reasons.setdefault(by_kind[kind], []).append(kind)
    name, colon, way = row.partition(": ")
    first = f"`{name}`{', ' if colon else ''}{way}"
    if not reasons:
        return [f"| {first} | none | |"]
    return [
        f"| {first if i == 0 else ''} | {', '.join(kinds)} | {reason.replace('|', '/')} |"
        for i, (reason, kinds) in enumerate(reasons.items())
    ]


def write(actual: Outcomes) -> None:
    """Write the outcomes and the page."""
    DATA.write_text(json.dumps(actual, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    PAGE.write_text(page(actual), encoding="utf-8")


_HEAD = """# What works with what

Every public call and every command was tried on a small driveline of every kind that the model file knows. Each
either works or is refused with one error that says why; none ends with an internal error. `make compositions` computes
this page anew; the tests compute the quick part of it every time, and the whole with `make test-long`.

Not in the table, for they take no model: `fit_loop`, `gas_torque`, `samples_needed` and the commands
`loop`, `reproduce` and `schema`."""
