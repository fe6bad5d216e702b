"""The shelf of kinds: laws that hold for every kind, and study files that ask for one."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gearrattle.cli import main
from gearrattle.errors import ModelError
from gearrattle.model.schema import key_docs
from gearrattle.report.study_pages import PAGES
from gearrattle.studies.kinds import KINDS, StudySpec
from gearrattle.studies.study_file import read_study
from tests.architecture.places import DOCS, EXAMPLES


def test_every_kind_has_its_page() -> None:
    assert set(KINDS) == set(PAGES)


@pytest.mark.parametrize("spec", KINDS.values(), ids=list(KINDS))
def test_every_key_of_a_kind_is_described(spec: type[StudySpec]) -> None:
    assert key_docs(spec).keys() == set(spec.keys())
    assert {"schema", "name", "kind", "model", "fixed"} <= set(spec.keys())


@pytest.mark.parametrize("name", KINDS)
def test_the_schema_of_a_kind_has_its_keys_and_its_name(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", "--study", name]) == 0
    schema = json.loads(capsys.readouterr().out)
    assert set(schema["properties"]) == set(KINDS[name].keys())
    assert schema["properties"]["kind"]["enum"] == [name]
    assert schema["additionalProperties"] is False
    assert ("kind" in schema["required"]) == (name != "grid")


@pytest.mark.parametrize("name", KINDS)
def test_every_kind_is_described_and_has_an_example(name: str) -> None:
    page = (DOCS / "howto" / "study.md").read_text(encoding="utf-8")
    assert f"`{name}`" in page
    kinds = [read_study(path).spec.kind for path in sorted((EXAMPLES / "studies").glob("*.toml"))]
    assert name in kinds


@pytest.mark.parametrize("name", KINDS)
def test_a_wrong_key_and_a_missing_one_are_told_with_the_file(folder: Path, name: str) -> None:
    path = folder / "wrong.toml"
    path.write_text(f'kind = "{name}"\nmodle = "two.toml"\n', encoding="utf-8")
    with pytest.raises(ModelError) as caught:
        read_study(path)
    reported = str(caught.value)
    assert "wrong.toml:2: modle" in reported
    assert 'did you mean "model"?' in reported
    assert "wrong.toml: model: this key is required" not in reported  # the misspelt key is the model's
    needed = {field.alias or key for key, field in KINDS[name].model_fields.items() if field.is_required()}
    needed -= {"model", "kind"}
    assert all(f"wrong.toml: {key}: this key is required" in reported for key in needed)


def test_a_file_without_a_kind_is_a_grid(folder: Path) -> None:
    path = folder / "plain.toml"
    path.write_text('model = "two.toml"\n[axis]\n"torque.0.mean" = [0.3, 0.6]\n', encoding="utf-8")
    actual = read_study(path)
    assert (actual.spec.kind, actual.name) == ("grid", "plain")
    assert actual.arguments["axes"] == {"torque.0.mean": [0.3, 0.6]}


@pytest.mark.parametrize(("asked", "match"), [('"grids"', 'did you mean "grid"'), ("3", "there is no such kind")])
def test_a_kind_that_does_not_exist_is_refused(
    folder: Path, asked: str, match: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = folder / "odd.toml"
    path.write_text(f'model = "two.toml"\nkind = {asked}\n', encoding="utf-8")
    assert main(["study", str(path)]) == 2
    message = capsys.readouterr().err
    assert "odd.toml:2: kind" in message
    assert match in message


def test_all_problems_of_a_file_are_told_at_once_with_their_lines(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = folder / "many.toml"
    path.write_text(
        'model = "two.toml"\n[fixed]\n"torque.0.men" = 3\n[axis]\n"coupling.join.clearance" = [0.1]\n'
        '"torque.0.mean" = { from = 1, to = "2 kg", count = 3 }\n[vary]\n'
        '"inertia.engine.J" = { distribution = "norml", mean = 0.2, deviation = 0.01 }\n'
        '[sample]\ncount = 8\nmethod = "sobool"\n',
        encoding="utf-8",
    )
    assert main(["study", str(path)]) == 2
    message = capsys.readouterr().err.splitlines()
    lines = [line.split("many.toml:")[1].split(":")[0] for line in message if line.startswith("error: ")]
    assert lines == ["3", "5", "6", "8", "11"]
