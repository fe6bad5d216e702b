"""How often the advice's forecasts come true: ``python -m benchmarks.advice``.

Writes docs/reference/advice.md: every forecast of ``gr.advise`` on drivelines drawn anew
(``benchmarks.drivelines``), scored against a run of 200 cycles, the first 100 discarded.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path

import gearrattle as gr
from benchmarks.drivelines import drawn
from gearrattle.advice import Score

PAGE = Path(__file__).resolve().parents[1] / "docs" / "reference" / "advice.md"
CYCLES, DISCARD = 200, 100
TIMES = "computing time"

HEAD = """\
# How often forecasts come true

Written by `make advice` on {date}; do not edit.

{count} drivelines: the paper's seven and two more examples, as they are and with loads, speeds and gaps drawn anew
(loads by factors of 1/4 to 4, speed and gaps of 1/2 to 2). Each was advised on, then run exactly for {cycles} cycles
of which the last {judged} are judged. *Right* is fixed beforehand: words the same, mean slopes within 0.1, counts and
times within a factor of two.

| foretold | by | right | of | share |
|---|---|---|---|---|
"""

TAIL = """
The wrong ones, computing times left out:

| driveline | foretold | of | by | forecast | happened |
|---|---|---|---|---|---|
"""


def tried(drivelines: Iterable[tuple[str, gr.Model]], cycles: int, discard: int) -> list[tuple[str, Score]]:
    """Advise on every driveline, run it, and score."""
    outcomes = []
    for name, model in drivelines:
        planned = {"cycles": cycles, "discard": discard, "samples_per_cycle": 64}
        advice = gr.advise(model, **planned)
        outcomes += [(name, score) for score in advice.scores(gr.simulate(model, **planned))]
    return outcomes


def shares(scores: Sequence[tuple[str, Score]]) -> dict[tuple[str, str], tuple[int, int]]:
    """Right ones and all, by quantity and route."""
    shares: dict[tuple[str, str], list[bool]] = defaultdict(list)
    for _, score in scores:
        shares[score.forecast.quantity, score.forecast.by].append(score.right)
    return {key: (sum(right), len(right)) for key, right in shares.items()}


def _value(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.3g}"


def main() -> None:
    """Try all and write the page."""
    drivelines = list(drawn())
    scores = tried(drivelines, CYCLES, DISCARD)
    date = datetime.now(UTC).date().isoformat()
    text = HEAD.format(date=date, count=len(drivelines), cycles=CYCLES, judged=CYCLES - DISCARD)
    for (quantity, route), (right, total) in shares(scores).items():
        text += f"| {quantity} | {route} | {right} | {total} | {100.0 * right / total:.0f} % |\n"
    text += TAIL
    for name, score in scores:
        forecast = score.forecast
        if not score.right and forecast.quantity != TIMES:
            text += (
                f"| {name} | {forecast.quantity} | {forecast.subject} | {forecast.by} | {_value(forecast.value)} | "
                f"{_value(score.happened)} |\n"
            )
    PAGE.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
