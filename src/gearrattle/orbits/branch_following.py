"""``continuation``: periodic motions followed over a value of the model, stable or not, with every change named."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from gearrattle.assembly import assemble
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.errors import ModelError
from gearrattle.model import Model, check_model
from gearrattle.model.factors import Written
from gearrattle.model.path_values import change_in_si
from gearrattle.model.value_kinds import CALLBACK, FLAG, Reader, argument_problems, checked
from gearrattle.orbits.balanced import balanced
from gearrattle.orbits.branch import NARROW, NARROW_RULE, Branch
from gearrattle.orbits.branch_switching import branches_missed, doublings_left, followers_of, further_curves
from gearrattle.orbits.branches_or_sweeps import branch_within
from gearrattle.orbits.followed_branch import Curve, Work, followed
from gearrattle.orbits.known_motions import states_of_periods
from gearrattle.orbits.orbit import CYCLES, Orbit
from gearrattle.orbits.periodic_search import periodic
from gearrattle.orbits.progress import never_falling, stretch_of
from gearrattle.orbits.settling_limits import WITHIN
from gearrattle.orbits.start_states import Start, check_repeats
from gearrattle.orbits.value_family import check_begin, ends_of, follower_over, notes_at_end
from gearrattle.wording import counted


def continuation(
    model: Model,
    path: str,
    range: tuple[Written, Written],
    *,
    start: Start | Orbit | None = None,
    cycles: int = 1,
    step_limit: float | str | None = None,
    isolated: bool = False,
    narrow: float = NARROW,
    within: float | str | None = None,
    progress: Callable[[float], None] | None = None,
    so_far: Callable[[Branch], None] | None = None,
) -> Branch:
    """Follow periodic motions over a value of the model.

    Parameters
    ----------
    model
        the driveline.
    path
        of the value, such as "excitation.speed" or "mesh.gear.backlash".
    range
        its ends, numbers in SI or strings with a unit; the branch begins at the first, which may be the larger. What
        happens exactly at an end is not among the events, except for a breaking of symmetry at the first one.
    start
        of the search for the motion at the first end, as of ``periodic``.
    cycles
        periods T after which the motions repeat. Where the motion at the first end repeats sooner, so do those of its
        branch, and ``cycles`` of the result is less.
    step_limit
        largest change of the value between points, a number in SI or a string with a unit; None: as the branch allows.
    isolated
        whether branches of n and of 2 n periods are sought that are not connected to the first.
    narrow
        share of the range: on the page events nearer to each other are shown as one family, and narrower ranges of
        unstable motions are left out. In ``data`` and ``events`` they are all.
    within
        time that the answer may take [s], or as text, such as "60s"; None for no limit. Where branches are not followed
        to their ends in it, because of friction, chaos or many impacts, exact runs up and down the range say which
        stable motions there are and where they jump: ``sweeps`` of the result. At the end of the time, and where
        ``progress`` raises ``Cancelled`` or Ctrl-C is pressed, the result is what is known by then.
    progress
        called with the finished share of the work, which never falls; an exception from it ends the work. The first
        branch, the two searches for isolated ones, and the branches that leave count as equal parts.
    so_far
        called with what is followed so far, after every step of every branch. What is looked for beyond a branch's
        points, such as branches that leave it, is not in it yet.

    Returns
    -------
    Branch
        Its points, what happens between them, and the motions.

    Raises
    ------
    ModelError
        inputs that do not repeat, a path that leads nowhere, a range without sense, or one that begins where a
        clearance or a slider comes or goes.
    ConvergenceError
        no motion was found at the first end.

    Examples
    --------
    >>> branch = gr.continuation(gr.example("rattle_oscillator"), "torque.0.harmonics.0.amplitude", (4.0, 7.0))
    >>> branch.events["kind"].tolist()
    ['grazing', 'fold']
    """
    check_model(model)
    rules: dict[str, tuple[Reader, Any]] = {"cycles": (CYCLES, cycles), "isolated": (FLAG, isolated)}
    rules |= {"narrow": (NARROW_RULE, narrow)}
    rules |= {"progress": (CALLBACK, progress), "so_far": (CALLBACK, so_far)}
    if problems := argument_problems(rules):
        raise ModelError(problems)
    seconds = None if within is None else checked(WITHIN, within, "within", dimensionless=False)
    ends = ends_of(model, path, range)
    limit = None if step_limit is None else change_in_si(path, step_limit, model, "positive", "step_limit")
    # the motion at the first end
    model = balanced(model, path)
    base = model.with_({path: ends[0]})
    check_repeats(base)
    check_begin(model, path, ends)
    follow = partial(_followed, model, path, step_limit=limit, narrow=narrow)
    asked = partial(follow, ends, start=start, cycles=cycles, isolated=isolated)
    if seconds is None:
        return asked(progress=progress, so_far=so_far)
    near = partial(follow, isolated=False, progress=None, so_far=None)
    return branch_within(model, path, ends, asked, follow_near=near, seconds=seconds, progress=progress, so_far=so_far)


def _followed(
    model: Model,
    path: str,
    ends: tuple[float, float],
    *,
    start: Start | Orbit | None,
    cycles: int,
    step_limit: float | None,
    isolated: bool,
    narrow: float,
    progress: Callable[[float], None] | None,
    so_far: Callable[[Branch], None] | None,
) -> Branch:
    """Follow the branches to their ends; arguments as of ``continuation``, already checked."""
    first, last = ends
    base = model.with_({path: first})
    first_orbit = periodic(base, cycles, start)
    fewest = len(states_of_periods(PeriodMap(assemble(base).system, cycles), first_orbit.motion))
    notes = notes_at_end(model, path, (first, last))
    if fewest < cycles:
        notes.append(f"The motion at the first end repeats after {counted(fewest, 'period')}: cycles is {fewest}.")
        cycles = fewest
    # its branch, and those that leave it or are isolated
    ascending = min(first, last), max(first, last)
    followers = followers_of(
        cycles, ascending, lambda n: follower_over(model, path, (first, last), n, first=first, step_limit=step_limit)
    )
    curve = followers.of[cycles]
    start_point = curve.begin(first_orbit.motion.start, first, upward=last > first)

    def tell(curves: Sequence[Curve]) -> None:
        if so_far is not None:
            so_far(Branch(model, path, (first, last), cycles, tuple(curves), narrow=narrow))

    report = never_falling(progress)
    work = Work(report, None if so_far is None else tell)
    parts = 2 + 2 * isolated
    curves = [followed(curve, start_point, ascending, work=work.part(0, parts))]
    rest = work._replace(progress=stretch_of(report, 1.0 / parts, 1.0)).beside(curves)
    curves += further_curves(followers, curves, isolated=isolated, work=rest)
    tell(curves)
    report(1.0)
    # what is not followed
    shown = curve.family.shown
    left = [*branches_missed(curves, cycles, ascending, shown), *doublings_left(curves, cycles, shown)]
    notes += dict.fromkeys([*(note for c in curves for note in c.notes), *left])
    return Branch(model, path, (first, last), cycles, tuple(curves), tuple(notes), narrow=narrow)
