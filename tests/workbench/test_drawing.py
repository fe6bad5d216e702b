"""Drawings of models and of what is none yet; every component of the shelf has symbol, template and ends."""

from __future__ import annotations

import tomllib
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.model.components import COMPONENTS
from gearrattle.model.examples import example_files
from gearrattle.model.model_file import load, text_of
from gearrattle.model.path_labels import path_label
from gearrattle.model.paths import path_names, value_at
from gearrattle.model.table_symbol import BOX
from gearrattle.report.plots.placement import place
from gearrattle.report.plots.sketch import inertia_words, torque_words
from gearrattle.workbench.checking import checked, units_of
from gearrattle.workbench.drawing import PITCH, drawing, law_of
from gearrattle.workbench.references import ends_of
from gearrattle.workbench.table_templates import TABLES, shelf
from gearrattle.workbench.workspace_folder import Folder
from tests.model.test_components import tables

START = 'schema = 1\n[[inertia]]\nname = "a"\nJ = 1\n'


@pytest.mark.parametrize("name", example_files())
def test_bodies_stand_as_in_the_report(name: str) -> None:
    model = gr.example(name)
    cells = place(assemble(model).layout).bodies
    drawn = drawing(model.to_tables())
    assert [(body["x"], body["y"]) for body in drawn["bodies"]] == [
        (PITCH[0] * cells[k][0], PITCH[1] * cells[k][1]) for k in range(len(cells))
    ]
    components = [element for element in model.elements if element.path in model.components]  # no drag parts
    faces = [element.name for one, element in pairwise(components) if one.path == element.path and not element.arms]
    expected = [element.name for element in components if element.name not in faces]  # of a bearing one alone
    assert [link["element"] for link in drawn["links"]] == expected


@pytest.mark.parametrize("name", example_files())
def test_a_law_is_that_of_the_solver(name: str) -> None:
    driveline = assemble(gr.example(name))
    layout = driveline.layout
    for number, element in enumerate(driveline.model.elements):
        points = np.array(law_of(element))
        assert (np.diff(points[:, 0]) > 0.0).all()
        slopes = np.diff(points[:, 1]) / np.diff(points[:, 0])
        if number in layout.clearance:
            at = layout.clearance.tolist().index(number)
            np.testing.assert_allclose(
                np.unique(slopes.round(6)), np.unique(layout.stiffness_of_piece[at].round(6)), rtol=1e-6
            )
            assert set(layout.corners[at].round(12)) <= set(points[:, 0].round(12))
        else:
            np.testing.assert_allclose(slopes, layout.stiffness[number])


@pytest.mark.parametrize("table", TABLES)
def test_every_table_has_a_symbol_and_a_template(table: str) -> None:
    entry = next(entry for entry in shelf() if entry["table"] == table)
    assert entry["title"]
    assert entry["symbol"] != BOX.path
    assert entry["template"]


@pytest.mark.parametrize("kind", COMPONENTS)
def test_a_template_is_a_sound_component_between_its_ends(kind: str) -> None:
    entry = next(entry for entry in shelf() if entry["table"] == kind)
    names = list(dict.fromkeys(ends_of(kind, entry["template"]).values()))
    assert len(names) == len(entry["ends"])
    heavy = {"mass": 0.5} if kind == "bearing" else {}
    bodies = [{"name": name, "J": 0.01, **heavy} for name in names]
    model = gr.Model.from_tables(
        {"schema": 1, "inertia": bodies, kind: [entry["template"]], "excitation": {"speed": 9.0}}
    )
    drawn = drawing(model.to_tables())
    assert all(link["sound"] and link["symbol"] for link in drawn["links"])


def test_only_ends_that_bear_it_may_be_ground() -> None:
    grounds = {entry["table"]: [end["ground"] for end in entry["ends"]] for entry in shelf()}
    assert grounds["coupling"] == [True, True]
    assert grounds["mesh"] == [False, False]
    assert grounds["planetary"] == [True, True, True, False]


@pytest.mark.parametrize(
    "rows",
    [
        {},
        {"inertia": 3},
        {"inertia": [{}]},
        {"inertia": [{"name": 3, "J": "heavy"}], "mesh": [{}, {"between": 4}, {"between": ["a", "a"]}]},
        {"inertia": [{"name": "a"}, {"name": "a"}], "coupling": [{"between": ["a", "nowhere"]}]},
        {"coupling": [{"between": ["a", "b"]}], "torque": [{"on": []}, {"on": "a", "harmonics": [1, {}]}]},
        {"inertia": [{"name": "a"}], "planetary": [{"sun": "a", "planets": ["a", 3]}, {"planets": {}}], "motion": [{}]},
    ],
)
def test_what_is_no_model_yet_is_drawn(rows: dict[str, Any]) -> None:
    drawn = drawing(rows)
    count = len(rows["inertia"]) if isinstance(rows.get("inertia"), list) else 0
    assert len(drawn["bodies"]) == count
    for link in drawn["links"]:
        assert all(-2 <= end["body"] < count for end in link["ends"])


@pytest.mark.parametrize("kind", COMPONENTS)
def test_a_broken_component_still_joins_its_bodies(kind: str) -> None:
    broken = tables(kind, stiffness="soft")
    drawn = drawing(broken)
    ends = {body["name"] for link in drawn["links"] for end in link["ends"] for body in _bodies(drawn, end)}
    assert ends == set(ends_of(kind, broken[kind][0]).values())
    assert not any(link["sound"] for link in drawn["links"])


