"""The conda recipe asks for what pyproject.toml asks for; rattler-build reads it, where it is installed."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement

from tests.architecture.places import ROOT
from tests.dependencies import DEPENDENCIES, EXTRAS, PROJECT

RECIPE = ROOT / "conda" / "recipe.yaml"
CONDA_NAMES = {"matplotlib": "matplotlib-base"}
NOT_ON_CONDA_FORGE = {"scikit-sundae", "mosqito"}


def _list(text: str, key: str) -> list[str]:
    """Items of a list of the recipe, without a reader of YAML, which gearrattle does not need."""
    (rows,) = re.findall(rf"^  {key}:[^\n]*\n((?:    - .*\n)+)", text, re.MULTILINE)
    return [line.strip().removeprefix("- ") for line in rows.splitlines()]


def _as_conda(rows: list[str]) -> set[str]:
    requirements = [Requirement(row) for row in rows]
    names = {row.name: DEPENDENCIES.plain(row.name) for row in requirements}
    return {
        f"{CONDA_NAMES.get(names[row.name], row.name.lower())} {row.specifier}"
        for row in requirements
        if names[row.name] not in NOT_ON_CONDA_FORGE | {"gearrattle"}
    }


def test_the_recipe_asks_for_what_the_package_asks_for() -> None:
    text = RECIPE.read_text(encoding="utf-8")
    assert f'version: "{PROJECT["version"]}"' in text
    assert f'python_min: "{PROJECT["requires-python"].removeprefix(">=")}"' in text
    run = set(_list(text, "run")) - {"python >=${{ python_min }}"}
    assert run == _as_conda(PROJECT["dependencies"])
    extras = {name: rows for name, rows in EXTRAS.items() if name not in DEPENDENCIES.DEVELOPMENT}
    assert set(_list(text, "run_constraints")) == _as_conda([row for rows in extras.values() for row in rows])
    (script,) = PROJECT["scripts"].items()
    assert " = ".join(script) in text


def test_rattler_build_reads_the_recipe(tmp_path: Path) -> None:
    build: Any = pytest.importorskip("rattler_build")
    recipe = build.Stage0Recipe.from_yaml(RECIPE.read_text(encoding="utf-8"))
    (variant,) = recipe.render(build.VariantConfig())
    made = variant.recipe.to_dict()
    assert (made["package"]["name"], made["package"]["version"]) == ("gearrattle", PROJECT["version"])
    assert made["build"]["noarch"] == "python"
