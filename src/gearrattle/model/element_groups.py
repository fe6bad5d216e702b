"""Elements as tables show them: those of a bearing, which have the same law, under its name."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gearrattle.model.components.component import Element
    from gearrattle.model.model import Model


def element_groups(model: Model) -> dict[str, list[Element]]:
    """Return by name, in element order, an element, or all elements of a bearing."""
    groups: dict[str, list[Element]] = {}
    for element in model.elements:
        kind, _, name = element.path.partition(".")
        groups.setdefault(name if kind == "bearing" else element.name, []).append(element)
    return groups
