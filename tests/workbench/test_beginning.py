"""What a form adds is valid where it stands: every table and list that the schema of model files offers."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

import pytest

import gearrattle as gr
from gearrattle.errors import ModelError
from gearrattle.model import json_schema
from gearrattle.workbench.checking import checked
from gearrattle.workbench.drawing import law_of
from gearrattle.workbench.editing import edited
from gearrattle.workbench.table_templates import TABLES, shelf

SINGLE = ("excitation", "simulation", "criteria")
BODIES = "".join(f'[[inertia]]\nname = "{name}"\nJ = 0.01\ndrag = 0.01\n' for name in "abcdef")
START = f'schema = 1\nunits = "SI"\n{BODIES}[excitation]\nspeed = 100.0\n'
FORMS = {
    "linear": 'stiffness = "1 kN*m/rad"\ndamping = 0.2\n',
    "gap": 'stiffness = "1 kN*m/rad"\ndamping = 0.2\nclearance = "2 deg"\nstiffness_ratio = 0.25\n',
    "free gap": 'stiffness = 1000.0\nclearance = 0.03\ncontact_damping = "clipped"\n',
    "friction": 'stiffness = 1000.0\nclearance = "0 deg"\nhysteresis = "10 N*m"\nstick_stiffness = 3e4\n',
}
"""Laws of a coupling."""


def _choices(schema: Mapping[str, Any], node: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """What the schema lets stand at a node."""

    def resolved(one: Mapping[str, Any]) -> Mapping[str, Any]:
        return schema["$defs"][one["$ref"].split("/")[-1]] if "$ref" in one else one

    return [resolved(choice) for choice in resolved(node).get("anyOf", [resolved(node)])]


def _offers(table: str) -> Iterator[tuple[str, int]]:
    """Keys of a table whose form has a button to add something, and the number of the button."""
    schema = json_schema()
    (top,) = _choices(schema, schema["properties"][table])
    (row,) = _choices(schema, top["items"]) if "items" in top else (top,)
    for key, node in row["properties"].items():
        choices = _choices(schema, node)
        lists = [
            choice
            for choice in choices
            if any("properties" in item for item in _choices(schema, choice.get("items", {})))
        ]
        tables = [choice for choice in choices if "properties" in choice]
        yield from ((key, number) for number in range(1 if lists else len(tables)))


OFFERS = [(table, *offer) for table in TABLES for offer in _offers(table)]


def _text(table: str) -> str:
    """A model with a new table, as the editor adds it."""
    if table in SINGLE or table == "inertia":
        return START
    template = next(entry["template"] for entry in shelf() if entry["table"] == table)
    return edited(START, [{"op": "add", "table": [table], "value": template}]).text


def problems(text: str) -> list[str]:
    return [f"{problem['place']}: {problem['rule']}" for problem in checked(text)["problems"]]


def test_the_schema_offers_much() -> None:
    assert len(OFFERS) > 15
    assert {("coupling", "stages", 0), ("torque", "harmonics", 0), ("excitation", "sweep", 0)} <= set(OFFERS)


@pytest.mark.parametrize("offer", OFFERS, ids=lambda offer: ".".join(map(str, offer)))
def test_what_is_added_is_valid(offer: tuple[str, str, int]) -> None:
    """Once, and as a row three times; a record in a file needs the file, and says so."""
    table, key, option = offer
    text = _text(table)
    path = [table, key] if table in SINGLE else [table, 0, key]
    for _ in range(3):
        row = tomllib.loads(text).get(table, {})
        if isinstance((row if table in SINGLE else row[0]).get(key), dict):
            return  # the form shows its values, and no button
        text = edited(text, [{"op": "begin", "path": path, "option": option}]).text
        assert [problem for problem in problems(text) if problem != "record.csv: no such file"] == []


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("key", ["stages", "coast_stages"])
def test_stages_begin_with_the_law_of_the_coupling(form: str, key: str) -> None:
    coupling = f'[[coupling]]\nname = "c"\nbetween = ["a", "b"]\n{FORMS[form]}'
    text = coupling_first = START.replace("[excitation]", f"{coupling}[excitation]")
    law = law_of(gr.loads(coupling_first).elements[0])
    for _ in range(3):
        text = edited(text, [{"op": "begin", "path": f"coupling.c.{key}"}]).text
        assert problems(text) == []
        (element,) = gr.loads(text).elements
        for deflection, force in law:
            assert _force(law_of(element), deflection) == pytest.approx(force, abs=1e-9)
    assert len(getattr(gr.loads(text).couplings[0], key)) == (4 if "gap" in form else 3)


def _force(law: list[list[float]], deflection: float) -> float:
    """Force at a deflection: between the corners of a law, or on the slope of its end."""
    k = next((k for k in range(1, len(law)) if law[k][0] >= deflection), len(law) - 1)
    (x0, y0), (x1, y1) = law[k - 1], law[k]
    return y0 + (y1 - y0) * (deflection - x0) / (x1 - x0)


def test_a_row_has_the_next_order() -> None:
    text = START.replace(
        "[excitation]", '[[torque]]\non = "a"\nharmonics = [{ order = 2, amplitude = 3.0 }]\n[excitation]'
    )
    text = edited(text, [{"op": "begin", "path": ["torque", 0, "harmonics"]}]).text
    harmonics = tomllib.loads(text)["torque"][0]["harmonics"]
    assert harmonics == [{"order": 2, "amplitude": 3.0}, {"order": 3, "amplitude": 3.0}]


def test_a_dimensionless_model_gets_numbers_without_units() -> None:
    text = START.replace('"SI"', '"dimensionless"')
    text = edited(text, [{"op": "add", "table": ["torque"], "value": {"on": "a", "mean": 0.0}}]).text
    text = edited(text, [{"op": "begin", "path": ["torque", 0, "harmonics"]}]).text
    assert problems(text) == []


@pytest.mark.parametrize(
    "path", [["coupling", 0, "nothing"], ["coupling", 7, "stages"], ["nowhere"], ["inertia", 0, "name"]]
)
def test_where_nothing_can_begin_is_refused(path: list[Any]) -> None:
    with pytest.raises(ModelError):
        edited(START, [{"op": "begin", "path": path}])
