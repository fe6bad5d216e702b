"""Interactive view of a result in a notebook: tabs, figures to zoom, histories, sound.

It is an anywidget with the same JavaScript as the page. Its requests go to the kernel of the notebook, in the same
messages as the requests of the page to the server. Without anywidget the static view of the result is shown.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable
from functools import cache, cached_property
from importlib.util import find_spec
from typing import Any, Protocol

from gearrattle.errors import GearRattleError, ModelError, Problem, shown_problems
from gearrattle.json_types import json_value
from gearrattle.orbits import Branch
from gearrattle.pipeline import Findings
from gearrattle.report.browser import widgets
from gearrattle.report.notebook_view import notebook_view
from gearrattle.report.plots.interactive import chart_json
from gearrattle.report.result_kinds import presentation_of
from gearrattle.results import Run
from gearrattle.workbench.traces import Hits, InMemory, described, packed
from gearrattle.workbench.views import motions_json, view_of

Answer = tuple[dict[str, Any], list[bytes]]


class Shown(Protocol):
    """View of a result in a notebook: sections, tables and names of figures, in JSON types."""

    view: dict[str, Any]


class Static:
    """A result as a notebook shows it without anywidget: a ``Shown``."""

    def __init__(self, result: Any) -> None:
        self.view: dict[str, Any] = json_value(view_of(presentation_of(result)))
        self._html = notebook_view(result)

    def _repr_html_(self) -> str:
        """Return the static view."""
        return self._html


class Answers:
    """Answers to the requests of a notebook's widget about one result, and the run behind it, if any."""

    def __init__(self, result: Any) -> None:
        self.presentation = presentation_of(result)
        motion = result.motion if isinstance(result, Findings) else result
        self.motion: Run | None = motion if isinstance(motion, Run) else None

    def answer(self, question: dict[str, Any]) -> Answer:
        """Return content and buffers for a question; what is refused becomes its problems."""
        asked: dict[str, Callable[[dict[str, Any]], Answer]] = {
            "figure": self._figure,
            "motions": self._motions,
            "channels": self._channels,
            "trace": self._trace,
            "impacts": self._impacts,
            "sound": self._sound,
        }
        try:
            return asked[str(question["ask"])](question)
        except ModelError as error:
            return {"problems": [problem.to_dict() for problem in shown_problems(error.problems)]}, []
        except (GearRattleError, KeyError, StopIteration) as error:
            return {"problems": [Problem("view", "", str(error) or "there is no such thing").to_dict()]}, []

    def _figure(self, question: dict[str, Any]) -> Answer:
        if question.get("is_chart", True):
            chart = next(chart for chart in self.presentation.charts() if chart.key == question["name"])
            return {"chart": chart_json(chart)}, []
        pictures = [picture for section in self.presentation.sections() for picture in section.pictures]
        svg = next(picture.svg for picture in pictures if picture.key == question["name"])
        return {"svg": f"data:image/svg+xml;base64,{b64encode(svg).decode('ascii')}"}, []

    def _motions(self, question: dict[str, Any]) -> Answer:
        del question
        return {"motions": self._at_points}, []

    @cached_property
    def _at_points(self) -> dict[str, Any] | None:
        branch = self.presentation.result
        if not isinstance(branch, Branch):
            raise ModelError(Problem("view", self.presentation.kind, "has no branches of motions"))
        motions: dict[str, Any] | None = json_value(motions_json(branch))
        return motions

    @cached_property
    def _source(self) -> InMemory:
        return InMemory.of_run(self._run)

    @cached_property
    def _hits(self) -> Hits:
        return Hits.of_run(self._run)

    @property
    def _run(self) -> Run:
        if self.motion is None:
            raise ModelError(Problem("view", self.presentation.kind, "has no histories"))
        return self.motion

    def _channels(self, question: dict[str, Any]) -> Answer:
        del question
        return described(self._source, self._hits), []

    def _trace(self, question: dict[str, Any]) -> Answer:
        begin, end, points = (question[name] for name in ("from", "to", "points"))
        traces = [self._source.trace(name, begin, end, points) for name in question["channels"]]
        return {}, [packed(traces)]

    def _impacts(self, question: dict[str, Any]) -> Answer:
        marks = self._hits.within(question["from"], question["to"], question["points"])
        return {}, [packed([(marks.time, marks.clearance, marks.velocity, marks.energy, marks.count)])]

    def _sound(self, question: dict[str, Any]) -> Answer:
        from gearrattle.report.sound.listen import listen

        del question
        sound = listen(self._run)
        gain = sound.gain if sound.pressure[0].any() else None
        return {"gain": gain}, [sound.wav(sound.names[0], 24)]


@cache
def _widget_class() -> Any:
    """Return the class of the widget; anywidget is imported here."""
    from anywidget import AnyWidget
    from traitlets import Bool, Dict, List, Unicode

    class View(AnyWidget):
        """A result as an anywidget; ``chosen`` holds what was clicked in a map, or in branches."""

        # state shared with the browser
        _esm = widgets.text("result")
        _css = widgets.style()
        view = Dict().tag(sync=True)
        chosen = Dict(allow_none=True, default_value=None).tag(sync=True)
        selected = List(Unicode()).tag(sync=True)
        tab = Unicode("").tag(sync=True)
        has_histories = Bool(False).tag(sync=True)
        has_sound = Bool(False).tag(sync=True)
        has_cases = Bool(False).tag(sync=True)

        # questions of the browser over the kernel
        def __init__(self, answers: Answers, **values: Any) -> None:
            super().__init__(**values)
            self._answers = answers
            self.on_msg(self._asked)

        def _asked(self, _: Any, question: dict[str, Any], buffers: list[Any]) -> None:
            """Answer a question of the browser."""
            del buffers
            content, answered = self._answers.answer(question)
            self.send({**content, "id": question.get("id")}, answered)

    return View


def view(result: object) -> Shown:
    """Show a result in a notebook as the workbench does: figures to zoom, histories, impacts, sound.

    Parameters
    ----------
    result
        what a function of gearrattle returned: a run, modes, a study, a comparison, ...

    Returns
    -------
    Shown
        An anywidget, or without the extra ``workbench`` what shows the result without interaction. ``view`` is what it
        shows, in JSON types; of an anywidget ``chosen`` is where a map was clicked, or the ``point`` of branches that
        was, for ``branch.orbit``.

    Raises
    ------
    ModelError
        it is no result of gearrattle.

    Examples
    --------
    >>> shown = gr.view(gr.modes(gr.example("case3")))
    >>> shown.view["kind"]
    'modes'
    """
    if find_spec("anywidget") is None:
        return Static(result)
    answers = Answers(result)
    shown: dict[str, Any] = json_value(view_of(answers.presentation))
    is_motion = answers.motion is not None
    sounds = answers.motion is not None and answers.motion.model.units == "SI"
    has_cases = answers.presentation.kind == "study"
    made: Shown = _widget_class()(answers, view=shown, has_histories=is_motion, has_sound=sounds, has_cases=has_cases)
    return made
