"""A threshold as a result: the value from which the driveline is quiet, and the hardest impact along the scan."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.design.target import QUIET
from gearrattle.design.threshold import Threshold
from gearrattle.model.path_labels import in_shown_unit
from gearrattle.report.plots.chart import Band, Chart, Key, Line, Panel, Rule
from gearrattle.report.plots.palette import ACCENT, COAST, COLOURS, MUTED
from gearrattle.report.presentation import Presentation
from gearrattle.report.tables import Table
from gearrattle.studies.output import ENERGY
from gearrattle.wording import counted, engineering, listed

if TYPE_CHECKING:
    import xarray as xr

_NOT_TRIED = "not tried"
_WORDS = {"rest": "from rest", "before": "from the motion before", "pushed": "after a push"}
_COLOURS = {"rest": ACCENT, "before": COAST, "pushed": COLOURS[2]}
_HARDER = 1.5  # times the hardest impact of the model itself: then it is said


class ThresholdPage(Presentation[Threshold]):
    """Where a driveline becomes quiet, or reaches another target."""

    kind = "threshold"
    is_interactive = True

    @property
    def title(self) -> str:
        return f"Threshold of the {self.result.variable.words}"

    @property
    def sentence(self) -> str:
        result = self.result
        words = result.variable.words
        subject = f"{words[:1].upper()}{words[1:]}"
        parts = [f"{subject}: {self._where()}"]
        if own := self._own_words():
            parts.append(own)
        if harder := self._harder_words():
            parts.append(harder)
        if coexisting := self._coexisting_words():
            parts.append(coexisting)
        if result.proven is not None:
            low, high = (result.variable.shown(end) for end in result.proven)
            parts.append(f"Proven: from {low} to {high} a quiet motion exists and is stable.")
        return " ".join(parts)

    def _coexisting_words(self) -> str:
        """Where the target holds of some motions and not of others."""
        rows = [row for row in self._rows() if row.coexist]
        if not rows:
            return ""
        values = listed([self.result.variable.shown(row.value) for row in rows[:4]])
        return f"Motions coexist at {values}: there it depends on where the motion comes from."

    def _where(self) -> str:
        """Where the target holds."""
        result = self.result
        shown = result.variable.shown
        target = result.target.words
        if result.bracket is None or result.value is None:
            low = shown(result.variable.low)
            high = shown(result.variable.high)
            always = bool(self._holds().all()) if self._holds().size else False
            return f"{'' if always else 'not '}{target} at any value from {low} to {high}."
        holding = result.value
        (failing,) = {*result.bracket} - {holding}
        side = "from" if holding > failing else "up to"
        more = [(below, above, holds) for below, above, holds in result.brackets if (below, above) != result.bracket]
        words = f"{target} {side} {shown(holding)} on, not at {shown(failing)}."
        if side == "up to":
            words = f"{target} up to {shown(holding)}, not at {shown(failing)}."
        if more:
            words += f" The answer changes {counted(len(more), 'time')} more within the range."
        return words

    def _own_words(self) -> str:
        """What the model itself does."""
        variable = self.result.variable
        if variable.own is None or not self._rows():
            return ""
        row = next((row for row in self._rows() if row.value == variable.own), None)
        if row is None:
            return ""
        hardest = f", hardest impact {engineering(row.energy, self._unit)} at {row.part}" if row.energy > 0.0 else ""
        return f"As the model is ({variable.shown(variable.own)}) it {_verb(row.word)}{hardest}."

    def _harder_words(self) -> str:
        """Where it hits harder than the model itself."""
        variable = self.result.variable
        rows = self._rows()
        own = next((row for row in rows if row.value == variable.own), None)
        if own is None or not own.energy > 0.0:
            return ""
        harder = [row for row in rows if row.energy > _HARDER * own.energy]
        if not harder:
            return ""
        hardest = max(harder, key=lambda row: row.energy)
        values = listed([variable.shown(row.value) for row in harder[:4]])
        return f"It hits harder at {values}: up to {engineering(hardest.energy, self._unit)}."

    def figures(self) -> tuple[Chart, ...]:
        chart = self._chart()
        return () if chart is None else (chart,)

    def answer(self) -> tuple[Table, ...]:
        variable = self.result.variable
        all_rows = self._rows()
        # an event has one start
        starts = [j for j in range(len(_WORDS)) if any(row.words[j] != _NOT_TRIED for row in all_rows)]
        names = list(_WORDS.values())
        rows = [
            (
                variable.shown(row.value),
                *(row.words[j] for j in starts),
                engineering(row.energy, self._unit) if row.energy > 0.0 else "-",
                row.part,
            )
            for row in all_rows
        ]
        head = ("value", *(names[j] for j in starts), "hardest impact", "part")
        texts = frozenset({*range(1, len(starts) + 1), len(starts) + 2})
        return (Table(head, tuple(rows), texts, title="What was simulated"),)

    def content(self) -> dict[str, Any]:
        result = self.result
        variable = result.variable
        return {
            "path": variable.path,
            "words": variable.words,
            "unit": variable.unit,
            "until": result.target.words,
            "range": [variable.low, variable.high],
            "own": variable.own,
            "value": result.value,
            "bracket": None if result.bracket is None else list(result.bracket),
            "brackets": [{"low": low, "high": high, "holds_above": holds} for low, high, holds in result.brackets],
            "proven": result.proven,
            "scan": [
                {
                    "value": row.value,
                    "holds": row.holds,
                    **dict(zip(_WORDS, row.words, strict=True)),
                    "hardest_impact_energy": row.energy,
                    "part": row.part,
                }
                for row in self._rows()
            ],
        }

    def numbers(self) -> xr.Dataset:
        return self.result.scan

    @property
    def _unit(self) -> str:
        """The unit of energies; none in a model without units."""
        unit = self.result.target.output_named(ENERGY).unit
        return unit[0] if unit and unit[0] != "1" else ""

    def _holds(self) -> Any:
        """Whether the target holds at every value."""
        return np.array([row.holds for row in self._rows()])

    def _rows(self) -> list[_Row]:
        """What every value showed."""
        # energies of parts with a gap
        scan = self.result.scan
        output = self.result.target.severity
        energies = np.nan_to_num(np.asarray(scan[ENERGY].values), nan=0.0)
        parts = [str(name) for name in scan["part"].values]
        gaps = np.isin(parts, output.gaps)
        rows = []
        for i, value in enumerate(scan["value"].values.tolist()):
            # severity by start of the motion
            tried = np.asarray(scan["holds"].values[i]) >= 0
            codes = np.asarray(scan[output.name].values[i])[:, gaps].max(axis=-1, initial=-1)
            words = tuple(
                output.words[int(code)].replace("_", " ") if was_tried else _NOT_TRIED
                for code, was_tried in zip(codes, tried, strict=True)
            )
            # the hardest impact of all starts
            of_parts = np.where(gaps, energies[i][tried].max(axis=0, initial=0.0), 0.0)
            worst = int(np.argmax(of_parts)) if of_parts.size else 0
            energy = float(of_parts[worst]) if of_parts.size else 0.0
            # whether the target holds of all motions, or of some
            reached = np.asarray(scan["holds"].values[i])[tried] == 1
            holds = bool(reached.size and reached.all())
            coexist = bool(reached.any() and not reached.all())
            word = output.words[int(codes.max(initial=0))]
            rows.append(_Row(value, words, word, energy, parts[worst] if energy > 0.0 else "", holds, coexist))
        return rows

    def _chart(self) -> Chart | None:
        """The hardest impact over the value, one line per start, and the threshold."""
        # energies of the hardest impacts over the variable, in its shown unit
        result = self.result
        scan = result.scan
        variable = result.variable
        factor, unit = in_shown_unit(variable.path, variable.unit, max(abs(variable.low), abs(variable.high)))
        x = np.asarray(scan["value"].values) * factor
        energies = np.asarray(scan[ENERGY].values)
        gaps = np.isin([str(name) for name in scan["part"].values], result.target.severity.gaps)
        lines = []
        legend = []
        # a curve for every start of the motion
        for j, start in enumerate(_WORDS):
            tried = np.asarray(scan["holds"].values[:, j]) >= 0
            hardest = np.nan_to_num(energies[:, j][:, gaps], nan=0.0).max(axis=-1, initial=0.0)
            shown = np.where(tried & (hardest > 0.0), hardest, np.nan)
            if np.isfinite(shown).any():
                lines += [
                    Line(x[tried], shown[tried], _WORDS[start], _COLOURS[start]),
                    Line(x[tried], shown[tried], _WORDS[start], _COLOURS[start], "points", 5.0),
                ]
                legend.append(Key(_WORDS[start], _COLOURS[start]))
        if not lines:
            return None
        # bands where the target holds and where quiet is proven; rules at the threshold and the model's own value
        seen = [float(y) for line in lines for y in line.y if np.isfinite(y)]
        bands = []
        rules = []
        for low, high in self._where_it_holds():
            bands.append(Band(low * factor, high * factor, COLOURS[1], "x", 0.12))
        if result.proven is not None:
            low, high = result.proven
            bands.append(Band(low * factor, high * factor, COLOURS[2], "x", 0.07))
        if result.value is not None:
            words = f"{result.target.words}: {variable.shown(result.value)}"
            rules.append(Rule(result.value * factor, "x", MUTED, label=words))
        if variable.own is not None:
            rules.append(Rule(variable.own * factor, "x", MUTED, dashed=False, label="the model"))
        holds = "is quiet" if result.target.words == QUIET else "reaches the target"
        caption = (
            f"Energy of the hardest impact of all parts over the {variable.words}, by where the motion began. "
            f"Shaded: every motion that was tried {holds}."
            f"{' Lightly shaded: a quiet motion is proven to exist and to be stable.' if result.proven else ''}"
        )
        # logarithmic axis of energies
        words = variable.words
        panel = Panel(
            "Hardest impact",
            self._unit,
            f"{words[:1].upper()}{words[1:]}{f' [{unit}]' if unit else ''}",
            tuple(lines),
            bands=tuple(bands),
            rules=tuple(rules),
            x_log=variable.is_log,
            y_log=True,
            x_range=(float(x[0]), float(x[-1])),
            y_range=(0.5 * min(seen), 2.0 * max(seen)),
        )
        return Chart("threshold", "Threshold", caption, (panel,), panel_height=300, share_x=False, legend=tuple(legend))

    def _where_it_holds(self) -> list[tuple[float, float]]:
        """Ranges between neighbouring values at which the target holds."""
        rows = self._rows()
        return [(one.value, other.value) for one, other in pairwise(rows) if one.holds and other.holds]


def _verb(word: str) -> str:
    """A verdict as what a driveline does."""
    return word if word.endswith("s") else f"is {word}"


@dataclass(frozen=True)
class _Row:
    """What one value showed.

    ``words`` say how bad it was, by start; the energy is that of the hardest impact [J]. ``holds`` is true where the
    target holds of every motion, ``coexist`` where it holds of some and not of others.
    """

    value: float
    words: tuple[str, ...]
    word: str
    energy: float
    part: str
    holds: bool
    coexist: bool
