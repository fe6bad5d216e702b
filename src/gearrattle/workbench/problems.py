"""Problems as the HTTP interface tells them.

Takes problems; gives JSON types.
"""

from __future__ import annotations

from collections.abc import Iterable

from gearrattle.errors import Problem


def written(problems: Iterable[Problem]) -> list[dict[str, str]]:
    """Return place, value, rule and remedy of each."""
    return [{"place": p.place, "value": p.value, "rule": p.rule, "remedy": p.remedy} for p in problems]
