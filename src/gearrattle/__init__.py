"""gearrattle: exact, certified simulation of gear rattle in torsional drivelines with clearances.

The flow, in the order of the 1995 paper it starts from (Padmanabhan, Barlow, Rook, Singh, ASME J. Mech. Des. 117, 185):

    model   = gr.example("case3")            a driveline in words: inertias, clutches, meshes, torques, units
    rest    = gr.equilibrium(model)          where it rests under its mean loads
    modes   = gr.modes(model)                how it would vibrate without clearances
    small   = gr.reduce(model, "75 Hz")      a smaller model that is as good up to 75 Hz, and how good
    advice  = gr.advise(model)               what to expect of a run, and on what evidence
    run     = gr.simulate(model)             its motion, every impact found
    verdict = gr.criteria(run)               does it rattle, where, how badly

Names are imported when first used, so that ``import gearrattle`` and ``gearrattle --help`` cost next to nothing.
"""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.metadata import version as _version
from types import ModuleType
from typing import TYPE_CHECKING, Any

from gearrattle.errors import Cancelled, ConvergenceError, GearRattleError, ModelError, Problem

if TYPE_CHECKING:
    from gearrattle.advice import Advice, advise
    from gearrattle.calls.campbell import Campbell, campbell
    from gearrattle.calls.condense import Condensed, condense
    from gearrattle.calls.contact_ratio import contact_ratio
    from gearrattle.calls.densities import coherence, cross_psd, psd
    from gearrattle.calls.drive import drive
    from gearrattle.calls.gas_torque import GasTorque, gas_torque
    from gearrattle.calls.judge import criteria
    from gearrattle.calls.look import Contents, look
    from gearrattle.calls.measure import metrics
    from gearrattle.calls.orders import order_cuts, order_map
    from gearrattle.calls.read import read
    from gearrattle.calls.reduce import reduce
    from gearrattle.calls.reduction import Reduction
    from gearrattle.calls.scaling import Nondimensional, nondimensionalize
    from gearrattle.calls.simulate import simulate
    from gearrattle.calls.spectra import spectra
    from gearrattle.calls.statics import Equilibrium, Modes, equilibrium, modes
    from gearrattle.calls.stiffness import Stiffness, stiffness
    from gearrattle.calls.store import open_stream
    from gearrattle.calls.stream import Stream, stream
    from gearrattle.calls.torque_angle import TorqueAngle, torque_angle
    from gearrattle.calls.waterfall import waterfall
    from gearrattle.criteria import Verdict
    from gearrattle.identification.fit import fit
    from gearrattle.identification.fitted import Fit
    from gearrattle.identification.loop_fit import fit_loop
    from gearrattle.identification.loop_result import LoopFit
    from gearrattle.model import Model, example, json_schema, load, loads
    from gearrattle.readers import write
    from gearrattle.recording import Channel, Recording
    from gearrattle.report.figures import Figures, figures
    from gearrattle.results import Run, open_run
    from gearrattle.sound.listen import Sound, listen
    from gearrattle.studies import (
        basins,
        bifurcation,
        open_study,
        optimize,
        rattle_probability,
        regime_boundary,
        samples_needed,
        screen,
        sensitivities,
        study,
    )
    from gearrattle.validation import RunUp, Validation, validate, validate_run_up

_HOME = {
    "Model": "model",
    "load": "model",
    "loads": "model",
    "json_schema": "model",
    "example": "model",
    "simulate": "calls.simulate",
    "equilibrium": "calls.statics",
    "Equilibrium": "calls.statics",
    "modes": "calls.statics",
    "Modes": "calls.statics",
    "campbell": "calls.campbell",
    "Campbell": "calls.campbell",
    "contact_ratio": "calls.contact_ratio",
    "gas_torque": "calls.gas_torque",
    "GasTorque": "calls.gas_torque",
    "nondimensionalize": "calls.scaling",
    "Nondimensional": "calls.scaling",
    "stiffness": "calls.stiffness",
    "Stiffness": "calls.stiffness",
    "reduce": "calls.reduce",
    "condense": "calls.condense",
    "Condensed": "calls.condense",
    "Reduction": "calls.reduction",
    "criteria": "calls.judge",
    "metrics": "calls.measure",
    "Verdict": "criteria",
    "Run": "results",
    "open_run": "results",
    "figures": "report.figures",
    "Figures": "report.figures",
    "compare": "comparison.compare",
    "advise": "advice",
    "basins": "studies",
    "bifurcation": "studies",
    "study": "studies",
    "open_study": "studies",
    "optimize": "studies",
    "rattle_probability": "studies",
    "regime_boundary": "studies",
    "samples_needed": "studies",
    "screen": "studies",
    "sensitivities": "studies",
    "Advice": "advice",
    "fit": "identification.fit",
    "validate": "validation",
    "Validation": "validation",
    "validate_run_up": "validation",
    "RunUp": "validation",
    "Fit": "identification.fitted",
    "fit_loop": "identification.loop_fit",
    "LoopFit": "identification.loop_result",
    "stream": "calls.stream",
    "Stream": "calls.stream",
    "open_stream": "calls.store",
    "listen": "sound.listen",
    "Sound": "sound.listen",
    "torque_angle": "calls.torque_angle",
    "TorqueAngle": "calls.torque_angle",
    "look": "calls.look",
    "Contents": "calls.look",
    "read": "calls.read",
    "write": "readers",
    "drive": "calls.drive",
    "psd": "calls.densities",
    "cross_psd": "calls.densities",
    "coherence": "calls.densities",
    "spectra": "calls.spectra",
    "order_map": "calls.orders",
    "order_cuts": "calls.orders",
    "waterfall": "calls.waterfall",
    "Recording": "recording",
    "Channel": "recording",
}

__version__ = _version("gearrattle")
__all__ = [
    "Advice",
    "Campbell",
    "Cancelled",
    "Channel",
    "Condensed",
    "Contents",
    "ConvergenceError",
    "Equilibrium",
    "Figures",
    "Fit",
    "GasTorque",
    "GearRattleError",
    "LoopFit",
    "Model",
    "ModelError",
    "Modes",
    "Nondimensional",
    "Problem",
    "Recording",
    "Reduction",
    "Run",
    "RunUp",
    "Sound",
    "Stiffness",
    "Stream",
    "TorqueAngle",
    "Validation",
    "Verdict",
    "advise",
    "basins",
    "bifurcation",
    "campbell",
    "coherence",
    "compare",
    "condense",
    "contact_ratio",
    "criteria",
    "cross_psd",
    "drive",
    "equilibrium",
    "example",
    "figures",
    "fit",
    "fit_loop",
    "gas_torque",
    "json_schema",
    "listen",
    "load",
    "loads",
    "look",
    "metrics",
    "modes",
    "nondimensionalize",
    "open_run",
    "open_stream",
    "open_study",
    "optimize",
    "order_cuts",
    "order_map",
    "psd",
    "rattle_probability",
    "read",
    "reduce",
    "regime_boundary",
    "samples_needed",
    "screen",
    "sensitivities",
    "simulate",
    "spectra",
    "stiffness",
    "stream",
    "study",
    "torque_angle",
    "validate",
    "validate_run_up",
    "waterfall",
    "write",
]


class _Package(ModuleType):
    """Keeps ``gearrattle.criteria`` the function when the folder of the same name is imported."""

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in _HOME and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __getattr__(name: str) -> Any:
    """Import a public name from its home at first use."""
    if name not in _HOME:
        raise AttributeError(f"module 'gearrattle' has no attribute {name!r}")
    value = getattr(import_module(f"gearrattle.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names, imported or not."""
    return sorted(__all__)
