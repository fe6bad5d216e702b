"""What is public: the names of ``gr``, and those of its namespaces as ``spectral.psd``."""

from __future__ import annotations

import inspect
from types import ModuleType
from typing import Any

import gearrattle as gr


def public_names() -> dict[str, Any]:
    """Return every public function and class by the name behind ``gr.``, as it is now."""
    top = {name: getattr(gr, name) for name in gr.__all__ if not name.startswith("_")}
    spaces = {name: space for name, space in top.items() if isinstance(space, ModuleType)}
    names = {name: member for name, member in top.items() if name not in spaces}
    for at, space in spaces.items():
        names |= {f"{at}.{name}": getattr(space, name) for name in space.__all__ if name not in top}
    return names


PUBLIC = public_names()
"""Every public function and class by the name behind ``gr.``."""
FUNCTIONS = {name: member for name, member in PUBLIC.items() if inspect.isfunction(member)}
