"""``threshold``: the smallest change at which a driveline becomes quiet.

First the range is scanned, because more drag or less backlash need not mean less rattle. Every value is simulated from
rest, from the motion of its neighbour and, if both are quiet, from a push (``motions``). Then the interval between two
neighbours with different answers is halved by exact runs until it is narrow enough. A value counts as *quiet* only if
all motions simulated there are quiet.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import takewhile
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gearrattle.assembly import refuse_but_events
from gearrattle.design.halving import Report, Search, Tried, Work
from gearrattle.design.motions import STARTS, starts_of
from gearrattle.design.target import QUIET, Target, target_of
from gearrattle.design.variable import Variable, variable_of
from gearrattle.errors import ModelError
from gearrattle.model import Model, check_model
from gearrattle.model.value_kinds import CALLBACK, Count, Plain, check_arguments
from gearrattle.result import Result
from gearrattle.simulation.settings import settled
from gearrattle.studies.quiet import prove_quiet
from gearrattle.studies.schedulers import check_scheduler

if TYPE_CHECKING:
    import xarray as xr

COUNT = 7  # values of the scan
WIDTH = 0.01  # width of a bracket, as a share of the value
_PROOF_SECONDS = 5.0  # time limit of a proof [s]
_BEFORE = 0.5  # length of a proof's range beyond the threshold, as a share of the quiet range
STOPPED = "stopped before the end: what is missing was not simulated."
_VALUES = Count(3, 1000)
_WIDTHS = Plain("positive")
Progress = Callable[[float], None]


@dataclass(frozen=True)
class Threshold(Result):
    """The value at which a driveline becomes quiet, or reaches another target.

    Attributes
    ----------
    value
        the nearest value to the model's own at which the answer changes, on the side where the target holds [SI, or a
        factor]; None where it does not change within the range.
    bracket
        (low, high): the two values between which the answer changes there; ``value`` is one of them. None if
        ``value`` is None.
    brackets
        every change of the answer along the range, ascending: (lower value, upper value, whether the target holds
        at the upper value).
    variable
        the variable that was changed.
    target
        the target.
    scan
        all simulated motions as a Dataset over "value" and "start": whether the target holds, the severity and the
        hardest impact of every part; -1 and NaN if a start was not simulated.
    proven
        the part of the range for which a quiet motion is proven to exist and to be stable (``prove_quiet``); None if
        there is no such proof.
    notes
        sentences that the user must know.
    """

    value: float | None
    bracket: tuple[float, float] | None
    brackets: tuple[tuple[float, float, bool], ...]
    variable: Variable
    target: Target
    scan: xr.Dataset = field(repr=False, compare=False)
    proven: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()

    kind: ClassVar[str] = "threshold"


def threshold(
    model: Model,
    path: str,
    range: tuple[object, object],
    until: str = "quiet",
    *,
    count: int = COUNT,
    width: float = WIDTH,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Threshold:
    """Find the smallest change of one value at which a driveline is quiet, by exact runs.

    Parameters
    ----------
    model
        the driveline; its settings hold for every run.
    path
        path of the value in the model file.
    range
        two ends of the range, as in a model file; the model's own value is tried first, if it lies between them.
    until
        "quiet", or an output of studies against a number in SI or with a unit: "largest impact energy < 0.1 mJ" (of
        the worst part), "m5: largest approach speed < 5 mm/s".
    count
        number of values of the scan.
    width
        width of the bracket, as a share of the value.
    workers
        number of threads; None: the number of cores.
    progress
        called with the finished share. If it raises ``Cancelled``, the result so far is returned.

    Raises
    ------
    ModelError
        anything wrong with the arguments; nothing has been simulated then.
    ConvergenceError
        the model itself cannot be simulated.

    Examples
    --------
    >>> model = gr.example("backlash_oscillator")
    >>> answer = gr.threshold(model, "coupling.mesh.kinematic_error.0.amplitude", (0.02, 0.06), workers=1)
    >>> f"{answer.value:.3f}", answer.variable.own
    ('0.040', 0.05)
    """
    check_model(model)
    check_arguments(count=(_VALUES, count), width=(_WIDTHS, width), progress=(CALLBACK, progress))
    check_scheduler(None, workers)
    refuse_but_events(model, "a threshold")
    base = settled(model, {})
    variable = variable_of(base, path, range)
    target = target_of(base, until)
    work = Work(count, width, starts=starts_of(base))
    search = Search(base, variable, target, work, Report(progress, float(len(work.starts) * count)))
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        changes = search.run(pool)
    return _result(search, changes)


def _proven(search: Search, failing: float, holding: float) -> tuple[float, float] | None:
    """Return the longest part of the range for which a quiet motion is proven; None if there is none.

    The proof covers the quiet neighbours, and a part of the range on the other side of the threshold, because a quiet
    motion may exist there beside motions that rattle.
    """
    variable = search.variable
    way = search.tried if holding > failing else search.tried[::-1]
    behind = [variant for variant in way if (variant.value - holding) * (holding - failing) >= 0.0]
    far = [variant.value for variant in takewhile(lambda variant: variant.holds, behind)][-1]
    near = holding - _BEFORE * (far - holding)
    low = max(min(near, far), variable.low)
    high = min(max(near, far), variable.high)
    try:
        ends = (variable.change(low), variable.change(high))
        proof = prove_quiet(search.model, {variable.path: ends}, within=_PROOF_SECONDS)
    except ModelError:  # no proof is possible for this path or driveline
        return None
    boxes = proof.boxes[proof.boxes["status"] == "proven"]
    # join neighbouring boxes
    parts: list[list[float]] = []
    for begin, end in sorted(zip(boxes[f"{variable.path} low"], boxes[f"{variable.path} high"], strict=True)):
        if parts and begin <= parts[-1][1] + 1e-9 * (variable.high - variable.low):
            parts[-1][1] = end
        else:
            parts.append([begin, end])
    longest = max(parts, key=lambda part: part[1] - part[0], default=None)
    return None if longest is None else (float(longest[0]), float(longest[1]))


def _result(search: Search, changes: list[tuple[Tried, Tried]]) -> Threshold:
    """Make the answer from the search."""
    variable = search.variable
    notes = [*search.notes, *([STOPPED] if search.is_stopped else [])]
    own = variable.own if variable.own is not None else variable.low
    brackets = tuple((below.value, above.value, above.holds) for below, above in changes)
    value = None
    bracket = None
    proven = None
    if changes:
        below, above = min(changes, key=lambda pair: min(abs(pair[0].value - own), abs(pair[1].value - own)))
        holding, failing = (above, below) if above.holds else (below, above)
        value = holding.value
        bracket = (below.value, above.value)
        if search.target.words == QUIET and not search.is_stopped:
            proven = _proven(search, failing.value, holding.value)
    return Threshold(value, bracket, brackets, variable, search.target, _dataset(search), proven, tuple(notes))


def _dataset(search: Search) -> xr.Dataset:
    """Dataset of all simulated motions."""
    import xarray as xr

    tried = search.tried
    target = search.target
    # arrays over the values and starts tried
    outputs = {output.name: output for output in target.outputs}
    shape = (len(tried), len(STARTS))
    holds = np.full(shape, -1, np.int8)
    number = np.full(shape, np.nan)
    variables: dict[str, Any] = {}
    for name, output in outputs.items():
        size = (len(output.subjects),) if output.dimension else ()
        variables[name] = np.full((*shape, *size), output.nothing, output.dtype)
    # fill in the motions
    for i, variant in enumerate(tried):
        for motion in variant.motions:
            j = STARTS.index(motion.start)
            holds[i, j] = target.holds(motion.values)
            number[i, j] = target.number(motion.values)
            for name in outputs:
                variables[name][i, j] = motion.values[name]
    # whether the target holds, and the number that it compares
    dims = ("value", "start")
    data: dict[str, Any] = {"holds": (dims, holds), "compared": (dims, number)}
    coordinates: dict[str, Any] = {
        "value": ("value", [variant.value for variant in tried], {"units": search.variable.unit or "1"}),
        "start": list(STARTS),
    }
    # outputs with units, or with words of their codes
    for name, output in outputs.items():
        along = (*dims, *((output.dimension,) if output.dimension else ()))
        attributes: dict[str, Any] = {"units": next((unit for unit in output.unit if unit), "1")}
        if output.words:
            attributes = {
                "flag_values": list(range_of(output.words)),
                "flag_meanings": " ".join(word.replace(" ", "_") for word in output.words),
            }
        data[name] = (along, variables[name], attributes)
        if output.dimension:
            coordinates[output.dimension] = list(output.subjects)
    attributes = {"path": search.variable.path, "until": target.words}
    return xr.Dataset(data, coordinates, attributes)


def range_of(words: tuple[str, ...]) -> range:
    """Codes of words."""
    return range(len(words))
