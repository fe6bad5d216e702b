"""Documents keep up: commands exist, every example is listed, every key and public name has its entry."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

import gearrattle as gr
from gearrattle.cli import COMMANDS, main
from gearrattle.model import json_schema
from tests.architecture.places import DOCS, EXAMPLES, ROOT, SOURCE, document_files, source_files
from tests.architecture.public import PUBLIC


def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def _targets() -> set[str]:
    return set(re.findall(r"^([a-z][a-z-]*):", _read(ROOT / "Makefile"), flags=re.MULTILINE))


def test_make_commands_named_in_pages_exist() -> None:
    named = {
        (path, target)
        for path in document_files()
        for target in re.findall(r"(?:^|`)make ([a-z][a-z-]*)", _read(path), flags=re.MULTILINE)
    }
    targets = _targets()
    assert {(path, target) for path, target in named if target not in targets} == set()


def test_files_that_are_named_exist() -> None:
    """From the root, or in a page from the package: `engine/kernels/region_stages.py`."""
    missing = []
    for path in [*document_files(), *source_files()]:
        text = _read(path)
        folders = "tests|docs|clearance-benchmarks|benchmarks|examples"
        named = re.findall(rf"\b(?:{folders})/[\w/]+\.(?:py|md|toml|json)\b", text)
        missing += [(path, name) for name in named if not (ROOT / name).exists()]
        if path.suffix == ".md":
            named = re.findall(r"`([a-z_]+/[\w/]+\.py)`", text)
            roots = (ROOT, SOURCE, EXAMPLES)
            missing += [(path, name) for name in named if not any((root / name).exists() for root in roots)]
    assert missing == []


def test_readme_opens_with_the_two_commands() -> None:
    opening = _read(ROOT / "README.md").split("```")[1]
    assert re.findall(r"^make (\S+)", opening, flags=re.MULTILINE) == ["run", "test"]


def test_gearrattle_commands_named_in_pages_exist_and_all_are_described() -> None:
    consoles = [
        block for path in document_files() for block in re.findall(r"```console\n(.*?)```", _read(path), re.DOTALL)
    ]
    assert set(re.findall(r"^gearrattle ([a-z-]+)", "\n".join(consoles), flags=re.MULTILINE)) == set(COMMANDS)
    described = _read(DOCS / "howto" / "command_line.md")
    assert [name for name in COMMANDS if f"## `gearrattle {name}`" not in described] == []


SETTINGS = ["--algorithm", "--cycles", "--discard", "--samples-per-cycle", "--tolerance", "--step", "--initial"]
"""Of every simulation: described once, with ``run``."""
EVERYWHERE = {"--json", "--output", "--set"}


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_of_a_command_is_described(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the command's section; the settings of a simulation with ``run``."""
    monkeypatch.setenv("COLUMNS", "200")
    assert main([name, "--help"]) == 0
    options = set(re.findall(r"^│\s+(?:\*\s+)?(--[a-z-]+)", capsys.readouterr().out, flags=re.MULTILINE))
    section = _read(DOCS / "howto" / "command_line.md").split(f"## `gearrattle {name}`")[1].split("\n## ")[0]
    named = {option.replace("--no-", "--") for option in re.findall(r"--[a-z][a-z-]+", section)}
    assert options - named - EVERYWHERE - (set(SETTINGS) if name != "run" else set()) == set()
    assert named - options <= {"--resume"} if name == "stream" else named <= options


def test_every_example_is_listed() -> None:
    catalogue = _read(DOCS / "howto" / "examples.md")
    files = [path for pattern in ("*.toml", "*.py") for path in EXAMPLES.rglob(pattern)]
    assert files
    assert [name for path in files if (name := path.relative_to(EXAMPLES).as_posix()) not in catalogue] == []


def test_readme_python_prints_what_it_says(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ((code, printed),) = re.findall(
        r"```python\n(.*?)```\n+```text\n(.*?)```", _read(ROOT / "README.md"), flags=re.DOTALL
    )
    assert len(code.strip().splitlines()) <= 12
    monkeypatch.chdir(tmp_path)  # it saves a report into the working directory
    exec(compile(code, "README.md", "exec"), {})
    assert capsys.readouterr().out == printed
    assert (tmp_path / "case3" / "report.html").is_file()


def _keys(schema: Any) -> set[str]:
    """Return every property name anywhere in a JSON Schema."""
    if isinstance(schema, list):
        return set().union(*map(_keys, schema)) if schema else set()
    if not isinstance(schema, dict):
        return set()
    own = set(schema["properties"]) if isinstance(schema.get("properties"), dict) else set()
    return own.union(*map(_keys, schema.values()))


def test_every_key_of_the_model_file_is_described() -> None:
    page = _read(DOCS / "howto" / "model_file.md")
    assert sorted(key for key in _keys(json_schema()) if f"`{key}`" not in page) == []


def test_the_first_model_in_the_key_reference_loads() -> None:
    page = _read(DOCS / "howto" / "model_file.md")
    assert gr.loads(page.split("```toml\n")[1].split("```")[0]).couplings[0].name == "clutch"


def test_links_between_pages_lead_somewhere() -> None:
    targets = [(path, target) for path in ROOT.glob("*.md") for target in re.findall(r"\]\(([^)#:]+)\)", _read(path))]
    assert targets
    assert [(path, target) for path, target in targets if not (ROOT / target).exists()] == []


def test_every_public_name_is_in_the_reference() -> None:
    page = _read(DOCS / "reference" / "index.md")
    listed = set(re.findall(r"^\s+([A-Za-z_.]+)$", page, flags=re.MULTILINE))
    assert set(PUBLIC) <= listed
