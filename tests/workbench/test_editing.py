"""Laws of editing: the values are those of ``Model.with_``, and everything else in the text stays."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest

import gearrattle as gr
from gearrattle.model.components import COMPONENTS
from gearrattle.model.examples import example_files
from gearrattle.model.model_file import load
from gearrattle.workbench.editing import edited, literal_of
from gearrattle.workbench.references import references
from tests.model.test_components import EXAMPLES, tables

TEXTS = {name: path.read_text(encoding="utf-8") for name, path in example_files().items()}
TEXT = """\
# A driveline.
schema = 1   # of the format
name = "two"

[[inertia]]
name = "a"  # the first
J = 1
# ends here

# about b
[[inertia]]
name = "b"
J = "2 kg*m^2"      # weighed

# --- elements ---

# about the coupling
[[coupling]]
name = "c"
between = ["a", "b"]   # both
stages = [
  { stiffness = "0.5 N*m/deg", until = "4 deg" },  # idle
  # the stop
  { stiffness = "6 N*m/deg" },
]

[excitation]
speed = "800 rpm"

[[torque]]
on = "a"

[[torque.harmonics]]
order = 2
amplitude = 10

[simulation]
initial = { angle = [0.0, 0.1], velocity = [0, 0] }
"""


def comments(text: str) -> list[str]:
    return [line[line.index("#") :] for line in text.splitlines() if "#" in line]


def after(text: str, *edits: dict[str, Any]) -> str:
    return edited(text, edits).text


@pytest.mark.parametrize("name", TEXTS)
def test_a_value_set_is_that_of_with_and_comments_stay(name: str) -> None:
    model = load(example_files()[name])
    for path in model.paths():
        value = _another(model, path)
        if value is None:
            continue
        text = after(TEXTS[name], {"op": "set", "path": path, "value": value})
        folder = example_files()[name]
        try:
            expected: Any = model.with_({path: value})
        except gr.ModelError as error:
            expected = [problem.rule for problem in error.problems]
        assert _read(text, str(folder)) == expected, path
        assert comments(text) == comments(TEXTS[name]), path
        changed = [pair for pair in zip(text.splitlines(), TEXTS[name].splitlines(), strict=True) if pair[0] != pair[1]]
        assert len(changed) <= 1, path


def _another(model: gr.Model, path: str) -> float | None:
    """Return another number for a path that has one in the file; None for what is no number."""
    node: Any = model.to_tables()
    for part in path.split("."):
        node = node[part] if isinstance(node, dict) else _row(node, part)
    return node * 0.75 if isinstance(node, float) else None


def _row(rows: list[dict[str, Any]], part: str) -> Any:
    return next((row for row in rows if row.get("name") == part), None) or rows[int(part)]


def _read(text: str, name: str) -> Any:
    try:
        return gr.loads(text, name)
    except gr.ModelError as error:
        return [problem.rule for problem in error.problems]


@pytest.mark.parametrize("name", TEXTS)
def test_a_text_without_edits_stays_letter_by_letter(name: str) -> None:
    assert after(TEXTS[name]) == TEXTS[name]
    added = after(TEXTS[name], {"op": "add", "table": ["inertia"], "value": {"name": "one_more", "J": 1}})
    count = len(tomllib.loads(added)["inertia"])
    assert after(added, {"op": "delete", "path": ["inertia", count - 1]}) == TEXTS[name]


def test_set_keeps_the_comment_in_its_column() -> None:
    text = after(TEXT, {"op": "set", "path": "inertia.b.J", "typed": "0.5 kg*m^2"})
    assert 'J = "0.5 kg*m^2"    # weighed' in text


def test_a_new_key_stands_below_the_keys_of_its_table() -> None:
    text = after(TEXT, {"op": "set", "path": "inertia.a.drag", "typed": "1 N*m*s/rad"})
    assert 'J = 1\ndrag = "1 N*m*s/rad"\n# ends here\n\n# about b\n[[inertia]]' in text
    text = after(TEXT, {"op": "set", "path": ["coupling", 0, "stages", 0, "damping"], "typed": "1e-3"})
    assert '  { stiffness = "0.5 N*m/deg", until = "4 deg", damping = 1e-3 },  # idle' in text


def test_nested_tables_and_missing_ones_are_begun() -> None:
    edits = [
        {"op": "set", "path": ["coupling", 0, "hooke", "angle"], "typed": "5 deg"},
        {"op": "set", "path": ["torque", 0, "harmonics", 0, "phase"], "typed": "5 deg"},
        {"op": "add", "table": ["torque", 0, "harmonics"], "value": {"order": 4, "amplitude": "1 N*m"}},
        {"op": "add", "table": "coupling.c.stages", "value": {"stiffness": "9 N*m/deg"}},
        {"op": "set", "path": ["simulation", "cycles"], "typed": "20"},
    ]
    expected = tomllib.loads(TEXT)
    expected["coupling"][0]["hooke"] = {"angle": "5 deg"}
    expected["torque"][0]["harmonics"] = [
        {"order": 2, "amplitude": 10, "phase": "5 deg"},
        {"order": 4, "amplitude": "1 N*m"},
    ]
    expected["coupling"][0]["stages"].append({"stiffness": "9 N*m/deg"})
    expected["simulation"]["cycles"] = 20
    text = after(TEXT, *edits)
    assert tomllib.loads(text) == expected
    assert comments(text) == comments(TEXT)
    assert '  { stiffness = "6 N*m/deg" },\n  { stiffness = "9 N*m/deg" },\n]' in text


def test_new_tables_stand_in_the_usual_order() -> None:
    mesh = {"name": "g", "between": ["a", "b"], "radii": ["50 mm", "50 mm"], "stiffness": 1e8}
    text = after(
        TEXT,
        {"op": "add", "table": ["mesh"], "value": mesh},
        {"op": "add", "table": ["inertia"], "value": {"name": "z", "J": 1}},
    )
    heads = [line for line in text.splitlines() if line.startswith("[")]
    assert heads == [
        *["[[inertia]]"] * 3,
        "[[coupling]]",
        "[[mesh]]",
        "[excitation]",
        "[[torque]]",
        "[[torque.harmonics]]",
        "[simulation]",
    ]
    assert '[[inertia]]\nname = "z"\nJ = 1\n\n# --- elements ---' in text
    assert tomllib.loads(text)["simulation"]["initial"] == {"angle": [0.0, 0.1, 0.0], "velocity": [0, 0, 0.0]}


def test_a_deleted_body_takes_along_what_refers_to_it_and_says_so() -> None:
    made = edited(TEXT, [{"op": "delete", "path": "inertia.b"}])
    assert "coupling" not in tomllib.loads(made.text)
    assert made.notes == ("coupling c went with b",)
    assert "# --- elements ---" in made.text
    assert tomllib.loads(made.text)["simulation"]["initial"] == {"angle": [0.0], "velocity": [0]}
    assert edited(TEXT, [{"op": "delete", "path": "inertia.a"}]).notes == ("coupling c and torque on a went with a",)


def test_one_of_several_planets_leaves_the_set() -> None:
    text = gr.Model.from_tables(tables("planetary")).to_toml()
    made = edited(text, [{"op": "delete", "path": "inertia.e"}])
    assert tomllib.loads(made.text)["planetary"][0]["planets"] == ["d"]
    assert "planetary" not in tomllib.loads(edited(text, [{"op": "delete", "path": "inertia.a"}]).text)


@pytest.mark.parametrize("kind", COMPONENTS)
def test_a_renamed_body_is_renamed_everywhere(kind: str) -> None:
    plain = {**tables(kind), "torque": [{"on": "a", "mean": 1.0}]}
    model = gr.Model.from_tables(plain)
    text = model.to_toml()
    count = len(list(references(plain, "a")))
    assert count == 2
    renamed = after(text, {"op": "rename", "table": "inertia", "name": "a", "to": "flywheel"})
    assert len(list(references(tomllib.loads(renamed), "flywheel"))) == count
    assert gr.loads(renamed).elements[0].between[0] == "flywheel"
    assert after(renamed, {"op": "rename", "table": "inertia", "name": "flywheel", "to": "a"}) == text


@pytest.mark.parametrize("kind", COMPONENTS)
def test_every_component_can_be_added_and_deleted(kind: str) -> None:
    without = {key: value for key, value in tables(kind).items() if key != kind}
    first = [{**EXAMPLES[kind], "name": "first"}] if kind == "bearing" else []  # a mass needs one
    text = "# head\n" + gr.Model.from_tables({**without, kind: first} if first else without).to_toml()
    added = after(text, {"op": "add", "table": [kind], "value": EXAMPLES[kind]})
    assert gr.loads(added) == gr.Model.from_tables({**without, kind: [*first, EXAMPLES[kind]]})
    assert after(added, {"op": "delete", "path": f"{kind}.one"}) == text


@pytest.mark.parametrize(
    ("typed", "literal"),
    [
        ("0.1 mm", '"0.1 mm"'),
        ("1e7", "1e7"),
        (" 20 ", "20"),
        (".5", "0.5"),
        ("1.", "1.0"),
        ('"5 deg"', '"5 deg"'),
        ("0,1", '"0,1"'),
        ("007", "7.0"),
    ],
)
def test_what_is_typed_is_a_number_or_a_text(typed: str, literal: str) -> None:
    assert literal_of(typed) == literal


@pytest.mark.parametrize(
    "edit",
    [
        {"op": "move", "path": "inertia.a"},
        {"op": "set", "path": "inertia.x.J", "typed": "1"},
        {"op": "set", "path": ["inertia", 9, "J"], "typed": "1"},
        {"op": "set", "path": 3, "typed": "1"},
        {"op": "add", "table": ["inertia"]},
        {"op": "rename", "table": "inertia", "name": "zz", "to": "b"},
    ],
)
def test_an_edit_that_leads_nowhere_is_refused(edit: dict[str, Any]) -> None:
    with pytest.raises(gr.ModelError):
        edited(TEXT, [edit])


@pytest.mark.parametrize(
    ("text", "edit"),
    [
        ('units = "SI"', {"op": "add", "table": ["units"], "value": 1.0}),
        ('units = "SI"', {"op": "add", "table": ["units", "a"], "value": 1.0}),
        ('units = "SI"', {"op": "set", "path": ["units", "a"], "value": 1.0}),
        ("inertia = 3", {"op": "add", "table": ["inertia"], "value": {"name": "a", "J": 1.0}}),
        ("inertia = [1, 2]", {"op": "delete", "path": ["inertia", 5]}),
        ("inertia = [1, 2]", {"op": "add", "table": ["inertia", 1], "value": 1.0}),
        ("inertia = [1, 2]", {"op": "set", "path": ["inertia", 1, "J"], "value": 1.0}),
        ("mesh = [[1]]", {"op": "add", "table": "mesh.backlash", "value": 1.0}),
        (TEXT, {"op": "add", "table": ["inertia"], "value": 3}),
        (TEXT, {"op": "add", "table": ["planetary"], "value": [1]}),
        (TEXT, {"op": "add", "table": ["excitation"], "value": {"speed": 1.0}}),
    ],
)
def test_an_edit_of_what_is_no_table_is_refused(text: str, edit: dict[str, Any]) -> None:
    if edit["op"] == "delete":
        assert edited(text, [edit]).text.strip() == text
        return
    with pytest.raises(gr.ModelError, match=r"leads nowhere|list|table|cannot be edited|goes by|is named"):
        edited(text, [edit])


def test_an_empty_field_takes_the_key_out() -> None:
    text = after(TEXT, {"op": "set", "path": "inertia.b.J", "typed": "  "})
    assert "J" not in tomllib.loads(text)["inertia"][1]


PATTERNS = ["inertia.*.J", "inertia.*.drag_torque", "mesh.*.backlash", "torque.*.harmonics.*.amplitude"]


def numbers(name: str, pattern: str) -> dict[str, float]:
    """Return the numbers of an example that a pattern matches."""
    model = load(example_files()[name])
    return {path: model[path] for path in model.paths(pattern)}


PLAIN = [name for name, text in TEXTS.items() if "file = " not in text and "value = [" not in text]


@pytest.mark.parametrize(
    ("name", "pattern"), [(name, pattern) for name in PLAIN for pattern in PATTERNS if numbers(name, pattern)]
)
def test_a_factor_on_a_pattern_is_that_of_a_model(name: str, pattern: str) -> None:
    own = numbers(name, pattern)
    text = edited(TEXTS[name], [{"op": "set", "path": pattern, "value": {"factor": 3}}]).text
    changed = gr.loads(text)
    assert {path: changed[path] for path in own} == {path: pytest.approx(3 * own[path], rel=1e-11) for path in own}
    assert changed.with_(own) == load(example_files()[name])
    quotes = [line.count('"') for line in TEXTS[name].splitlines()]
    assert [line.count('"') for line in text.splitlines()] == quotes  # every value keeps its unit


def test_a_pattern_sets_all_that_it_matches() -> None:
    text = edited(TEXT, [{"op": "set", "path": "inertia.*.J", "value": 3.0}]).text
    assert [inertia.J for inertia in gr.loads(text).inertias] == [3.0, 3.0]


@pytest.mark.parametrize("path", ["inertia.*.mass", "coupling.c.between", "inertia.a.name"])
def test_a_factor_of_what_is_no_number_is_refused(path: str) -> None:
    with pytest.raises(gr.ModelError, match=r"mass|a factor needs a number here"):
        edited(TEXT, [{"op": "set", "path": path, "value": {"factor": 3}}])
