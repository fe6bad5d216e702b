"""Numbers on the page and in reports are written by the same rules, letter by letter."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gearrattle.report.browser import widgets
from gearrattle.report.plots.numerals import engineering, numeral
from tests.browser import BROWSER, MARKS

pytestmark = MARKS
VALUES = [
    *(sign * 10.0**power * factor for sign in (1.0, -1.0) for power in range(-12, 10) for factor in (1.0, 2.345678)),
    *(0.0, 2.5, 0.125, 1000.5, 1001.5, 62.5, 0.9999999, 99999.99, 0.00099996, 0.001, 1e5, 123456.0, 12345.678),
    *np.random.default_rng(5).lognormal(0.0, 6.0, 300).tolist(),
]
UNITS = ("", "1", "J", "m/s", "N s", "N m", "kg m^2", "dB")


@pytest.fixture(scope="module")
def written() -> Any:
    """What the part of the widgets makes of every value, digits and unit."""
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as play:
        browser = play.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        tab = browser.new_page()
        source = widgets.text("numerals").replace("export default", "globalThis.numerals =")
        tab.evaluate(f"() => {{ {source} }}")
        yield lambda call, cases: tab.evaluate(f"(cases) => cases.map((one) => numerals.{call}(...one))", cases)
        browser.close()


@pytest.mark.parametrize("digits", [2, 3, 4, 8])
def test_numerals_are_those_of_reports(written: Any, digits: int) -> None:
    assert written("numeral", [[value, digits] for value in VALUES]) == [numeral(value, digits) for value in VALUES]


@pytest.mark.parametrize("unit", UNITS)
def test_units_take_the_prefixes_of_reports(written: Any, unit: str) -> None:
    assert written("engineering", [[value, unit] for value in VALUES]) == [engineering(v, unit) for v in VALUES]


def test_the_page_has_no_other_way_to_write_a_number() -> None:
    """What rounds otherwise writes values of fields and of models, which are read by programs."""
    for path in widgets.FOLDER.glob("*.js"):
        assert "toPrecision" not in path.read_text(encoding="utf-8") or path.name == "plot.js", path.name
