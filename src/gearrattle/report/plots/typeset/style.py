"""The style of figures for print: width, fonts, line widths, and the user's own style file.

A figure has the size that it has in the printed text, so that its letters keep their size: 85 mm is one column of a
journal, 175 mm two columns (Elsevier, Artwork sizing: 90 and 190 mm; ASME, two columns of 3.5 in). Line widths in
pixels on a page of 880 px are converted to points on a page of 175 mm.

matplotlib's settings of the current session are neither read nor changed. Fonts are named by family, because
"sans-serif" would be looked up in those settings later, when the figure is drawn.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gearrattle.errors import ModelError, Problem, check_installed
from gearrattle.model.units import LENGTH, UnitError, convert
from gearrattle.report.plots.palette import FAINT, INK, MUTED, PAPER

WIDTHS = {"single": 85.0, "double": 175.0}
"""Widths that have a name [mm]."""
NARROWEST = 60.0
WIDEST = 500.0
SMALLEST = 5.0
LARGEST = 14.0
POINTS = 175.0 / 880.0 * 72.0 / 25.4
"""Points in print per pixel on the page."""
_FONTS = {"sans": ("DejaVu Sans",), "serif": ("STIXGeneral", "DejaVu Serif")}
"""Both come with matplotlib, so the same chart gives the same file everywhere."""


@dataclass(frozen=True)
class Style:
    """How figures for print look.

    Attributes
    ----------
    width
        of the figure [mm]: a number, a quantity such as "85 mm", "single" (85 mm) or "double" (175 mm).
    font
        "sans", "serif", or the name of an installed family such as "Arial".
    size
        of the letters [pt], 5 to 14; those of ticks and legends are an eighth smaller.
    rc
        matplotlib style file, or the name of a style matplotlib knows; it is laid over gearrattle's own.
    """

    width: float | str = "double"
    font: str = "sans"
    size: float = 8.0
    rc: str | os.PathLike[str] | None = None

    def __post_init__(self) -> None:
        """Refuse every width, font, size or style that is not valid, all at once (ModelError).

        NotInstalled where matplotlib is not there: every figure for print begins with its style.
        """
        check_matplotlib("figures")
        problems = [
            problem
            for problem in (
                _width_wrong(self.width),
                _font_wrong(self.font),
                _size_wrong(self.size),
                _rc_wrong(self.rc),
            )
            if problem is not None
        ]
        if problems:
            raise ModelError(problems)

    @property
    def millimetres(self) -> float:
        """The width."""
        return _millimetres(self.width)

    @property
    def settings(self) -> dict[str, Any]:
        """matplotlib's settings for it, all that differ from matplotlib's own."""
        small = 0.875 * self.size
        return {
            # letters
            "font.family": list(_FONTS.get(self.font, (self.font, "DejaVu Sans"))),
            "font.size": self.size,
            "axes.titlesize": self.size,
            "axes.labelsize": self.size,
            "xtick.labelsize": small,
            "ytick.labelsize": small,
            "legend.fontsize": small,
            # axes
            "axes.titlelocation": "left",
            "axes.titlepad": 3.0,
            "axes.labelpad": 2.5,
            "axes.edgecolor": MUTED,
            "axes.labelcolor": INK,
            "axes.titlecolor": INK,
            "text.color": INK,
            "axes.linewidth": 0.5,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.axisbelow": True,
            # grid and ticks
            "grid.color": FAINT,
            "grid.linewidth": 0.4,
            "xtick.color": MUTED,
            "ytick.color": MUTED,
            "xtick.labelcolor": INK,
            "ytick.labelcolor": INK,
            "xtick.major.width": 0.5,
            "ytick.major.width": 0.5,
            "xtick.major.size": 2.5,
            "ytick.major.size": 2.5,
            "xtick.minor.width": 0.4,
            "ytick.minor.width": 0.4,
            "xtick.minor.size": 1.5,
            "ytick.minor.size": 1.5,
            "xtick.major.pad": 2.0,
            "ytick.major.pad": 2.0,
            "legend.frameon": False,
            "legend.handlelength": 2.2,
            "legend.handletextpad": 0.5,
            "legend.columnspacing": 1.4,
            "legend.labelspacing": 0.3,
            "legend.borderpad": 0.0,
            "legend.borderaxespad": 0.5,
            # strokes and paper
            "hatch.linewidth": 0.5,
            "lines.scale_dashes": False,
            "figure.facecolor": PAPER,
            "savefig.facecolor": PAPER,
            "axes.facecolor": PAPER,
        }

    @contextmanager
    def context(self) -> Iterator[None]:
        """Make matplotlib's settings these, over its own defaults, while the context is open."""
        import warnings

        from matplotlib import MatplotlibDeprecationWarning, rc_context, rcParams, rcParamsDefault

        chosen: Any = rcParams

        with rc_context():
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", MatplotlibDeprecationWarning)  # of settings that the defaults have
                chosen.update({key: v for key, v in rcParamsDefault.items() if key not in _OF_THE_SESSION})
            chosen.update(self.settings)
            chosen.update(_laid_over(self.rc))
            yield


