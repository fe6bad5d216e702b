"""Result of the fit of a torque-angle loop: stages with standard errors, as a coupling, and its loop drawn again."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.torque_angle import TorqueAngle, torque_angle
from gearrattle.json_types import Json, TomlTable
from gearrattle.model import loads
from gearrattle.model.toml_text import toml_text
from gearrattle.result import Result

Array = NDArray[np.float64]

_UNITS = {
    "stiffness": "N*m/rad",
    "until": "rad",
    "hysteresis": "N*m",
    "stick_stiffness": "N*m/rad",
    "preload": "N*m",
}
_POWERS_OF_ANGLE = {"stiffness": -1, "until": 1, "stick_stiffness": -1}


class FittedStage(NamedTuple):
    """One stage, from the centre outward.

    Attributes
    ----------
    stiffness
        slope [N m/rad].
    until
        where it ends, a positive magnitude [rad]; None for the last.
    hysteresis
        full height of the loop in it, in all [N m].
    stick_stiffness
        of its slider [N m/rad]; None: it has none of its own, or the default stands.
    """

    stiffness: float
    until: float | None
    hysteresis: float
    stick_stiffness: float | None


@dataclass(frozen=True, eq=False)
class LoopFit(Result):
    """A law fitted to a measured torque-angle loop.

    Attributes
    ----------
    name
        of the coupling.
    between
        what it couples.
    stages, coast_stages
        from the centre outward, positive magnitudes.
    preload
        torque at zero deflection, without friction [N m].
    values
        every fitted number [SI] by its name in the coupling, such as "stages.1.stiffness".
    errors
        their standard errors, by name; of breaks the standard deviation of the density of their place, of stick
        stiffnesses the width of the interval over 2 x 1.96.
    intervals
        their 95 % intervals, by name, and those of stick stiffnesses whose default stands; a stick
        stiffness that the samples bound on one side only ends at 0 or inf.
    covariance
        (V, V) of the values, in their order; of stick stiffnesses by the curvature.
    bootstrap_errors
        standard errors by resampled blocks, by name; empty unless asked for.
    residual
        root mean square of measured less fitted torque [N m].
    tau
        integrated autocorrelation time of the residuals, in samples; 1 for white noise.
    measured
        deflection [rad] and torque [N m] of the samples used.
    residuals
        (N,) measured less fitted torque [N m].
    source
        where they came from.
    steps
        drive-side and coast-side stages tried, with their BIC.
    notes
        what the user must know.
    angle_unit
        in which the report and ``toml`` are written: "deg" or "rad", as in the file.

    Examples
    --------
    >>> turn = np.linspace(0.0, 4.0 * np.pi, 2001)
    >>> angle = 0.2 * np.sin(turn)
    >>> torque = 100.0 * angle + 2.0 * np.sign(np.cos(turn))
    >>> fit = gr.identification.fit_loop((angle, torque), stages=1)
    >>> len(fit.stages)
    1
    """

    kind: ClassVar[str] = "loop fit"
    name: str
    between: tuple[str, str]
    stages: tuple[FittedStage, ...]
    coast_stages: tuple[FittedStage, ...]
    preload: float
    values: Mapping[str, float]
    errors: Mapping[str, float]
    intervals: Mapping[str, tuple[float, float]]
    covariance: Array
    bootstrap_errors: Mapping[str, float]
    residual: float
    tau: float
    measured: tuple[Array, Array]
    residuals: Array
    source: str
    steps: tuple[tuple[int, int, float], ...]
    notes: tuple[str, ...]
    angle_unit: str = "rad"

    @property
    def hysteresis(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Full heights of the loop [N m], of the drive-side and of the coast-side stages."""
        return tuple(s.hysteresis for s in self.stages), tuple(s.hysteresis for s in self.coast_stages)

    @property
    def full_scale(self) -> float:
        """Largest magnitude of the measured torque [N m]."""
        return float(np.abs(self.measured[1]).max())

    @property
    def coupling(self) -> TomlTable:
        """The table of a ``[[coupling]]``, numbers in SI."""
        sides = {
            key: [{k: v for k, v in stage._asdict().items() if v is not None} for stage in stages]
            for key, stages in (("stages", self.stages), ("coast_stages", self.coast_stages))
        }
        return {"name": self.name, "between": list(self.between), **sides, "preload": self.preload}

    @property
    def toml(self) -> str:
        """The ``[[coupling]]`` as text for a model file: numbers in SI, or with their units where angles are in deg."""
        coupling = self.coupling
        if self.angle_unit == "rad":
            return toml_text({"coupling": [coupling]}).lstrip("\n")
        for key in ("stages", "coast_stages"):
            coupling[key] = [{k: self._with_unit(k, v) for k, v in stage.items()} for stage in coupling[key]]
        coupling["preload"] = self._with_unit("preload", coupling["preload"])
        return toml_text({"coupling": [coupling]}).lstrip("\n")

    def drawn(self, low: float | None = None, high: float | None = None) -> TorqueAngle:
        """The loop of the fitted law by ``torque_angle`` between two deflections [rad]; default: the measured ends."""
        deflection = self.measured[0]
        ends = float(deflection.min()) if low is None else low, float(deflection.max()) if high is None else high
        tables = {
            "schema": 1,
            "name": "one coupling",
            "units": "SI",
            "inertia": [{"name": "body", "J": 1.0}],
            "coupling": [{**self.coupling, "between": ["body", "ground"]}],
            "excitation": {"speed": 1.0},
        }
        return torque_angle(loads(toml_text(tables)), self.name, *ends)

    def to_dict(self) -> dict[str, Json]:
        """Return the record in JSON types; values in SI."""
        return {
            "source": self.source,
            "samples": int(self.measured[0].size),
            "coupling": self.coupling,
            "values": dict(self.values),
            "errors": dict(self.errors),
            "intervals": {name: list(ends) for name, ends in self.intervals.items()},
            "bootstrap_errors": dict(self.bootstrap_errors),
            "covariance": self.covariance.tolist(),
            "residual": self.residual,
            "full_scale": self.full_scale,
            "tau": self.tau,
            "steps": [{"stages": d, "coast_stages": c, "bic": float(b)} for d, c, b in self.steps],
            "notes": list(self.notes),
        }

    def unit(self, key: str) -> tuple[float, str]:
        """Return the factor of a key's SI value to the unit it is shown in, and that unit."""
        if self.angle_unit == "rad":
            return 1.0, _UNITS[key]
        return math.degrees(1.0) ** _POWERS_OF_ANGLE.get(key, 0), _UNITS[key].replace("rad", "deg")

    def _with_unit(self, key: str, value: float) -> str:
        """Return a value as a model file has it, to eight digits."""
        factor, unit = self.unit(key)
        return f"{value * factor:.8g} {unit}"
