"""Values over time: a measured record, or points written in the model file.

    signal = { file = "torque.csv", time = "t", value = "T" }
    signal = { time = [0.0, 0.1, 0.2, 0.3], value = [0.0, 40.0, 60.0, 65.0] }

A file is read once, when the model is; from then on the model carries the points and needs the file no more. Between
the points stands the cubic spline through all of them; beyond them there is nothing, and a longer run is refused.

Takes columns from ``csv_columns`` and value kinds from ``quantity``; gives ``Signal`` to the classes of the model.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, core_schema

from gearrattle.files import Refused, reachable
from gearrattle.json_types import TomlTable
from gearrattle.model import units
from gearrattle.model.csv_columns import read_columns
from gearrattle.model.csv_layout import RecordError
from gearrattle.model.quantity import Plain, Quantity
from gearrattle.model.table import breach, did_you_mean, listed, shown
from gearrattle.model.units import Dimension
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
FEWEST = 4
"""A cubic spline without further conditions needs so many points."""
_EXAMPLE = 'such as { file = "record.csv", time = "t", value = "x" }'


@dataclass(frozen=True, eq=False)
class Signal:
    """Points of a value over time.

    Attributes
    ----------
    time
        (N,) strictly ascending [s], read-only.
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
    """

    time: Array
    value: Array
    scale: float = 1.0
    start: float = 0.0
    static: float | None = None
    source: str = ""
    key: str = "time"

    def __post_init__(self) -> None:
        """Keep the points from being changed."""
        import numpy as np

        for name in ("time", "value"):
            array = np.array(getattr(self, name), dtype=float)
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def __reduce__(self) -> tuple[Any, ...]:
        """Return what makes an equal one, for copies and pickles."""
        return Signal, (self.time, self.value, self.scale, self.start, self.static, self.source, self.key)

    @cached_property
    def digest(self) -> str:
        """The points in 32 characters; worked out once."""
        return sha256(self.time.tobytes() + self.value.tobytes()).hexdigest()[:32]

    def _key(self) -> tuple[object, ...]:
        return self.digest, self.scale, self.start, self.static, self.source, self.key

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
        }
        points: dict[str, Any] = (
            {STORED: self.digest} if stored else {self.key: self.time.tolist(), "value": self.value.tolist()}
        )
        return {**points, **{key: value for key, value in settings.items() if value is not None}}


@dataclass(frozen=True)
class OverTime:
    """Reads a ``Signal`` of one dimension.

    Attributes
    ----------
    dimension
        of the values.
    static
        whether the key ``static`` is allowed.
    key, along
        name and dimension of what the values are given over.
    """

    dimension: Dimension
    static: bool = False
    key: str = "time"
    along: Dimension = units.TIME

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys of its table."""
        start = ("start",) if self.key == "time" else ()
        return ("file", self.key, "value", "scale", *start, *(("static",) if self.static else ()), "source")

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        def check(value: Any, info: ValidationInfo) -> Signal:
            return value if isinstance(value, Signal) else self._read(value, info.context or {})

        return core_schema.with_info_plain_validator_function(check)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return self.describe()

    def _read(self, table: Any, context: Mapping[str, Any]) -> Signal:
        """Read a table; the points come from a file, from the table itself, or from where they are stored."""
        dimensionless = bool(context.get("dimensionless", False))
        if not isinstance(table, Mapping):
            raise breach("must be a table of a record, or of its points", _EXAMPLE)
        stored: Points = context.get(STORED) or {}
        allowed = (*self.keys, *((STORED,) if stored else ()))
        unknown = [key for key in table if key not in allowed]
        if unknown:
            rule = f"{unknown[0]} is an unknown key; allowed are {listed(self.keys)}"
            raise breach(rule, did_you_mean(unknown[0], self.keys))
        settings = self._settings(table, dimensionless)
        if STORED in table:
            time, value = stored[table[STORED]]
            return Signal(time, value, **settings)
        missing = [key for key in (self.key, "value") if key not in table]
        if missing:
            raise breach(f"{missing[0]} is required: a column of the file, or a list of numbers", _EXAMPLE)
        if "file" in table:
            return self._from_file(table, context.get(FOLDER), dimensionless, settings)
        time = self._points(self.key, table[self.key], self.along, dimensionless)
        value = self._points("value", table["value"], self.dimension, dimensionless)
        if time.size != value.size:
            raise breach(
                f"{self.key} and value must be of equal length; they have {time.size} and {value.size} entries"
            )
        if at := _out_of_order(time):
            raise breach(f"{self.key}s must ascend; entry {at} is {time[at]:.9g}, the one before {time[at - 1]:.9g}")
        return self._checked(Signal(time, value, **settings), "", "")

    def _settings(self, table: Mapping[str, Any], dimensionless: bool) -> dict[str, Any]:
        """Read the keys beside the points."""
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
        return {**settings, "source": source}

    def _from_file(
        self, table: Mapping[str, Any], folder: Path | None, dimensionless: bool, settings: dict[str, Any]
    ) -> Signal:
        names = {key: table[key] for key in ("file", self.key, "value")}
        wrong = [key for key, name in names.items() if not isinstance(name, str) or not name or "\0" in name]
        if wrong:
            rule = f"{wrong[0]} must be a text in quotes, as there is a file: its path, or the name of a column"
            raise breach(rule, _EXAMPLE)
        path = (folder or Path()) / names["file"]
        try:
            if folder is not None:
                reachable(names["file"], folder)
            columns = read_columns(path, {names[self.key]: self.along, names["value"]: self.dimension}, dimensionless)
            time, value = columns.values[names[self.key]], columns.values[names["value"]]
            if at := _out_of_order(time):
                unit = self.along.si
                rule = f"{self.key}s must ascend; the one before is {time[at - 1]:.9g} {unit}"
                location = columns.place(at, names[self.key])
                raise RecordError(location, f"{time[at]:.9g} {unit}", rule, "sort the record")
        except Refused as error:
            raise breach(error.rule, error.remedy, place=str(path)) from None
        except RecordError as error:
            raise breach(error.rule, error.remedy, place=error.place, value=error.value) from None
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
        else:
            reader, values = Quantity(dimension), []
            for index, entry in enumerate(entries):
                try:
                    values.append(reader.read(entry, dimensionless))
                except ValueError as error:
                    raise breach(f"entry {index} of {key}, {shown(entry)}: {error}") from None
            array = np.array(values, dtype=float)
        if not np.isfinite(array).all():
            at = int(np.argmin(np.isfinite(array)))
            raise breach(f"entry {at} of {key}, {array[at]}: must be a finite number")
        return array

    @staticmethod
    def _checked(signal: Signal, file: str, column: str) -> Signal:
        """Refuse too few points, and a run that would begin outside of them."""
        location = f"{file}: {column}" if file else ""
        if signal.time.size < FEWEST:
            rule = f"a signal needs {FEWEST} points or more: a cubic spline goes through them"
            raise breach(rule, place=location, value=f"{counted(signal.time.size, 'point')}")
        first, last = float(signal.time[0]), float(signal.time[-1])
        if signal.key == "time" and not first <= signal.start < last:
            rule = f"the record goes from {first:.9g} s to {last:.9g} s, and a run begins at its {signal.start:.9g} s"
            raise breach(rule, f"choose another start, such as start = {first!r}", place=location)
        return signal

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema: a file and its columns, or two lists."""
        number = {"type": "array", "minItems": FEWEST}
        quantity, along = Quantity(self.dimension).describe(), Quantity(self.along).describe()
        static = {"static": quantity} if self.static else {}
        shared = {
            "scale": {"type": "number"},
            **({"start": along} if self.key == "time" else {}),
            **static,
            "source": {"type": "string"},
        }
        text = {"type": "string", "minLength": 1}
        forms = (
            (["file", self.key, "value"], {"file": text, self.key: text, "value": text}),
            ([self.key, "value"], {self.key: {**number, "items": along}, "value": {**number, "items": quantity}}),
        )
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


def _out_of_order(time: Array) -> int:
    """Index of the first time that does not ascend; 0 if all do."""
    import numpy as np

    wrong = np.diff(time) <= 0.0
    return int(np.argmax(wrong)) + 1 if wrong.any() else 0
