"""Options that several commands share."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter, Token

from gearrattle.cli.assignments import value_in, words
from gearrattle.errors import ModelError, Problem

if TYPE_CHECKING:
    from gearrattle.model import Model
    from gearrattle.model.factors import Written


def _whole(_type: Any, tokens: Sequence[Token]) -> int:
    """Read a whole number; cyclopts itself rounds 3.5 to 4."""
    text = tokens[0].value
    try:
        return int(text)
    except ValueError:
        raise ValueError(f'"{text}" must be a whole number, such as {_nearest(text)}') from None


def _nearest(text: str) -> int:
    """Return the largest whole number below a text's value, for a message; 8 if the text is not a number."""
    try:
        return math.floor(float(text))
    except (ValueError, OverflowError):
        return 8


Whole = Annotated[int, Parameter(converter=_whole)]
"""A whole number: every option that counts."""
Words = Annotated[Sequence[str], Parameter(show_default=False)]
"""An option that may be repeated."""
ModelFile = Annotated[Path, Parameter(help="Model file (TOML).")]
OutputPath = Annotated[Path | None, Parameter(name=["--output", "-o"])]
"""Path of a result, for commands that describe their file formats themselves."""
Output = Annotated[
    OutputPath,
    Parameter(
        help="Folder for report.html, summary.json, results.nc and figures/, all or nothing; or a file: the numbers "
        "(.nc, .csv), the page (.pdf), slides (.pptx) or tables (.xlsx). Default: the answer on the terminal only.",
    ),
]
"""Where a result goes."""
Changes = Annotated[
    Words,
    Parameter(
        name="--set",
        help="PATH=VALUE of the model, as in its file. * in PATH stands for any text, x3 for three times what the "
        'model says: "inertia.*.drag_torque=x3". May be repeated.',
    ),
]
"""Values that the model has other than its file."""
Json = Annotated[bool, Parameter(show_default=False, help="Print the result as JSON on stdout.")]


Negligible = Annotated[
    Words,
    Parameter(
        name="--negligible",
        help="Below which size an impact is a touch, as [criteria] negligible of a model file: "
        '"impact_energy=10 uJ", "approach_speed=1 mm/s" or "angular_approach_speed=1 rad/s"; may be repeated.',
    ),
]
"""Thresholds of the verdict."""


def negligible_of(entries: Sequence[str]) -> dict[str, float | str] | None:
    """Return the thresholds by name, None for none; ModelError for a word of another form."""
    named = words("--negligible", entries)
    return {name: plain for name, text in named.items() if (plain := number_or_text(text)) is not None} or None


@Parameter(name="*")
@dataclass(frozen=True)
class Settings:
    """Settings of a simulation; missing settings are taken from the model file, then from the defaults."""

    algorithm: Annotated[str | None, Parameter(help='"exact" (default), or a stepping algorithm such as "rk4".')] = None
    cycles: Annotated[Whole | None, Parameter(help="Length of the run, in common periods.")] = None
    discard: Annotated[Whole | None, Parameter(help="Cycles left out of the criteria as start-up.")] = None
    samples_per_cycle: Annotated[Whole | None, Parameter(help="Output samples per cycle.")] = None
    tolerance: Annotated[float | None, Parameter(help="Accuracy; its meaning depends on the algorithm.")] = None
    step: Annotated[str | None, Parameter(help='Step of a fixed-step algorithm: seconds, or e.g. "20 us".')] = None
    initial: Annotated[Literal["steady", "static", "zero"] | None, Parameter(help="Where the run starts.")] = None

    def arguments(self) -> dict[str, Any]:
        """Return the settings as keyword arguments of ``simulate``."""
        return {**asdict(self), "step": number_or_text(self.step)}

    def on(self, model: Model) -> Model:
        """Return a model with these settings."""
        chosen = {name: value for name, value in self.arguments().items() if value is not None}
        return model.with_simulation(chosen) if chosen else model


def typed(record: Any) -> list[str]:
    """Return the names of options, as typed, whose values in ``record`` differ from their defaults."""
    values = {field: getattr(record, field.name) for field in fields(record)}
    return [f"--{field.name.replace('_', '-')}" for field, value in values.items() if value not in (field.default, [])]


def refuse_unless(option: str, others: Mapping[str, object]) -> None:
    """Refuse options that were typed (not None) but have no effect without ``option`` (ModelError)."""
    if typed := [name for name, value in others.items() if value is not None]:
        raise ModelError(
            Problem(", ".join(typed), "", f"plays no part without {option}", f"add {option}, or leave it out")
        )


def refuse_beside(option: str, others: Mapping[str, object]) -> None:
    """Refuse options that were typed (not None) but have no effect together with ``option`` (ModelError)."""
    if typed := [name for name, value in others.items() if value is not None]:
        raise ModelError(Problem(", ".join(typed), "", f"plays no part with {option}", "leave one of them out"))


@contextmanager
def named_as(options: Mapping[str, str]) -> Iterator[None]:
    """Context in which a ModelError names the options instead of the Python arguments that they set."""
    try:
        yield
    except ModelError as error:
        problems = [replace(problem, place=options.get(problem.place, problem.place)) for problem in error.problems]
        raise ModelError(problems) from error


def number_or_text(text: str | None) -> float | str | None:
    """Return a text as a number, or, if it is none, the text itself: a quantity with its unit."""
    if text is None:
        return None
    try:
        return float(text)
    except ValueError:
        return text


NO_LIMIT = "none"
_A_MINUTE = 60.0  # s
_ENDLESS = 1e9  # s


def seconds_of(within: str | None) -> float | str:
    """Return the time that a search for motions may take: a minute by default; "none" for no limit."""
    if within is None:
        return _A_MINUTE
    return _ENDLESS if within == NO_LIMIT else number_or_text(within) or 0.0


def ends_in(text: str, option: str = "--range") -> tuple[Written, Written]:
    """Return the two ends of a range LOW:HIGH; a unit after the second end applies to both; "x1:x8" are factors.

    ModelError unless the text has two values.
    """
    from gearrattle.model.units import with_last_unit

    first, colon, second = text.partition(":")
    if not (first.strip() and colon and second.strip()) or ":" in second:
        raise ModelError(Problem(option, f'"{text}"', 'must be two values, such as "300:2000 rpm"'))
    low, high = with_last_unit([first, second])
    return value_in(low), value_in(high)
