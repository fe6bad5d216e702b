"""The edges of a box of parameters: a range of one value of the model, or of several that vary together.

A path may be a pattern, and ends may be factors of what the model says, as in studies.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.factors import FACTOR
from gearrattle.model.path_values import Varied
from gearrattle.model.table import shown
from gearrattle.model.value_kinds import AnyTable, checked
from gearrattle.studies.study_axes import listed_values, without_factor

SPEEDS = ("excitation.speed", "excitation.frequency")
"""Paths of the reference speed."""
_VARIED = (
    "J",
    "drag",
    "drag_torque",
    "stiffness",
    "damping",
    "clearance",
    "backlash",
    "preload",
    "stiffness_ratio",
    "damping_ratio",
    "until",
    "hysteresis",
    "stick_stiffness",
    "mean",
    "amplitude",
)
"""Keys whose numbers the coefficients of the driveline are proportional to."""


@dataclass(frozen=True)
class Edge:
    """One edge of a box.

    Attributes
    ----------
    name
        its path, or what the user calls several paths together.
    low, high
        by plain path its ends [SI].
    factors
        its ends as factors, where all values that vary together have the same; None elsewhere.
    """

    name: str
    low: Mapping[str, float]
    high: Mapping[str, float]
    factors: tuple[float, float] | None = None

    @property
    def path(self) -> str | None:
        """The one path that varies; None for several."""
        return next(iter(self.low)) if len(self.low) == 1 else None

    def coordinate(self, share: float) -> float:
        """Return the value or the factor at a share of the edge, 0 to 1; the share itself if several paths vary."""
        if self.factors is not None:
            low, high = self.factors
            return low + share * (high - low)
        return self.at(share)[self.path] if self.path else share

    def at(self, share: float) -> dict[str, float]:
        """Return the values by path at a share of the edge, 0 to 1."""
        if share == 1.0:
            return dict(self.high)
        return {path: low + share * (self.high[path] - low) for path, low in self.low.items()}


def edges_of(requested: Mapping[str, Any], model: Model) -> tuple[Edge, ...]:
    """Read the edges of a box: pairs (low, high) by path, or by another name a mapping of paths that vary together.

    A ModelError has every edge without a range, every path that leads nowhere or that no proof can vary, and all ends
    without sense.
    """
    problems: list[Problem] = []
    edges = []
    varied: set[str] = set()
    # one path, or several that vary together under a name
    for name, entry in checked(AnyTable(), requested, "ranges").items():
        by_path = dict(entry) if isinstance(entry, Mapping) and FACTOR not in entry else {name: entry}
        ends: dict[str, tuple[float, float]] = {}
        factors: set[tuple[float, float] | None] = set()
        # ends of every path
        for path, pair in by_path.items():
            try:
                plain, factor = _ends(str(path), pair, model)
            except ModelError as error:
                problems += [Problem(f"range {path}: {p.place}", p.value, p.rule, p.remedy) for p in error.problems]
                continue
            problems += _twice(varied, plain)
            varied |= set(plain)
            ends |= plain
            factors.add(factor)
        low, high = ({path: pair[i] for path, pair in ends.items()} for i in (0, 1))
        edges.append(Edge(str(name), low, high, factors.pop() if len(factors) == 1 else None))
    # at least one range, the speed once
    if not problems and not edges:
        rule = "a box needs one range at least"
        problems.append(Problem("ranges", "none", rule, 'such as {"inertia.gear.drag_torque": (0.1, 0.2)}'))
    if set(SPEEDS) <= varied:
        problems.append(Problem("ranges", ", ".join(SPEEDS), "are one quantity", "leave one of them out"))
    if problems:
        raise ModelError(problems)
    return tuple(edges)


def _twice(varied: set[str], by_path: Mapping[str, Any]) -> Iterator[Problem]:
    """Yield a problem for every path that has a range already."""
    for path in by_path:
        if path in varied:
            yield Problem(f"range {path}", "", "has a range already", "leave one of them out")


def _ends(path: str, entry: Any, model: Model) -> tuple[dict[str, tuple[float, float]], tuple[float, float] | None]:
    """Read the ends of one range: by plain path, and as factors where they are some."""
    inner, by_factor = without_factor(path, entry)
    pair = listed_values(inner)
    if len(pair) != 2:
        raise ModelError(Problem("ends", shown(entry), "must be a pair", "give (low, high)"))
    keys = path.split(".")
    if path not in SPEEDS and (keys[0] == "excitation" or keys[-1] not in _VARIED):
        varied = ", ".join(_VARIED)
        rule = f"a proof varies numbers that the driveline is linear in: {varied}, and the speed"
        raise ModelError(Problem("path", path, rule, "leave the model's own value, or split it with study"))
    asked = Varied(path, by_factor)
    low, high = (asked.read(end, model) for end in pair)
    if any(isinstance(end, bool) or not isinstance(end, int | float) for end in (low, high)):
        raise ModelError(Problem("ends", f"{shown(low)} to {shown(high)}", "must be numbers"))
    if not low < high:
        raise ModelError(Problem("ends", f"{low:g} to {high:g}", "the lower end must lie below the upper one"))
    plain = {one: (float(min(values)), float(max(values))) for one, values in asked.spread((low, high), model).items()}
    return plain, (float(low), float(high)) if by_factor else None
