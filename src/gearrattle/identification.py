"""Parameters from measurements: of measured modes and responses, of a recorded motion, of a torque-angle loop."""

from gearrattle.measured.fitting.fit import fit
from gearrattle.measured.identification.loop_fit import fit_loop

__all__ = [
    "fit",
    "fit_loop",
]
