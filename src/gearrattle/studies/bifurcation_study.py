"""``bifurcation``: the settled motion against one value of the model, swept up and down, by brute force.

A driven motion seen once a period (``sections``) is n points if it is n-periodic, and a cloud if it is chaotic; drawn
over a parameter these points are the bifurcation diagram. Where motions coexist the one found depends on its start. So
every value begins with the state, angles and velocities, in which the one before it ended: upward and downward sweeps
then follow different branches, and where they differ there are two motions at least (a jump with hysteresis).

A sweep is sequential: it is one chunk, stores its progress every second, and resumes from there to the same bits.
Directions and the values of further axes are sweeps of their own, each begun with the model's own start, and run in
parallel.
"""

from __future__ import annotations

import io
import json
import os
import time
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import refuse_unsteady, start_at
from gearrattle.errors import Cancelled, ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.table import shown
from gearrattle.model.value_kinds import Choice, argument_problems
from gearrattle.simulation.settings import settled
from gearrattle.simulation.simulate import simulate
from gearrattle.studies.case_runs import DONE, Computed, code_of, empty
from gearrattle.studies.coexistence import hysteresis
from gearrattle.studies.outputs import along_all, check_names, outputs_of
from gearrattle.studies.plan import Plan
from gearrattle.studies.poincare_sections import NEARNESS, Sections, own_units, section_of, states_of, unit_of
from gearrattle.studies.prepared import Prepared, Progress
from gearrattle.studies.storage import File
from gearrattle.studies.structures import structures_of
from gearrattle.studies.study import first_run
from gearrattle.studies.study_axes import Axis, axes_of, check_once
from gearrattle.studies.study_call import conduct
from gearrattle.studies.study_cost import seconds_alone
from gearrattle.studies.study_store import ProgressCallback, Store
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

DIRECTION = "direction"
WAYS: Mapping[str, tuple[str, ...]] = {"both": ("up", "down"), "up": ("up",), "down": ("down",)}
DIRECTIONS = Choice(tuple(WAYS))
DEFAULT = ("verdict severity", "verdict", "severity", "regime")
TOLERANCE = 1e-6
MOST_PERIOD = 16
MOST_POINTS = 128
_KEEP_EVERY = 1.0  # seconds


@dataclass(frozen=True)
class Sweeps(Plan):
    """The cases of a bifurcation diagram: directions, further axes, and along the last dimension the swept value."""

    kind: ClassVar[str] = "bifurcation"
    is_grid: ClassVar[bool] = False
    said: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def chunk_shape(self) -> tuple[int, ...]:
        """A sweep: all values, one of everything else."""
        return (*(1 for _ in self.shape[:-1]), self.shape[-1])

    @property
    def attributes(self) -> dict[str, Any]:
        """The settings of the section and of the test of its period."""
        return self.said

    def changes(self, at: tuple[int, ...]) -> dict[str, Any]:
        """Return what one case changes; its direction is no value of the model."""
        changes = super().changes(at)
        del changes[DIRECTION]
        return changes

    def rises(self, chunk: int) -> bool:
        """Return whether a sweep goes through the values in their order."""
        return bool(self.axes[0].coordinate[self.box(chunk)[0].start] == "up")


@dataclass(frozen=True)
class Diagram(Prepared):
    """Prepared bifurcation diagram."""

    def _counted(self) -> str:
        """Numbers of sweeps and values, in words."""
        sweeps = self.plan.chunks
        return f"{counted(sweeps, 'sweep')} of {counted(self.plan.shape[-1], 'value')}"

    def sensible(self) -> int:
        """Return how many workers pay: never more than there are sweeps."""
        return min(super().sensible(), self.plan.chunks)

    def completed(self, store: Store) -> xr.Dataset:
        """Find where both directions end in different motions, and store that as well."""
        swept = hysteresis(store.dataset())
        if swept is not None:
            store.add(swept.to_dataset(name="motions"))
        return store.dataset()


