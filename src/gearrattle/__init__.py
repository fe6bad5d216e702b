"""gearrattle: exact, certified simulation of gear rattle in torsional drivelines with clearances.

The flow, in the order of the 1995 paper it starts from (Padmanabhan, Barlow, Rook, Singh, ASME J. Mech. Des. 117, 185):

    model   = gr.example("case3")            a driveline in words: inertias, clutches, meshes, torques, units
    rest    = gr.equilibrium(model)          its static equilibrium under the mean loads
    modes   = gr.modes(model)                how it would vibrate without clearances
    small   = gr.reduce(model, "75 Hz")      a smaller model that is valid up to 75 Hz, with its error
    advice  = gr.advise(model)               forecasts of a run, with their evidence
    run     = gr.simulate(model)             its motion with every impact
    verdict = gr.criteria(run)               does it rattle, where, how badly
    all     = gr.run(model)                  all of it; all.save("folder") writes the report

The public names and the files they come from are in ``__init__.pyi``, which type checkers and lazy_loader read
(Scientific Python Ecosystem Coordination, SPEC 1). A name is imported at its first use, so that ``import gearrattle``
and ``gearrattle --help`` are fast. With the environment variable ``EAGER_IMPORT=1`` all names are imported at once.
"""

from __future__ import annotations

from importlib.metadata import version
from types import ModuleType

from lazy_loader import attach_stub

from gearrattle.result import show_results_by


def _view() -> ModuleType:
    """Return the module that shows results, imported when a result is shown."""
    from gearrattle.report import result_view

    return result_view


show_results_by(_view)
__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
__version__ = version("gearrattle")
