"""``remedies``: the single changes, and the pairs of changes, that make a driveline quiet, by cost.

Every candidate is searched as in ``threshold``, with exact runs: its range is scanned and, if the target holds
somewhere, the smallest sufficient change is located. A value counts only if the target holds at the model's speed and
at the neighbouring speeds, from rest, from the motion at the value before, and after a push. The best changes that do
not reach the target alone are tried in pairs: both values change together towards their best ends.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import combinations
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import is_driven_over_time, refuse_but_events
from gearrattle.design.candidates import Candidate, candidates_of
from gearrattle.design.halving import Report, Search, Tried, Work, finish
from gearrattle.design.inline_executor import Inline
from gearrattle.design.kept_motions import Keep, kept_or_moved
from gearrattle.design.motions import REST, Asked, Motion, starts_of
from gearrattle.design.target import Target, half_of, target_of
from gearrattle.design.threshold import STOPPED
from gearrattle.design.variable import Variable, together
from gearrattle.errors import Cancelled
from gearrattle.model import Model, check_model
from gearrattle.model.factors import Factor
from gearrattle.model.path_labels import in_shown_unit, path_label
from gearrattle.model.path_values import in_si
from gearrattle.model.value_kinds import CALLBACK, FLAG, check_arguments
from gearrattle.result import Result
from gearrattle.simulation.settings import settled
from gearrattle.studies.output import ENERGY, REGIME
from gearrattle.studies.outputs import outputs_of, short_runs
from gearrattle.studies.ranges import Range
from gearrattle.studies.schedulers import check_scheduler
from gearrattle.wording import engineering, listed

if TYPE_CHECKING:
    import pandas as pd

COUNT = 5  # values of a scan
WIDTH = 0.02  # width of a bracket, as a share of the value
HALF = "half"
TRANSMISSIBILITY = "TR rms"
NEIGHBOURS = (0.97, 1.03)
"""Neighbouring speeds at which a remedy must hold as well, as factors on the model's own speed."""
_PAIRED = 4  # number of candidates that are tried in pairs
_RUNS = 9.0  # expected number of motions of a candidate
_WORSE = 1.1  # ratio of impact energy, or transmissibility, from which on a rise is a side effect
_SPEEDS = ("excitation.speed", "excitation.frequency")


@dataclass(frozen=True)
class Remedy:
    """One change, or a pair of changes.

    Attributes
    ----------
    change
        the change in words, with the value before and after.
    changes
        argument of ``Model.with_``; empty if no other value is better.
    cost
        cost of the change.
    holds
        whether the target holds, at all speeds and from all starts.
    verdict
        severity of the worst part.
    hardest_impact
        energy of the hardest impact in all motions simulated with the change [J].
    part
        part with the hardest impact.
    side_effects
        other changes of the motion, in words.
    """

    change: str
    changes: Mapping[str, Any]
    cost: float
    holds: bool
    verdict: str
    hardest_impact: float
    part: str
    side_effects: tuple[str, ...]


@dataclass(frozen=True)
class Remedies(Result):
    """Changes of a driveline, the best first.

    Attributes
    ----------
    model
        the driveline.
    target
        the target.
    own
        the unchanged driveline, as a remedy without changes.
    remedies
        remedies that reach the target by rising cost, then the others by falling effect.
    speeds
        speeds at which the target must hold [rad/s, or the model's unit].
    notes
        sentences that the user must know.
    """

    model: Model = field(repr=False)
    target: Target = field(repr=False)
    own: Remedy
    remedies: tuple[Remedy, ...]
    speeds: tuple[float, ...]
    notes: tuple[str, ...] = ()

    kind: ClassVar[str] = "remedies"

    @property
    def table(self) -> pd.DataFrame:
        """The remedies as a table: change, value, cost, verdict, hardest_impact [J], side_effects, certified.

        ``value`` is the new number in SI, or the factor; for a pair both values.
        """
        import pandas as pd

        columns = {
            "change": [remedy.change for remedy in self.remedies],
            "value": [_value_of(remedy.changes) for remedy in self.remedies],
            "cost": [remedy.cost for remedy in self.remedies],
            "verdict": [remedy.verdict for remedy in self.remedies],
            "hardest_impact": [remedy.hardest_impact for remedy in self.remedies],
            "side_effects": ["; ".join(remedy.side_effects) for remedy in self.remedies],
            "certified": [remedy.holds for remedy in self.remedies],
        }
        return pd.DataFrame(columns)


