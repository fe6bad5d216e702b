"""The style sheet of all pages: well formed, narrow screens and print."""

from __future__ import annotations

import re
from importlib.resources import files

CSS = re.sub(r"/\*.*?\*/", "", files("gearrattle.report").joinpath("page.css").read_text(encoding="utf-8"), flags=re.S)


def test_no_selector_holds_an_at_rule_and_every_brace_closes() -> None:
    selectors = [selector.strip() for selector in re.findall(r"([^{};]*)\{", CSS)]
    assert len(selectors) > 100
    assert [selector for selector in selectors if "@" in selector[1:]] == []
    assert CSS.count("{") == CSS.count("}")


def test_print_shows_the_drawn_figure_once() -> None:
    rules = CSS.partition("@media print {")[2]
    assert ".scripted .drawn .live { display: none; }" in rules
    assert ".scripted .drawn .static { display: block; }" in rules


def test_no_column_is_wider_than_a_narrow_screen() -> None:
    widths = re.findall(r"minmax\((min\()?(\d+)px(, 100%\))?", CSS)
    assert len(widths) >= 4
    assert [px for bounded, px, whole in widths if int(px) > 300 and not (bounded and whole)] == []
