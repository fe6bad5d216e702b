"""Folders for pages: new, empty, or with a page of ours in it; a folder of somebody else's is refused.

A page comes with files of common names (report.html, summary.json, figures/), which would replace others'. Studies and
stored motions refuse such folders by the same rule.

Takes the folder asked for; gives a Staging.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gearrattle.writing import Staging

_PAGES = ("report.html", "modes.html", "compare.html", "reproduction.html", "study.html")


def page_folder(folder: Path) -> Staging:
    """Return a folder to write a page into; nothing is computed yet where it is refused.

    Raises:
        ModelError: it holds files, and no page with its figures.
    """
    from gearrattle.errors import ModelError, Problem
    from gearrattle.wording import listed
    from gearrattle.writing import Staging, sweep

    sweep(folder)  # a page that was being replaced when the program was killed
    names = sorted(item.name for item in folder.iterdir() if not item.name.startswith(".")) if folder.is_dir() else []
    has_page = (folder / "figures").is_dir() and not set(names).isdisjoint(_PAGES)
    if names and not has_page:
        shown = [*names[:3], f"{len(names) - 3} more"] if len(names) > 4 else names
        rule = f"is not empty and holds no page of gearrattle: {listed(shown)}"
        raise ModelError(Problem(str(folder), "", rule, "give a new or an empty folder"))
    return Staging(folder)
