"""The model: a driveline as its engineer describes it, validated, immutable, in SI."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, ModelWrapValidatorHandler, ValidationError, model_validator

from gearrattle.derived_values import kept
from gearrattle.errors import ModelError, Problem
from gearrattle.json_types import TomlTable
from gearrattle.model.components import COMPONENTS, Bearing, Coupling, Mesh, Planetary
from gearrattle.model.components.component import Component, Element
from gearrattle.model.drag_part_rules import damper_names, drag_rules
from gearrattle.model.drag_points import component_elements, drag_elements
from gearrattle.model.excitation import Excitation, Motion, Torque
from gearrattle.model.inertia import Inertia
from gearrattle.model.late_class import LateClass
from gearrattle.model.negligible_impacts import Criteria
from gearrattle.model.over_speed import LAST, OMEGA
from gearrattle.model.paths import changed, location_of, path_names
from gearrattle.model.prescribed_motion_rules import prescribed_rules
from gearrattle.model.pydantic_problems import Positions, model_error
from gearrattle.model.sideways_rules import sideways_rules, start_rules, weight_rules
from gearrattle.model.signal import FOLDER, STORED, Points, Signal
from gearrattle.model.simulation import Simulation
from gearrattle.model.table import Breach, Table, did_you_mean, listed, shown
from gearrattle.model.toml_text import toml_text
from gearrattle.model.value_kinds import GROUND, Choice, SchemaVersion, Text, is_newer_schema
from gearrattle.model.written_units import keep_written_units, written_units

if TYPE_CHECKING:
    from gearrattle.model.gravity import Gravity
    from gearrattle.model.oil import Oil
else:
    Gravity = Any  # these classes are imported when a file has their tables
    Oil = Any


class Model(Table):
    """A driveline: inertias, what connects them, what drives them, how to simulate them.

    Everything is in SI (or dimensionless throughout). Made by ``gearrattle.load``, ``gearrattle.loads`` or
    ``Model.from_tables``; read by path, ``model["mesh.gear.backlash"]``; changed by ``with_``, which returns a new one.

    Examples
    --------
    >>> model = gr.example("case3")
    >>> model["mesh.gear.backlash"]
    0.0001
    >>> tight = model.with_({"mesh.gear.backlash": "0.05 mm"})
    >>> tight["mesh.gear.backlash"]
    5e-05
    """

    schema_version: Annotated[int, Field(alias="schema"), SchemaVersion()]
    """Version of the file format."""
    name: Annotated[str, Text()] = ""
    """What the model is, in words."""
    units: Annotated[Literal["SI", "dimensionless"], Choice(("SI", "dimensionless"))] = "SI"
    """"SI" or "dimensionless"."""
    inertias: Annotated[tuple[Inertia, ...], Field(alias="inertia")]
    """Rotating bodies, in file order."""
    couplings: Annotated[tuple[Coupling, ...], Field(alias="coupling")] = ()
    """Torsional elements, in file order."""
    meshes: Annotated[tuple[Mesh, ...], Field(alias="mesh")] = ()
    """Gear pairs, in file order."""
    planetaries: Annotated[tuple[Planetary, ...], Field(alias="planetary")] = ()
    """Planetary gear sets, in file order."""
    bearings: Annotated[tuple[Bearing, ...], Field(alias="bearing")] = ()
    """Bearings of bodies with a mass, in file order."""
    gravity: Annotated[Gravity | None, LateClass("gearrattle.model.gravity", "Gravity")] = None
    """Weight of bodies with a mass; None: none acts."""
    oil: Annotated[Oil | None, LateClass("gearrattle.model.oil", "Oil")] = None
    """Oil, with which the parts of the drag are computed."""
    excitation: Excitation
    """Reference speed."""
    torques: Annotated[tuple[Torque, ...], Field(alias="torque")] = ()
    """Applied torques, in file order."""
    motions: Annotated[tuple[Motion, ...], Field(alias="motion")] = ()
    """Prescribed motions, in file order."""
    simulation: Simulation = Simulation()
    """Settings; None where the file is silent."""
    criteria: Criteria = Criteria()
    """How its motions are judged."""

    @classmethod
    def from_tables(
        cls, tables: Mapping[str, object], positions: Positions | None = None, stored: Points | None = None
    ) -> Self:
        """Validate tables of the file format given as plain dictionaries and lists.

        Parameters
        ----------
        tables
            the content of a model file, e.g. ``{"schema": 1, "inertia": [{...}], ...}``.
        positions
            line of every key, for messages; None if the tables do not come from a file. Paths in the tables are
            relative to the folder of the file, or to the working directory.
        stored
            points of signals by their digest, as returned by ``to_stored``.

        Raises
        ------
        ModelError
            with all problems of the tables.
        """
        model = cls._read(tables, positions, stored)
        keep_written_units(model, tables)
        return model

    @classmethod
    def _read(
        cls, tables: Mapping[str, object], positions: Positions | None = None, stored: Points | None = None
    ) -> Self:
        dimensionless = tables.get("units") == "dimensionless"
        folder = Path(positions.name).parent if positions else Path()
        omega, last = _speeds(tables.get("excitation"), dimensionless)
        context = {"dimensionless": dimensionless, OMEGA: omega, LAST: last, FOLDER: folder, STORED: stored}
        try:
            return cls.model_validate(tables, context=context)
        except ValidationError as error:
            only = ("schema",) if is_newer_schema(tables.get("schema")) else ()
            raise model_error(error, tables, positions or Positions(), only) from None

    @property
    def components(self) -> Mapping[str, Component]:
        """All components by their path in the file, such as "coupling.clutch", in element order."""
        return _components(self)

    @property
    def elements(self) -> tuple[Element, ...]:
        """All elements: of couplings, meshes and so on in the order of ``COMPONENTS``, then of drag parts."""
        return _elements(self)

    def to_tables(self, *, at_speed: bool = False) -> TomlTable:
        """Return the tables of the file format with quantities as plain numbers, without keys that the file left out.

        Parameters
        ----------
        at_speed
            whether tables over speed are replaced by their values at the model's speed.
        """
        return self.to_plain(at_speed=at_speed)

    def to_toml(self) -> str:
        """Return the model as a file, quantities as plain numbers; reading it gives an equal model."""
        return toml_text(self.to_tables())

    def to_stored(self) -> tuple[str, Points]:
        """Return the model as a text with digests instead of the points of signals, and the points by digest.

        A record may be far longer than a model file. ``loads(text, stored=points)`` returns an equal model.
        """
        tables = self.to_tables()
        points = {}
        parts: tuple[Torque | Motion, ...] = (*self.torques, *self.motions)
        for row, part in zip((*tables.get("torque", ()), *tables.get("motion", ())), parts, strict=True):
            for key in {"signal", "speed", "angle"} & set(row):
                signal: Signal = getattr(part, key)
                row[key] = signal.to_plain(stored=True)
                points[signal.digest] = (signal.time, signal.value)
        return toml_text(tables), points

    def with_(self, changes: Mapping[str, object]) -> Self:
        """Return a new model with some values changed.

        Parameters
        ----------
        changes
            values by path: ``{"mesh.gear.backlash": "0.2 mm", "torque.0.mean": 5.0}``. A path contains the names of
            named tables, and 0-based indices of torques, harmonics and stages. Values as in a file; None removes a key.
            ``*`` in a path stands for any text: all matching values that are set are changed (``paths`` lists them).
            ``gr.factor(3)`` is three times the value of this model.

        Raises
        ------
        ModelError
            the path does not exist, or the file format refuses the value.

        Examples
        --------
        >>> cold = gr.example("manual_transmission").with_({"inertia.*.drag_torque": gr.factor(3)})
        """
        tables = changed(self.to_tables(), changes)
        model = self._read(tables)
        has_texts = any(not isinstance(value, int | float) for value in changes.values())
        keep_written_units(model, tables if has_texts else {}, written_units(self))
        return model

    def with_simulation(self, settings: Mapping[str, object]) -> Self:
        """Return a new model with some simulation settings changed; it shares all other tables with this model.

        Parameters
        ----------
        settings
            name to value, values as in a file.

        Raises
        ------
        ModelError
            as ``with_``.
        """
        tables = {**self.simulation.to_plain(), **settings}
        if not isinstance(tables.get("initial"), Mapping):
            context = {"dimensionless": self.units == "dimensionless"}
            with suppress(ValidationError):
                return self.model_copy(update={"simulation": Simulation.model_validate(tables, context=context)})
        return self.with_({f"simulation.{key}": value for key, value in settings.items()})

    def with_negligible(self, negligible: Mapping[str, object]) -> Self:
        """Return a new model with some thresholds of negligible impacts changed; it shares all other tables.

        Parameters
        ----------
        negligible
            name to value, values as in the table ``[criteria] negligible`` of a file.

        Raises
        ------
        ModelError
            as ``with_``.
        """
        own = {} if self.criteria.negligible is None else self.criteria.negligible.to_plain()
        context = {"dimensionless": self.units == "dimensionless"}
        with suppress(ValidationError):
            criteria = Criteria.model_validate({"negligible": {**own, **negligible}}, context=context)
            return self.model_copy(update={"criteria": criteria})
        return self.with_({f"criteria.negligible.{key}": value for key, value in negligible.items()})

    def paths(self, pattern: str = "*") -> tuple[str, ...]:
        """Return the paths of all values that are set, for ``with_``.

        Parameters
        ----------
        pattern
            pattern that the paths must match; ``*`` stands for any text.

        Examples
        --------
        >>> gr.example("case3").paths("*backlash*")
        ('mesh.gear.backlash',)
        """
        return path_names(self.to_tables(), pattern)

    def __getitem__(self, path: str) -> Any:
        """Return the value or the object at a path.

        Parameters
        ----------
        path
            of a value (a number in SI, a text or a list; the default if the file does not state it); of a table, for
            which its object is returned, such as a ``Mesh``; or of an array of tables, for all its objects.

        Raises
        ------
        ModelError
            the path does not exist, or is a pattern.

        Examples
        --------
        >>> model = gr.example("case3")
        >>> model["torque.0.mean"], model["mesh.gear"].backlash, len(model["inertia"])
        (10.125, 0.0001, 4)
        """
        if not isinstance(path, str):
            raise ModelError(Problem("path", shown(path), "must be a text", 'such as "mesh.gear.backlash"'))
        node: Any = self
        for key in location_of(self.to_tables(), path):
            node = _held(node, key, path)
        return node

    @model_validator(mode="wrap")
    @classmethod
    def _settle_units(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """In a dimensionless model, read the excitation again, with its frequency as Omega itself."""
        model = handler(data)
        if model.units == "dimensionless":
            model.__dict__["excitation"] = model.excitation.without_units()
        return model

    @classmethod
    def rules(cls, table: Mapping[str, Any], _dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: names used twice, names that do not exist, an initial state of the wrong length."""
        inertias = _rows(table, "inertia")
        if table.get("inertia") in ([], ()):
            yield Breach(("inertia",), table["inertia"], "a model needs at least one inertia")
        yield from _twice("inertia", inertias, {}, "inertias")
        names = {row["name"]: None for row in inertias if isinstance(row.get("name"), str)}
        yield from _elements_twice(table)
        for kind, component in COMPONENTS.items():
            for index, row in enumerate(_rows(table, kind)):
                yield from _bodies((kind, index), component, row, names)
        for kind in ("torque", "motion"):
            for index, row in enumerate(_rows(table, kind)):
                on = row.get("on")
                if isinstance(on, str) and on not in names:
                    yield _dangling((kind, index, "on"), on, names)
        yield from drag_rules(inertias, names, table.get("oil"))
        yield from prescribed_rules({kind: _rows(table, kind) for kind in ("inertia", *COMPONENTS, "torque", "motion")})
        yield from sideways_rules({kind: _rows(table, kind) for kind in ("inertia", *COMPONENTS)})
        yield from weight_rules(table.get("gravity"), inertias)
        yield from _start_length(table.get("simulation"), len(inertias))
        yield from start_rules(table.get("simulation"), inertias, _rows(table, "bearing"))


