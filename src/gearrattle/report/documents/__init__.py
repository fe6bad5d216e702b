"""Results as documents to hand over: the page as PDF, slides for PowerPoint, tables for Excel.

A format has one file with two functions: one refuses it where a library is missing, before anything is computed, one
writes it. Every kind of result is written from its presentation, in the same way.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, cast

from gearrattle.report.presentation import FIGURE_ENDINGS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gearrattle.report.presentation import Presentation

_FORMATS = {".pdf": "page_as_pdf", ".pptx": "slides", ".xlsx": "workbook"}


class Document(Protocol):
    """A format: a module of this folder."""

    def check(self, option: str, value: str, /) -> None:
        """Refuse the format where what it needs is not installed (NotInstalled)."""
        ...

    def write(self, presentation: Presentation[Any], path: Path, /) -> None:
        """Write a result as a new file."""
        ...


def document_of(suffix: str, endings: Sequence[str]) -> Document | None:
    """Return the format of a file's ending; None for one of numbers, or of a figure.

    ``endings`` are those of the kind of result: where it is saved as one figure, PDF is the figure.
    """
    is_figure = suffix in FIGURE_ENDINGS and set(FIGURE_ENDINGS) <= set(endings)
    if suffix not in _FORMATS or is_figure:
        return None
    return cast(Document, import_module(f"{__name__}.{_FORMATS[suffix]}"))
