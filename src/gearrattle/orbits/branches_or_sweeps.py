"""The motions over a value of a model within a time: branches where they can be followed, sweeps where they cannot.

1. The branches are followed for a share of the time: half of it where a driveline goes through the compiled loop of
   branches, else a twentieth, for with friction a branch takes 10 to 100 times as long. If they come to their ends,
   that is the answer.
2. Otherwise exact runs go up and down the whole range (``sweeps``).
3. In what is left of the time the branches are tried once more where they had a twentieth; else a short branch is
   followed from the motion before a jump: if that folds, or loses its stability there, the jump is located.

Takes what follows branches, and a time; gives a Branch.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Protocol

from gearrattle.assembly import assemble
from gearrattle.errors import Cancelled, ConvergenceError, ModelError
from gearrattle.model import Model
from gearrattle.model.path_labels import shown_value
from gearrattle.orbits.attractors import settled_orbit
from gearrattle.orbits.branch import Branch
from gearrattle.orbits.orbit import Orbit
from gearrattle.orbits.progress import never_falling, stretch_of
from gearrattle.orbits.stability import losses_of
from gearrattle.orbits.sweeps import Sweeper
from gearrattle.orbits.swept_motions import Jump, Sweeps
from gearrattle.orbits.value_family import is_compiled
from gearrattle.time_limits import OutOfTime, TimeLimit, check_time, limited
from gearrattle.wording import counted

Progress = Callable[[float], None]

# shares of the time for the branches
_COMPILED = 0.5
_GENERAL = 0.05
_SWEEPS = 0.85  # share of the time up to the end of the sweeps
_MOST_TOLD = 4  # jumps on a progress line


class Following(Protocol):
    """Follows branches to their ends."""

    def __call__(self, *, progress: Progress | None, so_far: Callable[[Branch], None] | None) -> Branch:
        """Return them; both as of ``continuation``."""


class Continuing(Protocol):
    """Follows branches over a part of the range."""

    def __call__(self, ends: tuple[float, float], *, start: Orbit, cycles: int) -> Branch:
        """Return them."""


def branch_within(
    model: Model,
    path: str,
    ends: tuple[float, float],
    follow: Following,
    *,
    follow_near: Continuing,
    seconds: float,
    progress: Progress | None,
    so_far: Callable[[Branch], None] | None,
) -> Branch:
    """Return what can be said of the motions over a range within a time.

    Parameters
    ----------
    model, path, ends
        the driveline, and the value with its range [SI].
    follow
        follows the branches to their ends.
    follow_near
        follows those through a motion over a part of the range.
    seconds
        that the answer may take.
    progress, so_far
        as of ``continuation``.

    Raises
    ------
    ConvergenceError
        nothing was known when the time was over.
    Cancelled
        nothing was known when the work was stopped.
    """
    limit = TimeLimit(seconds)
    report = never_falling(progress)
    if (expect := getattr(progress, "expect", None)) is not None:
        expect(seconds)
    is_fast = is_compiled(assemble(model.with_({path: ends[0]})).system)
    share = _COMPILED if is_fast else _GENERAL
    work = _Branches(follow, stretch_of(report, 0.0, share), so_far)
    # branches
    whole = work.followed_within(share * seconds)
    if whole is not None:
        report(1.0)
        return whole
    # sweeps
    sweeps = None
    if not work.is_stopped:
        words = partial(_known_words, model, path)
        part = TimeLimit(_SWEEPS * seconds - (seconds - limit.left))
        telling = _telling(report, share, getattr(progress, "because", None))
        sweeper = Sweeper(model, path, (min(ends), max(ends)), limit=part, progress=telling, words=words)
        sweeps = sweeper.sweep()
        work.is_stopped = sweeper.is_stopped
    # what is left: branches once more, or short ones through the jumps
    if sweeps is not None and sweeps.is_complete and not is_fast:
        whole = work.followed_within(limit.left)
        if whole is not None:
            return whole
    branch = work.known or Branch(model, path, ends, 1, ())
    if sweeps is None or not sweeps.values:
        return _without_sweeps(branch, work, seconds)
    if not work.is_stopped:
        sweeps = _located(model, path, sweeps, follow_near, limit)
    return replace(branch, notes=(*branch.notes, *_notes(branch, sweeps, work.why)), sweeps=sweeps)


class _Branches:
    """Branches that are followed, perhaps not to their ends.

    Attributes
    ----------
    known
        so far; None where no motion was found yet.
    why
        they are not whole.
    is_stopped
        whether somebody stopped the work.
    """

    def __init__(self, follow: Following, report: Progress, so_far: Callable[[Branch], None] | None) -> None:
        self.known: Branch | None = None
        self.why = ""
        self.is_stopped = False
        self._follow = follow
        self._report = report
        self._so_far = so_far

    def followed_within(self, seconds: float) -> Branch | None:
        """Follow them for so long; return them if they come to their ends.

        Cancelled or KeyboardInterrupt where the work was stopped, and nothing is known yet.
        """
        try:
            with limited(TimeLimit(seconds)):
                return self._follow(progress=self._tell, so_far=self._keep)
        except OutOfTime:
            self.why = "the time for them was over"
        except ConvergenceError as error:
            self.why = error.message
        except (Cancelled, KeyboardInterrupt):
            if self.known is None:
                raise
            self.is_stopped = True
        return None

    def _keep(self, branch: Branch) -> None:
        self.known = branch
        if self._so_far is not None:
            self._so_far(branch)

    def _tell(self, share: float) -> None:
        check_time()
        self._report(share)


def _telling(report: Progress, begin: float, because: Callable[[str], None] | None) -> Progress:
    """The progress of the sweeps, from a share of the whole on; with what is known so far, in words."""
    part = stretch_of(report, begin, _SWEEPS)
    if because is not None:
        part.because = because  # type: ignore[attr-defined]
    return part


def _known_words(model: Model, path: str, sweeps: Sweeps) -> str:
    """What sweeps have shown so far, for a progress line."""
    largest = max(map(abs, sweeps.ends))
    jumps = [
        f"{'up' if jump.upward else 'down'} at {shown_value(path, model, jump.value, 4, largest)}"
        for jump in sweeps.jumps[:_MOST_TOLD]
    ]
    known = f"motions known at {counted(len(sweeps.values), 'value')}"
    return f"{known}; jumps {', '.join(jumps)}" if jumps else known


def _located(model: Model, path: str, sweeps: Sweeps, follow_near: Continuing, limit: TimeLimit) -> Sweeps:
    """The sweeps with those jumps located that a short branch shows."""
    jumps = list(sweeps.jumps)
    with suppress(OutOfTime, Cancelled, KeyboardInterrupt), limited(limit):
        for k, jump in enumerate(jumps):
            if jump.before.cycles:
                with suppress(ConvergenceError, ModelError):
                    jumps[k] = _on_branch(model, path, jump, follow_near)
    return replace(sweeps, jumps=tuple(jumps))


def _on_branch(model: Model, path: str, jump: Jump, follow_near: Continuing) -> Jump:
    """A jump located on the branch of the motion before it; the same where the branch does not end there."""
    before = jump.before.value
    after = jump.after.value
    orbit = settled_orbit(model.with_({path: before}), jump.before.end, jump.before.cycles)
    if orbit is None:
        return jump
    branch = follow_near((before, after), start=orbit, cycles=orbit.cycles)
    losses = [loss for loss in losses_of(branch) if loss.upward == jump.upward and loss.jumps is not False]
    first = min(losses, key=lambda loss: abs(loss.value - before), default=None)
    return jump if first is None else replace(jump, kind=first.kind, located=first.value)


def _without_sweeps(branch: Branch, work: _Branches, seconds: float) -> Branch:
    """The branches so far, where no sweep was made; ConvergenceError or Cancelled where there are none either."""
    if branch.curves:
        return replace(branch, notes=(*branch.notes, _stopped_at(branch)))
    if work.is_stopped:
        raise Cancelled("stopped before a motion was known")
    message = f"no motion was known after {seconds:.3g} s: {work.why}"
    raise ConvergenceError(message, remedy="more time, a narrower range, or a smaller model (gr.reduce)")


def _stopped_at(branch: Branch) -> str:
    """Up to where the branches were followed."""
    last = branch.points[-1].parameter
    reached = shown_value(branch.path, branch.model, last, 6, max(map(abs, branch.range)))
    return (
        f"Stopped: {counted(len(branch.curves), 'branch', 'branches')} followed, the last one to {reached}. Further "
        "branches were not looked for."
    )


def _notes(branch: Branch, sweeps: Sweeps, why: str) -> list[str]:
    """What was not looked at."""
    followed = "Branches were not followed to their ends" if branch.curves else "No branch was followed"
    notes = [
        f"{followed}: {why}. So the stable motions come from exact runs, up and down, at "
        f"{counted(len(sweeps.values), 'value')}. Unstable motions, and stable ones that neither direction comes to, "
        "are not among them."
    ]
    if not sweeps.is_complete:
        notes.append(
            "The work was stopped before all jumps were narrowed and all values gone through: a jump known to a wide "
            "range only may be a steep change."
        )
    for value, reason in sweeps.failures:
        notes.append(f"No run could be followed at {shown_value(branch.path, branch.model, value, 6)}: {reason}.")
    return notes
