"""The page of a kind of study: its figures, sentences and tables, all from the Dataset.

To add one: a file with a ``StudyPage``, and its line in the table in ``__init__``. A page says in words and tables what
its figures show. Pages import this module and not each other.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from gearrattle.report.page import Section, SupportsHtml
from gearrattle.report.plots.chart import Chart
from gearrattle.report.tables import Table

if TYPE_CHECKING:
    import xarray as xr
    from markupsafe import Markup

Messages = Mapping[tuple[int, ...], str]
"""Why cases failed, by their place in the grid."""


class Inlay(NamedTuple):
    """HTML below a figure, and its script."""

    key: str
    html: SupportsHtml
    script: Markup


@dataclass(frozen=True)
class StudyPage:
    """The page of a kind of study.

    Attributes
    ----------
    charts
        every figure that has something to show, in reading order.
    summary
        what came out, in a few sentences.
    setting
        what was varied.
    counts
        the table below the summary.
    sections
        the tables behind it all, those that have rows.
    answer
        what the terminal shows below the summary.
    inlay
        key of a figure, and HTML that stands below it with the script of the page; None for nothing.
    content
        what ``--json`` and summary.json give: SI values, by the paths of the model file.
    """

    charts: Callable[[xr.Dataset], list[Chart]]
    summary: Callable[[xr.Dataset], str]
    setting: Callable[[xr.Dataset], str]
    counts: Callable[[xr.Dataset], Table]
    sections: Callable[[xr.Dataset, Messages], list[Section]]
    answer: Callable[[xr.Dataset], tuple[Table, ...]]
    content: Callable[[xr.Dataset], dict[str, Any]]
    inlay: Callable[[xr.Dataset], Inlay] | None = None


def joined(words: list[str]) -> str:
    """Return words as a sentence lists them."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
