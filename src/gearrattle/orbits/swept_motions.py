"""What sweeps over a value of a model show: the motions going up and going down, and the jumps between them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.orbits.exact_runs import ExactRun


@dataclass(frozen=True)
class Jump:
    """Between two neighbouring values of a sweep the motion changes abruptly.

    Attributes
    ----------
    upward
        whether the value grows.
    before, after
        the motions, in the order of the sweep.
    clearance
        index of the clearance whose rms changes most.
    has_return
        whether the other direction shows the other motion on one side: the jump back lies elsewhere.
    kind, located
        of the event on a branch with which it was located, and its value [SI]; empty and NaN where it was not.
    """

    upward: bool
    before: ExactRun
    after: ExactRun
    clearance: int
    has_return: bool
    kind: str = ""
    located: float = np.nan

    @property
    def value(self) -> float:
        """The middle of its bracket, or where it was located [SI]."""
        return 0.5 * (self.before.value + self.after.value) if np.isnan(self.located) else self.located

    @property
    def error(self) -> float:
        """Half the width of its bracket [SI]; 0 where it was located."""
        return 0.5 * abs(self.after.value - self.before.value) if np.isnan(self.located) else 0.0


@dataclass(frozen=True)
class Sweeps:
    """What sweeps over a value show.

    Attributes
    ----------
    up, down
        the motions, by ascending values; going up and going down.
    jumps
        by ascending values.
    ends
        of the range, ascending [SI].
    is_complete
        whether all of the work was done.
    failures
        values at which no run could be followed [SI], and why.
    """

    up: tuple[ExactRun, ...]
    down: tuple[ExactRun, ...]
    jumps: tuple[Jump, ...]
    ends: tuple[float, float]
    is_complete: bool
    failures: tuple[tuple[float, str], ...] = ()

    @property
    def of_both(self) -> list[tuple[ExactRun, ExactRun]]:
        """The motions at the values that both directions have reached: going up, and going down."""
        down = {run.value: run for run in self.down}
        return [(run, down[run.value]) for run in self.up if run.value in down]

    @property
    def values(self) -> list[float]:
        """The values at which a motion is known, ascending [SI]."""
        return sorted({run.value for run in (*self.up, *self.down)})

    @property
    def coexistence(self) -> list[tuple[float, float]]:
        """Ranges in which both directions show different motions: from the first such value to the last [SI]."""
        ranges: list[tuple[float, float]] = []
        was_two = False
        for up, down in self.of_both:
            is_two = up.differs(down)
            if is_two and was_two:
                ranges[-1] = ranges[-1][0], up.value
            elif is_two:
                ranges.append((up.value, up.value))
            was_two = is_two
        return ranges

    def variables(self, of_value: Mapping[str, Any], of_deflection: Mapping[str, Any]) -> dict[str, Any]:
        """Return the motions and the jumps as variables of a Dataset, with the attributes of values and deflections."""
        runs = [*self.up, *self.down]
        along = "motion"
        by_clearance = ("motion", "clearance")
        clearances = len(runs[0].rms) if runs else 0

        def of_clearances(name: str) -> NDArray[np.float64]:
            return np.array([getattr(run, name) for run in runs]).reshape(len(runs), clearances)

        # the motions of both directions, and the jumps
        motions = {
            "swept_value": (along, np.array([run.value for run in runs]), of_value),
            "swept_upward": (along, np.arange(len(runs)) < len(self.up)),
            "swept_cycles": (along, np.array([run.cycles for run in runs], dtype=np.int64)),
            "swept_periods": (along, np.array([run.periods for run in runs], dtype=np.int64)),
            "swept_verdict": (along, np.array([run.headline for run in runs], dtype=np.str_)),
            "swept_rms": (by_clearance, of_clearances("rms"), of_deflection),
            "swept_swing": (by_clearance, of_clearances("swing"), of_deflection),
            "swept_impacts": (by_clearance, of_clearances("impacts")),
        }
        jumps = {
            "jump_value": ("jump", np.array([jump.value for jump in self.jumps]), of_value),
            "jump_error": ("jump", np.array([jump.error for jump in self.jumps]), of_value),
            "jump_upward": ("jump", np.array([jump.upward for jump in self.jumps], dtype=np.bool_)),
            "jump_clearance": ("jump", np.array([jump.clearance for jump in self.jumps], dtype=np.int64)),
            "jump_kind": ("jump", np.array([jump.kind for jump in self.jumps], dtype=np.str_)),
        }
        return motions | jumps
