"""The kind "conditions": idle rattle over oil temperature, load and speed.

most = 2_000_000                         # conditions allowed, if more than a million
rating = [                               # calibration points of one's own: straight lines between, nothing beyond
  { level = 55, rating = 8 },            # sound level [dB re 20 uPa] -> rating
  { level = 70, rating = 5 },
]
sound_path = [[1200, 0.02, 1.0]]         # frequency [Hz], damping ratio, gain [Pa/(N s)]; assumed casing without
sounds = false                           # no sounds on the page

[temperature]
path = "oil.temperature"                 # unless another is named
values = ["-20 degC", "20 degC", "40 degC", "80 degC", "100 degC"]

[load]                                   # if it varies; one path and its values, or several together:
values = { "torque.1.mean" = ["0 N*m", "10 N*m"], "torque.0.mean" = ["0 N*m", "12 N*m"] }

[speed]
path = "excitation.speed"                # unless another is named
values = { from = "650 rpm", to = "900 rpm", count = 6 }

[fixed]
"simulation.cycles" = 60
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, ClassVar

from gearrattle.model.table import Table, breach
from gearrattle.model.value_kinds import Choice, Flag, Plain, Reader, Text
from gearrattle.studies.conditions_study import prepare
from gearrattle.studies.kinds.study_kind import StudySpec
from gearrattle.studies.study import CASES, MOST
from gearrattle.studies.study_call import Study


class Values(Reader):
    """The values along an axis; what they may be depends on the model."""

    def read(self, value: Any, _dimensionless: bool, /) -> Any:
        """Return them."""
        if not isinstance(value, list | Mapping):
            raise breach("must be a list of values, a range, or a table of several paths", "[20, 40]")
        return value

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema."""
        return {"anyOf": [{"type": "array"}, {"type": "object", "additionalProperties": True}]}


class Modes(Reader):
    """Rows of frequency, damping ratio and gain; what they may be is judged with all else of the study."""

    def read(self, value: Any, _dimensionless: bool, /) -> list[Any]:
        """Return the rows."""
        if not isinstance(value, list):
            raise breach("must be rows of frequency [Hz], damping ratio and gain [Pa/(N s)]", "[[1200, 0.02, 1.0]]")
        return value

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema."""
        row = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
        return {"type": "array", "items": row}


class Varied(Table):
    """What varies, and its values."""

    path: Annotated[str, Text()] = ""
    """Of the model; "oil.temperature" or "excitation.speed" without it."""
    values: Annotated[Any, Values()]
    """A list, a range, or a table of several paths that vary together."""


class CalibrationPoint(Table):
    """A level, and how the user rates it."""

    level: Annotated[float, Plain()]
    """Sound level [dB re 20 uPa]."""
    rating: Annotated[float, Plain()]
    """From 1 to 10."""


class ConditionsSpec(StudySpec):
    """Idle rattle over oil temperature, load and speed."""

    prepare: ClassVar[Callable[..., Study]] = staticmethod(prepare)
    kind: Annotated[str, Choice(("conditions",))]
    """Kind of study."""
    most: Annotated[int, CASES] = MOST
    """Conditions allowed."""
    temperature: Varied
    """Temperatures of the oil."""
    speed: Varied
    """Speeds."""
    load: Varied | None = None
    """Loads, of accessories for example; the model's own without."""
    rating: tuple[CalibrationPoint, ...] = ()
    """Calibration points of the user's: straight lines between, nothing beyond."""
    sound_path: Annotated[Sequence[Any], Modes()] = ()
    """Modes of the path to sound pressure: frequency [Hz], damping ratio, gain [Pa/(N s)]; an assumed casing else."""

    sounds: Annotated[bool, Flag()] = True
    """Whether a loop of the sound of every condition is kept, of 120 at most."""

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of ``conditions``."""
        axes = {"temperature": self.temperature, "speed": self.speed, "load": self.load}
        asked = {role: axis.stated("path", "values") for role, axis in axes.items() if axis is not None}
        points = [(point.level, point.rating) for point in self.rating]
        return {**asked, "rating": points, **self.stated("sound_path", "sounds", "fixed", "most")}
