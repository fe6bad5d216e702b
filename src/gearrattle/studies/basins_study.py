"""``basins``: the settled motion that every initial state leads to, and the share of states that lead to a quiet one.

Initial states lie on a grid, or are drawn from a box; each is simulated by the settings of the model and its motion
seen once a period (``sections``). Periodic motions are distinguished by these points, and each is found to rounding by
shooting (``attractors``). A case is one initial state, so that chunks, workers, clusters, stopping and resuming are
those of every study.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

from gearrattle.assembly import assemble, refuse_unsteady
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.path_labels import INITIAL
from gearrattle.model.table import shown
from gearrattle.model.value_kinds import SEED, Reader, argument_problems
from gearrattle.orbits.attractors import Attractor, settled_orbit
from gearrattle.orbits.start_states import check_repeats, state_of
from gearrattle.simulation.settings import settled
from gearrattle.simulation.simulate import simulate
from gearrattle.studies.basin_attractors import attractors_of
from gearrattle.studies.designs import METHOD, SAMPLES
from gearrattle.studies.distributions import Distribution, sampled
from gearrattle.studies.outputs import check_names, outputs_of
from gearrattle.studies.plan import Plan, Samples
from gearrattle.studies.poincare_sections import NEARNESS, Sections, own_units, section_of, unit_of
from gearrattle.studies.prepared import Prepared, Progress, fit_size
from gearrattle.studies.start_coordinates import Starts, read_value, starts_of
from gearrattle.studies.study import CASES, MOST, first_run
from gearrattle.studies.study_axes import Axis, values_of
from gearrattle.studies.study_call import conduct
from gearrattle.studies.study_cost import seconds_alone
from gearrattle.studies.study_store import Store

if TYPE_CHECKING:
    import xarray as xr

SAME = 1e-3
TOLERANCE = 1e-6
MOST_PERIOD = 16
DEFAULT = ("verdict severity", "verdict", "severity", "regime")


@dataclass(frozen=True)
class Initials(Plan):
    """The cases of a basin study: the model from one initial state after the other."""

    kind: ClassVar[str] = "basins"
    is_grid: ClassVar[bool] = False
    said: dict[str, Any] = field(default_factory=dict)
    starts: Starts | None = None

    @property
    def attributes(self) -> dict[str, Any]:
        """The settings of the section and of the test of its period."""
        return self.said

    def changes(self, at: tuple[int, ...]) -> dict[str, Any]:
        """Return the initial state of one case."""
        assert self.starts is not None
        values = {name.removeprefix(INITIAL): value for name, value in super().changes(at).items()}
        return {"simulation.initial": self.starts.state(values)}


@dataclass(frozen=True)
class Basins(Prepared):
    """Prepared basin study; orbits nearer than ``same`` are one."""

    same: float = SAME

    def completed(self, store: Store) -> xr.Dataset:
        """Find the attractors, and store them as well."""
        store.add(attractors_of(store.dataset(), self.same, self._settled))
        return store.dataset()

    def _settled(self, at: tuple[int, ...], cycles: int) -> Attractor | None:
        """The periodic motion in which a case has settled: it is run again, and found by shooting from its end."""
        model = self.plan.model.with_(self.plan.changes(at))
        try:
            check_repeats(model)
        except ModelError:  # a train that mean torques drive away: its deflections repeat, its state does not
            return None
        period_map = PeriodMap(assemble(model).system, cycles)
        orbit = settled_orbit(model, state_of(model, period_map, simulate(model, audit=False)), cycles)
        return None if orbit is None else Attractor(orbit)


def prepare(
    model: Model,
    over: Mapping[str, object],
    *,
    samples: int = 0,
    method: str = "latin-hypercube",
    seed: int = 0,
    cycles: int | None = None,
    discard: int | None = None,
    phase: float = 0.0,
    section: Sequence[str] | None = None,
    tolerance: float = TOLERANCE,
    same: float = SAME,
    outputs: Sequence[str] = DEFAULT,
    fixed: Mapping[str, object] | None = None,
    most: int = MOST,
) -> Basins:
    """Check all arguments of a basin study, and run one case. Arguments, errors as ``basins``."""
    # check the arguments
    refuse_unsteady(model, "a map of basins")
    _check(
        {
            "samples": (SAMPLES, samples),
            "method": (METHOD, method),
            "seed": (SEED, seed),
            "most": (CASES, most),
            "tolerance": (NEARNESS, tolerance),
            "same": (NEARNESS, same),
        }
    )
    # settings, section and coordinates of the initial states
    base = model.with_(fixed) if fixed else model
    chosen = section_of(base, section, phase)
    grid = {"cycles": cycles, "discard": discard, "samples_per_cycle": chosen.phase.denominator}
    base = settled(base, grid)
    # grid or samples of initial values
    starts = starts_of(base, tuple(over))
    axes, points = _points(over, base, samples, method, seed)
    # points of the section that are kept
    kept = int(base.simulation.cycles or 0) - int(base.simulation.discard or 0)
    last = min(kept, MOST_PERIOD)
    said = {
        "over": list(over),
        "phase": float(chosen.phase),
        "tolerance": float(tolerance),
        "points": last,
        "section": list(chosen.names),
        "scale": [chosen.scale[name] for name in chosen.names],
        "largest_period": last,
    }
    # cases, at most as many as allowed
    plan = Initials(base, axes, points, 1, said, starts)
    if plan.count > most:
        rule = f"{plan.count} initial states, more than the {most} allowed"
        raise ModelError(Problem("over", "", rule, "fewer values, or allow more with most"))
    if list(outputs):
        check_names(outputs, [base])
    # the outputs, by one case
    run, seconds = first_run(plan)
    kept_outputs = outputs_of(dict.fromkeys((*DEFAULT, *outputs)), run)  # type: ignore[arg-type]
    units = tuple(unit_of(name, base) for name in chosen.names)
    of_itself = own_units(base)
    sections = Sections(kept_outputs.chosen, None, (), chosen, units, last, float(tolerance), last, own_units=of_itself)
    # chunks by the time of a case
    seconds = seconds_alone(plan, sections.of, run, seconds)
    plan = Initials(base, axes, points, fit_size(seconds, plan.count), said, starts)
    return Basins(plan, sections, seconds, same=float(same))


def basins(
    model: Model,
    over: Mapping[str, object],
    *,
    samples: int = 0,
    method: str = "latin-hypercube",
    seed: int = 0,
    cycles: int | None = None,
    discard: int | None = None,
    phase: float = 0.0,
    section: Sequence[str] | None = None,
    tolerance: float = TOLERANCE,
    same: float = SAME,
    outputs: Sequence[str] = DEFAULT,
    fixed: Mapping[str, object] | None = None,
    most: int = MOST,
    output: str | os.PathLike[str] | None = None,
    resume: bool = False,
    retry_failed: bool = False,
    workers: int | None = None,
    scheduler: object = "local",
    progress: Progress | None = None,
) -> xr.Dataset:
    """Find which settled motion every initial state leads to.

    Parameters
    ----------
    model
        the driveline; its own start holds for what ``over`` leaves open (``studies.start_coordinates``).
    over
        by name, "deflection.ELEMENT", "rate.ELEMENT", "angle.INERTIA" or "velocity.INERTIA", a list of initial
        values or a range ``{"from": ..., "to": ..., "count": ...}``: all combinations; with ``samples`` a box,
        ``{"from": ..., "to": ...}`` for each.
    samples, method, seed
        how many states are drawn from the box, evenly, and how, as in ``study``.
    cycles, discard
        periods simulated, and those left out to settle; None: the model's.
    phase, section, tolerance, outputs, fixed
        as in ``bifurcation``.
    same
        periodic motions nearer than this, in units of half the clearance, are one attractor.
    most
        a study of more initial states is refused.
    output, resume, retry_failed, workers, scheduler, progress
        as in ``study``.

    Returns
    -------
    xr.Dataset
        A Dataset over the initial values, "initial.deflection.ELEMENT" and so on (or "sample"): ``basin``, the number
        of the attractor each leads to, from 1; 0 chaotic, -1 undecided, -2 no result; along "attractor" its name, such
        as "single-sided rattle, 1 T", its ``share`` of the states with Wilson's interval ``low``, ``high`` (of drawn
        states), its period, verdict and largest multiplier. Attributes ``within`` and ``between``: how far orbits of
        one attractor, and attractors, are apart; ``quiet_share``: how likely one that does not rattle is, ``quiet_low``
        to ``quiet_high``. Besides ``motion``, ``period``, the section, the outputs.

    Raises
    ------
    ModelError
        anything wrong with the arguments; nothing has been computed then.
    ConvergenceError, NotInstalled, SchedulerLost
        as in ``study``.

    Examples
    --------
    >>> model = gr.example("rattle_oscillator")
    >>> starts = {"deflection.flanks": {"from": -2.0, "to": 2.0}, "rate.flanks": {"from": -1.0, "to": 1.0}}
    >>> settled = gr.basins(model, starts, samples=4, cycles=40, workers=1)
    >>> settled["basin"].values.shape
    (4,)
    """
    return conduct(prepare, **locals())  # every argument, by its name


def _check(arguments: Mapping[str, tuple[Reader, Any]]) -> None:
    """Refuse arguments that are wrong by themselves."""
    problems = argument_problems(arguments)
    if not problems:
        samples, tolerance, same = (arguments[name][1] for name in ("samples", "tolerance", "same"))
        if samples > 100 * MOST:
            problems.append(Problem("samples", shown(samples), f"more than {100 * MOST} cases cannot be held"))
        if not tolerance < same:
            rule = f"must be above tolerance, {tolerance:g}: a motion settles to no better than that"
            problems.append(Problem("same", f"{same:g}", rule))
    if problems:
        raise ModelError(problems)


def _points(
    over: Mapping[str, object], model: Model, samples: int, method: str, seed: int
) -> tuple[tuple[Axis, ...], Samples | None]:
    """Axes of a grid, or points drawn from a box."""
    problems: list[Problem] = []
    axes = []
    box = []
    for name, bounds in over.items():
        try:
            if samples:
                box.append(_range(name, bounds, model))
            else:
                axes.append(
                    Axis(
                        INITIAL + name,
                        {INITIAL + name: values_of(name, bounds, partial(read_value, name, model=model))},
                    )
                )
        except ModelError as error:
            problems += [Problem(f"over {name}: {p.place}", p.value, p.rule, p.remedy) for p in error.problems]
    if problems:
        raise ModelError(problems)
    if not samples:
        return tuple(axes), None
    return (), Samples(tuple(INITIAL + name for name in over), sampled(tuple(box), samples, method, seed))


def _range(name: str, bounds: Any, model: Model) -> Distribution:
    if not isinstance(bounds, Mapping) or set(bounds) != {"from", "to"}:
        raise ModelError(Problem(name, "", "is drawn from a range: it must have from and to, and nothing else"))
    low, high = (read_value(name, bounds[key], model) for key in ("from", "to"))
    if not low < high:
        raise ModelError(Problem("from", f"{low:g}", f"must lie below to, {high:g}"))
    return Distribution(name, "uniform", {"from": low, "to": high})
