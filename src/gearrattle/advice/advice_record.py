"""Records of an advice: lines with their evidence, and forecasts that a run confirms or refutes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any, ClassVar

from gearrattle.advice.forecasts import Forecast, Score, scored
from gearrattle.json_types import Json, json_value
from gearrattle.result import Result
from gearrattle.results import Run


@dataclass(frozen=True)
class Line:
    """One piece of advice.

    Attributes
    ----------
    topic
        "lumping", "scaling", "stiffness", "clearances", "contact ratios", "algorithm", "cost", "predictability" or
        "other motions".
    words
        what to do, in a sentence or two.
    evidence
        sentences on the evidence.
    """

    topic: str
    words: str
    evidence: tuple[str, ...] = ()


@dataclass(frozen=True)
class Advice(Result):
    """Advice before simulating a driveline.

    Attributes
    ----------
    model
        name of the driveline.
    lines
        lines of advice, in the order of the procedure.
    forecasts
        forecasts of quantities of a run with these settings.
    notes
        notes, for example that another motion exists at this load.

    Examples
    --------
    >>> gr.advise(gr.example("case3"), cycles=20).line("clearances").topic
    'clearances'
    """

    kind: ClassVar[str] = "advice"
    model: str
    lines: tuple[Line, ...]
    forecasts: tuple[Forecast, ...]
    notes: tuple[str, ...] = ()

    def line(self, topic: str) -> Line:
        """The line on a topic."""
        return next(line for line in self.lines if line.topic == topic)

    def scores(self, run: Run) -> tuple[Score, ...]:
        """Return every forecast that the run decides, with the value in the run.

        Raises
        ------
        ModelError
            the run has no cycle after the discarded cycles.
        """
        return scored(self.forecasts, run)

    def to_dict(self) -> dict[str, Json]:
        """Return the advice in JSON types."""
        return {
            "model": self.model,
            "lines": json_value(self.lines),
            "forecasts": json_value(self.forecasts),
        }


def scores_dict(scores: Iterable[Score]) -> list[dict[str, Any]]:
    """Return scores in JSON types: the forecast's fields, and happened, right, rule."""
    return [
        json_value({**asdict(score.forecast), "happened": score.happened, "right": score.right, "rule": score.rule})
        for score in scores
    ]
