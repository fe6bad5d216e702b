"""Outputs of a study: the values kept of every case.

Every quantity of every criterion and metric is one, by its name in their entries ("impacts per cycle", "TR rms",
"separation margin"), so that a new one brings its outputs with it; further whole-run figures stand in ``RUN_OUTPUTS``.
Words are kept as codes: their place in ``flag_meanings``. "... over all stable motions" (``stable_motion_outputs``) is
the largest value that any motion of the case has. A function of the user's adds numbers of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import is_driven_over_time
from gearrattle.errors import ConvergenceError, GearRattleError, ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.table import did_you_mean, shown
from gearrattle.orbits.start_states import check_repeats
from gearrattle.quantities.criteria import criteria
from gearrattle.quantities.evaluation import add, rows_of
from gearrattle.quantities.metrics import event_metric_of, inputs_of
from gearrattle.quantities.quantity import WITHOUT_DIMENSION, Row
from gearrattle.quantities.quantity_table import CRITERIA, METRICS
from gearrattle.results import Run
from gearrattle.signals import gap_names, parts_of
from gearrattle.simulation.simulate import simulate
from gearrattle.studies.event_outputs import NAMES, known_event_outputs, values_of_event
from gearrattle.studies.output import EVENT, HARDEST, OVER_ALL, SOUND, VERDICT, WORDS, WORST, Output
from gearrattle.studies.sound_output import SOUND_LOOP, known_sound_output, sounds_of
from gearrattle.studies.stable_motion_outputs import COUNT, SWING, values_over_all
from gearrattle.trajectory import Layout

Array = NDArray[np.float64]


class Available(tuple[str, ...]):
    """Names of outputs of which those are kept that the driveline has: any other list refuses what it lacks.

    They may have the loop of the sound among them, which no other list may: only pages of conditions show it.
    """


DEFAULT = Available(("verdict severity", "verdict", "severity", "regime", "impacts per cycle", "contact share"))
Function = Callable[[Run], Mapping[str, float]]


def _crossings(run: Run) -> float:
    t = run.trajectory
    begin = (t.first_cycle + t.discard) * t.layout.period
    return float(np.count_nonzero(t.events.time >= begin)) / (t.cycles - t.discard)


def _predictable(run: Run) -> float:
    return float(run.predictability_horizon) / run.trajectory.layout.period


_OF_IMPACTS = "impacts"  # the criterion whose quantity ENERGY is
RUN_OUTPUTS: Mapping[str, tuple[Callable[[Run], float], str]] = {
    "crossings per cycle": (_crossings, "1/cycle"),
    "predictable cycles": (_predictable, "1"),
    "largest Lyapunov exponent": (lambda run: run.largest_lyapunov_exponent, "1/s"),
    "function calls": (lambda run: float(run.cost.function_calls), "1"),
}
"""Figures of a whole run, with their units."""


@dataclass(frozen=True)
class Outputs:
    """All outputs of a study.

    Attributes
    ----------
    function
        the user's; None for none.
    known
        every output of cases that were computed before the study began, by their places in the grid; none with
        a function of the user's, for that may depend on the process it runs in.
    """

    chosen: tuple[Output, ...]
    function: Function | None = None
    function_names: tuple[str, ...] = ()
    known: dict[tuple[int, ...], dict[str, NDArray[Any]]] = field(
        default_factory=dict, compare=False, repr=False, kw_only=True
    )

    @property
    def all(self) -> tuple[Output, ...]:
        """Those of the function as well."""
        return (*self.chosen, *(Output(name, "", (), ("",)) for name in self.function_names))

    def of(self, run: Run) -> dict[str, NDArray[Any]]:
        """Return every output of one run, (subjects,) or ()."""
        over_all = [output for output in self.chosen if output.over_all]
        values = values_of(tuple(output for output in self.chosen if not output.over_all), run)
        if over_all:
            values |= values_over_all(over_all, run, values_of)
        if self.function is not None:
            values |= {name: np.array(float(value)) for name, value in _called(self.function, run).items()}
            missing = [name for name in self.function_names if name not in values]
            if missing:
                raise GearRattleError(f"the function did not return {missing[0]}, as it did for the first case")
        return {output.name: values[output.name] for output in self.all}


def values_of(
    outputs: Sequence[Output], run: Run, crossings: Mapping[str, Array] | None = None
) -> dict[str, NDArray[Any]]:
    """Return every output of criteria, metrics and whole runs, (subjects,) or ().

    ``crossings`` are the sums over the crossings of the steady part (``signals.crossing_sums``), where these are known
    already; None: those of the run's log.
    """
    needed = {output.criterion for output in outputs}
    needed_criteria = [criterion for criterion in CRITERIA if criterion.name in needed]
    sums = add(run.trajectory, None, needed_criteria)
    rows = [row for criterion in needed_criteria for row in criterion.rows(sums)]
    if metrics := [metric for metric in METRICS if metric.name in needed]:
        inputs = replace(inputs_of(run), known_crossings=crossings)
        rows += rows_of(inputs, metrics, {output.quantity for output in outputs}, units=run.model.units)
    of_event = [output for output in outputs if output.criterion == EVENT and output.name in NAMES]
    if EVENT in needed and any(output.criterion == EVENT and output not in of_event for output in outputs):
        rows += rows_of(inputs_of(run), [event_metric_of(run)], units=run.model.units)
    of_sound = [output for output in outputs if output.criterion == SOUND]
    plain = [output for output in outputs if output.name not in RUN_OUTPUTS and output not in of_event + of_sound]
    figures = sounds_of(run, of_sound)
    figures |= {o.name: np.array(RUN_OUTPUTS[o.name][0](run)) for o in outputs if o.name in RUN_OUTPUTS}
    if of_event:
        figures |= values_of_event(of_event, run)
    return figures | values_in(rows, plain, parts_of(run.trajectory.layout))


def values_in(rows: Sequence[Row], outputs: Sequence[Output], layout: Layout) -> dict[str, NDArray[Any]]:
    """Return outputs of criteria and metrics, of their rows about a motion of a driveline."""
    values: dict[str, NDArray[Any]] = {}
    for output in outputs:
        wanted = (output.criterion, output.quantity)
        entries = {row.subject: row for row in rows if row.subject and (row.name, row.quantity) == wanted}
        if not output.dimension and output.name not in WORST:  # of the whole driveline
            values[output.name] = np.array(next((float(e.value) for e in entries.values()), output.absent))
        elif output.name in WORST:  # of the parts that can separate: a code, or a number
            gaps = gap_names(layout)
            of_gaps = [entry.value for part, entry in entries.items() if part in gaps]
            numbers = [output.words.index(str(value)) if output.words else float(value) for value in of_gaps]
            values[output.name] = np.array(max(numbers, default=0), dtype=output.dtype)
        else:
            values[output.name] = _values(output, entries)
    return values


def _measured(run: Run) -> list[Row]:
    """Rows of all metrics about a subject; of an event those of the event as well."""
    of_event = [event_metric_of(run)] if is_driven_over_time(run.model) else []
    return [row for row in rows_of(inputs_of(run), [*METRICS, *of_event], units=run.model.units) if row.subject]


def _values(output: Output, entries: Mapping[str, Row]) -> NDArray[Any]:
    values = output.before
    for i, subject in enumerate(output.subjects):
        if subject in entries:
            value = entries[subject].value
            values[i] = output.words.index(value) if isinstance(value, str) else value
    return values


def _called(function: Function, run: Run) -> Mapping[str, float]:
    returned = function(run)
    if not isinstance(returned, Mapping):
        raise ModelError(Problem("function", type(returned).__name__, "must return a mapping from names to numbers"))
    if bad := [name for name, value in returned.items() if not isinstance(value, Real | np.generic)]:
        raise ModelError(Problem("function", shown(bad[0]), "must return numbers", "float(...) makes one"))
    return returned


def _outputs_in(said: Sequence[Row], occasional: Sequence[Row], runs: Sequence[Run]) -> dict[str, Output]:
    """Return an output for every quantity that is said of some runs, or that another motion of theirs may have."""
    # rows by quantity and subject
    names = _names(runs)
    by_name = dict[str, dict[str, Row]]()
    outputs = dict[str, Output]()
    for entry in (*said, *occasional):
        by_name.setdefault(entry.quantity, {}).setdefault(entry.subject, entry)
    absent = {entry.quantity: entry for entry in occasional}
    # parts that can separate
    gaps = tuple(
        name for name in names["part"] if any(name in gap_names(parts_of(run.trajectory.layout)) for run in runs)
    )
    # subjects, units and words of every output
    for name, entries in by_name.items():
        first = next(iter(entries.values()))
        dimension = next((dimension for dimension, known in names.items() if first.subject in known), "")
        words = WORDS[name] if isinstance(first.value, str) else ()
        subjects = tuple(sorted(entries, key=names[dimension].index) if dimension else entries)
        units = tuple(unit and unit_in(runs[0].model, unit) for unit in (entries[name].unit for name in subjects))
        owner = first.name
        error = "" if words else _error_of([*entries.values()])
        output = Output(
            name, dimension, subjects if dimension else (), units, words, owner, gaps=gaps if words else (), error=error
        )
        # values for motions without the quantity
        if name in absent:
            value = absent[name].value
            number = float(words.index(value) if isinstance(value, str) else value)
            output = replace(output, absent=number, lacking=absent[name].note)
        outputs[name] = output
    return outputs


def _names(runs: Sequence[Run]) -> dict[str, list[str]]:
    """Names of parts, forces of bearings among them, and of inertias in all of some runs, each once."""
    layouts = [parts_of(run.trajectory.layout) for run in runs]
    parts = [*(n for layout in layouts for n in layout.element_names), *(n for at in layouts for n in at.bearing_names)]
    return {
        "part": list(dict.fromkeys(parts)),
        "inertia": list(dict.fromkeys(name for layout in layouts for name in layout.inertia_names)),
    }


def _error_of(entries: Sequence[Row]) -> str:
    """Error of sampling of the values of one run, in words."""
    estimates = [(entry.error, abs(float(entry.value))) for entry in entries if np.isfinite(float(entry.value))]
    if any(np.isnan(error) for error, _ in estimates):
        return "of samples, not estimated"
    largest = max((error / value for error, value in estimates if error > 0.0 and value > 0.0), default=0.0)
    return f"of samples, about {100.0 * largest:.2g} % in the first case" if largest else "none"


def unit_in(model: Model, unit: str) -> str:
    """Return an SI unit as a model has it: "1" if it is dimensionless, unless the unit is not of SI."""
    return unit if model.units == "SI" or unit in WITHOUT_DIMENSION else "1"


def _known(names: Sequence[str], runs: Sequence[Run]) -> dict[str, Output]:
    """Return all outputs of a driveline by name: those of metrics only where a name needs them, for they take samples.

    ``runs`` are one of every structure that its cases have (``structures.structures_of``), however short.
    """
    bases = [name.removesuffix(OVER_ALL) for name in names]
    if any(base != name or name == COUNT for base, name in zip(bases, names, strict=True)):
        check_repeats(runs[0].model)
        plain = [base for base, name in zip(bases, names, strict=True) if name not in (COUNT, SWING)]
        return _with_largest(_known(plain, runs), runs)
    model = runs[0].model
    known = {whole: Output(whole, "", (), ("",), WORDS[of], of) for whole, of in WORST.items() if of in WORDS}
    known[HARDEST] = Output(HARDEST, "", (), (unit_in(model, "J"),), criterion=_OF_IMPACTS)
    known |= known_event_outputs(model, runs[0].trajectory.layout)
    of_sound = known_sound_output(model, [run.trajectory.layout for run in runs])
    known |= {name: output for name, output in of_sound.items() if name != SOUND_LOOP or isinstance(names, Available)}
    known |= {name: Output(name, "", (), (unit_in(model, unit),)) for name, (_, unit) in RUN_OUTPUTS.items()}
    said = [entry for run in runs for entry in criteria(run).entries]
    occasional = [
        entry
        for run in runs
        for criterion in CRITERIA
        for entry in criterion.occasional(parts_of(run.trajectory.layout))
    ]
    known |= _outputs_in(said, occasional, runs)
    if not isinstance(names, Available) and any(name not in known for name in names):
        measured = _outputs_in([row for run in runs for row in _measured(run)], (), runs)
        known |= {name: output for name, output in measured.items() if name not in known}
    return known


def _with_largest(known: Mapping[str, Output], runs: Sequence[Run]) -> dict[str, Output]:
    """Outputs, and the largest value of each over all stable motions."""
    layout = runs[0].trajectory.layout
    model = runs[0].model
    largest = {
        f"{name}{OVER_ALL}": replace(output, name=f"{name}{OVER_ALL}", over_all=True)
        for name, output in known.items()
        if output.criterion != SOUND  # the level of a single period tells nothing
    }
    units = tuple(unit_in(model, "m" if layout.is_mesh[k] else "rad") for k in layout.clearance)
    swing = Output(SWING, "part", layout.clearance_names, units, over_all=True)
    return {**known, **largest, SWING: swing, COUNT: Output(COUNT, "", (), ("1",), over_all=True)}


def _refuse_unknown(names: Sequence[str], known: Sequence[str], runs: Sequence[Run]) -> None:
    """Refuse every name that is not known."""
    has_clearance = any(run.trajectory.layout.clearance_names for run in runs)
    rule = f"there is no such output{'' if has_clearance else ' of a driveline without a clearance'}"
    plain = [name for name in known if not name.endswith(OVER_ALL)]
    rule += f'; there are {", ".join(plain)}, each of them also with "{OVER_ALL.strip()}"'
    unknown = [name for name in names if name not in known]
    if unknown:
        raise ModelError([Problem("outputs", shown(name), rule, did_you_mean(name, known)) for name in unknown])


def check_names(names: Sequence[str], models: Sequence[Model], function: Function | None = None) -> None:
    """Refuse outputs that no motion of a driveline has, before any case is simulated.

    The known outputs do not depend on a motion: they are those of one period of each structure, simulated in
    milliseconds, and those that only some motions have (``Quantity.occasional``).

    Parameters
    ----------
    models
        one of every structure; those that cannot be simulated are left to the study itself.
    function
        gives further outputs; without it one name is needed at least.

    Raises
    ------
    ModelError
        names there are not, all of them; what is no list of names.
    """
    check_list(names, function)
    if isinstance(names, Available) or all(name in WORST or name in RUN_OUTPUTS for name in names):
        return
    if runs := short_runs(models):
        _refuse_unknown(names, tuple(_known(names, runs)), runs)


def check_list(names: Sequence[str], function: Function | None = None) -> None:
    """Refuse anything but a list of names; without a function giving further outputs one name is needed at least.

    ModelError: everything in it that is no name.
    """
    no_list = isinstance(names, str) or not isinstance(names, Sequence)
    words = [names] if no_list else [name for name in names if not isinstance(name, str)]
    if words:
        rule = "outputs must be a list of names"
        raise ModelError([Problem("outputs", shown(word), rule, f'for example ["{VERDICT}"]') for word in words])
    if not names and function is None:
        raise ModelError(Problem("outputs", "none", "a study needs at least one", f"for example {', '.join(DEFAULT)}"))


def short_runs(models: Sequence[Model]) -> list[Run]:
    """Return one period of the motion of every model that can be simulated, which shows its outputs."""
    runs = []
    for model in models:
        with suppress(ModelError, ConvergenceError):
            runs.append(simulate(model, cycles=1, discard=0, audit=False))
    return runs


def outputs_of(
    names: Sequence[str], run: Run, function: Function | None = None, others: Sequence[Model] = ()
) -> Outputs:
    """Find outputs by name in what a driveline has.

    Parameters
    ----------
    names
        of outputs; if they are ``Available``, those of them that the driveline has.
    others
        a model of every structure that cases have: parts that have a clearance in some are parts as well.

    Raises
    ------
    ModelError
        a name there is not; all of them.
    """
    runs = [run, *(short_runs(others) if len(others) > 1 else ())]
    known = _known(names, runs)
    if isinstance(names, Available):
        names = tuple(name for name in names if name in known)
    _refuse_unknown(names, tuple(known), runs)
    extra = tuple(_called(function, run)) if function is not None else ()
    clash = [name for name in extra if name in names]
    if clash:
        raise ModelError(Problem("function", clash[0], "returns what is an output already", "give it another name"))
    return Outputs(along_all([known[name] for name in dict.fromkeys(names)], run), function, extra)


def along_all(chosen: Sequence[Output], run: Run, subjects: Sequence[str] = ()) -> tuple[Output, ...]:
    """Return outputs with one list of parts, and one of inertias, for all of them.

    Any run of the driveline gives the order of names in the lists.
    """
    layout = parts_of(run.trajectory.layout)
    outputs = []
    names = {"part": (*layout.element_names, *layout.bearing_names), "inertia": layout.inertia_names}
    for output in chosen:
        occurring = {name for other in chosen if other.dimension == output.dimension for name in other.subjects}
        listed = tuple(name for name in names.get(output.dimension, ()) if name in occurring | set(subjects))
        widened = bool(listed) and listed != output.subjects
        outputs.append(replace(output, subjects=listed, only=output.subjects) if widened else output)
    return tuple(outputs)
