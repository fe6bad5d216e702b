"""Labels of paths of the model file in charts, tables and messages: words, and the unit of plain numbers.

``mesh.gear.backlash`` is "backlash of mesh gear" [m], ``torque.0.harmonics.1.amplitude`` "torque amplitude on flywheel,
order 2" [N m]. Units come from the classes that read the file. Quantities of a state (``deflection.gear``,
``velocity.hub``, with "initial." before them too) have labels as well: studies sweep them beside paths. Patterns have
labels, ``mesh.*.backlash`` is "backlash of all meshes" if all match; so have factors, "..., times".
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, NamedTuple, get_args

from gearrattle.model import units
from gearrattle.model.components import COMPONENTS
from gearrattle.model.late_class import LateClass
from gearrattle.model.model import Model
from gearrattle.model.paths import ANY, path_names
from gearrattle.model.signal import OverTime
from gearrattle.model.table import Table
from gearrattle.model.units import ANGULAR_VELOCITY, Dimension, UnitError, convert
from gearrattle.model.value_kinds import Quantity
from gearrattle.model.written_units import written_units
from gearrattle.wording import counted, prefixed

INITIAL = "initial."
"""Before the name of a quantity: its value at the start, not that of the settled motion."""

_STATE = {
    "deflection": (units.ANGLE, units.LENGTH),
    "rate": (units.ANGULAR_VELOCITY, units.LINE_SPEED),
    "angle": (units.ANGLE, units.ANGLE),
    "velocity": (units.ANGULAR_VELOCITY, units.ANGULAR_VELOCITY),
}
"""Quantities of a state: dimension of an angular one, and of one along a line of action."""
_WORDS = {
    "J": "moment of inertia",
    "mean": "mean torque",
    "until": "end",
    "radii": "base radii",
    "over": "duration",
    "cycles": "simulated cycles",
    "discard": "discarded cycles",
    "initial": "initial state",
    "step": "time step",
    "about": "mean speed",
    "on": "inertia",
    "around": "second inertia",
    "between": "inertias",
}
"""What a key is called where its own letters do not say it."""
_PLURALS = {
    "inertia": "inertias",
    **{kind: component.plural for kind, component in COMPONENTS.items()},
    "torque": "torques",
    "motion": "motions",
}
"""What the parts of a section are called together."""
_HARMONIC = 5
"""Parts of a path such as ``torque.0.harmonics.1.amplitude``."""
_ALTERNATION = {"fewer": "stiffness ratio", "share": "share of all pairs"}
_RAMP = {"at": "start", "over": "duration", "to": "end torque"}
_SWEEP = {
    "from": "speed at the start of the run-up",
    "to": "speed at the end of the run-up",
    "over": "duration of the run-up",
}
_SIGNAL = ("signal", "speed", "angle", "pressure")


class PathLabel(NamedTuple):
    """What a path is called.

    Attributes
    ----------
    unit
        of plain numbers there, as it is printed, e.g. ``"N m/rad"``; empty for counts, ratios and words, and in
        dimensionless models.
    """

    words: str
    unit: str


def path_label(path: str, model: Model, *, by_factor: bool = False) -> PathLabel:
    """Return in words, and with its SI unit, what a path of the model file or a quantity of a state is called; factors
    of the model's own values have no unit.

    Parameters
    ----------
    path
        such as ``"mesh.gear.backlash"`` or ``"initial.deflection.gear"``, or a pattern; an unknown path gets its own
        keys as words, and no unit.

    Examples
    --------
    >>> path_label("mesh.gear.backlash", model)
    PathLabel(words='backlash of mesh gear', unit='m')
    >>> path_label("inertia.*.drag_torque", model, by_factor=True)
    PathLabel(words='drag torque of 2 inertias, times', unit='')
    """
    if by_factor:
        return PathLabel(f"{path_label(path, model).words}, times", "")
    if ANY in path:
        return _group_label(path, model)
    before = "initial " if path.startswith(INITIAL) else ""
    kind, _, subject = path.removeprefix(INITIAL).partition(".")
    if kind in _STATE and subject:
        return PathLabel(f"{before}{kind} of {subject}", _state_unit(kind, subject, model))
    parts = path.split(".")
    words = _words(parts, model.to_tables())
    unit = "" if model.units == "dimensionless" else si_unit(path)
    return PathLabel(words, unit)


def path_words(path: str, tables: Mapping[str, Any]) -> str:
    """Return what a path is called in a model file that is given by its tables, which need not be sound.

    Examples
    --------
    >>> from gearrattle.model.path_labels import path_words
    >>> path_words("mesh.gear.backlash", {"mesh": [{"name": "gear"}]})
    'backlash of mesh gear'
    """
    return _words(path.split("."), tables)


def in_shown_unit(path: str, unit: str, largest: float = 1.0) -> tuple[float, str]:
    """Return the factor and the unit with which numbers in an SI unit at a path are shown.

    The reference speed is shown in rpm, others with the SI prefix that suits the ``largest`` of them.

    Examples
    --------
    >>> in_shown_unit("excitation.speed", "rad/s")
    (9.549296585513721, 'rpm')
    >>> in_shown_unit("mesh.gear.backlash", "m", 1e-4)
    (1000000.0, 'µm')
    """
    is_speed = unit == "rad/s" and path.startswith("excitation.")
    return (30.0 / math.pi, "rpm") if is_speed else prefixed(largest, unit)


def in_written_unit(path: str, model: Model) -> tuple[float, str]:
    """Return the factor and the unit with which numbers at a path are shown: those of the model file, SI where it has a
    plain number.
    """
    dimension = dimension_at(path)
    unit = written_units(model).get(path, "")
    if unit and dimension is not None:
        with suppress(UnitError):
            return 1.0 / convert(f"1 {unit}", dimension), unit
    return 1.0, path_label(path, model).unit


def shown_value(path: str, model: Model, value: float, digits: int = 9, largest: float | None = None) -> str:
    """Return a number in SI at a path, of so many significant digits, as messages write it: in the unit of the tables
    beside it.

    Parameters
    ----------
    largest
        magnitude of the numbers in the tables, such as the larger end of a range; None: the value stands alone.

    Examples
    --------
    >>> shown_value("mesh.gear.backlash", model, 1e-4)
    '100 µm'
    """
    size = abs(value) if largest is None else largest
    factor, unit = in_shown_unit(path, path_label(path, model).unit, size)
    return f"{value * factor:.{digits}g} {unit}".rstrip()


def _group_label(pattern: str, model: Model) -> PathLabel:
    """Return what the values that match a pattern are called together; the unit that all of them have."""
    tables = model.to_tables()
    paths = path_names(tables, pattern)
    labels = [path_label(path, model) for path in paths]
    unit = labels[0].unit if len({label.unit for label in labels}) == 1 else ""
    return PathLabel(labels[0].words if len(paths) == 1 else _group_words(pattern, paths, tables), unit)


def _group_words(pattern: str, paths: Sequence[str], tables: Mapping[str, Any]) -> str:
    """Words of several paths: one key of parts of one kind, of harmonics, or values of any kind."""
    parts = [path.split(".") for path in paths]
    sections = {part[0] for part in parts}
    keys = {tuple(part[2:]) for part in parts}
    # one key of inertias, of components of one kind, of torques or motions: all of them, those of a pattern, so many
    if len(sections) == 1 and len(keys) == 1 and (section := parts[0][0]) in _PLURALS:
        key = list(keys.pop())
        plural = _PLURALS[section]
        name = pattern.split(".")[1] if pattern.count(".") == len(key) + 1 else ANY
        owner = f"{len(paths)} {plural}" if name == ANY else f"{plural} {name}"
        if len(paths) == len(tables[section]):
            owner = f"all {plural}"
        return _of_part(key, owner, {})
    # one key of the harmonics of torques or motions
    if len(sections) == 1 and all(len(part) == _HARMONIC and part[2] == "harmonics" for part in parts):
        count = sum(len(row.get("harmonics", ())) for row in tables[parts[0][0]])
        owner = "all harmonics" if len(paths) == count else counted(len(paths), "harmonic")
        if len({part[-1] for part in parts}) == 1:
            return f"{parts[0][0]} {_key(parts[0][-1])} of {owner}"
    # paths of one length: a star where they differ
    if len({len(part) for part in parts}) == 1:
        alike = [entries[0] if len(set(entries)) == 1 else ANY for entries in zip(*parts, strict=True)]
        if alike[0] != ANY:
            return _words(alike, tables)
    last = {part[-1] for part in parts}
    return f"{_key(last.pop()) if len(last) == 1 else pattern}, {len(paths)} values"


def printed_unit(si: str) -> str:
    """Return an SI unit as it is printed: ``"kg*m^2"`` becomes ``"kg m²"``."""
    return si.replace("*", " ").replace("^2", "²").replace("^3", "³")


def _state_unit(kind: str, subject: str, model: Model) -> str:
    if model.units == "dimensionless":
        return ""
    on_line = kind in ("deflection", "rate") and any(e.name == subject and e.along_line for e in model.elements)
    return _STATE[kind][on_line].si


def _words(parts: Sequence[str], tables: Mapping[str, Any]) -> str:
    """Words of a path, by what its first part holds."""
    section = parts[0]
    rest = list(parts[1:])
    if section in ("inertia", *COMPONENTS) and len(rest) > 1:
        owner = rest[0] if section == "inertia" else f"{section} {rest[0]}"
        return _of_part(rest[1:], owner, _row(tables, section, rest[0]))
    if section in ("torque", "motion") and len(rest) > 1:
        return _of_drive(section, rest, tables)
    if section == "excitation" and rest:
        if rest[0] == "sweep" and len(rest) > 1:
            return _SWEEP.get(rest[1], _key(rest[1]))
        return "speed" if rest == ["speed"] else _key(rest[0])
    if section in ("simulation", "criteria") and rest:
        return _of_part(rest, "", {}) if section == "simulation" else _key(" ".join(rest))
    return " ".join(_key(part) for part in parts)


def _of_part(keys: Sequence[str], owner: str, table: Mapping[str, Any]) -> str:
    """Words of a key of a part; the innermost key is named first, then what contains it."""
    key = keys[0]
    rest = list(keys[1:])
    of = f" of {owner}" if owner else ""
    if key in ("stages", "coast_stages", "drag_parts") and len(rest) > 1:
        return _of_part(rest[1:], f"{_row_words(key, rest[0], table)}{of}", {})
    if key in ("transmission_error", "kinematic_error") and len(rest) > 1:
        sines = table.get(key, ())
        named = owner
        if isinstance(sines, Mapping):  # of a planetary set, by sun and ring
            side = rest.pop(0)
            sines = sines.get(side, ())
            named = f"{owner}, {side}"
        return f"{_key(key)} {_sine(rest, sines, named, 'of')}"
    if key == "alternation" and rest:
        return f"{_ALTERNATION.get(rest[0], _key(rest[0]))} of the alternation{of}"
    if key == "radii" and rest:
        return f"base radius {_number(rest[0])}{of}"
    if rest:  # an entry of a list, or a table over speed
        return f"{_key(key)}{of}, {_entry(rest)}"
    return f"{_key(key)}{of}"


def _row_words(key: str, index: str, table: Mapping[str, Any]) -> str:
    """What a stage or a drag part is called: by its number, a drag part by its kind."""
    if key != "drag_parts":
        return f"{'stage' if key == 'stages' else 'coast stage'} {_number(index)}"
    rows = table.get(key, ())
    kind = rows[int(index)].get("kind") if index.isdigit() and int(index) < len(rows) else None
    if kind is None:
        return f"drag part {_number(index)}"
    alike = [k for k, row in enumerate(rows) if row.get("kind") == kind]
    number = f" {alike.index(int(index)) + 1}" if len(alike) > 1 else ""
    return f"{kind}{number}".replace("-", " ")


def _of_drive(section: str, parts: Sequence[str], tables: Mapping[str, Any]) -> str:
    """Words of a key of an applied torque or a prescribed motion."""
    table = _row(tables, section, parts[0])
    alike = [row for row in tables.get(section, ()) if row.get("on") == table.get("on")]
    which = next((i for i, row in enumerate(alike) if row is table), 0)
    number = f" ({which + 1} of {len(alike)})" if len(alike) > 1 else ""
    owner = f"{table.get('on', _number(parts[0]))}{number}"
    key = parts[1]
    rest = list(parts[2:])
    if key == "mean" and not rest:
        return f"mean torque on {owner}"
    if key == "harmonics" and len(rest) > 1:
        return f"{section} {_sine(rest, table.get(key, ()), owner, 'on' if section == 'torque' else 'of')}"
    if key == "ramps" and len(rest) > 1:
        which_ramp = f"ramp {_number(rest[0])}" if len(table.get(key, ())) > 1 else "the ramp"
        return f"{_RAMP.get(rest[1], _key(rest[1]))} of {which_ramp} of the torque on {owner}"
    if key == "engine" and rest:
        return _of_part(rest, f"the engine on {owner}", {})
    if key in _SIGNAL and rest:
        return f"{_key(key)} of {owner}, {_entry(rest)}"
    word = "torque" if section == "torque" else "motion"
    return f"{_key(key)} of the {word} {'on' if section == 'torque' else 'of'} {owner}" + (
        f", {_entry(rest)}" if rest else ""
    )


def _sine(parts: Sequence[str], sines: Sequence[Mapping[str, Any]], owner: str, link: str) -> str:
    """Words of one sine, or of a key of it: by its order, unless that varies or another sine has the same."""
    key = parts[1] if len(parts) > 1 else ""
    deeper = list(parts[2:])
    after = f", {_entry(deeper)}" if deeper else ""
    index = int(parts[0]) if parts[0].isdigit() else -1
    orders = [sine.get("order") for sine in sines]
    known = 0 <= index < len(orders) and isinstance(orders[index], int | float)
    if key == "order" or not known or orders.count(orders[index]) > 1:
        return f"{_key(key)} {link} {owner}, harmonic {_number(parts[0])}{after}".lstrip()
    return f"{_key(key)} {link} {owner}, order {orders[index]:g}{after}".lstrip()


def _row(tables: Mapping[str, Any], section: str, name: str) -> Mapping[str, Any]:
    """The table of a part by its name, of a torque or motion by its index; empty if there is none."""
    rows = list(tables.get(section, ()))
    if name.isdigit() and int(name) < len(rows) and section in ("torque", "motion"):
        table_row: Mapping[str, Any] = rows[int(name)]
        return table_row
    return next((row for row in rows if row.get("name") == name), {})


def _key(key: str) -> str:
    return _WORDS.get(key, key.replace("_", " "))


def _entry(parts: Sequence[str]) -> str:
    return " ".join(_number(part) if part.isdigit() else _key(part) for part in parts)


def _number(index: str) -> str:
    """A 0-based index as people count."""
    return f"{int(index) + 1}" if index.isdigit() else index


def si_unit(path: str) -> str:
    """Return the SI unit of plain numbers at a path, from the annotations of the classes that read it.

    Examples
    --------
    >>> si_unit("mesh.gear.backlash"), si_unit("simulation.cycles")
    ('m', '')
    """
    dimension = dimension_at(path)
    return "" if dimension is None else printed_unit(dimension.si)


def dimension_at(path: str) -> Dimension | None:
    """Return the dimension of numbers at a path, from the annotations of the classes that read it; None for plain ones.

    Examples
    --------
    >>> dimension_at("mesh.gear.backlash").si
    'm'
    """
    annotations: list[Any] = [Model]
    last = ""  # the key of a table over speed or time, if the path ends in one
    for part in path.split("."):
        inner = [child for node in annotations for child in _below(node, part)]
        # not found: a name, an index, that key
        annotations = inner or annotations
        last = "" if inner else part
    readers = [reader for node in annotations for reader in _walk(node)]
    quantity = next((reader for reader in readers if isinstance(reader, Quantity)), None)
    record = next((reader for reader in readers if isinstance(reader, OverTime)), None)
    if quantity is not None:
        return ANGULAR_VELOCITY if last == "speed" else quantity.dimension
    if record is not None and last in ("value", record.key):
        return record.dimension if last == "value" else record.along
    return None


def _below(annotation: Any, key: str) -> list[Any]:
    """Annotations and metadata of a key, in every table class of an annotation."""
    annotations: list[Any] = []
    for node in _walk(annotation):
        if isinstance(node, type) and issubclass(node, Table):
            for name, field in node.model_fields.items():
                if key in (name, field.alias):
                    annotations += [field.annotation, *field.metadata]
    return annotations


def _walk(annotation: Any) -> Iterator[Any]:
    """An annotation and everything it is made of."""
    yield annotation
    if isinstance(annotation, LateClass):
        yield from _walk(annotation.annotation)
    for inner in (*get_args(annotation), *getattr(annotation, "__metadata__", ())):
        if inner is not annotation:
            yield from _walk(inner)
