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
    "motion": "gearrattle.report.motion_page:MotionReport",
    "verdict": "gearrattle.report.run_report:VerdictReport",
    "Campbell diagram": "gearrattle.report.campbell_page:CampbellPage",
    "modes": "gearrattle.report.modes_page:ModesPage",
    "comparison": "gearrattle.report.comparison_page:ComparisonPage",
    "validation": "gearrattle.report.validation_page:ValidationPage",
    "validation of a run-up": "gearrattle.report.run_up_validation_page:RunUpPage",
    "reduction": "gearrattle.report.reduction_pages:ReductionPage",
    "condensation": "gearrattle.report.reduction_pages:CondensedPage",
    "scaling": "gearrattle.report.scaling_page:ScalingPage",
    "fit": "gearrattle.report.fit_pages:FitPage",
    "loop fit": "gearrattle.report.loop_fit_page:LoopFitPage",
    "stiffness": "gearrattle.report.stiffness_page:StiffnessPage",
    "equilibrium": "gearrattle.report.equilibrium_page:EquilibriumPage",
    "advice": "gearrattle.report.advice_page:AdvicePage",
    "torque over angle": "gearrattle.report.torque_angle_page:TorqueAnglePage",
    "gas torque": "gearrattle.report.gas_torque_page:GasTorquePage",
    "contents": "gearrattle.report.contents_page:ContentsPage",
    "sound": "gearrattle.report.sound.sound_page:SoundPage",
    "reproduction": "gearrattle.reproduction.reproduction_page:ReproductionPage",
    "study": "gearrattle.report.study_report:StudyReport",
    "sensitivities": "gearrattle.report.study_result_pages:SensitivitiesPage",
    "rattle probability": "gearrattle.report.study_result_pages:ProbabilityPage",
    "regime boundary": "gearrattle.report.study_result_pages:BoundaryPage",
    "screening": "gearrattle.report.screening_page:ScreeningPage",
    "spectra": "gearrattle.report.spectra_pages:SpectraPage",
    "density": "gearrattle.report.spectra_pages:DensityPage",
    "cross density": "gearrattle.report.spectra_pages:CrossDensityPage",
    "coherence": "gearrattle.report.spectra_pages:CoherencePage",
    "order map": "gearrattle.report.order_pages:OrderMapPage",
    "order cuts": "gearrattle.report.order_pages:OrderCutsPage",
    "waterfall": "gearrattle.report.order_pages:WaterfallPage",
    "metrics": "gearrattle.report.metrics_page:MetricsPage",
    "periodic motion": "gearrattle.report.periodic_motion_pages:PeriodicMotionPage",
    "periodic motions": "gearrattle.report.periodic_motion_pages:PeriodicMotionsPage",
    "settled motion": "gearrattle.report.settled_motion_page:SettledMotionPage",
    "branches": "gearrattle.report.branches_page:BranchesPage",
    "map of motions": "gearrattle.report.motion_map_page:MotionMapPage",
    "event boundary": "gearrattle.report.event_boundary_page:EventBoundaryPage",
    "jumps of run-ups": "gearrattle.report.run_up_jumps_page:RunUpJumpsPage",
    "cause": "gearrattle.report.cause_page:CausePage",
    "proof of quiet": "gearrattle.report.quiet_proof_page:QuietProofPage",
    "threshold": "gearrattle.report.threshold_page:ThresholdPage",
    "remedies": "gearrattle.report.remedies_page:RemediesPage",
    "contact ratio": "gearrattle.report.contact_ratio_page:ContactRatioPage",
}
"""Module and class of the presentation, by kind of result."""


def presentation_of(result: Any) -> Presentation[Any]:
    """Return the presentation of a result or of labelled data from gearrattle; a presentation is returned unchanged.

    ModelError for any other object.
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
    """Return the kind of a result; None for anything else."""
    if isinstance(result, Result):
        return type(result).shown_as or result.kind
    kind = getattr(result, "attrs", {}).get(KIND)
    return kind if kind in PRESENTATIONS else None
