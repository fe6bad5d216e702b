"""The templates of all pages, and what they do with text: numbers such as 1e-14 are not broken at their hyphen.

Takes folders of templates; gives a jinja environment.
"""

from __future__ import annotations

import re
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

_HERE = Path(__file__).parent
_EXPONENT = re.compile(r"(?<=\de-)(?=\d)")
_JOINER = "\u2060"


def templates(*folders: Path) -> Environment:
    """Return the templates of some folders, then of this one; text is escaped, ``Markup`` is left as it is."""
    return Environment(
        loader=FileSystemLoader([*folders, _HERE]), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, finalize=unbroken,
    )  # fmt: skip


def unbroken(value: object) -> object:
    """Return text whose powers of ten stay on one line: a word joiner stands after their hyphen."""
    if isinstance(value, str) and not isinstance(value, Markup):
        return _EXPONENT.sub(_JOINER, value)
    return value
