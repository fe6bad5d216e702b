"""Functions that show and save results, called by ``gearrattle.result`` (``result.View``).

Every function imports the modules it needs, because a result on a terminal needs no figures or templates.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any


def presentation_of(result: Any) -> Any:
    """Return the presentation of a result."""
    from gearrattle.report import result_kinds

    return result_kinds.presentation_of(result)


def plain_text(result: Any) -> str:
    """Return sentence, tables and notes of a result as a terminal shows them."""
    from gearrattle.report import text

    presentation = presentation_of(result)
    return "\n".join([text.plain_text(presentation), *(f"note: {note}" for note in presentation.notes)])


def save(result: Any, path: str | os.PathLike[str]) -> Path:
    """Save a result as a file or a folder."""
    from gearrattle.report import saved

    return saved.save(result, path)


def notebook_view(result: Any) -> str:
    """Return a result as HTML for a notebook."""
    from gearrattle.report import notebook_view

    return notebook_view.notebook_view(result)
