"""The templates of all pages, and what they do with text: numbers such as 1e-14 are not broken at their hyphen.

Gives a jinja environment.
"""

from __future__ import annotations

import re
from base64 import b64encode
from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from gearrattle.report.live_figures import plotly_data
from gearrattle.wording import counted

_HERE = Path(__file__).parent
_EXPONENT = re.compile(r"(?<=\de-)(?=\d)")
_JOINER = "\u2060"


@cache
def templates() -> Environment:
    """Return the templates of this folder; text is escaped, ``Markup`` is left as it is."""
    environment = Environment(
        loader=FileSystemLoader(_HERE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=unbroken,
    )
    environment.globals["counted"] = counted
    environment.filters["plotly_data"] = plotly_data
    environment.filters["data_address"] = lambda svg: f"data:image/svg+xml;base64,{b64encode(svg).decode('ascii')}"
    return environment


def unbroken(value: object) -> object:
    """Return text whose powers of ten stay on one line: a word joiner stands after their hyphen."""
    if isinstance(value, str) and not isinstance(value, Markup):
        return _EXPONENT.sub(_JOINER, value)
    return value
