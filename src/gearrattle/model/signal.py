"""Values over time: a measured record, or points written in the model file.

    signal = { file = "torque.csv", time = "t", value = "T" }
    signal = { time = [0.0, 1.0, 1.05, 3.0], value = [0.0, 0.0, 50.0, 50.0], interpolation = "linear" }

A file is read once, when the model is; from then on the model carries the points and needs the file no more.
``interpolation`` defines the curve between the points: the cubic spline through all of them, straight lines, or steps,
where each value holds until the next point. A run longer than the points is refused; only the last value of steps goes
on.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, core_schema

from gearrattle.files import Refused, reachable
from gearrattle.json_types import TomlTable
from gearrattle.model import units
from gearrattle.model.csv_columns import read_columns
from gearrattle.model.csv_layout import RecordError
from gearrattle.model.table import breach, did_you_mean, listed, shown
from gearrattle.model.units import Dimension
from gearrattle.model.value_kinds import LARGEST, Plain, Quantity
from gearrattle.wording import counted

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

Points = Mapping[str, "tuple[Array, Array]"]
"""Times [s] and values [SI] of signals by their digest."""

FOLDER = "folder"
"""Key of the validation context: the folder that paths are relative to, and under which files may be read. Without it
the table comes from Python, whose author names what may be read."""
STORED = "stored"
"""Key of the validation context, and of a signal's table, for points kept elsewhere under their digest."""
Interpolation = Literal["cubic", "linear", "step"]
INTERPOLATIONS: tuple[Interpolation, ...] = get_args(Interpolation)
"""What may stand between points; the first is the default."""
FEWEST: Mapping[Interpolation, int] = {"cubic": 4, "linear": 2, "step": 1}
"""How many different times each needs; a cubic spline without further conditions needs four."""
_DERIVATIVES: Mapping[Interpolation, int] = {"cubic": 2, "linear": 0, "step": -1}
"""How many derivatives of each are continuous; of steps not even the value is."""
_CONTINUOUS = {0: "the value must not jump", 1: "neither the value nor its slope may jump"}
_SMOOTHER = {
    0: 'write a steep straight line: two points near each other, interpolation = "linear"',
    1: 'give the speed in place of the angle: it may be "linear"',
}
"""Why not every interpolation is allowed, and what to do, by the number of derivatives that must be continuous."""
_CURVES: Mapping[Interpolation, str] = {"cubic": "a cubic spline", "linear": "a straight line", "step": "a step"}
_START = "Where in the record the run begins, "
_EXAMPLE = 'such as { file = "record.csv", time = "t", value = "x" }'


@dataclass(frozen=True, eq=False)
class Signal:
    """Points of a value over time.

    Attributes
    ----------
    time
        (N,) ascending [s], read-only. Two are equal where a "linear" record jumps.
    value
        (N,) at these times [SI], before ``scale``, read-only.
    scale
        factor on the values.
    start
        time of the record at which a run begins [s].
    static
        what the static start and everything linear take it for [SI]; None: the mean from ``start`` on.
    source
        where the points came from, in words.
    key
        "time", or "angle" for points over the crank angle: ``time`` is then an angle [rad].
    interpolation
        what stands between the points: "cubic", "linear" or "step".
    is_held
        whether the last value goes on; that of steps always does.
    """

    time: Array
    value: Array
    scale: float = 1.0
    start: float = 0.0
    static: float | None = None
    source: str = ""
    key: str = "time"
    interpolation: Interpolation = "cubic"
    is_held: bool = False

    def __post_init__(self) -> None:
        """Keep the points from being changed."""
        import numpy as np

        for name in ("time", "value"):
            array = np.array(getattr(self, name), dtype=float)
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if self.interpolation == "step":
            object.__setattr__(self, "is_held", True)

    def __reduce__(self) -> tuple[Any, ...]:
        """Return what makes an equal one, for copies and pickles."""
        return Signal, (self.time, self.value, *self._settings())

    @cached_property
    def digest(self) -> str:
        """Digest of the points in 32 characters; computed once."""
        return sha256(self.time.tobytes() + self.value.tobytes()).hexdigest()[:32]

    def _settings(self) -> tuple[Any, ...]:
        """Return all that is no point, in the order of the fields."""
        return self.scale, self.start, self.static, self.source, self.key, self.interpolation, self.is_held

    def _key(self) -> tuple[object, ...]:
        return self.digest, *self._settings()

    def __eq__(self, other: object) -> bool:
        """Compare points and settings."""
        return isinstance(other, Signal) and self._key() == other._key()

    def __hash__(self) -> int:
        """Return a hash that agrees with equality."""
        return hash(self._key())

    def to_plain(self, *, stored: bool = False) -> TomlTable:
        """Return the table of the file format; with ``stored`` its points are named, not written."""
        settings = {
            "scale": None if self.scale == 1.0 else self.scale,
            "start": None if self.start == 0.0 else self.start,
            "static": self.static,
            "source": self.source or None,
            "interpolation": None if self.interpolation == "cubic" else self.interpolation,
        }
        points: dict[str, Any] = (
            {STORED: self.digest} if stored else {self.key: self.time.tolist(), "value": self.value.tolist()}
        )
        return {**points, **{key: value for key, value in settings.items() if value is not None}}


