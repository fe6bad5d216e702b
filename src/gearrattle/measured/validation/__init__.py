"""Validation of a simulated motion by a measured one: agreement within random scatter, differences, causes.

The paper's Table 5 for any pair of a model or run and a record. Beyond the predictability horizon, and with a start
that was not measured, two motions can only be compared by what they have on average: levels, orders of the mean cycle,
spectra, rates of impacts. Each is given with the interval that the scatter from cycle to cycle leaves.
"""

from gearrattle.measured.order_over_speed import Track
from gearrattle.measured.paper_sigma import Printed, of_printed, sigma
from gearrattle.measured.validation.effects import Effect, Explained, Parameter
from gearrattle.measured.validation.run_up_record import RunUp
from gearrattle.measured.validation.validate import validate
from gearrattle.measured.validation.validate_run_up import validate_run_up
from gearrattle.measured.validation.validation_records import (
    Band,
    Clock,
    Contribution,
    Impacts,
    Level,
    Order,
    Pair,
    Validation,
)

__all__ = [
    "Band",
    "Clock",
    "Contribution",
    "Effect",
    "Explained",
    "Impacts",
    "Level",
    "Order",
    "Pair",
    "Parameter",
    "Printed",
    "RunUp",
    "Track",
    "Validation",
    "of_printed",
    "sigma",
    "validate",
    "validate_run_up",
]
