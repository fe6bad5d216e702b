"""``exact`` has two schemes with the same accuracy; this module chooses between them for a driveline.

*Tables* of the matrix exponential (``exact``) allow long steps once the tables of a region are built. But every region
visited costs an eigendecomposition, and K clearances have about 3^K regions. The *sweep* (``sweep``) builds no tables
and takes short steps, *windows*, a few per period of the fastest mode.

The sweep is chosen if the driveline has more regions than a period has windows and more than ``FEW_REGIONS``, or if it
has more than ``MANY_INERTIAS`` inertias. It supports only elements between at most two inertias, no auxiliaries and no
inputs over time. Two examples: a transmission with stiff meshes and five clearances has 243 regions and about a
thousand windows per period; a train of ten inertias with five clearances, whose contact modes have a few dozen times
the excitation's frequency, has 243 regions and 96 windows. Computing times of both are in ``docs/reference/growth.md``.
"""

from __future__ import annotations

from math import prod

from gearrattle.derived_values import kept
from gearrattle.engine.solvers.exact import ExactMarch
from gearrattle.engine.solvers.solver import Marching, Task
from gearrattle.engine.solvers.window_solver import SweepMarch
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.sparse_arrays import Majorant, is_sparse, windows_of

FEW_REGIONS = 100  # built in a tenth of a second
MANY_INERTIAS = 200  # from here building one region takes seconds; the time grows with the third power

SOME_INERTIAS = 20
"""Up to here the regions that one period visits are built sooner than its gradient is found without them: with five
gaps at 24, 32, 64 inertias a period with gradient takes 56, 122, 774 ms by tables, 38, 46, 183 ms by the sweep."""


def regions_of(system: PiecewiseSystem) -> int:
    """Number of regions of a system."""
    return prod(law.pieces for law in system.laws)


@kept
def is_large(system: PiecewiseSystem) -> bool:
    """Whether the sweep is the better scheme for a system; False if the sweep does not support it."""
    return (
        not system.auxiliaries
        and system.signals is None
        and (system.size > MANY_INERTIAS or regions_of(system) > FEW_REGIONS)
        and is_sparse(system)
        and (system.size > MANY_INERTIAS or regions_of(system) > windows_of(system, Majorant(system)))
    )


def is_large_for_periods(system: PiecewiseSystem) -> bool:
    """Whether the sweep is the better scheme for single periods, which visit few of the regions."""
    return system.size > SOME_INERTIAS and is_large(system)


def start_exact(task: Task) -> Marching:
    """Start a run of the algorithm ``exact``."""
    return SweepMarch(task) if is_large(task.system) else ExactMarch(task)
