"""``gr.view``: the widget answers what the page's server answers; without anywidget the static view is shown."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.workbench import notebook_widget
from gearrattle.workbench.notebook_widget import Answers
from tests.report.examples import EXAMPLES, EXTREMES, result
from tests.workbench.test_results import arrays


@pytest.mark.slow
@pytest.mark.parametrize("case", [*EXAMPLES, *(pytest.param(case, marks=pytest.mark.long) for case in EXTREMES)])
def test_every_kind_of_result_can_be_viewed(case: str) -> None:
    pytest.importorskip("anywidget")
    shown = gr.view(result(case))
    answers = Answers(result(case))
    for section in shown.view["sections"]:
        for figure in section["figures"]:
            content, _ = answers.answer({"ask": "figure", "name": figure["key"], "is_chart": figure["is_chart"]})
            assert "problems" not in content, figure["key"]


def test_histories_are_answered() -> None:
    answers, run = Answers(result("run")), result("run").motion
    known, _ = answers.answer({"ask": "channels"})
    question = {"ask": "trace", "channels": ["force.gear"], "from": known["begin"], "to": known["end"], "points": 100}
    _, (buffer,) = answers.answer(question)
    ((_, values),) = arrays(buffer, 2)
    assert (values.min(), values.max()) == (run.trajectory.force[:, 2].min(), run.trajectory.force[:, 2].max())
    _, (marks,) = answers.answer({"ask": "impacts", "from": known["begin"], "to": known["end"], "points": 5000})
    ((time, *_),) = arrays(marks, 5)
    events = run.events
    np.testing.assert_array_equal(time, events.time[events.to_region.abs() > events.from_region.abs()])
    content, (wav,) = answers.answer({"ask": "sound"})
    assert content["gain"] == gr.listen(answers.motion).gain
    assert wav.startswith(b"RIFF")


@pytest.mark.parametrize(
    "question",
    [{"ask": "nothing"}, {"ask": "figure", "name": "none"}, {"ask": "trace", "channels": ["none"]}, {}],
)
def test_what_cannot_be_answered_is_a_problem(question: dict[str, Any]) -> None:
    content, buffers = Answers(result("run")).answer({"from": 0.0, "to": 1.0, "points": 50, **question})
    assert content["problems"]
    assert buffers == []


def test_without_anywidget_the_static_view_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notebook_widget, "find_spec", lambda _: None)
    shown = gr.view(result("modes"))
    assert shown.view["kind"] == "modes"
    assert "<script" not in shown._repr_html_()
    assert shown._repr_html_() == result("modes")._repr_html_()


def test_what_is_no_result_is_refused() -> None:
    with pytest.raises(gr.ModelError, match="is no result of gearrattle"):
        gr.view(3.0)
