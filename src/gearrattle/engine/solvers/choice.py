"""``exact`` has two marches that keep the same promises; a driveline gets the one that suits it.

Tables of the matrix exponential (``exact``) take long steps once a region's are built, but every region met costs an
eigendecomposition, and with K clearances in play there are some 3^K. The sweep (``sweep``) builds nothing and takes
short steps, *windows*, a few to the period of the fastest mode. So: the sweep where the driveline has more regions than
a period has windows, and more than can be built in passing; and where it has so many inertias that a single region
takes seconds. A transmission with stiff meshes and five clearances has 243 regions and some thousand windows; a train
of ten inertias with five clearances and contact modes of a few dozen times the excitation's frequency 243 and 96. Both
runs through there are measured on the page ``docs/reference/growth.md``.
"""

from __future__ import annotations

from math import prod

from gearrattle.engine.solvers.base import Marching, Task
from gearrattle.engine.solvers.exact import ExactMarch
from gearrattle.engine.solvers.sweep import SweepMarch
from gearrattle.engine.system.network import Majorant, is_sparse, windows_of
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.remember import kept

FEW_REGIONS = 100  # built in a tenth of a second
MANY_INERTIAS = 200  # one region takes seconds to build, and grows with their third power


def regions_of(system: PiecewiseSystem) -> int:
    """How many regions there are."""
    return prod(law.pieces for law in system.laws)


@kept
def is_large(system: PiecewiseSystem) -> bool:
    """Whether the sweep suits a system better; every element must join two inertias at most, and stand alone."""
    return (
        not system.auxiliaries
        and system.signals is None
        and (system.size > MANY_INERTIAS or regions_of(system) > FEW_REGIONS)
        and is_sparse(system)
        and (system.size > MANY_INERTIAS or regions_of(system) > windows_of(system, Majorant(system)))
    )


def start_exact(task: Task) -> Marching:
    """Start a run of the algorithm ``exact``."""
    return SweepMarch(task) if is_large(task.system) else ExactMarch(task)
