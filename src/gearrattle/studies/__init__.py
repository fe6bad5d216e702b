"""Studies: one driveline, many variants; maps and tolerances; what is done survives being killed.

``study`` is the call; ``plan`` says which cases there are, ``outputs`` what is kept of each, ``cases`` computes a chunk
of them, ``schedulers`` deal chunks out, ``store`` keeps them, ``prepared`` carries a study out. ``kinds`` is a shelf:
what a study file may ask for. What is made of the Dataset: ``boundary``, ``probability`` and ``sensitivity``.
"""

from gearrattle.studies.attraction import basins
from gearrattle.studies.boundary import regime_boundary
from gearrattle.studies.diagram import bifurcation
from gearrattle.studies.kept import open_study
from gearrattle.studies.optimization import optimize
from gearrattle.studies.probability import rattle_probability, samples_needed
from gearrattle.studies.quiet import prove_quiet
from gearrattle.studies.screening import screen
from gearrattle.studies.sensitivity import sensitivities
from gearrattle.studies.study import study

__all__ = [
    "basins",
    "bifurcation",
    "open_study",
    "optimize",
    "prove_quiet",
    "rattle_probability",
    "regime_boundary",
    "samples_needed",
    "screen",
    "sensitivities",
    "study",
]