def _held(node: Any, key: int | str, path: str) -> Any:
    """Return the value of a key of an object of the model, or the entry of an array at an index."""
    if isinstance(key, int):
        return node[key]
    if isinstance(node, Table):
        fields = {info.alias or name: name for name, info in type(node).model_fields.items()}
        held = {name: getattr(node, field) for name, field in fields.items()}
    else:
        held = node.to_plain() if hasattr(node, "to_plain") else node
    if key not in held:
        rule = f"there is no {key}; there are {listed(held)}"
        raise ModelError(Problem(f"path {path}", "", rule, did_you_mean(key, list(held))))
    return held[key]


@kept
def _components(model: Model) -> Mapping[str, Component]:
    """All components by their path."""
    fields = {field.alias: name for name, field in Model.model_fields.items()}
    return {f"{kind}.{component.name}": component for kind in COMPONENTS for component in getattr(model, fields[kind])}


@kept
def _elements(model: Model) -> tuple[Element, ...]:
    """The elements of all components, and of all drag parts."""
    return (*component_elements(model), *drag_elements(model))


def _speeds(table: object, dimensionless: bool) -> tuple[float | None, float | None]:
    """Return the speed of an excitation, and the speed at the end of a sweep; None for values that cannot be read."""
    try:
        excitation = Excitation.model_validate(table, context={"dimensionless": dimensionless})
    except ValidationError:
        return None, None
    omega = (excitation.without_units() if dimensionless else excitation).omega
    return omega, None if excitation.sweep is None else excitation.sweep.end