def prepare(
    model: Model,
    path: str,
    values: Sequence[float | str] | NDArray[np.float64] | Mapping[str, object],
    *,
    axes: Mapping[str, object] | None = None,
    direction: str = "both",
    cycles: int | None = None,
    discard: int | None = None,
    phase: float = 0.0,
    section: Sequence[str] | None = None,
    tolerance: float = TOLERANCE,
    outputs: Sequence[str] = DEFAULT,
    fixed: Mapping[str, object] | None = None,
) -> Diagram:
    """Check all arguments of a diagram, and run one case. Arguments, errors as ``bifurcation``."""
    # check the arguments
    refuse_unsteady(model, "a bifurcation diagram")
    if problems := argument_problems({"direction": (DIRECTIONS, direction), "tolerance": (NEARNESS, tolerance)}):
        raise ModelError(problems)
    # settings, section and axes
    base = model.with_(fixed) if fixed else model
    chosen = section_of(base, section, phase)
    grid = {"cycles": cycles, "discard": discard, "samples_per_cycle": chosen.phase.denominator}
    base = settled(base, grid)
    others = axes_of(axes or {}, base)
    swept = axes_of({path: values}, base)
    check_once([value for axis in (*others, *swept) for value in axis.values])
    _check_order(swept[0])
    # points of the section that are kept
    kept = int(base.simulation.cycles or 0) - int(base.simulation.discard or 0)
    points = min(kept, MOST_POINTS)
    said = {
        "path": path,
        "phase": float(chosen.phase),
        "tolerance": float(tolerance),
        "points": points,
        "section": list(chosen.names),
        "scale": [chosen.scale[name] for name in chosen.names],
        "largest_period": MOST_PERIOD,
        "direction": direction,
    }
    # sweeps: directions, further axes, swept value
    ways = Axis(DIRECTION, {DIRECTION: WAYS[direction]})
    plan = Sweeps(base, (ways, *others, *swept), None, 1, said)
    structures = structures_of(plan)
    check_names(outputs, structures)
    # outputs and number of states, by one case of every structure
    run, seconds = first_run(plan)
    kept_outputs = outputs_of(outputs, run, others=structures)
    states = max(states_of(one) for one in structures)
    units = tuple(unit_of(name, base) for name in chosen.names)
    ends = tuple(inertia.name for inertia in base.inertias)
    chosen_outputs = along_all(kept_outputs.chosen, run, ends)
    sections = Sections(
        chosen_outputs,
        section=chosen,
        units=units,
        points=points,
        tolerance=float(tolerance),
        most=MOST_PERIOD,
        states=states,
        inertias=ends,
        own_units=own_units(base),
    )
    return Diagram(plan, sections, seconds_alone(plan, sections.of, run, seconds), sweep)


def bifurcation(
    model: Model,
    path: str,
    values: Sequence[float | str] | NDArray[np.float64] | Mapping[str, object],
    *,
    axes: Mapping[str, object] | None = None,
    direction: str = "both",
    cycles: int | None = None,
    discard: int | None = None,
    phase: float = 0.0,
    section: Sequence[str] | None = None,
    tolerance: float = TOLERANCE,
    outputs: Sequence[str] = DEFAULT,
    fixed: Mapping[str, object] | None = None,
    output: str | os.PathLike[str] | None = None,
    resume: bool = False,
    retry_failed: bool = False,
    workers: int | None = None,
    scheduler: object = "local",
    progress: Progress | None = None,
) -> xr.Dataset:
    """Sweep one value of a driveline up and down, and keep the settled motion seen once a period.

    Parameters
    ----------
    model
        the driveline; its start is that of the first value of every sweep.
    path
        of the swept value; or a name of one's own, and ``values`` a mapping from paths to lists, swept together.
    values
        a list that ascends, or a range ``{"from": ..., "to": ..., "count": ..., "spacing": "linear" | "log"}``.
    axes
        further axes, as in ``study``: a sweep for every combination.
    direction
        "both", "up", "down".
    cycles, discard
        periods simulated at every value, and those left out to settle; None: the model's.
    phase
        of the period, at which the motion is seen: a fraction from 0 to below 1.
    section
        quantities that are kept: "deflection.ELEMENT", "rate.ELEMENT", "angle.INERTIA", "velocity.INERTIA";
        None: deflection and rate of every clearance.
    tolerance
        points nearer than this, in units of half the clearance (and that times 2 pi / T), are the same.
    outputs
        of criteria, as in ``study``.
    fixed
        other values of the model, by path.
    output
        folder or address to keep it in; None: in memory.
    resume, retry_failed
        go on with what the folder holds; and compute sweeps with failed cases anew.
    workers, scheduler, progress
        as in ``study``; a sweep is one piece of work.

    Returns
    -------
    xr.Dataset
        A Dataset over "direction", further axes and the swept value: every quantity of the section over "cycle" (the
        last 0, those before it negative); ``motion`` (codes: periodic, chaotic, undecided), ``period`` in T, the
        largest Lyapunov exponent over the periods kept, the Floquet multipliers of periodic motions, the state at the
        end, the outputs of criteria, ``outcome``; and ``motions`` (codes: one, two), without "direction": whether both
        directions end in the same motion, -1 where that is undecided.

    Raises
    ------
    ModelError
        anything wrong with the arguments; nothing has been computed then.
    ConvergenceError, NotInstalled, SchedulerLost
        as in ``study``.

    Examples
    --------
    >>> model = gr.example("rattle_oscillator")
    >>> swept = gr.bifurcation(model, "excitation.frequency", [0.9, 1.0], direction="up", cycles=40, workers=1)
    >>> swept["period"].values.ravel().tolist()
    [1.0, 1.0]
    """
    return conduct(prepare, **locals())  # every argument, by its name