def check_matplotlib(subject: str, value: str = "") -> None:
    """Refuse figures for print where matplotlib is not installed (NotInstalled)."""
    rule = "figures for print need matplotlib, which is not installed"
    check_installed("matplotlib", "figures", subject, value, rule)


_OF_THE_SESSION = frozenset({"backend", "backend_fallback", "interactive", "toolbar", "timezone", "webagg.port"})


def _millimetres(width: float | str) -> float:
    """Return a width in millimetres; NaN if it is no width."""
    if isinstance(width, str):
        if width in WIDTHS:
            return WIDTHS[width]
        try:
            return 1e3 * convert(width, LENGTH)
        except UnitError:
            return math.nan
    return float(width) if isinstance(width, int | float) and not isinstance(width, bool) else math.nan


def _width_wrong(width: float | str) -> Problem | None:
    if NARROWEST <= _millimetres(width) <= WIDEST:
        return None
    value = f'"{width}"' if isinstance(width, str) else f"{width}"
    rule = f"must be a length from {NARROWEST:g} to {WIDEST:g} mm"
    return Problem("width", value, rule, 'such as "85 mm" or "3.5 inch", or "single" (85 mm) or "double" (175 mm)')


def _font_wrong(font: str) -> Problem | None:
    if font in _FONTS:
        return None
    from matplotlib.font_manager import fontManager

    if isinstance(font, str) and font in fontManager.get_font_names():
        return None
    return Problem("font", f'"{font}"', 'must be "sans", "serif" or an installed family', "fc-list names those")


def _size_wrong(size: float) -> Problem | None:
    if isinstance(size, int | float) and SMALLEST <= size <= LARGEST:
        return None
    return Problem("size", f"{size}", f"must be {SMALLEST:g} to {LARGEST:g} pt", "journals ask for 7 to 9")


def _rc_wrong(rc: str | os.PathLike[str] | None) -> Problem | None:
    if rc is None:
        return None
    from matplotlib import style

    if str(rc) in style.library:
        return None
    if not Path(rc).is_file():
        rule = "must be a matplotlib style file, or the name of a style that matplotlib knows"
        return Problem("style", f'"{os.fspath(rc)}"', rule, "such as my.mplstyle or grayscale")
    try:
        _laid_over(rc)
    except (ValueError, OSError) as error:
        return Problem("style", f'"{os.fspath(rc)}"', f"cannot be read: {' '.join(str(error).split())}")
    return None


def _laid_over(rc: str | os.PathLike[str] | None) -> dict[str, Any]:
    """Return the settings of a style."""
    if rc is None:
        return {}
    from matplotlib import rc_params_from_file, style

    if str(rc) in style.library:
        known: Any = style.library[str(rc)]
        return dict(known)
    read: Any = rc_params_from_file(os.fspath(rc), use_default_template=False)
    return dict(read)
