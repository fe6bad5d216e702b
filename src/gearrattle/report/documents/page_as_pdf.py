"""The page of a result as PDF: printed by a browser of the system, or set by matplotlib where there is none.

A browser prints the page as it is, by its print style. Looked for are Chromium, Google Chrome and Microsoft Edge, or
what the environment variable ``GEARRATTLE_BROWSER`` names. Without one, or where it fails, the PDF has the sentence,
the tables of the answer, the notes and all figures.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearrattle.report.plots.typeset.style import check_matplotlib
from gearrattle.report.text import plain_text

if TYPE_CHECKING:
    from gearrattle.report.presentation import Presentation

BROWSER = "GEARRATTLE_BROWSER"
"""Environment variable: path of a browser of the Chromium family; empty: the first one that is found."""
_NAMES = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "microsoft-edge",
    "microsoft-edge-stable",
    "msedge",
)
_USUAL_PATHS = {
    "darwin": (
        "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
        "/Applications/Chromium.app/Contents/MacOS/Chromium",
        "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    ),
    "win32": (
        r"C:\Program Files\Google\Chrome\Application\chrome.exe",
        r"C:\Program Files (x86)\Google\Chrome\Application\chrome.exe",
        r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
        r"C:\Program Files\Microsoft\Edge\Application\msedge.exe",
    ),
}
_LONGEST = 120.0  # s that a browser may take
_A4 = (8.27, 11.69)  # inch
_COLUMNS = 108  # characters of a line
_LINES = 92  # lines of a page
_LETTERS = 7.0  # pt


def check(option: str, value: str) -> None:
    """Refuse a PDF where there is neither a browser nor matplotlib (NotInstalled)."""
    if browser() is None:
        check_matplotlib(option, value)


def write(presentation: Presentation[Any], path: Path) -> None:
    """Write the page as PDF."""
    from gearrattle.report.written_page import fill_page

    if browser() is not None:
        with tempfile.TemporaryDirectory() as folder:
            fill_page(presentation.page(), Path(folder))
            if print_page(Path(folder) / "report.html", path):
                return
    check_matplotlib(str(path), "")
    _typeset(presentation, path)


def browser() -> str | None:
    """Return the path of a browser that prints pages; None where none is found."""
    named = os.environ.get(BROWSER, "")
    if named:
        return shutil.which(named)
    candidates = [shutil.which(name) for name in _NAMES] + [shutil.which(p) for p in _USUAL_PATHS.get(sys.platform, ())]
    return next((program for program in candidates if program), None)


def print_page(page: Path, path: Path) -> bool:
    """Print a page of HTML as PDF by a browser; return whether there is one, and it went well."""
    program = browser()
    if program is None:
        return False
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        words = [
            program,
            "--headless",
            "--disable-gpu",
            "--no-pdf-header-footer",
            f"--user-data-dir={profile}",
            f"--print-to-pdf={path.resolve()}",
        ]
        # the browser refuses its sandbox to the superuser, as in a container
        words += ["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []
        try:
            subprocess.run([*words, page.resolve().as_uri()], capture_output=True, timeout=_LONGEST, check=True)
        except (OSError, subprocess.SubprocessError):
            path.unlink(missing_ok=True)
            return False
    return path.is_file() and path.stat().st_size > 0


def _typeset(presentation: Presentation[Any], path: Path) -> None:
    """Write words, tables and figures by matplotlib: text on pages of A4, then a page a figure."""
    from matplotlib.backends.backend_pdf import PdfPages

    from gearrattle.report.plots.typeset import Style, matplotlib_figure

    about: dict[str, Any] = {"Title": presentation.title, "Creator": "gearrattle", "CreationDate": None}
    with PdfPages(path, metadata=about) as pages:
        for lines in _pages_of(_words(presentation)):
            pages.savefig(_page_of_text(lines))
        for chart in presentation.charts():
            pages.savefig(matplotlib_figure(chart, Style()))


def _words(presentation: Presentation[Any]) -> Iterator[str]:
    """Yield the lines of the text: title, answer, notes, captions of the figures in their order."""
    parts = [presentation.title, plain_text(presentation, _COLUMNS)]
    parts += [f"Note: {note}" for note in presentation.notes]
    charts = presentation.charts()
    parts += [f"Figure {number}. {chart.title}. {chart.caption}" for number, chart in enumerate(charts, 1)]
    for line in "\n\n".join(parts).splitlines():
        yield from textwrap.wrap(line, _COLUMNS, drop_whitespace=False) or [""]


def _pages_of(lines: Iterator[str]) -> Iterator[list[str]]:
    """Yield the lines of every page; one page at least."""
    everything = list(lines)
    for begin in range(0, max(1, len(everything)), _LINES):
        yield everything[begin : begin + _LINES]


def _page_of_text(lines: list[str]) -> Any:
    """Return a page of A4 with its lines, in letters of one width."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=_A4)
    how: dict[str, Any] = {"fontsize": _LETTERS, "family": "DejaVu Sans Mono", "linespacing": 1.3}
    figure.text(0.08, 0.95, "\n".join(lines), va="top", parse_math=False, **how)
    return figure