@dataclass(frozen=True)
class OverTime:
    """Reads a ``Signal`` of one dimension; ``static`` allows the key of this name.

    Attributes
    ----------
    key, along
        name and dimension of what the values are given over.
    derivatives
        how many derivatives must be continuous; -1: even the value may jump.
    """

    dimension: Dimension
    static: bool = False
    key: str = "time"
    along: Dimension = units.TIME
    derivatives: int = -1

    @property
    def interpolations(self) -> tuple[Interpolation, ...]:
        """What may stand between its points."""
        return tuple(way for way in INTERPOLATIONS if _DERIVATIVES[way] >= self.derivatives)

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys of its table."""
        start = ("start",) if self.key == "time" else ()
        static = ("static",) if self.static else ()
        return ("file", self.key, "value", "interpolation", "scale", *start, *static, "source")

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        def check(value: Any, info: ValidationInfo) -> Signal:
            return value if isinstance(value, Signal) else self._read(value, info.context or {})

        return core_schema.with_info_plain_validator_function(check)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return self.describe()

    def _read(self, table: Any, context: Mapping[str, Any]) -> Signal:
        """Read a table; the points come from a file, from the table itself, or from where they are stored."""
        dimensionless = bool(context.get("dimensionless", False))
        # form and keys of the table
        if not isinstance(table, Mapping):
            raise breach("must be a table of a record, or of its points", _EXAMPLE)
        stored: Points = context.get(STORED) or {}
        allowed = (*self.keys, STORED)
        unknown = [key for key in table if key not in allowed]
        if unknown:
            rule = f"{unknown[0]} is an unknown key; allowed are {listed(self.keys)}"
            raise breach(rule, did_you_mean(unknown[0], self.keys))
        settings = self._settings(table, dimensionless)
        # points kept beside the text of a saved run
        if STORED in table:
            if table[STORED] not in stored:
                rule = "its points are kept beside this text, in the saved run that the text is from"
                raise breach(rule, 'gr.open_run("run.nc").model has them')
            time, value = stored[table[STORED]]
            return Signal(time, value, **settings)
        # points from the columns of a file
        missing = [key for key in (self.key, "value") if key not in table]
        if missing:
            raise breach(f"{missing[0]} is required: a column of the file, or a list of numbers", _EXAMPLE)
        if "file" in table:
            return self._from_file(table, context.get(FOLDER), dimensionless, settings)
        # points written in the table, in ascending order
        time = self._points(self.key, table[self.key], self.along, dimensionless)
        value = self._points("value", table["value"], self.dimension, dimensionless)
        if time.size != value.size:
            raise breach(
                f"{self.key} and value must be of equal length; they have {time.size} and {value.size} entries"
            )
        if at := self._misplaced(time, settings["interpolation"]):
            rule, remedy = self._order(settings["interpolation"], is_equal=time[at] == time[at - 1])
            raise breach(f"{rule}; entry {at} is {time[at]:.9g}, the one before {time[at - 1]:.9g}", remedy)
        return self._checked(Signal(time, value, **settings), "", "")

    def _settings(self, table: Mapping[str, Any], dimensionless: bool) -> dict[str, Any]:
        """Read the keys that stand with the points."""
        settings: dict[str, Any] = {"key": self.key}
        readers = {"scale": Plain(), "start": Quantity(units.TIME), "static": Quantity(self.dimension)}
        for key, reader in readers.items():
            if key in table:
                try:
                    settings[key] = reader.read(table[key], dimensionless)
                except ValueError as error:
                    raise breach(f"{key} = {shown(table[key])}: {error}") from None
        source = table.get("source", "")
        if not isinstance(source, str):
            raise breach("source must be a text in quotes")
        return {**settings, "source": source, "interpolation": self._interpolation(table)}

    def _interpolation(self, table: Mapping[str, Any]) -> Interpolation:
        """Read what stands between the points."""
        word = table.get("interpolation", INTERPOLATIONS[0])
        allowed = self.interpolations
        for way in allowed:
            if word == way:
                return way
        rule = f"interpolation = {shown(word)}: must be {' or '.join(shown(way) for way in allowed)}"
        if word in INTERPOLATIONS:
            rule += f" here: {_CONTINUOUS[self.derivatives]}"
            remedy = _SMOOTHER[self.derivatives]
        else:
            remedy = did_you_mean(word, allowed)
        raise breach(rule, remedy)

    def _misplaced(self, time: Array, interpolation: Interpolation) -> int:
        """Index of the first time that does not follow the one before; 0 if all do. A jump has two equal ones."""
        import numpy as np

        wrong = np.diff(time) <= 0.0
        if interpolation == "linear" and "step" in self.interpolations:
            wrong = np.diff(time) < 0.0
            wrong[1:] |= time[2:] == time[:-2]
        return int(np.argmax(wrong)) + 1 if wrong.any() else 0

    def _order(self, interpolation: Interpolation, *, is_equal: bool) -> tuple[str, str]:
        """Return rule and remedy of a time that does not follow the one before."""
        may_jump = is_equal and "step" in self.interpolations
        if may_jump and interpolation == "linear":
            return "a jump has two points at one time, the values before and after it", "remove the others"
        jump = 'a jump is two points at one time with interpolation = "linear", and one with "step"'
        return f"{self.key}s must ascend", f"sort the record; {jump}" if may_jump else "sort the record"

    def _from_file(
        self, table: Mapping[str, Any], folder: Path | None, dimensionless: bool, settings: dict[str, Any]
    ) -> Signal:
        # names of the file and its columns
        names = {key: table[key] for key in ("file", self.key, "value")}
        wrong = [key for key, name in names.items() if not isinstance(name, str) or not name or "\0" in name]
        if wrong:
            rule = f"{wrong[0]} must be a text in quotes, as there is a file: its path, or the name of a column"
            raise breach(rule, _EXAMPLE)
        # columns of the file, times in ascending order
        path = (folder or Path()) / names["file"]
        try:
            if folder is not None:
                reachable(names["file"], folder)
            columns = read_columns(path, {names[self.key]: self.along, names["value"]: self.dimension}, dimensionless)
            time = columns.values[names[self.key]]
            value = columns.values[names["value"]]
            if at := self._misplaced(time, settings["interpolation"]):
                unit = self.along.si
                rule, remedy = self._order(settings["interpolation"], is_equal=time[at] == time[at - 1])
                rule = f"{rule}; the one before is {time[at - 1]:.9g} {unit}"
                location = columns.place(at, names[self.key])
                raise RecordError(location, f"{time[at]:.9g} {unit}", rule, remedy)
        except Refused as error:
            raise breach(error.rule, error.remedy, place=str(path)) from None
        except RecordError as error:
            raise breach(error.rule, error.remedy, place=error.place, value=error.value) from None
        # signal with its source
        source = settings.pop("source") or f"{names['file']}: {names['value']} over {names[self.key]}"
        return self._checked(Signal(time, value, source=source, **settings), str(path), names[self.key])

    def _points(self, key: str, entries: Any, dimension: Dimension, dimensionless: bool) -> Array:
        """Read a list of numbers, or of quantities."""
        import numpy as np

        if not isinstance(entries, list | tuple):
            remedy = f"{key} is a list where no file is given: add file, or write the numbers"
            raise breach(f"{key} must be a list of numbers", remedy)
        if all(type(entry) is float for entry in entries):
            array = np.array(entries, dtype=float)
            if (np.abs(array) <= LARGEST).all():  # as below, at once
                return array
        reader = Quantity(dimension)
        values = []
        for index, entry in enumerate(entries):
            try:
                values.append(reader.read(entry, dimensionless))
            except ValueError as error:
                raise breach(f"entry {index} of {key}, {shown(entry)}: {error}") from None
        return np.array(values, dtype=float)

    def _checked(self, signal: Signal, file: str, column: str) -> Signal:
        """Refuse too few points, and a run that would begin outside of them."""
        import numpy as np

        location = f"{file}: {column}" if file else ""
        fewest = FEWEST[signal.interpolation]
        if np.unique(signal.time).size < fewest:
            rule = f"{_CURVES[signal.interpolation]} needs {counted(fewest, 'point')} or more"
            others = [f'interpolation = "{way}" needs {FEWEST[way]}' for way in self.interpolations]
            remedy = "; ".join(
                words for way, words in zip(self.interpolations, others, strict=True) if FEWEST[way] < fewest
            )
            raise breach(rule, remedy, place=location, value=f"{counted(signal.time.size, 'point')}")
        first = float(signal.time[0])
        last = float(np.inf if signal.interpolation == "step" else signal.time[-1])
        if signal.key == "time" and not first <= signal.start < last:
            extent = f"goes from {first:.9g} s to {last:.9g} s" if np.isfinite(last) else f"begins at {first:.9g} s"
            rule = f"the record {extent}, and a run begins at its {signal.start:.9g} s"
            raise breach(rule, f"choose another start, such as start = {first!r}", place=location)
        return signal

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema: a file and its columns, or two lists."""
        # keys that both forms share
        numbers = {"type": "array", "minItems": min(FEWEST[way] for way in self.interpolations)}
        begins = [0.0, 0.1, 0.2, 0.3] if self.key == "time" else ["0 deg", "180 deg", "360 deg", "540 deg"]
        quantity = Quantity(self.dimension).describe()
        along = Quantity(self.along).describe()
        level = {"static": quantity | {"description": "Its part in the static equilibrium: " + quantity["description"]}}
        static = level if self.static else {}
        shared = {
            "interpolation": {
                "enum": list(self.interpolations),
                "default": INTERPOLATIONS[0],
                "description": "What stands between two points.",
            },
            "scale": {"type": "number", "description": "Factor on the values; 1 where it is left out."},
            **({"start": along | {"description": _START + along["description"]}} if self.key == "time" else {}),
            **static,
            "source": {"type": "string", "description": "Where the record is from, in words."},
        }
        # columns of a file, or lists of points
        columns = {
            "file": "CSV file, in the folder of this one or below.",
            self.key: f"Name of the column with the {self.key}.",
            "value": f"Name of the column with the {self.dimension.name}.",
        }
        text = {"type": "string", "minLength": 1}
        forms = (
            (list(columns), {key: {**text, "description": words} for key, words in columns.items()}),
            (
                [self.key, "value"],
                {
                    self.key: {
                        **numbers,
                        "items": along,
                        "examples": [begins],
                        "description": f"Points of the {self.key}, ascending, each {along['description']}",
                    },
                    "value": {
                        **numbers,
                        "items": quantity,
                        "examples": [[0.0] * len(begins)],
                        "description": f"The {self.dimension.name} there, {quantity['description']}",
                    },
                },
            ),
        )
        # either form
        return {
            "anyOf": [
                {
                    "type": "object",
                    "required": required,
                    "additionalProperties": False,
                    "properties": {**keys, **shared},
                }
                for required, keys in forms
            ],
            "description": f"{self.dimension.name} over {self.key}: columns of a CSV file, or lists of points",
        }
