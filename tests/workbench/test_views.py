"""Every kind of result has a view, by one mechanism, which JSON can say and whose figures are there."""

from __future__ import annotations

import base64
import json

import numpy as np
import pytest

from gearrattle.json_types import json_value
from gearrattle.report.plots.interactive import chart_json
from gearrattle.report.result_kinds import presentation_of
from gearrattle.workbench.views import view_of, without_styles
from tests.report.examples import CASE_PARAMETERS, result


@pytest.mark.parametrize("case", CASE_PARAMETERS)
def test_every_kind_of_result_has_a_view(case: str) -> None:
    presentation = presentation_of(result(case))
    view = view_of(presentation)
    text = json.dumps(json_value(view), allow_nan=False)
    assert json.loads(text)["kind"] == presentation.kind
    assert view["title"] == presentation.title
    assert view["sentence"] == presentation.sentence
    page = presentation.page()
    assert [section["key"] for section in view["sections"]] == [section.key for section in page.sections]
    drawn = [figure["key"] for section in view["sections"] for figure in section["figures"] if figure["is_chart"]]
    assert drawn == [chart.key for chart in page.charts if chart.panels]
    tables = [table for section in view["sections"] for table in section["tables"]]
    assert len(tables) == sum(bool(table.rows) for section in page.sections for table in section.tables)
    for table in tables:
        assert all(len(row) == len(table["head"]) for row in table["rows"])
    assert "style=" not in text, "a style attribute is refused by the page's policy"


def test_the_verdict_of_a_run_stands_before_its_sections() -> None:
    findings = result("run")
    block = view_of(presentation_of(findings))["verdict"]
    assert block["verdict"] == findings.verdict.verdict
    assert [part["name"] for part in block["parts"]] == [part.name for part in findings.verdict.parts]
    for part in block["parts"]:
        assert sum(part["shares"].values()) == pytest.approx(1.0)
        assert part["shares"]["drive"] + part["shares"]["coast"] == pytest.approx(part["contact_share"])
    assert block["drawing"].startswith("<svg")
    assert len(block["trust"]) >= 3


def test_arrays_of_a_figure_come_through() -> None:
    (chart,) = presentation_of(result("modes")).charts()
    written = json.loads(json.dumps(chart_json(chart), allow_nan=False))
    for panel, drawn in zip(written["panels"], chart.panels, strict=True):
        for line, of in zip(panel["lines"], drawn.lines, strict=True):
            values = np.frombuffer(base64.b64decode(line["y"]["f4"]), "<f4")
            np.testing.assert_allclose(values, of.y, rtol=1e-7)


def test_styles_are_taken_out_of_a_drawing() -> None:
    assert without_styles('<svg style="max-width:3px" class="a"><g style=""/></svg>') == '<svg class="a"><g/></svg>'
