"""Models from other tools, and for other tools: the table of formats, and what a format cannot hold.

What a format cannot hold is refused, with its place, unless ``partial`` is set: then it is left out and listed. Loads
and settings that it cannot hold are notes.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

from gearrattle.assembly import steady
from gearrattle.errors import ModelError, Problem, shown_problems
from gearrattle.exchange import opentorsion, ross_rotor
from gearrattle.exchange.c_source import c_text
from gearrattle.exchange.julia_source import julia_text
from gearrattle.exchange.modelica_export import modelica_text, not_in_modelica
from gearrattle.exchange.modelica_import import driveline_of_text, with_orders
from gearrattle.exchange.python_source import python_text
from gearrattle.exchange.right_hand_side import Equations, equations_of, not_in_equations
from gearrattle.exchange.state_space import matrices_file
from gearrattle.exchange.torsional_network import TorsionalNetwork, lumping_note, model_of
from gearrattle.files import opened
from gearrattle.json_types import Json, parsed_json
from gearrattle.model import Excitation, Model, check_model, units
from gearrattle.model.model_file import text_of, unreadable
from gearrattle.model.value_kinds import FLAG, Choice, Count, Quantity, argument_problems, check_arguments
from gearrattle.wording import counted, listed
from gearrattle.writing import put

LARGEST = 10_000_000
"""Of a file that is read [bytes]."""
_SPEED = Quantity(units.ANGULAR_VELOCITY, "positive")
_MOST_PARTS = 64
_PARTIAL = "partial (--partial) leaves it out"


@dataclass(frozen=True)
class ImportedModel:
    """A model that another tool described.

    Attributes
    ----------
    model
        the driveline.
    format
        name of the format, as ``import_model`` takes it.
    notes
        what the user must know, such as the error of lumped shafts.
    left_out
        what the source says and the model does not, each with its place; only with ``partial``, and loads.

    Examples
    --------
    >>> from gearrattle.typing import ImportedModel
    >>> ImportedModel(gr.example("case3"), "modelica").left_out
    ()
    """

    model: Model
    format: str
    notes: tuple[str, ...] = ()
    left_out: tuple[Problem, ...] = ()

    def to_dict(self) -> dict[str, Json]:
        """Return names, notes and what was left out, as ``gearrattle import --json`` prints them."""
        return {
            "format": self.format,
            "name": self.model.name,
            "inertias": [body.name for body in self.model.inertias],
            "elements": [element.name for element in self.model.elements],
            "notes": list(self.notes),
            "left_out": [problem.to_dict() for problem in self.left_out],
        }

    def to_toml(self) -> str:
        """Return the model as a model file that begins with the notes."""
        lines = [f"imported: {self.format}", *self.notes, *(f"left out: {problem}" for problem in self.left_out)]
        head = "".join(f"# {' '.join(line.split())}\n" for line in lines)
        return f"{head}\n{text_of(self.model)}"

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the model file with its notes; return its path. ModelError unless it ends in .toml."""
        target = Path(path)
        if target.suffix.lower() != ".toml":
            raise ModelError(Problem(str(path), target.suffix or "no ending", "a model file ends in .toml"))
        put(target, self.to_toml().encode())
        return target


@dataclass(frozen=True)
class ExportedModel:
    """A file for another tool that was written.

    Attributes
    ----------
    path
        the file.
    format
        name of the format, as ``export_model`` takes it.
    notes
        what the user must know about the file.
    left_out
        what the model says and the file does not.

    Examples
    --------
    >>> from pathlib import Path
    >>> from gearrattle.typing import ExportedModel
    >>> ExportedModel(Path("x.json"), "opentorsion").notes
    ()
    """

    path: Path
    format: str
    notes: tuple[str, ...] = ()
    left_out: tuple[Problem, ...] = ()

    def to_dict(self) -> dict[str, Json]:
        """Return path, format, notes and what was left out, as ``gearrattle export --json`` prints them."""
        return {
            "output": str(self.path),
            "format": self.format,
            "notes": list(self.notes),
            "left_out": [problem.to_dict() for problem in self.left_out],
        }


