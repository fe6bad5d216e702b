"""The one place that knows both wings: a model in words becomes a piecewise system and its name plate."""

from gearrattle.assembly.elements import elements_of
from gearrattle.assembly.friction import left_out
from gearrattle.assembly.lumped import lumped_model, must_stay_level
from gearrattle.assembly.period import CommonPeriod, common_period, period_of
from gearrattle.assembly.signals import check_length, default_cycles, ramp_of, signals_of
from gearrattle.assembly.steady import steady, unsteady
from gearrattle.assembly.system import assemble, name_plate

__all__ = [
    "CommonPeriod",
    "assemble",
    "check_length",
    "common_period",
    "default_cycles",
    "elements_of",
    "left_out",
    "lumped_model",
    "must_stay_level",
    "name_plate",
    "period_of",
    "ramp_of",
    "signals_of",
    "steady",
    "unsteady",
]
