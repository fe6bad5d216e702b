"""The table of algorithms, by their names in files, calls and on the command line."""

from __future__ import annotations

from gearrattle.engine.solvers.cvode import multistep
from gearrattle.engine.solvers.one_step import ChosenStep, FixedStep, extrapolation
from gearrattle.engine.solvers.scheme_choice import start_exact
from gearrattle.engine.solvers.scipy_ivp import stepped
from gearrattle.engine.solvers.solver import Extensible, Marching, Motion, Solver, Task
from gearrattle.engine.solvers.sundials import ADAMS, BDF
from gearrattle.engine.solvers.tableaus import CLASSICAL, FEHLBERG, MIDPOINT, VERNER

SOLVERS: dict[str, Solver] = {
    "exact": start_exact,
    "rk2": FixedStep(MIDPOINT),
    "rk4": FixedStep(CLASSICAL),
    "rkf": ChosenStep(FEHLBERG),
    "rkv": ChosenStep(VERNER),
    "adams": multistep("adams", ADAMS, newton=False),
    "gear": multistep("gear", BDF, newton=True),
    "bulirsch-stoer": extrapolation,
    "rkv-events": ChosenStep(VERNER.extrapolated(), at_corners=True),
    "gear-events": multistep("gear-events", BDF, newton=True, events=True),
    "dop853": stepped("DOP853"),
    "radau": stepped("Radau"),
}
"""Name -> function that starts a run on a task."""

__all__ = ["SOLVERS", "Extensible", "Marching", "Motion", "Solver", "Task"]