class Content(NamedTuple):
    """A file for another tool: its text or bytes, what it leaves out of the driveline, and notes."""

    content: str | bytes
    left_out: Sequence[Problem] = ()
    notes: Sequence[str] = ()


@dataclass(frozen=True)
class _ExportFormat:
    """A format that is written: its endings, and the function that writes it."""

    endings: tuple[str, ...]
    write: Callable[[Model, str, Mapping[str, int] | None], Content]
    takes_region: bool = False


def _tors(model: Model, _ending: str, _region: object) -> Content:
    return Content(*opentorsion.tors_text(model))


def _source_text(write: Callable[[Equations], str]) -> Callable[[Model, str, object], Content]:
    """Return the writer of the equations of motion in one language."""

    def content(model: Model, _ending: str, _region: object) -> Content:
        left_out = not_in_equations(model)
        return Content(write(equations_of(steady(model))), left_out, _assumed(model))

    return content


def _matrices(model: Model, ending: str, region: Mapping[str, int] | None) -> Content:
    left_out = [*not_in_equations(model)]
    left_out += [
        Problem(element.path, "clipped contact damping", "the matrices of one region are linear")
        for element in model.elements
        if element.contact_damping == "clipped"
    ]
    notes = [] if region else ["every element is in its last drive stage; region (--region) chooses another"]
    return Content(matrices_file(steady(model), ending, region), left_out, (*notes, *_assumed(model)))


def _modelica(model: Model, _ending: str, _region: object) -> Content:
    notes = [*_assumed(model), "written for the Modelica Standard Library 4.0.0; not compiled here"]
    return Content(modelica_text(steady(model), "Driveline"), not_in_modelica(model), notes)


def _assumed(model: Model) -> list[str]:
    """Notes on what equations take as fixed."""
    notes = [f"the motion of {motion.on} is an error of the elements at it" for motion in model.motions]
    drag = [body.name for body in model.inertias if body.drag_torque or body.drag_parts]
    return notes + ([f"drag torques of {listed(drag)} are mean torques"] if drag else [])


EXPORTS: Mapping[str, _ExportFormat] = {
    "opentorsion": _ExportFormat((".json",), _tors),
    "modelica": _ExportFormat((".mo",), _modelica),
    "python": _ExportFormat((".py",), _source_text(python_text)),
    "julia": _ExportFormat((".jl",), _source_text(julia_text)),
    "c": _ExportFormat((".c",), _source_text(c_text)),
    "state-space": _ExportFormat((".npz", ".mat"), _matrices, takes_region=True),
}
"""Every format that is written."""
IMPORTS = ("opentorsion", "ross", "modelica")
"""Every format that is read."""


@dataclass
class _Source:
    """What an import has read so far."""

    format: str
    whole: TorsionalNetwork
    split: TorsionalNetwork
    left_out: list[Problem] = field(default_factory=list)
    refused: list[Problem] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    excitation: Mapping[str, Any] | None = None


