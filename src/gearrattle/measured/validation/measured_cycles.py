"""The measured side of a comparison: checks of the record, and its cycles by its own clock."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.measured.validation import cycle_clock
from gearrattle.measured.validation.cycles import Cycles, Setting, Source, cut
from gearrattle.measured.validation.pairing import Pairing
from gearrattle.measured.validation.validation_arguments import Wanted
from gearrattle.model import Model
from gearrattle.model.table import listed

_ROUNDS = 4
_REMEDY = "set a steady speed, or compare orders over speed with validate_run_up"


def check_period(model: Model) -> None:
    """Refuse a model whose speed changes."""
    if model.excitation.sweep is not None:
        rule = "the speed changes along the run, so it has no period to compare by"
        raise ModelError(Problem(f"{model.name or 'model'}: excitation", "a sweep", rule, _REMEDY))


def check_names(pairing: Pairing, wanted: Wanted) -> None:
    """Refuse names that are no compared channel's."""
    names = [channel.name for channel in pairing.measured]
    by_channel = wanted.calibration if isinstance(wanted.calibration, Mapping) else {}
    names_by_argument = {"noise": list(wanted.noise), "calibration": list(by_channel)}
    names_by_argument["clock_by"] = [wanted.clock_by] if wanted.clock_by else []
    rule = f"is no measured channel that is compared; these are {listed(names)}"
    problems = [
        Problem(key, name, rule)
        for key, listed_names in names_by_argument.items()
        for name in listed_names
        if name not in names
    ]
    if problems:
        raise ModelError(problems)


def measured_cycles(source: Source, period: float, setting: Setting, wanted: Wanted) -> Cycles:
    """Cut the measured record into cycles as long as its own clock says."""
    bounds = (
        source.first if wanted.start is None else wanted.start,
        source.last if wanted.end is None else wanted.end,
    )
    cycles = cut(source, period, setting, bounds, whole_start=False)
    for _ in range(_ROUNDS):
        amplitudes = cycles.amplitudes()
        power = np.mean(cycles.values**2, axis=(0, 1))
        strongest = np.max(np.mean(np.abs(amplitudes) ** 2, axis=0), axis=0) / np.where(power > 0.0, power, np.inf)
        c = int(np.argmax(strongest))
        by_own = cycle_clock.period_by_clock(
            amplitudes[:, :, c], float(power[c]), cycles.period, refine=cycles.period != period
        )
        if by_own == cycles.period:
            break
        cycles = cut(source, by_own, setting, bounds, whole_start=False)
    return cycles
