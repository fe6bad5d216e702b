"""Classes of returned objects and of the parts of errors, for type annotations; users do not construct them.

Examples
--------
>>> from gearrattle.typing import Modes
>>> isinstance(gr.modes(gr.example("case3")), Modes)
True
"""

from gearrattle.advice import Advice
from gearrattle.analysis.campbell import Campbell
from gearrattle.analysis.scaling import Nondimensional
from gearrattle.analysis.statics import Equilibrium, Modes
from gearrattle.analysis.stiffness import Stiffness
from gearrattle.analysis.torque_angle import TorqueAngle
from gearrattle.causes import Cause
from gearrattle.errors import Problem
from gearrattle.exchange.model_exchange import ExportedModel, ImportedModel
from gearrattle.measured.gas_torque import GasTorque
from gearrattle.measured.identification.fit_result import Fit
from gearrattle.measured.identification.loop_result import LoopFit
from gearrattle.measured.look import Contents
from gearrattle.measured.validation import RunUp, Validation
from gearrattle.model import Factor
from gearrattle.orbits import Branch, MotionMap, Orbit, PeriodicMotions, RunUpJumps
from gearrattle.pipeline import Findings
from gearrattle.quantities.verdict import Verdict
from gearrattle.reductions.condense import Condensed
from gearrattle.reductions.reduction import Reduction
from gearrattle.report.figures import Figures
from gearrattle.report.sound.listen import Sound
from gearrattle.result import Result
from gearrattle.simulation.stream import Stream
from gearrattle.studies.quiet import QuietProof

__all__ = [
    "Advice",
    "Branch",
    "Campbell",
    "Cause",
    "Condensed",
    "Contents",
    "Equilibrium",
    "ExportedModel",
    "Factor",
    "Figures",
    "Findings",
    "Fit",
    "GasTorque",
    "ImportedModel",
    "LoopFit",
    "Modes",
    "MotionMap",
    "Nondimensional",
    "Orbit",
    "PeriodicMotions",
    "Problem",
    "QuietProof",
    "Reduction",
    "Result",
    "RunUp",
    "RunUpJumps",
    "Sound",
    "Stiffness",
    "Stream",
    "TorqueAngle",
    "Validation",
    "Verdict",
]