def _check_order(axis: Axis) -> None:
    values = axis.coordinate
    if not all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        raise ModelError(Problem(axis.name, shown(values[0]), "what is swept must be a number"))
    if len(values) < 2 or np.any(np.diff(np.array(values, dtype=float)) <= 0.0):
        remedy = 'sort them; direction = "down" goes backward'
        raise ModelError(Problem(axis.name, "", "a sweep needs two values at least, and they must ascend", remedy))


@dataclass
class _Reached:
    """Progress of a sweep: results so far, values done, and the state in which the last one ended."""

    computed: Computed
    count: int = 0
    state: dict[str, list[float]] | None = None

    def keep(self, file: File) -> None:
        """Write it whole or not at all."""
        arrays = {f"value {name}": values for name, values in self.computed.values.items()}
        messages = [[list(at), text] for at, text in self.computed.messages.items()]
        said = json.dumps({"count": self.count, "messages": messages})
        state = self.state or {}
        arrays |= {f"state {name}": np.array(values) for name, values in state.items()}
        stream = io.BytesIO()
        np.savez(stream, outcome=self.computed.outcome, said=np.array(said), **arrays)  # type: ignore[arg-type]
        file.write_bytes(stream.getvalue())

    def read(self, file: File) -> None:
        """Read the progress that was kept; nothing where it is missing or damaged."""
        try:
            with np.load(io.BytesIO(file.read_bytes())) as archive:
                kept = {name: archive[name] for name in archive.files}
            said = json.loads(str(kept["said"]))
            values = {name: kept[f"value {name}"] for name in self.computed.values}
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return
        messages = {tuple(at): text for at, text in said["messages"]}
        self.computed = Computed(values, kept["outcome"], messages)
        self.count = said["count"]
        state = {name: kept[f"state {name}"].tolist() for name in ("angle", "velocity") if f"state {name}" in kept}
        self.state = state or None


def sweep(store: Store, chunk: int, progress: ProgressCallback | None) -> Computed:
    """Compute one sweep, value after value, each begun where the one before it ended; a failed one is passed over."""
    plan = store.plan
    outputs = store.outputs
    assert isinstance(plan, Sweeps)
    # cases in the direction of the sweep
    cases = list(plan.cases(chunk))
    if not plan.rises(chunk):
        cases.reverse()
    # go on from where a stopped sweep had come
    reached = _Reached(empty(plan, outputs, chunk))
    reached.read(store.part(chunk))
    kept = time.monotonic()
    # simulate each value from the end of the one before
    for at, changes in cases[reached.count :]:
        computed = reached.computed
        try:
            run = simulate(plan.model.with_(changes), initial=reached.state, audit=False)
            for name, value in outputs.of(run).items():
                computed.values[name][at] = value
            computed.outcome[at] = DONE
            reached.state = start_at(run.trajectory, -1)
        except Cancelled:
            raise
        except Exception as error:  # as in a grid: a failure is a result
            computed.outcome[at] = code_of(error)
            computed.messages[at] = " ".join(f"{error}".split()) or type(error).__name__
        reached.count += 1
        # keep how far the sweep has come
        if time.monotonic() - kept > _KEEP_EVERY:
            reached.keep(store.part(chunk))
            kept = time.monotonic()
        if progress is not None:
            progress(reached.count / len(cases))
    return reached.computed