def _rows(table: Mapping[str, Any], key: str) -> list[Mapping[str, Any]]:
    """Return an array of tables as mappings; empty if the value is something else."""
    rows = table.get(key)
    if not isinstance(rows, (list, tuple)):
        return []
    return [row if isinstance(row, Mapping) else getattr(row, "__dict__", {}) for row in rows]


def _twice(kind: str, rows: Sequence[Mapping[str, Any]], seen: dict[str, str], scope: str) -> Iterator[Breach]:
    """Yield a breach for every name that was used before."""
    for index, row in enumerate(rows):
        name = row.get("name")
        if not isinstance(name, str):
            continue
        if name in seen:
            rule = f"a name must be unique over {scope}; {seen[name]} has it already"
            yield Breach((kind, index, "name"), name, rule, "rename one of them")
        seen.setdefault(name, f"{kind}.{index}")


def _elements_twice(table: Mapping[str, Any]) -> Iterator[Breach]:
    """Yield a breach for every element whose name was used before."""
    scope = " and ".join(component.plural for component in COMPONENTS.values())
    seen = dict[str, str]()
    for kind, component in COMPONENTS.items():
        for index, row in enumerate(_rows(table, kind)):
            for location, name in component.element_names(row):
                if name in seen:
                    rule = f"a name must be unique over {scope} together; {seen[name]} has it already"
                    yield Breach((kind, index, *location), name, rule, "rename one of them")
                seen.setdefault(name, f"{kind}.{index}")
    for location, name in damper_names(_rows(table, "inertia")):
        owner = f"{location[0]}.{location[1]}"
        if seen.setdefault(name, owner) != owner:
            rule = f"its drag is the element {name}, and {seen[name]} has this name already"
            yield Breach(location, name, rule, "rename one of them")


