"""Files for print: the same figure gives the same bytes on every machine, at any time, with any settings.

Letters in PDF and EPS are embedded TrueType fonts (type 42), which publishers accept and editors can change; in SVG
they are outlines, so that no font is needed. No file contains a date. EPS has no transparency: transparent colours are
replaced by the opaque colours that they have on paper.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearrattle.errors import ModelError, Problem
from gearrattle.report.plots.palette import PAPER
from gearrattle.report.plots.typeset.styles_by_colour import blended
from gearrattle.writing import put

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = ("pdf", "eps", "svg", "png", "tiff")
"""File formats of saved figures."""
DPI = 300.0
_LOWEST = 72.0
_HIGHEST = 2400.0
_SETTINGS: dict[str, Any] = {
    "pdf.fonttype": 42,
    "ps.fonttype": 42,
    "svg.fonttype": "path",
    "svg.hashsalt": "gearrattle",
    "pdf.compression": 6,
    "savefig.bbox": None,
    "savefig.transparent": False,
    "savefig.facecolor": PAPER,
    "savefig.edgecolor": PAPER,
    "path.simplify": True,
    "path.simplify_threshold": 1.0 / 9.0,
    "agg.path.chunksize": 0,
    "hatch.linewidth": 0.5,
    "pdf.use14corefonts": False,
    "ps.useafm": False,
    "ps.usedistiller": None,
    "ps.papersize": "figure",
    "image.composite_image": True,
    "svg.image_inline": True,
    "text.antialiased": True,
    "text.hinting": "force_autohint",
    "pdf.inheritcolor": False,
}


def known_formats(requested: str | Sequence[str]) -> list[str]:
    """Return formats, each once, of names or of one text with commas; a dot before a name is allowed.

    ModelError for none, or one that figures are not saved as.
    """
    names = requested.split(",") if isinstance(requested, str) else list(requested)
    formats = list(dict.fromkeys(name.strip().lower().removeprefix(".") for name in names if name.strip()))
    wrong = [name for name in formats if name not in FORMATS]
    if wrong or not formats:
        listed_names = ", ".join(f'"{name}"' for name in wrong) or "none"
        remedy = "a PGF figure is made by matplotlib itself: figure.savefig, with LaTeX" if "pgf" in wrong else ""
        raise ModelError(Problem("format", listed_names, f"must be {', '.join(FORMATS[:-1])} or {FORMATS[-1]}", remedy))
    return formats


def checked_dpi(dpi: float) -> float:
    """Return a resolution; ModelError below 72 or above 2400 points an inch, or for what is no number."""
    if not isinstance(dpi, int | float) or not _LOWEST <= dpi <= _HIGHEST:
        rule = f"must be {_LOWEST:g} to {_HIGHEST:g} dots an inch"
        raise ModelError(Problem("dpi", f"{dpi}", rule, "journals ask for 300 to 1200"))
    return float(dpi)


def saved(figure: Figure, kind: str, *, dpi: float = DPI, title: str = "", subject: str = "") -> bytes:
    """Return a figure as the bytes of a file, of a kind in ``FORMATS``.

    PNG, TIFF and pictures inside other formats have ``dpi`` points an inch. Title and subject are kept as far as the
    format can.
    """
    from matplotlib import rc_context, rcParams

    content = BytesIO()
    known: dict[Any, Any] = {key: value for key, value in _SETTINGS.items() if key in rcParams}
    with rc_context(known), _opaque(figure, wanted=kind == "eps"):
        figure.savefig(content, format=kind, dpi=dpi, **_metadata(kind, title, subject))
    raw = content.getvalue()
    return re.sub(rb"(?m)^%%CreationDate:.*\n", b"", raw) if kind == "eps" else raw


def save_figure(figure: Figure, path: str | os.PathLike[str], *, dpi: float = DPI) -> Path:
    """Save a figure; the ending says as what.

    Parameters
    ----------
    path
        a file that ends in one of ``FORMATS``.
    dpi
        points an inch of PNG and TIFF, and of pictures inside the others; 72 to 2400.

    Raises
    ------
    ModelError
        an unknown ending, or a resolution out of range.
    OSError
        the file cannot be written.
    """
    (kind,) = known_formats([Path(path).suffix])
    content = saved(figure, kind, dpi=checked_dpi(dpi))
    put(Path(path), content)
    return Path(path)


def _metadata(kind: str, title: str, subject: str) -> dict[str, Any]:
    """Return what a file says of itself: no date, no machine, no version."""
    if kind == "pdf":
        keys = {"Title": title or None, "Subject": subject or None, "Creator": "gearrattle", "Producer": None}
        return {"metadata": {**keys, "CreationDate": None}}
    if kind == "svg":
        return {"metadata": {"Title": title or None, "Description": subject or None, "Date": None, "Creator": None}}
    if kind == "eps":
        return {"metadata": {"Creator": "gearrattle"}}
    if kind == "png":
        words = {"Title": title, "Description": subject, "Software": "gearrattle"}
        return {"metadata": {key: word for key, word in words.items() if word}}
    return {"pil_kwargs": {"compression": "tiff_lzw"}}


@contextmanager
def _opaque(figure: Figure, *, wanted: bool) -> Iterator[None]:
    """Make translucent curves opaque, in the colour they have on paper, while the context is open."""
    from matplotlib.colors import to_hex
    from matplotlib.lines import Line2D

    changed = [
        (line, line.get_color(), float(line.get_alpha() or 1.0))
        for line in figure.findobj(Line2D)
        if wanted and isinstance(line, Line2D) and line.get_alpha() not in (None, 1.0)
    ]
    for line, colour, alpha in changed:
        line.set(color=blended(to_hex(colour), alpha), alpha=None)
    try:
        yield
    finally:
        for line, colour, alpha in changed:
            line.set(color=colour, alpha=alpha)
