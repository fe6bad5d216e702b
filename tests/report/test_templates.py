"""Text of pages: numbers stay on one line, and what is to be copied is left as it is."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from markupsafe import Markup

from gearrattle.report.templates import templates
from tests import synthetic


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("up to 1e-14 of it", "up to 1e-\u206014 of it"),
        ("3.2e-07", "3.2e-\u206007"),
        ("one-sided", "one-sided"),
        ("one-1", "one-1"),
        (3, "3"),
        ("62 % of 5 Hz", "62\u00a0% of 5\u00a0Hz"),
        (Markup("1e-14 Hz"), "1e-14 Hz"),
    ],
)
def test_numbers_are_not_broken_and_markup_is_left_as_it_is(text: object, shown: str) -> None:
    assert templates().from_string("{{ text }}").render(text=text) == shown


def test_the_report_breaks_no_power_of_ten_and_its_model_file_can_be_copied(tmp_path: Path) -> None:
    synthetic.findings("double-sided").save(tmp_path / "o")
    page = (tmp_path / "o" / "report.html").read_text(encoding="utf-8")
    model = re.search(r"<pre>(.*?)</pre>", page, re.DOTALL)
    assert model is not None
    assert not set("\u2060\u00a0") & set(model[1])
    shown = re.sub(r"<(script|style|pre|svg)\b.*?</\1>|<[^>]*>", " ", page, flags=re.DOTALL)
    assert re.search(r"\de-\u2060\d", shown)
    assert not re.search(r"\de-\d", shown)
