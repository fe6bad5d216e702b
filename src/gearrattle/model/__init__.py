"""Model of a driveline: read from files, validated, in SI.

``load`` and ``loads`` read model files, ``example`` reads one that comes with the package. ``Model`` and its parts are
immutable. ``json_schema`` describes the file format.
"""

from gearrattle.model.components import Coupling, Mesh, Planetary
from gearrattle.model.components.alternation import Alternation
from gearrattle.model.components.component import Element, Piece
from gearrattle.model.components.coupling import Stage
from gearrattle.model.engine import Engine
from gearrattle.model.examples import example
from gearrattle.model.excitation import Excitation, Harmonic, Motion, Sweep, Torque, TorqueHarmonic
from gearrattle.model.factors import Factor, factor
from gearrattle.model.inertia import Inertia
from gearrattle.model.model import Model, check_model
from gearrattle.model.model_file import load, loads, readable_text
from gearrattle.model.negligible_impacts import ASSUMED_ENERGY, Criteria, Negligible
from gearrattle.model.schema import json_schema
from gearrattle.model.signal import Points, Signal
from gearrattle.model.simulation import ALGORITHMS, DEFAULTS, Defaults, Initial, Simulation
from gearrattle.model.value_kinds import GROUND, SCHEMA_VERSION

__all__ = [
    "ALGORITHMS",
    "ASSUMED_ENERGY",
    "DEFAULTS",
    "GROUND",
    "SCHEMA_VERSION",
    "Alternation",
    "Coupling",
    "Criteria",
    "Defaults",
    "Element",
    "Engine",
    "Excitation",
    "Factor",
    "Harmonic",
    "Inertia",
    "Initial",
    "Mesh",
    "Model",
    "Motion",
    "Negligible",
    "Piece",
    "Planetary",
    "Points",
    "Signal",
    "Simulation",
    "Stage",
    "Sweep",
    "Torque",
    "TorqueHarmonic",
    "check_model",
    "example",
    "factor",
    "json_schema",
    "load",
    "loads",
    "readable_text",
]