def _bodies(drawn: dict[str, Any], end: dict[str, Any]) -> list[dict[str, Any]]:
    return [drawn["bodies"][end["body"]]] if end["body"] >= 0 else []


def test_problems_are_those_of_the_command_line_at_their_fields() -> None:
    text = START + '[[coupling]]\nname = "c"\nbetween = ["a", "b"]\nstiffness = "5 kg"\n[excitation]\nspeed = "5 rpm"\n'
    with pytest.raises(gr.ModelError) as caught:
        gr.loads(text, "model.toml")
    answer = checked(text)
    kept = [{key: entry[key] for key in ("place", "value", "rule", "remedy")} for entry in answer["problems"]]
    assert kept == [
        {"place": p.place, "value": p.value, "rule": p.rule, "remedy": p.remedy} for p in caught.value.problems
    ]
    assert [(entry["path"], entry["line"]) for entry in answer["problems"]] == [
        (["coupling", 0, "between"], 7),
        (["coupling", 0, "stiffness"], 8),
    ]


def test_a_text_that_is_no_toml_says_where() -> None:
    answer = checked("schema = 1\n[[inertia\n")
    assert answer["drawing"] is None
    assert [(entry["line"], entry["path"]) for entry in answer["problems"]] == [(2, [])]


def test_an_equilibrium_that_does_not_exist_is_a_problem() -> None:
    text = START + '[[coupling]]\nname = "c"\nbetween = ["a", "ground"]\n'
    text += "stages = [{ stiffness = 1, until = 0.1 }, { stiffness = 0 }]\n"
    text += '[excitation]\nspeed = "5 rpm"\n[[torque]]\non = "a"\nmean = 1\n'
    with pytest.raises(gr.ModelError) as caught:
        gr.equilibrium(gr.loads(text))
    assert [entry["rule"] for entry in checked(text)["problems"]] == [problem.rule for problem in caught.value.problems]


def test_files_that_a_text_names_are_read_in_the_workspace_alone(tmp_path: Path) -> None:
    text = START + '[excitation]\nspeed = "5 rpm"\n[[torque]]\non = "a"\n'
    text += 'signal = { file = "torque.csv", time = "t", value = "T" }\n'
    inner, outer = Folder(tmp_path / "in"), Folder(tmp_path)
    inner.root.mkdir()
    (tmp_path / "torque.csv").write_text("t [s],T [N*m]\n0,1\n1,2\n2,1\n3,0\n")
    assert [entry["rule"] for entry in checked(text, inner)["problems"]] == ["no such file"]
    assert checked(text.replace("torque.csv", "../torque.csv"), inner)["problems"] != []
    assert checked(text, outer)["problems"] == []
    assert checked(text.replace("torque.csv", "../torque.csv"), outer, "in/model.toml")["problems"] == []
    for name in ("../model.toml", "/tmp/model.toml", ".hidden/model.toml"):
        with pytest.raises(gr.ModelError, match="must name a file within the folder"):
            checked(text, inner, name)


@pytest.mark.parametrize("name", example_files())
def test_numbers_are_those_of_the_sketch_of_the_report(name: str) -> None:
    """Inertias and torques, with their units, in every example: the same words in the editor and beside the verdict."""
    path = example_files()[name]
    tables, model = tomllib.loads(path.read_text(encoding="utf-8")), gr.load(path)
    made, is_si = drawing(tables), model.units == "SI"
    assert [body["inertia"] for body in made["bodies"]] == [inertia_words(i.J, is_si=is_si) for i in model.inertias]
    torques = [load["words"] for load in made["loads"] if load["path"][0] == "torque"]
    for words, row, torque in zip(torques, tables.get("torque", []), model.torques, strict=True):
        if "engine" not in row:
            assert words == torque_words(torque, is_si=is_si)


def test_what_is_no_number_yet_stands_as_in_the_file() -> None:
    made = drawing({"inertia": [{"name": "a", "J": "heavy"}], "torque": [{"on": "a", "mean": "3 kg"}]})
    assert (made["bodies"][0]["inertia"], made["loads"][0]["words"]) == ("heavy", "3 kg")


@pytest.mark.parametrize("name", example_files())
def test_every_plain_number_has_the_unit_that_charts_give_it(name: str) -> None:
    """Of the example as it is written, and of its model in SI, in which every number is plain."""
    model = load(example_files()[name])
    for text in (example_files()[name].read_text(encoding="utf-8"), text_of(model)):
        tables = tomllib.loads(text)
        plain = [path for path in path_names(tables) if type(value_at(tables, path)) in (int, float)]
        units = {path: path_label(path, model).unit for path in plain}
        assert units_of(tables) == {path: unit for path, unit in units.items() if unit}


@pytest.mark.parametrize("name", ["manual_transmission", "dual_mass_flywheel", "planetary_set"])
def test_every_value_is_called_what_charts_call_it(name: str) -> None:
    """The page names runs by these words."""
    model = load(example_files()[name])
    labels = checked(text_of(model))["labels"]
    assert len(labels) > 40
    assert labels == {path: path_label(path, model).words for path in labels}
