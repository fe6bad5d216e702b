"""Parameters from measurements: from modes and responses, from a recorded motion, from a torque-angle loop."""

from gearrattle.measured.fitting.fit import fit
from gearrattle.measured.identification.loop_fit import fit_loop

__all__ = [
    "fit",
    "fit_loop",
]
