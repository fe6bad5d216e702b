"""The edges of a box of parameters: a range of one value of the model, or of several that vary together.

Takes mappings; gives frozen edges.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.path_values import in_si
from gearrattle.model.quantity import AnyTable, checked
from gearrattle.model.table import shown
from gearrattle.studies.axes import listed_values

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
        by path its ends [SI].
    """

    name: str
    low: Mapping[str, float]
    high: Mapping[str, float]

    @property
    def path(self) -> str | None:
        """The one path that varies; None for several."""
        return next(iter(self.low)) if len(self.low) == 1 else None

    def coordinate(self, share: float) -> float:
        """Return the value at a share of the edge, 0 to 1; the share itself if several paths vary."""
        return self.at(share)[self.path] if self.path else share

    def at(self, share: float) -> dict[str, float]:
        """Return the values by path at a share of the edge, 0 to 1."""
        if share == 1.0:
            return dict(self.high)
        return {path: low + share * (self.high[path] - low) for path, low in self.low.items()}


def edges_of(requested: Mapping[str, Any], model: Model) -> tuple[Edge, ...]:
    """Read the edges of a box.

    Parameters
    ----------
    requested
        by path a pair (low, high); by another name a mapping from paths to such pairs, which vary together.
    model
        whose values they are.

    Raises
    ------
    ModelError
        no range, a path that leads nowhere or that no proof can vary, ends without sense; all of them.
    """
    problems: list[Problem] = []
    edges = []
    varied: set[str] = set()
    for name, entry in checked(AnyTable(), requested, "ranges").items():
        by_path = dict(entry) if isinstance(entry, Mapping) else {name: entry}
        ends: dict[str, tuple[float, float]] = {}
        for path, pair in by_path.items():
            try:
                ends[path] = _ends(str(path), pair, model)
            except ModelError as error:
                problems += [Problem(f"range {path}: {p.place}", p.value, p.rule, p.remedy) for p in error.problems]
        problems += _twice(varied, by_path)
        varied |= set(by_path)
        edges.append(Edge(str(name), *({path: pair[i] for path, pair in ends.items()} for i in (0, 1))))
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


def _ends(path: str, entry: Any, model: Model) -> tuple[float, float]:
    """Read the ends of one range."""
    pair = listed_values(entry)
    if len(pair) != 2:
        raise ModelError(Problem("ends", shown(entry), "must be a pair", "give (low, high)"))
    keys = path.split(".")
    if path not in SPEEDS and (keys[0] == "excitation" or keys[-1] not in _VARIED):
        varied = ", ".join(_VARIED)
        rule = f"a proof varies numbers that the driveline is linear in: {varied}, and the speed"
        raise ModelError(Problem("path", path, rule, "leave the model's own value, or split it with study"))
    low, high = (in_si(path, end, model) for end in pair)
    if any(isinstance(end, bool) or not isinstance(end, int | float) for end in (low, high)):
        raise ModelError(Problem("ends", f"{shown(low)} to {shown(high)}", "must be numbers"))
    if not low < high:
        raise ModelError(Problem("ends", f"{low:g} to {high:g}", "the lower end must lie below the upper one"))
    return float(low), float(high)
