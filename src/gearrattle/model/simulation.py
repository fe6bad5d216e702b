"""Default settings of a model's simulation: algorithm, start, length, output, accuracy.

Every key is optional. A key that the file leaves out is None, so that callers can apply the order of precedence: call,
file, default. ``DEFAULTS`` holds the defaults.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from gearrattle.model import units
from gearrattle.model.table import Breach, Table, breach, did_you_mean
from gearrattle.model.table_symbol import Shown, Symbol
from gearrattle.model.value_kinds import Choice, Count, Plain, Quantity, value_of

ALGORITHMS = (
    "exact",
    "rk2",
    "rk4",
    "rkf",
    "rkv",
    "adams",
    "gear",
    "bulirsch-stoer",
    "rkv-events",
    "gear-events",
    "dop853",
    "radau",
)
STARTS = ("steady", "static", "zero")


class Initial(Table):
    """An initial state, one entry per inertia in file order."""

    angle: tuple[Annotated[float, Quantity(units.ANGLE)], ...]
    """Angles [rad]."""
    velocity: tuple[Annotated[float, Quantity(units.ANGULAR_VELOCITY)], ...]
    """Angular velocities [rad/s]."""
    displacement: tuple[Annotated[float, Quantity(units.LENGTH)], ...] | None = None
    """Displacements of the bodies with a mass, one an entry of ``Layout.direction_names`` [m]; None: zero."""
    displacement_velocity: tuple[Annotated[float, Quantity(units.LINE_SPEED)], ...] | None = None
    """Their rates [m/s]; None: zero."""


class _Start:
    """Reads ``initial``: one of the words, or a table with angles and velocities."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        def check(value: Any, inner: Callable[[Any], Any]) -> Any:
            if isinstance(value, (Mapping, Initial)):
                return inner(value)
            if value in STARTS:
                return value
            raise breach(
                'must be "steady", "static", "zero" or { angle = [...], velocity = [...] }', did_you_mean(value, STARTS)
            )

        return core_schema.no_info_wrap_validator_function(check, handler.generate_schema(Initial))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"anyOf": [{"enum": list(STARTS)}, handler(schema)]}


class Simulation(Shown):
    """The ``[simulation]`` table; None where the file is silent."""

    noun: ClassVar[str] = "simulation"
    symbol: ClassVar[Symbol] = Symbol("a12 12 0 1 1 24 0 a12 12 0 1 1 -24 0 m12 -8 v8 h6 m6 0", 24.0)
    template: ClassVar[Mapping[str, Any]] = {"cycles": 100, "discard": 50}
    algorithm: Annotated[str, Choice(ALGORITHMS)] | None = None
    """Name of the algorithm."""
    initial: Annotated[str | Initial, _Start()] | None = None
    """"steady", "static", "zero" or an initial state."""
    cycles: Annotated[int, Count(1)] | None = None
    """Length of the run in periods T of all orders together."""
    discard: Annotated[int, Count(0)] | None = None
    """Periods left out of the criteria."""
    samples_per_cycle: Annotated[int, Count(1, 10**6)] | None = None
    """Output samples per period, a million at most."""
    tolerance: Annotated[float, Plain("positive")] | None = None
    """exact: bound on a crossing's residual relative to the largest corner; others: relative local error."""
    step: Annotated[float, Quantity(units.TIME, "positive")] | None = None
    """Step of a fixed-step algorithm, the first one tried by the others [s]."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: everything discarded."""
        cycles = value_of(cls, table, "cycles", dimensionless)
        discard = value_of(cls, table, "discard", dimensionless)
        if cycles is not None and discard is not None and cycles <= discard:
            rule = f"must be less than cycles ({cycles}): nothing would be left to judge"
            yield Breach(("discard",), table["discard"], rule)


@dataclass(frozen=True)
class Defaults:
    """Settings of last resort; None where the value depends on the algorithm or the model."""

    algorithm: str = "exact"
    initial: str = "steady"
    cycles: int = 200
    discard: int = 100
    samples_per_cycle: int = 512
    tolerance: float | None = None
    step: float | None = None


DEFAULTS = Defaults()