def import_model(
    source: object, format: str = "", *, speed: float | str | None = None, split: int = 1, partial: bool = False
) -> ImportedModel:
    """Read a driveline that another tool describes.

    Parameters
    ----------
    source
        a file: .json of openTorsion (TORS); .toml or .json of ROSS; .mo of Modelica; or an object: an
        assembly of openTorsion, a rotor of ROSS.
    format
        "opentorsion", "ross" or "modelica"; by default told by the content.
    speed
        reference speed of the model: a number [rad/s] or a text with a unit; by default that of the source, if it
        states one, otherwise 1 rad/s, noted.
    split
        number of parts of every shaft that has an inertia of its own; half of each part's inertia is at either end.
    partial
        whether parts of the driveline that are not understood, or that a model cannot hold, are left out and listed;
        by default they are refused.

    Returns
    -------
    ImportedModel
        The model, notes, and what was left out.

    Raises
    ------
    ModelError
        a file that cannot be read, of no known format, too large, with parts that are not understood; a driveline
        that is no model.

    Examples
    --------
    >>> _ = gr.export_model(gr.example("case3"), "case3.json", partial=True)
    >>> gr.import_model("case3.json").model.inertias[0].name
    'driveline_flywheel'
    """
    # the arguments
    arguments: dict[str, tuple[Any, Any]] = {"partial": (FLAG, partial), "split": (Count(1, _MOST_PARTS), split)}
    if format != "":
        arguments["format"] = (Choice(IMPORTS), format)
    problems = argument_problems(arguments)
    if speed is not None:
        problems += argument_problems({"speed": (_SPEED, speed)}, dimensionless=False)
    if problems:
        raise ModelError(problems)
    # the source; messages name the file
    if not isinstance(source, str | os.PathLike):
        return _imported(_from_object(source, format, split), speed, split, partial=partial)
    path = Path(source)
    text = _text(path)
    try:
        return _imported(_of_text(path, text, format, split), speed, split, partial=partial)
    except ModelError as error:
        places = [replace(one, place=f"{path}: {one.place}" if one.place else str(path)) for one in error.problems]
        raise ModelError(places) from None


def _imported(read: _Source, speed: float | str | None, split: int, *, partial: bool) -> ImportedModel:
    """Make the model of what was read; ModelError for what is refused."""
    if read.refused and not partial:
        raise ModelError([*shown_problems(read.refused), Problem("", "", "the import is not whole", _PARTIAL)])
    excitation = read.excitation if speed is None else {"speed": speed}
    with_orders(read.split, _omega(excitation))
    model, notes = model_of(read.split, excitation)
    lumped = lumping_note(read.whole, model, split)
    return ImportedModel(model, read.format, (*read.notes, *notes, *lumped), (*read.refused, *read.left_out))


def _omega(excitation: Mapping[str, Any] | None) -> float:
    """The reference speed of a table of the excitation [rad/s]."""
    return Excitation.model_validate(excitation).omega if excitation else 1.0


def _from_object(source: Any, format: str, split: int) -> _Source:
    """Read an object of another tool."""
    if opentorsion.is_assembly(source) and format in ("", "opentorsion"):
        return _Source(
            "opentorsion", opentorsion.network_of_assembly(source, 1), opentorsion.network_of_assembly(source, split)
        )
    if ross_rotor.is_rotor(source) and format in ("", "ross"):
        whole, refused, notes = ross_rotor.network_of_rotor(source, 1)
        return _Source("ross", whole, ross_rotor.network_of_rotor(source, split)[0], [], refused, notes)
    rule = "must be a file, an assembly of openTorsion, or a rotor of ROSS"
    raise ModelError(Problem("source", type(source).__name__, rule))


def _of_text(path: Path, text: str, format: str, split: int) -> _Source:
    """Tell a file's format by its content, and read it."""
    ending = path.suffix.lower()
    if format == "modelica" or (ending == ".mo" and not format):
        read = driveline_of_text(text)
        return _Source("modelica", read.network, read.network, read.left_out, read.refused, read.notes, read.excitation)
    content = _tables(text, is_toml=ending == ".toml")
    if opentorsion.is_tors(content) and format in ("", "opentorsion"):
        whole, left_out = opentorsion.network_of_tors(content, 1)
        divided, _ = opentorsion.network_of_tors(content, split)
        return _Source("opentorsion", whole, divided, left_out)
    if ross_rotor.is_rotor_file(content) and format in ("", "ross"):
        whole, refused, notes = ross_rotor.network_of_rotor_file(content, 1)
        divided = ross_rotor.network_of_rotor_file(content, split)[0]
        return _Source("ross", whole, divided, [], refused, notes)
    if isinstance(content, Mapping) and "inertia" in content:
        raise ModelError(Problem("", "a model file of gearrattle", "needs no import", "gr.load reads it"))
    wanted = f"a file of {format}" if format else f"a file of {listed(IMPORTS, 'or')}"
    raise ModelError(Problem("", ending or "no ending", f"{wanted} is needed"))


