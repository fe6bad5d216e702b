"""``threshold``: the smallest change at which a driveline becomes quiet.

The range is scanned first, for more drag or less backlash need not mean less rattle: every value is simulated from
rest, from the motion of its neighbour, and, where both are quiet, from a push (``motions``). Then the change between
two neighbours of different answers is halved with exact runs until it is known well enough. A value is *quiet* only if
every motion that was tried there is.
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

COUNT = 7
WIDTH = 0.01
_PROOF_SECONDS = 5.0
_BEFORE = 0.5  # of the quiet range, that a proof begins before it
STOPPED = "stopped before the end: what is missing was not simulated."
_VALUES = Count(3, 1000)
_WIDTHS = Plain("positive")
Progress = Callable[[float], None]


@dataclass(frozen=True)
class Threshold(Result):
    """Where a driveline becomes quiet, or reaches another target.

    Attributes
    ----------
    value
        the nearest value to the model's own at which the answer changes, on the side where the target holds [SI, or a
        factor]; None where it does not change within the range.
    bracket
        (low, high): the two values between which the answer changes there; ``value`` is one of them. None as above.
    brackets
        every change of the answer along the range, ascending, each as (lower value, upper value, whether the target
        holds above).
    variable
        what was changed.
    target
        what was asked for.
    scan
        all that was simulated, as ``data``: over "value" and "start" whether the target holds, the severity and the
        hardest impact of every part; -1 and NaN where a start was not tried.
    proven
        the part of the range for which a quiet motion is proven to exist and to be stable (``prove_quiet``); None where
        none is.
    notes
        what the user must know.
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
        of the value in the model file.
    range
        its two ends, as in a model file; the model's own value is the first that is tried, where it lies between them.
    until
        "quiet", or an output of studies against a number in SI or with a unit: "largest impact energy < 0.1 mJ" (of
        the worst part), "m5: largest approach speed < 5 mm/s".
    count
        values of the scan.
    width
        of the bracket, as a share of the value.
    workers
        threads; None: as many as cores.
    progress
        called with the finished share. Where it raises ``Cancelled``, what is known by then is returned.

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
    """Return the longest part of the range about the quiet side for which a quiet motion is proven; None for none.

    It is looked for from the farthest of the quiet neighbours to a little before the threshold, as the quiet motion may
    exist where others rattle.
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
    except ModelError:  # a path, or a driveline, that no proof knows
        return None
    boxes = proof.boxes[proof.boxes["status"] == "proven"]
    # neighbouring boxes make one part
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
    """Dataset of every motion that was tried."""
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
    # answer and compared number
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
