"""The jinja environment with the templates of all pages; numbers such as 1e-14 or 5 Hz stay on one line."""

from __future__ import annotations

from base64 import b64encode
from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from gearrattle.report.live_figures import chart_data
from gearrattle.report.plots.numerals import unbroken
from gearrattle.report.plots.shapes import background, swatch
from gearrattle.wording import counted

_HERE = Path(__file__).parent


@cache
def templates() -> Environment:
    """Return the templates of this folder; text is escaped, ``Markup`` is left as it is."""
    environment = Environment(
        loader=FileSystemLoader(_HERE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_finalized,
    )
    environment.globals["counted"] = counted
    environment.filters["chart_data"] = chart_data
    environment.filters["swatch"] = swatch
    environment.filters["background"] = background
    environment.filters["data_address"] = _data_address
    return environment


def _data_address(svg: bytes) -> Markup:
    """Return the address of a picture within the page: no text, in which numerals were sought."""
    return Markup(f"data:image/svg+xml;base64,{b64encode(svg).decode('ascii')}")


def _finalized(value: object) -> object:
    """Return what a template shows of a value: text whose lines are not broken within a number or before its unit."""
    return unbroken(value) if isinstance(value, str) and not isinstance(value, Markup) else value
