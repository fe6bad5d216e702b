"""Advice on other motions at the same load: motions from many starts, and where they settle (``orbits.attractors``).

A simulation shows one motion. Under the same load there may be others; the initial state decides which motion the
driveline takes. The search for other motions has a limit in function calls of the exact solution, predicted from the
pilot, so that the answer does not depend on the machine: ``ADVISED`` calls, about a second, in an advice; ``PASSING``
calls, some hundredths of a second, in a run whose user did not ask for advice. Beyond ``SMALL`` inertias the cost of a
call grows with about the square of the number of inertias, and the limit falls in the same ratio. An advice simulates
as many starts as its calls allow, but at least ``PILOTS`` times the periods of the pilot, and says how many starts it
left out. Irregular motions visit ever new regions; building a region takes as long as ``REGION`` calls. So the number
of new regions is limited by the same number of calls.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from gearrattle.advice.advice_record import Line
from gearrattle.advice.pilot import Pilot
from gearrattle.assembly import assemble
from gearrattle.errors import ConvergenceError, ModelError
from gearrattle.model import Model
from gearrattle.orbits.settling_limits import BLOCK, BLOCKS, STARTS
from gearrattle.wording import counted

if TYPE_CHECKING:
    from gearrattle.orbits.attractors import Settled

TOPIC = "other motions"
ADVISED = 2_000_000
"""Function calls of the search in an advice, for a driveline of up to ``SMALL`` inertias."""
PASSING = 100_000
"""Function calls of the search in a run, for a driveline of up to ``SMALL`` inertias."""
SMALL = 8
"""Number of inertias up to which a call costs about the same."""
PILOTS = 2.0
"""Periods that an advice may simulate in any case, over those of the pilot."""
REGION = 2000
"""Function calls that take as long as building one region."""
_SHARE = 0.1  # share of the planned run's function calls that the search may spend in any case
PERIODS = (1 + STARTS) * BLOCKS * BLOCK
"""Largest number of periods of the whole search."""
_REMEDY = "gr.basins looks for motions that settle, gr.periodic(model, every=True) for all that repeat"
_REACH = "starts lie evenly within 4 times the largest clearance, else turning and wound up as the pilot"


def others_of(
    model: Model, pilot: Pilot, *, is_asked: bool, progress: Callable[[float], None] | None = None
) -> tuple[tuple[Line, ...], tuple[str, ...]]:
    """Return a line and a note on other motions at this load.

    Parameters
    ----------
    is_asked
        whether the user asked for advice; otherwise there is no line if the search would cost too much.

    Returns
    -------
    tuple[tuple[Line, ...], tuple[str, ...]]
        No line for a driveline without clearances, or whose state cannot repeat. A note if another motion exists.
    """
    # bound on the function calls of the search
    if not pilot.run.trajectory.layout.clearance_names:
        return (), ()
    most = periods_for(pilot, ADVISED if is_asked else PASSING)
    if is_asked:
        most = max(most, PILOTS * pilot.run.trajectory.cycles)
    elif most < PERIODS:
        return (), ()
    from gearrattle.engine.periodic.period_map import PeriodMap
    from gearrattle.orbits.attractors import settled_motions
    from gearrattle.orbits.balanced import balanced
    from gearrattle.orbits.start_states import check_repeats, state_of

    # drivelines whose states cannot repeat
    model = balanced(model)
    try:
        check_repeats(model)
    except ModelError:
        return (), ()
    # simulate from many starts until the motions settle
    try:
        start = state_of(model, PeriodMap(assemble(model).system), pilot.run)
        regions = calls_for(pilot, ADVISED if is_asked else PASSING) / REGION
        settled = settled_motions(model, start, progress=progress, most_periods=most, most_regions=regions)
    except ConvergenceError:
        return (), ()
    # line and note
    words = words_of(settled)
    evidence = [_counts(settled), _REACH] if settled.starts else []
    if settled.left_out:
        evidence += [_left_out(settled, most), _REMEDY]
    return (Line(TOPIC, words, tuple(evidence)),), (words,) if others_in(settled) else ()


def periods_for(pilot: Pilot, calls: float) -> float:
    """Return the number of periods that the search for other motions may simulate.

    ``calls`` is the limit of function calls for a driveline of up to ``SMALL`` inertias.
    """
    return calls_for(pilot, calls) * pilot.run.trajectory.cycles / pilot.run.cost.function_calls


def calls_for(pilot: Pilot, calls: float) -> float:
    """Return the number of function calls that the search may spend; arguments as of ``periods_for``."""
    bodies = len(pilot.run.trajectory.layout.inertia_names)
    allowed = calls / max(1.0, bodies / SMALL) ** 2
    planned = pilot.run.cost.function_calls * pilot.stretched
    return max(allowed, _SHARE * planned)


def others_in(settled: Settled) -> list[int]:
    """Return the indices of motions on which a start settles, without the motion of the pilot."""
    return [i for i, count in enumerate(settled.counts) if i != settled.own and count]


def words_of(settled: Settled) -> str:
    """Return a sentence on the motions besides that of the pilot."""
    others = others_in(settled)
    # no search from other starts
    if not settled.starts and not others:
        own = f"the pilot settles in {settled.names[settled.own]}; " if settled.own >= 0 else ""
        return f"Not looked for: {own}other starts cost more than advice may spend."
    # other motions with the share of their basins
    basins = "; ".join(
        f"{settled.names[i]}, basin about {_percent(settled.counts[i] / settled.starts)}" for i in others
    )
    # pilot run that has not settled
    if settled.own < 0:
        if not others:
            periods = BLOCK * BLOCKS
            return (
                f"None of {counted(settled.starts, 'start')} settled within {counted(periods, 'period')}: motions here "
                "settle slowly or do not repeat."
            )
        return f"The pilot has not settled; from other starts the driveline settles at this load: {basins}."
    # settled pilot run, no other motion
    if not others:
        left = f", {settled.unsettled} had not settled" if settled.unsettled else ""
        return (
            f"None was found beside {settled.names[settled.own]}: {settled.counts[settled.own]} of "
            f"{counted(settled.starts, 'start')} settle in it{left}. That is no proof that there is none."
        )
    first = "A second motion exists" if len(others) == 1 else f"{len(others)} other motions exist"
    return f"{first} at this load: {basins}."


def _counts(settled: Settled) -> str:
    """Number of starts that settle on each motion, with the interval of its share, and of starts that do not settle."""
    parts = []
    for i, name in enumerate(settled.names):
        low, high = settled.interval(i)
        own = " (the pilot's)" if i == settled.own else ""
        parts.append(f"{name}{own} {settled.counts[i]}, 95 % interval {_percent(low)} to {_percent(high)}")
    if settled.unsettled:
        parts.append(f"not settled after {BLOCK * BLOCKS} periods {settled.unsettled}")
    return f"of {counted(settled.starts, 'start')}: {'; '.join(parts)}"


def _left_out(settled: Settled, most: float) -> str:
    """Number of starts that were not simulated, and why."""
    total = settled.starts + settled.left_out
    return (
        f"{settled.left_out} of {counted(total, 'start')} left out: advice follows {most:.0f} periods here, and all "
        f"starts take up to {PERIODS}"
    )


def _percent(share: float) -> str:
    return f"{100.0 * share:.{2 if share < 0.995 else 3}g} %"  # no 1e+02
