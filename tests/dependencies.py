"""The script that lists what an installation brings, as a module, and what pyproject.toml asks for."""

from __future__ import annotations

from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from types import ModuleType
from typing import Any

from tests.architecture.places import ROOT


def _loaded() -> ModuleType:
    spec = spec_from_loader("dependencies", SourceFileLoader("dependencies", str(ROOT / ".ci" / "dependencies")))
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


DEPENDENCIES: Any = _loaded()
PROJECT: dict[str, Any] = DEPENDENCIES.project()
EXTRAS: dict[str, list[str]] = PROJECT["optional-dependencies"]