def remedies(
    model: Model,
    candidates: Mapping[str, object] | None = None,
    target: str = "quiet",
    *,
    speeds: Sequence[float | str] | None = None,
    pairs: bool = True,
    keep: str | os.PathLike[str] | None = None,
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Remedies:
    """Find which single change, and which pair, makes a driveline quiet, by exact runs.

    Parameters
    ----------
    model
        the driveline; its settings hold for every run.
    candidates
        ranges of the allowed changes by path or pattern: two ends around the model's own value, or a mapping with
        ``from``, ``to`` (or ``factor`` with these two) and ``cost``, the cost of the whole way to an end (default 1).
        None: drag torques, backlashes, gaps, stages and inertias, each from 0.7 to 1.3 times its value.
    target
        "quiet"; "half": half the energy of the hardest impact; or a comparison as for ``threshold``.
    speeds
        further speeds at which the target must hold; None: 3 % below and above the model's own, none for an event.
    pairs
        whether pairs of the best changes that do not reach the target alone are tried.
    keep
        a folder for all computed motions, so that a second call goes on where the first one stopped.
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
    >>> answer = gr.remedies(model, {"torque.0.mean": {"factor": (0.5, 4.0)}}, speeds=[], workers=1)
    >>> answer.table["change"].tolist()
    ['mean torque on gear: 0.1 to 0.1255']
    """
    check_model(model)
    check_arguments(pairs=(FLAG, pairs), progress=(CALLBACK, progress))
    check_scheduler(None, workers)
    refuse_but_events(model, "a search for remedies")
    base = settled(model, {})
    options = candidates_of(base, candidates)
    conditions, shown_speeds = _speeds(base, speeds)
    wanted = target_of(base, "quiet" if target == HALF else target)
    study = _Study(base, conditions, Report(progress, _RUNS * len(options)), None if keep is None else Keep(keep))
    own = study.own(wanted)
    if target == HALF:
        wanted = half_of(wanted, own.motions[0].values)
        own = Tried(0.0, wanted, own.motions)
    answers = study.all_of(options, wanted, own, workers, pairs=pairs)
    return Remedies(base, wanted, study.remedy_of_own(own), tuple(_ranked(answers)), shown_speeds, tuple(study.notes))


def _speeds(model: Model, speeds: Sequence[float | str] | None) -> tuple[tuple[dict[str, Any], ...], tuple[float, ...]]:
    """Return the changes that set every other speed, and all speeds ascending."""
    path = next(path for path in _SPEEDS if model.paths(path))
    own = float(model[path])
    neighbours = () if is_driven_over_time(model) else NEIGHBOURS
    others = [own * factor for factor in neighbours] if speeds is None else [in_si(path, v, model) for v in speeds]
    changes = tuple({path: other} for other in others if other != own)
    return changes, tuple(sorted({own, *others}))


class _Study:
    """The searches of all candidates."""

    def __init__(
        self, model: Model, conditions: Sequence[Mapping[str, Any]], report: Report, keep: Keep | None
    ) -> None:
        self.model = model
        self.notes: list[str] = []
        self.is_stopped = False
        self._report = report
        self._transmitted = outputs_of([TRANSMISSIBILITY], short_runs([model])[0]).chosen
        self._levels: dict[int, NDArray[np.float64]] = {}
        self._work = Work(COUNT, WIDTH, tuple(conditions), is_lean=True, keep=keep, starts=starts_of(model))

    def own(self, target: Target) -> Tried:
        """Simulate the model itself, from rest."""
        asked = Asked(self.model, REST, None, target.outputs, target.samples)
        return Tried(0.0, target, [kept_or_moved(asked, self._work.keep, self._report)])

    def all_of(
        self, options: Sequence[Candidate], target: Target, own: Tried, workers: int | None, *, pairs: bool
    ) -> list[Remedy]:
        """Search every candidate, then pairs of the best candidates that do not reach the target alone."""
        if own.holds:
            self.notes.append(f"the driveline is {target.words} as it is: from rest, at its own speed.")
        answers: list[tuple[Search, Candidate]] = []
        with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
            try:
                answers += [(self._search(option.variable, target), option) for option in options]
                finish([pool.submit(self._run, search, own) for search, _ in answers])
                if pairs:
                    paired = self._pairs(answers, target)
                    answers += paired
                    finish([pool.submit(self._run, search, own) for search, _ in paired])
                finish([pool.submit(self._transmit, search) for search in (None, *(search for search, _ in answers))])
            except Cancelled:
                self.is_stopped = True
        if self.is_stopped or any(search.is_stopped for search, _ in answers):
            self.notes.append(STOPPED)
        singles = [self._remedy(search, option, own) for search, option in answers[: len(options)] if search.is_begun]
        both = [self._remedy(search, option, own) for search, option in answers[len(options) :] if search.is_begun]
        return [*singles, *(pair for pair in both if pair.holds or _is_better(pair, singles))]

    def remedy_of_own(self, own: Tried) -> Remedy:
        """The unchanged driveline, as a remedy without changes."""
        word, energy, part = _worst(own.motions, own.target)
        return Remedy("as it is", {}, 0.0, own.holds, word, energy, part, ())

    def _search(self, variable: Variable, target: Target) -> Search:
        return Search(self.model, variable, target, self._work, self._report)

    def _run(self, search: Search, own: Tried) -> None:
        """Search one candidate in the thread of the caller."""
        search.run(Inline(), Tried(search.variable.own or 0.0, own.target, [*own.motions]))

    def _transmit(self, search: Search | None) -> None:
        """Transmissibilities of all bodies in the best variant of a search; None: in the model itself."""
        model = self.model
        best = None if search is None else _best(search)
        if search is not None and best is not None:
            model = model.with_(search.variable.changes(best.value))
        asked = Asked(model, REST, None, self._transmitted, None)
        motion = kept_or_moved(asked, self._work.keep, self._report)
        self._levels[id(search)] = motion.values[TRANSMISSIBILITY]

    def _pairs(self, answers: Sequence[tuple[Search, Candidate]], target: Target) -> list[tuple[Search, Candidate]]:
        """Pairs of changes that come nearer to the target; each changes a value up to its best value."""
        helpful = []
        for search, option in answers:
            if _reached(search) is None and search.is_begun:
                best = _best(search)
                if best.value != option.variable.own:
                    helpful.append((best.distance, option, best.value))
        helpful.sort(key=lambda entry: entry[0])
        pairs = []
        for one, other in combinations(helpful[:_PAIRED], 2):
            moves = [(option.variable.ends[0][0], value) for _, option, value in (one, other)]
            cost = one[1].cost_of(one[2]) + other[1].cost_of(other[2])
            variable = together(self.model, moves)
            pairs.append((self._search(variable, target), Candidate(variable, cost)))
        return pairs

    def _remedy(self, search: Search, option: Candidate, own: Tried) -> Remedy:
        """Remedy from one search: the smallest change that reaches the target, else the best value."""
        variable = option.variable
        best = _best(search)
        word, energy, part = _worst(best.motions, search.target)
        changes = {} if best.value == variable.own else variable.changes(best.value)
        effects = () if best.value == variable.own else self._side_effects(own, best) + self._transmission(search)
        words = _change_words(self.model, variable, best.value)
        return Remedy(words, changes, option.cost_of(best.value), best.holds, word, energy, part, effects)

    def _side_effects(self, own: Tried, best: Tried) -> tuple[str, ...]:
        """Parts that hit harder than before, and springs that now change stage."""
        target = own.target
        before = own.motions[0].values
        after = next((motion.values for motion in best.motions if motion.start == REST), best.motions[0].values)
        effects = []
        unit = "J" if self.model.units == "SI" else ""
        energy = target.output_named(ENERGY)
        regime = target.output_named(REGIME)
        for i, part in enumerate(energy.subjects):
            old = float(np.nan_to_num(before[ENERGY][i]))
            new = float(np.nan_to_num(after[ENERGY][i]))
            if part in regime.gaps and new > _WORSE * old and new > 0.0:
                effects.append(f"{part} hits harder: {engineering(old, unit)} to {engineering(new, unit)}")
        for i, part in enumerate(regime.subjects):
            if part not in regime.gaps and int(before[REGIME][i]) != int(after[REGIME][i]):
                state = "changes stage" if int(after[REGIME][i]) > 0 else "stays in its stage"
                effects.append(f"{part} {state}")
        return tuple(effects)

    def _transmission(self, search: Search) -> tuple[str, ...]:
        """The largest rise of a transmissibility over that of the model itself, in words; empty if it is small."""
        old = self._levels.get(id(None))
        new = self._levels.get(id(search))
        if old is None or new is None:
            return ()
        rise = np.nan_to_num(new / np.where(old > 0.0, old, np.nan))
        most = int(np.argmax(rise))
        if rise[most] <= _WORSE:
            return ()
        body = self._transmitted[0].subjects[most]
        return (f"transmissibility (rms) to {body} rises: {old[most]:.3g} to {new[most]:.3g}",)


def _value_of(changes: Mapping[str, Any]) -> Any:
    """The number or factor of a change; for several changes a tuple, without a change None."""
    numbers = tuple(value.times if isinstance(value, Factor) else value for value in changes.values())
    return numbers if len(numbers) > 1 else next(iter(numbers), None)


def _best(search: Search) -> Tried:
    """The smallest change that reaches the target, else the value whose hardest motion is nearest to the target."""
    own = search.variable.own or 0.0
    return _reached(search) or min(search.tried, key=lambda variant: (variant.distance, abs(variant.value - own)))


def _reached(search: Search) -> Tried | None:
    """The value nearest to the model's own at which the target holds; None if there is none."""
    own = search.variable.own or 0.0
    holding = [variant for variant in search.tried if variant.holds and variant.value != own]
    return min(holding, key=lambda variant: abs(variant.value - own)) if holding else None


def _is_better(pair: Remedy, singles: Sequence[Remedy]) -> bool:
    """Whether a pair of changes has a weaker hardest impact than either change alone."""
    alone = [single.hardest_impact for single in singles if single.changes.keys() <= pair.changes.keys()]
    return pair.hardest_impact < min(alone, default=np.inf)


def _worst(motions: Sequence[Motion], target: Target) -> tuple[str, float, str]:
    """The severity of the worst part, the energy of the hardest impact of a gap, and the name of that gap."""
    output = target.severity
    energy = target.output_named(ENERGY)
    gaps = np.isin(output.subjects, output.gaps)
    code = max(int(np.asarray(motion.values[output.name])[gaps].max(initial=0)) for motion in motions)
    energies = np.array([target.energies(motion.values) for motion in motions]).max(axis=0)
    hardest = int(np.argmax(energies))
    largest = float(energies[hardest])
    return output.words[code], largest, str(energy.subjects[hardest]) if largest > 0.0 else ""


def _change_words(model: Model, variable: Variable, value: float) -> str:
    """A change in words, with the value before and after."""
    if value == variable.own:
        return f"{variable.words}: no other value is better"
    if len(variable.ends) == 1:
        ((one, _, _),) = variable.ends
        own = variable.own if variable.own is not None else variable.low
        return _from_to(model, one, own, value)
    return listed([_from_to(model, one, own, own + value * (end - own)) for one, own, end in variable.ends])


def _from_to(model: Model, one: Range, before: float, after: float) -> str:
    """Name of a changed value, with the number or factor before and after; for a factor on one value, the numbers."""
    targets = one.varied.targets(model)
    own = next(iter(targets.values()))
    path = next(iter(targets))
    if not one.varied.by_factor or len(targets) > 1 or own is None:
        words, unit = one.varied.label(model)
        path = one.path
    else:
        words, unit = path_label(path, model)
        before = before * own
        after = after * own
    factor, shown_unit = in_shown_unit(path, unit, max(abs(before), abs(after)))
    return f"{words}: {before * factor:.4g} to {after * factor:.4g} {shown_unit}".rstrip()


def _ranked(answers: Sequence[Remedy]) -> list[Remedy]:
    """Remedies that reach the target by cost, then the others by the hardest impact."""
    return sorted(
        answers, key=lambda remedy: (not remedy.holds, remedy.cost if remedy.holds else remedy.hardest_impact)
    )