def _text(path: Path) -> str:
    """The text of a file; ModelError if it is missing, unreadable, too large or no text."""
    try:
        with opened(path) as stream:
            content = stream.read(LARGEST + 1)
    except (OSError, ValueError) as error:
        raise ModelError(unreadable(str(path), error)) from None
    if len(content) > LARGEST:
        raise ModelError(Problem(str(path), "more than 10 MB", "a file of a driveline has at most 10 MB"))
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ModelError(Problem(str(path), "bytes that are no text", "must be a text in UTF-8")) from None


def _tables(text: str, *, is_toml: bool) -> Any:
    """The content of a TOML or JSON text; ModelError if it is neither."""
    try:
        return tomllib.loads(text) if is_toml else parsed_json(text)
    except RecursionError:
        raise ModelError(Problem("", "", "is nested too deeply")) from None
    except ValueError as error:
        kind = "TOML" if is_toml else "JSON"
        raise ModelError(Problem("", "", f"is no {kind}: {str(error)[:100]}")) from None


def export_model(
    model: Model,
    path: str | os.PathLike[str],
    format: str = "",
    *,
    region: Mapping[str, int] | None = None,
    partial: bool = False,
) -> ExportedModel:
    """Write a driveline for another tool.

    Parameters
    ----------
    model
        the driveline.
    path
        the file; one that exists is replaced.
    format
        "opentorsion" (.json), "modelica" (.mo), "python" (.py), "julia" (.jl), "c" (.c) or "state-space" (.npz,
        .mat); by default told by the ending.
    region
        for "state-space": region label by element name; others are in their last drive stage.
    partial
        whether what the format cannot hold is left out and listed; by default it is refused.

    Returns
    -------
    ExportedModel
        The file, notes, and what was left out.

    Raises
    ------
    ModelError
        an unknown format or ending, a driveline that the format cannot hold.
    OSError
        the machine refused; nothing half-written is left.

    Examples
    --------
    >>> written = gr.export_model(gr.example("case3"), "case3.json", partial=True)
    >>> [problem.place for problem in written.left_out][:3]
    ['coupling.clutch', 'coupling.spline', 'mesh.gear']
    """
    # the arguments
    check_model(model)
    check_arguments(partial=(FLAG, partial), **({"format": (Choice(tuple(EXPORTS)), format)} if format else {}))
    target = Path(path)
    ending = target.suffix.lower()
    name = format or next((name for name, one in EXPORTS.items() if ending in one.endings), "")
    if not name or ending not in EXPORTS[name].endings:
        known = EXPORTS[name].endings if name else [end for one in EXPORTS.values() for end in one.endings]
        remedy = "gr.export_fmu (gearrattle fmu) writes an FMU" if ending == ".fmu" else ""
        raise ModelError(Problem(str(path), ending or "no ending", f"must end in {listed(list(known), 'or')}", remedy))
    writer = EXPORTS[name]
    if region is not None and not writer.takes_region:
        raise ModelError(Problem("region", str(dict(region)), "plays no part but for state-space"))
    # the content, whole unless less is allowed
    content, left_out, notes = writer.write(model, ending, region)
    if left_out and not partial:
        rule = f"{name} cannot hold {counted(len(left_out), 'part')} of this driveline"
        raise ModelError([*shown_problems(left_out), Problem(str(path), "", rule, _PARTIAL)])
    put(target, content.encode() if isinstance(content, str) else content)
    return ExportedModel(target, name, tuple(notes), tuple(left_out))
