"""The one place that knows both wings: a model in words becomes a piecewise system and its name plate."""

from gearrattle.assembly.lumped import lumped_model, must_stay_level
from gearrattle.assembly.period import CommonPeriod, common_period
from gearrattle.assembly.system import assemble, elements_of, name_plate, period_of

__all__ = [
    "CommonPeriod",
    "assemble",
    "common_period",
    "elements_of",
    "lumped_model",
    "must_stay_level",
    "name_plate",
    "period_of",
]
