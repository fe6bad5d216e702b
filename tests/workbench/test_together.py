"""What values of a model are changed together, and what a change of a model is called."""

from __future__ import annotations

import pytest

import gearrattle as gr
from gearrattle.workbench.value_groups import change_words, groups_of


def model() -> gr.Model:
    return gr.example("manual_transmission")


def test_every_group_takes_a_factor_and_holds_two_numbers_or_more() -> None:
    driveline = model()
    groups = groups_of(driveline)
    assert {"inertia.*.drag_torque", "mesh.*.backlash"} <= set(groups)
    for pattern, words in groups.items():
        assert len(driveline.paths(pattern)) > 1
        assert words.endswith(", times")
        doubled = driveline.with_({pattern: gr.factor(2)})
        assert all(doubled[path] == pytest.approx(2.0 * driveline[path]) for path in driveline.paths(pattern))


def test_a_factor_on_a_group_is_said_as_one() -> None:
    driveline = model()
    for pattern, words in groups_of(driveline).items():
        changed = driveline.with_({pattern: gr.factor(1.25)})
        assert change_words(driveline, changed) == words.replace(", times", " x1.25")


def test_what_differs_is_said_in_words_and_units() -> None:
    driveline = model()
    mesh = driveline.meshes[0].name
    path = f"mesh.{mesh}.backlash"
    assert change_words(driveline, driveline) == ""
    assert change_words(driveline, driveline.with_({path: driveline[path]})) == ""
    assert change_words(driveline, driveline.with_({path: "0.2 mm"})) == f"backlash of mesh {mesh} 200 µm"
    many = {path: "0.2 mm", "simulation.cycles": 7, "simulation.discard": 2, "inertia.*.J": gr.factor(2)}
    words = change_words(driveline, driveline.with_(many))
    assert words == f"moment of inertia of all inertias x2, backlash of mesh {mesh} 200 µm and 2 more"


def test_parts_that_are_new_or_gone_are_named_with_nothing_of_theirs() -> None:
    driveline = gr.example("case3")
    tables = driveline.to_tables()
    tables["inertia"] = [*tables["inertia"], {"name": "brake", "J": 0.1}]
    tables["coupling"] = [
        *tables["coupling"],
        {"name": "shaft", "between": [driveline.inertias[0].name, "brake"], "stiffness": 100.0},
    ]
    larger = gr.Model.from_tables(tables)
    assert change_words(driveline, larger) == "inertia brake added and coupling shaft added"
    assert change_words(larger, driveline) == "inertia brake removed and coupling shaft removed"
