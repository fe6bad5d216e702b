"""Studies of many variants of one driveline: maps and tolerances. A study that was stopped goes on from what it kept.

``study`` is the call. ``plan`` lists the cases, ``outputs`` what is kept of each; ``case_runs`` computes a chunk of
them, ``schedulers`` distribute the chunks, ``study_store`` keeps the results, ``prepared`` carries a study out.
``kinds`` holds the kinds of studies that a study file may ask for. ``regime_boundary``, ``probability`` and
``sensitivity`` evaluate the Dataset.
"""

from gearrattle.studies.basins_study import basins
from gearrattle.studies.bifurcation_study import bifurcation
from gearrattle.studies.conditions_study import conditions
from gearrattle.studies.optimization import optimize
from gearrattle.studies.probability import rattle_probability, samples_needed
from gearrattle.studies.quiet import prove_quiet
from gearrattle.studies.regime_boundary import regime_boundary
from gearrattle.studies.screening import screen
from gearrattle.studies.sensitivity import sensitivities
from gearrattle.studies.stored_studies import open_study
from gearrattle.studies.study import study

__all__ = [
    "basins",
    "bifurcation",
    "conditions",
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
