"""Schemas for editors: written beside the files that name them, current, and understood by taplo and tombi."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import tomllib
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.cli.schema_command import FILES, schema_for
from gearrattle.model.schema_line import MARK, schema_file, with_schema_line, without_schema_line
from gearrattle.studies.kinds import KINDS
from tests.architecture.places import EXAMPLES, ROOT

KIND_OF_FILE = (*FILES, *KINDS)
TOML = sorted(EXAMPLES.rglob("*.toml"))
OF_FOLDER = {"studies": "", "remedies": "remedies", "measured": "data"}


def _kind(path: Path) -> str:
    """What an example is, by its folder; a study says its kind."""
    kind = OF_FOLDER.get(path.parent.name, "model")
    return kind or str(tomllib.loads(path.read_text(encoding="utf-8")).get("kind", "grid"))


def _parts(node: Any) -> Iterator[dict[str, Any]]:
    """Yield every table within a schema."""
    if isinstance(node, dict):
        yield node
    for part in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        yield from _parts(part)


@pytest.mark.parametrize("kind", KIND_OF_FILE)
def test_every_key_is_described(kind: str) -> None:
    tables = [part["properties"] for part in _parts(schema_for(kind)) if isinstance(part.get("properties"), dict)]
    assert tables
    assert [key for table in tables for key, value in table.items() if not value.get("description")] == []


@pytest.mark.parametrize("kind", KIND_OF_FILE)
def test_descriptions_are_those_of_a_file(kind: str) -> None:
    words = [part["description"] for part in _parts(schema_for(kind)) if isinstance(part.get("description"), str)]
    assert [text for text in words if re.search(r"\bNone\b|``", text)] == []


def test_quantities_say_unit_and_bound() -> None:
    tables = schema_for("model")["$defs"]
    stiffness = tables["Mesh"]["properties"]["stiffness"]["description"]
    assert stiffness.endswith('a plain number in N/m, or a string with a unit such as "7.2e8 N/m"; not negative.')
    duration = tables["Excitation"]["properties"]["duration"]["description"]  # may be left out
    assert "a plain number in s" in duration
    assert duration.endswith("above 0.")


def test_free_keys_are_allowed_in_words_that_editors_read() -> None:
    for kind in KINDS:
        table = schema_for(kind)["properties"]
        assert all(table[key]["additionalProperties"] is True for key in ("fixed", "vary", "axis") if key in table)


@pytest.mark.parametrize("path", TOML, ids=lambda path: path.stem)
def test_every_example_names_its_schema(path: Path) -> None:
    first = path.read_text(encoding="utf-8").partition("\n")[0]
    assert first.startswith(MARK)
    assert (path.parent / first.removeprefix(MARK)).resolve() == EXAMPLES / schema_file(_kind(path))


@pytest.mark.parametrize("path", TOML, ids=lambda path: path.stem)
def test_every_example_is_valid_by_its_schema(path: Path) -> None:
    validator = pytest.importorskip("jsonschema").Draft202012Validator
    tables = tomllib.loads(path.read_text(encoding="utf-8"))
    assert [error.message for error in validator(schema_for(_kind(path))).iter_errors(tables)] == []
    tables["unknown_key"] = 1
    assert len(list(validator(schema_for(_kind(path))).iter_errors(tables))) == 1


def test_the_schemas_beside_the_examples_are_current(tmp_path: Path) -> None:
    pins = (ROOT / "constraints.txt").read_text(encoding="utf-8")
    if f"\npydantic=={version('pydantic')}\n" not in pins:
        pytest.skip("another pydantic words schemas in another way")
    assert main(["schema", "-o", str(tmp_path)]) == 0
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == sorted(path.name for path in EXAMPLES.glob("*.schema.json"))
    old = [name for name in names if (tmp_path / name).read_bytes() != (EXAMPLES / name).read_bytes()]
    assert old == [], "gearrattle schema -o examples"


@pytest.mark.parametrize("kind", KIND_OF_FILE)
def test_a_schema_is_printed(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", "--study" if kind in KINDS else "--file", kind]) == 0
    assert json.loads(capsys.readouterr().out) == schema_for(kind)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--file", "mappin"], '--file: found "mappin"; must be model, mapping, data'),
        (["--study", "gird"], "--study: found"),
        (["-o", "x.schema.json"], "must be a folder"),
    ],
)
def test_other_kinds_and_files_are_refused(
    words: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["schema", *words]) == 2
    assert message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_other_files_of_the_folder_remain(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text("schema = 1\n", encoding="utf-8")
    (tmp_path / "gearrattle.schema.json").write_text("{}", encoding="utf-8")
    assert main(["schema", "-o", str(tmp_path)]) == 0
    assert (tmp_path / "mine.toml").read_text(encoding="utf-8") == "schema = 1\n"
    assert json.loads((tmp_path / "gearrattle.schema.json").read_text(encoding="utf-8")) == schema_for("model")


def test_copied_examples_have_their_schemas(tmp_path: Path) -> None:
    assert main(["examples", "-o", str(tmp_path / "ex")]) == 0
    for path in (tmp_path / "ex").rglob("*.toml"):
        first = path.read_text(encoding="utf-8").partition("\n")[0]
        assert (path.parent / first.removeprefix(MARK)).is_file()


def test_a_written_model_names_a_schema_only_where_there_is_one(tmp_path: Path) -> None:
    scaled = gr.nondimensionalize(gr.example("case3"))
    plain = tmp_path / "plain.toml"
    scaled.save(plain)
    assert not plain.read_text(encoding="utf-8").startswith("#")
    assert main(["schema", "-o", str(tmp_path)]) == 0
    (tmp_path / "below").mkdir()
    for path, line in ((tmp_path / "beside.toml", "./"), (tmp_path / "below" / "below.toml", "../")):
        scaled.save(path)
        text = path.read_text(encoding="utf-8")
        assert text == f"#:schema {line}gearrattle.schema.json\n{plain.read_text(encoding='utf-8')}"
        assert gr.load(path) == gr.load(plain)
    (tmp_path / "below" / "two").mkdir()
    scaled.save(tmp_path / "below" / "two" / "x.toml")
    assert not (tmp_path / "below" / "two" / "x.toml").read_text(encoding="utf-8").startswith("#")


def test_a_written_mapping_names_its_schema(tmp_path: Path) -> None:
    shutil.copy(EXAMPLES / "measured" / "flywheel_speed.csv", tmp_path / "rig.csv")
    assert main(["schema", "-o", str(tmp_path)]) == 0
    assert main(["look", str(tmp_path / "rig.csv"), "-o", str(tmp_path / "measurement.toml")]) == 0
    text = (tmp_path / "measurement.toml").read_text(encoding="utf-8")
    assert text.startswith("#:schema ./gearrattle.mapping.schema.json\n")
    assert gr.read(tmp_path / "measurement.toml").channels


def test_a_line_is_removed_as_it_was_added(tmp_path: Path) -> None:
    (tmp_path / schema_file()).write_text("{}", encoding="utf-8")
    text = "# my model\nschema = 1\n"
    assert without_schema_line(with_schema_line(text, tmp_path)) == text
    assert without_schema_line(text) == text


CHECKERS = {"taplo": ["taplo", "check"], "tombi": ["tombi", "lint", "--offline"]}


@pytest.mark.parametrize("checker", CHECKERS)
def test_editors_take_every_example_and_see_what_is_wrong(checker: str, tmp_path: Path) -> None:
    if shutil.which(checker) is None:
        pytest.skip(f"pip install {checker}")
    shutil.copytree(EXAMPLES, tmp_path / "ex")
    files = sorted((tmp_path / "ex").rglob("*.toml"))

    def complaints(paths: list[Path]) -> tuple[int, str]:
        call = [*CHECKERS[checker], *map(str, paths)]
        done = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
        return done.returncode, re.sub(r"\x1b\[[0-9;]*m", "", done.stdout + done.stderr)

    code, text = complaints(files)
    assert code == 0
    assert not re.search(r"\b(warn|warning|error)\b", text, re.IGNORECASE), text
    wrong = tmp_path / "ex" / "wrong.toml"
    for old, new in (("backlash", "backlsh"), ('stiffness = "', 'stiffness = true # "')):
        text = (EXAMPLES / "run_up.toml").read_text(encoding="utf-8")
        assert old in text
        wrong.write_text(text.replace(old, new, 1), encoding="utf-8")
        assert complaints([wrong])[0] != 0
