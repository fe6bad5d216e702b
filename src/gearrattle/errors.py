"""Exceptions of the package, all derived from ``GearRattleError``.

Every message a user can meet names the *place* (file, line, key, or element and time), the *value* found, the *rule*
it breaks and the *remedy*. This module imports no other module of the package, so every module may raise these.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field


class GearRattleError(Exception):
    """Base of all errors this package raises on purpose.

    Examples
    --------
    >>> issubclass(gr.ModelError, gr.GearRattleError)
    True
    """


@dataclass(frozen=True)
class Problem:
    """One thing wrong with the input.

    Attributes
    ----------
    place
        where, e.g. ``"case3.toml:12: coupling.clutch.stiffness"``.
    value
        the wrong value as the user wrote it; empty if something is absent.
    rule
        what is allowed.
    remedy
        what to do, e.g. ``'did you mean "hub"?'``; may be empty.
    location
        keys and 0-based indices of the value in the tables of a file; empty if the value is not in a file.

    Examples
    --------
    >>> from gearrattle.typing import Problem
    >>> print(Problem("mesh.gear.backlash", "-1 mm", "must not be negative", "leave it out for no backlash"))
    mesh.gear.backlash: found -1 mm; must not be negative (leave it out for no backlash)
    """

    place: str
    value: str
    rule: str
    remedy: str = ""
    location: tuple[int | str, ...] = field(default=(), compare=False, repr=False)

    def to_dict(self) -> dict[str, str]:
        """Return place, value, rule and remedy, as ``gearrattle check --json`` and the workbench give them.

        Examples
        --------
        >>> from gearrattle.typing import Problem
        >>> Problem("--port", "70000", "must be 0 ... 65535").to_dict()
        {'place': '--port', 'value': '70000', 'rule': 'must be 0 ... 65535', 'remedy': ''}
        """
        return {"place": self.place, "value": self.value, "rule": self.rule, "remedy": self.remedy}

    def __str__(self) -> str:
        """Return the problem as one line."""
        where = f"{self.place}: " if self.place else ""
        value_words = f"found {self.value}; " if self.value else ""
        advice = f" ({self.remedy})" if self.remedy else ""
        return f"{where}{value_words}{self.rule}{advice}"


MOST_SHOWN = 20
"""Number of problems that a message lists: nobody reads more, and a page of thousands takes seconds to draw."""


def shown_problems(problems: Iterable[Problem]) -> list[Problem]:
    """Return the problems that a message lists: the first twenty, and one without a place that counts the others.

    Parameters
    ----------
    problems
        all of them.

    Examples
    --------
    >>> from gearrattle.errors import Problem, shown_problems
    >>> print(shown_problems(Problem(f"row {k}", "-1", "must not be negative") for k in range(3000))[-1])
    and 2 980 more
    """
    every = list(problems)
    left_out = len(every) - MOST_SHOWN
    if left_out <= 0:
        return every
    return [*every[:MOST_SHOWN], Problem("", "", f"and {left_out:,} more".replace(",", " "))]


class ModelError(GearRattleError):
    """Bad input: a model file, a model or a call's arguments.

    ``problems`` holds all problems, not only the first; the text of the error lists twenty and counts the others.

    Examples
    --------
    >>> try:
    ...     gr.example("case3").with_({"mesh.gear.backlash": "-1 mm"})
    ... except gr.ModelError as error:
    ...     print(error.problems[0].rule)
    must not be negative
    """

    def __init__(self, problems: Problem | Iterable[Problem]) -> None:
        self.problems: tuple[Problem, ...] = (problems,) if isinstance(problems, Problem) else tuple(problems)
        super().__init__("\n".join(str(problem) for problem in shown_problems(self.problems)))


class NotInstalled(ModelError):
    """What was asked for needs an optional extra that is not installed; the problem's remedy is the command."""

    @classmethod
    def of(cls, extra: str, location: str, value: str, rule: str) -> NotInstalled:
        """Return the error that names the extra; double quotes, which every shell takes, cmd.exe too."""
        return cls(Problem(location, value, rule, f'pip install "gearrattle[{extra}]"'))


def check_installed(library: str, extra: str, location: str, value: str, rule: str) -> None:
    """Refuse what needs a library of an extra, before anything is computed; the library is not imported.

    Raises
    ------
    NotInstalled
        the library is not there.
    """
    from importlib.util import find_spec

    if find_spec(library) is None:
        raise NotInstalled.of(extra, location, value, rule)


class ConvergenceError(GearRattleError):
    """A computation failed or went unstable.

    Attributes
    ----------
    message
        what failed, without the remedy.
    time
        model time of the failure [s]; NaN where time plays no part.
    state
        values of the computation at the failure, by name.
    remedy
        what to try.

    Examples
    --------
    >>> issubclass(gr.ConvergenceError, gr.GearRattleError)
    True
    """

    def __init__(
        self, message: str, *, time: float = float("nan"), state: dict[str, float] | None = None, remedy: str = ""
    ):
        self.message = message
        self.time = time
        self.state = dict(state or {})
        self.remedy = remedy
        super().__init__(f"{message}; try: {remedy}" if remedy else message)


class SchedulerLost(GearRattleError):
    """The scheduler of a long computation no longer answers; saved results remain, and the computation can resume."""


class Cancelled(GearRattleError):
    """The caller asked a long computation to stop.

    Attributes
    ----------
    kept
        which results are saved, and how to resume; empty if nothing was written.

    Examples
    --------
    >>> gr.Cancelled(kept="3 of 12 cases are kept").kept
    '3 of 12 cases are kept'
    """

    def __init__(self, message: str = "", *, kept: str = "") -> None:
        self.kept = kept
        super().__init__(message or kept)
