"""The table of the kinds of results: how each one is presented.

To add a kind: a class derived from ``Presentation`` in a file of this folder, and its line here.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.report.presentation import Presentation
from gearrattle.result import KIND, Result

PRESENTATIONS: Mapping[str, str] = {
    "run": "gearrattle.report.run_report:RunReport",
    "motion": "gearrattle.report.motion:MotionReport",
    "verdict": "gearrattle.report.run_report:VerdictReport",
    "Campbell diagram": "gearrattle.report.modes:CampbellPage",
    "modes": "gearrattle.report.modes:ModesPage",
    "comparison": "gearrattle.report.comparison:ComparisonPage",
    "validation": "gearrattle.report.validation:ValidationPage",
    "validation of a run-up": "gearrattle.report.run_up_validation:RunUpPage",
    "reduction": "gearrattle.report.reductions:ReductionPage",
    "condensation": "gearrattle.report.reductions:CondensedPage",
    "scaling": "gearrattle.report.scaling:ScalingPage",
    "fit": "gearrattle.report.fits:FitPage",
    "loop fit": "gearrattle.report.loop_fit:LoopFitPage",
    "stiffness": "gearrattle.report.stiffness:StiffnessPage",
    "equilibrium": "gearrattle.report.equilibrium:EquilibriumPage",
    "advice": "gearrattle.report.advice:AdvicePage",
    "torque over angle": "gearrattle.report.torque_angle:TorqueAnglePage",
    "gas torque": "gearrattle.report.gas_torque:GasTorquePage",
    "contents": "gearrattle.report.contents:ContentsPage",
    "sound": "gearrattle.report.sound.page:SoundPage",
    "reproduction": "gearrattle.reproduction.page:ReproductionPage",
    "study": "gearrattle.report.study:StudyReport",
    "sensitivities": "gearrattle.report.of_studies:SensitivitiesPage",
    "rattle probability": "gearrattle.report.of_studies:ProbabilityPage",
    "regime boundary": "gearrattle.report.of_studies:BoundaryPage",
    "screening": "gearrattle.report.screening:ScreeningPage",
    "spectra": "gearrattle.report.spectra:SpectraPage",
    "density": "gearrattle.report.spectra:DensityPage",
    "cross density": "gearrattle.report.spectra:CrossDensityPage",
    "coherence": "gearrattle.report.spectra:CoherencePage",
    "order map": "gearrattle.report.orders:OrderMapPage",
    "order cuts": "gearrattle.report.orders:OrderCutsPage",
    "waterfall": "gearrattle.report.orders:WaterfallPage",
    "metrics": "gearrattle.report.metrics:MetricsPage",
    "periodic motion": "gearrattle.report.orbits:PeriodicMotionPage",
    "periodic motions": "gearrattle.report.orbits:PeriodicMotionsPage",
    "settled motion": "gearrattle.report.settled_motion:SettledMotionPage",
    "branches": "gearrattle.report.branches:BranchesPage",
    "map of motions": "gearrattle.report.motion_map:MotionMapPage",
    "event boundary": "gearrattle.report.event_boundary:EventBoundaryPage",
    "jumps of run-ups": "gearrattle.report.run_up_jumps:RunUpJumpsPage",
    "cause": "gearrattle.report.cause:CausePage",
    "proof of quiet": "gearrattle.report.quiet_proof:QuietProofPage",
    "threshold": "gearrattle.report.threshold:ThresholdPage",
    "remedies": "gearrattle.report.remedies:RemediesPage",
    "contact ratio": "gearrattle.report.contact_ratio:ContactRatioPage",
}
"""Kind of result -> module and class."""


def presentation_of(result: Any) -> Presentation[Any]:
    """Return the presentation of a result or of labelled data that gearrattle returned; a presentation stays itself.

    Raises
    ------
    ModelError
        it is none of these.
    """
    if isinstance(result, Presentation):
        return result
    kind = kind_of(result)
    if kind is None:
        remedy = 'give what a function of gearrattle returned; it names its kind in attrs["result"]'
        raise ModelError(Problem("result", type(result).__name__, "is no result of gearrattle", remedy))
    return presentation_class(kind)(result)


def presentation_class(kind: str) -> type[Presentation[Any]]:
    """Return the class that presents a kind of result."""
    module, _, name = PRESENTATIONS[kind].partition(":")
    presentation: type[Presentation[Any]] = getattr(import_module(module), name)
    return presentation


def kind_of(result: Any) -> str | None:
    """Return the kind of a result; None for what is none."""
    if isinstance(result, Result):
        return type(result).shown_as or result.kind
    kind = getattr(result, "attrs", {}).get(KIND)
    return kind if kind in PRESENTATIONS else None
