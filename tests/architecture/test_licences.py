"""Libraries under copyleft licences that an extra brings are named in the manual."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from importlib.metadata import Distribution, PackageNotFoundError, distribution

import pytest
from packaging.requirements import Requirement

from tests.architecture.places import DOCS, ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]
COPYLEFT = re.compile(r"\bA?L?GPL|MPL|Mozilla|GNU |EUPL")


def _licence(package: Distribution) -> str:
    about = package.metadata
    classes = [line for line in about.get_all("Classifier") or [] if line.startswith("License ::")]
    return " ".join(about.get_all("License-Expression") or classes or (about.get("License") or "")[:60].splitlines())


def _installed(requirements: Iterable[str]) -> dict[str, str]:
    """Licences of what is installed of some requirements, and of all that these require, by name."""
    licences: dict[str, str] = {}
    wanted = [Requirement(text) for text in requirements]
    while wanted:
        requirement = wanted.pop()
        name = re.sub(r"[-_.]+", "-", requirement.name).lower()
        if name in licences or (requirement.marker and not requirement.marker.evaluate({"extra": ""})):
            continue
        try:
            package = distribution(requirement.name)
        except PackageNotFoundError:
            continue
        licences[name] = _licence(package)
        wanted += map(Requirement, package.requires or ())
    return licences


def test_what_gearrattle_needs_is_under_permissive_licences() -> None:
    licences = _installed(PROJECT["dependencies"])
    assert len(licences) > 20
    assert {name: words for name, words in licences.items() if COPYLEFT.search(words)} == {}


@pytest.mark.parametrize("extra", EXTRAS)
def test_copyleft_libraries_of_an_extra_are_named(extra: str) -> None:
    page = (DOCS / "howto" / "install.md").read_text(encoding="utf-8").lower()
    copyleft = [name for name, words in _installed(EXTRAS[extra]).items() if COPYLEFT.search(words)]
    assert [name for name in copyleft if name not in page] == []


def test_the_known_copyleft_library_is_recognised() -> None:
    pytest.importorskip("asammdf")
    assert COPYLEFT.search(_installed(EXTRAS["measured"])["asammdf"])
