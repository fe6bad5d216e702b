"""What an installation brings: the manual names copyleft libraries, the bill of materials is whole."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.architecture.places import DOCS, ROOT
from tests.dependencies import DEPENDENCIES, EXTRAS, PROJECT


def _licences(requirements: list[str]) -> dict[str, str]:
    """Licences of what is installed of some requirements, and of all that these require, by name."""
    packages, _ = DEPENDENCIES.brought(requirements, EXTRAS)
    return {name: DEPENDENCIES.licence_of(package) for name, package in packages.items() if package is not None}


def _copyleft(licences: dict[str, str]) -> list[str]:
    return [name for name, words in licences.items() if DEPENDENCIES.COPYLEFT.search(words)]


def test_what_gearrattle_needs_is_under_permissive_licences() -> None:
    licences = _licences(PROJECT["dependencies"])
    assert len(licences) > 20
    assert _copyleft(licences) == []


@pytest.mark.parametrize("extra", EXTRAS)
def test_copyleft_libraries_of_an_extra_are_named(extra: str) -> None:
    page = (DOCS / "howto" / "install.md").read_text(encoding="utf-8").lower()
    assert [name for name in _copyleft(_licences(EXTRAS[extra])) if name not in page] == []


@pytest.mark.parametrize("extra", sorted(set(EXTRAS) - DEPENDENCIES.DEVELOPMENT))
def test_every_extra_of_a_user_is_in_the_manual(extra: str) -> None:
    page = (DOCS / "howto" / "install.md").read_text(encoding="utf-8")
    assert f"| `{extra}` |" in page


def test_the_known_copyleft_library_is_recognised() -> None:
    pytest.importorskip("asammdf")
    assert "asammdf" in _copyleft(_licences(EXTRAS["measured"]))


def test_the_bill_of_materials_has_every_package_once(tmp_path: Path) -> None:
    pytest.importorskip("asammdf")
    call = [sys.executable, str(ROOT / ".ci" / "dependencies"), str(tmp_path / "new")]
    done = subprocess.run(call, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    bill = json.loads((tmp_path / "new" / "sbom.cdx.json").read_text(encoding="utf-8"))
    references = [component["bom-ref"] for component in bill["components"]]
    assert len(set(references)) == len(references)
    own = bill["metadata"]["component"]["bom-ref"]
    assert own == f"pkg:pypi/gearrattle@{PROJECT['version']}"
    assert {one["ref"] for one in bill["dependencies"]} == {own, *references}
    assert {name for one in bill["dependencies"] for name in one["dependsOn"]} == set(references)
    with open(tmp_path / "new" / "licences.csv", encoding="utf-8", newline="") as file:
        rows = {row["package"]: row for row in csv.DictReader(file)}
    assert len(rows) == len(references)
    assert rows["numpy"]["brought by"] == "core"
    assert "studies" in rows["zarr"]["brought by"]
    assert "pytest" not in rows
    assert "asammdf" in " ".join(line for line in done.stdout.splitlines() if line.endswith("<- copyleft"))