def _bodies(
    location: tuple[str, int], component: type[Component], row: Mapping[str, Any], names: Mapping[str, None]
) -> Iterator[Breach]:
    """Yield breaches for bodies of a component that do not exist or that it names twice."""
    seen: dict[str, None] = {}
    bodies = list(component.bodies(row))
    several = "two different" if len(bodies) == 2 else "different"
    for body in bodies:
        where = (*location, *body.location)
        written = row.get(str(body.location[0])) if len(body.location) == 1 else body.name
        if body.name == GROUND and body.no_ground:
            yield Breach(where, written, body.no_ground, body.remedy)
        elif isinstance(body.name, str) and body.name != GROUND and body.name not in names:
            yield _dangling(where, body.name, names)
        if isinstance(body.name, str) and (body.name != GROUND or len(bodies) == 2):
            if body.name in seen:
                yield Breach(where, written, f"a {component.noun} must connect {several} inertias")
            seen[body.name] = None


def _dangling(location: tuple[str | int, ...], name: str, names: Collection[str]) -> Breach:
    """Return the breach for a name that is not the name of an inertia."""
    return Breach(location, name, f"no inertia has this name; there are {listed(names)}", did_you_mean(name, names))


def _start_length(simulation: object, count: int) -> Iterator[Breach]:
    """Yield breaches of an initial state that does not have one entry per inertia."""
    initial = simulation.get("initial") if isinstance(simulation, Mapping) else getattr(simulation, "initial", None)
    for key in ("angle", "velocity"):
        entries = initial.get(key) if isinstance(initial, Mapping) else getattr(initial, key, None)
        if isinstance(entries, (list, tuple)) and len(entries) != count:
            rule = f"must have one entry for each of the {count} inertias, in file order"
            yield Breach(("simulation", "initial", key), entries, rule)


def check_model(value: object) -> None:
    """Refuse a value that is not a model, such as a path; the ModelError says how to get a model."""
    if isinstance(value, Model):
        return
    is_path = isinstance(value, str | os.PathLike)
    remedy = f"gr.load({str(value)!r}) reads a model file" if is_path else "gr.load reads a model file"
    raise ModelError(Problem("model", shown(value) if is_path else type(value).__name__, "must be a gr.Model", remedy))
