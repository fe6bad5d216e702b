"""``nondimensionalize``: a model in multiples of its own characteristic quantities, and the way back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gearrattle.assembly import assemble, refuse_motions, steady
from gearrattle.assembly.scaled import dimensional, dimensionless, restored
from gearrattle.engine.system.characteristic import Scales, characteristic, coefficients
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model, check_model
from gearrattle.result import Result
from gearrattle.results import Run


@dataclass(frozen=True)
class Nondimensional(Result):
    """A model without dimensions.

    Attributes
    ----------
    original
        the SI model.
    model
        the dimensionless one.
    coefficients
        xi, eta, Omega2, T, epsilon, ... by their names in eqs. (9)-(22) of Padmanabhan et al. 1995.
    scales
        what counts as one: frequency [rad/s], angle [rad], length and radius [m], inertia [kg m^2].

    Examples
    --------
    >>> sorted(gr.nondimensionalize(gr.example("case3")).coefficients)[:3]
    ['Omega2_11', 'Omega2_12', 'Omega2_22']
    """

    kind: ClassVar[str] = "scaling"
    notes: ClassVar[tuple[str, ...]] = ()
    original: Model
    model: Model
    coefficients: dict[str, float]
    scales: Scales

    def restore(self, run: Run) -> Run:
        """Return a run of the dimensionless model in SI, as a run of the original.

        Parameters
        ----------
        run
            from ``simulate(self.model)``, with any settings.

        Raises
        ------
        ModelError
            a run of another model.
        """
        theirs, mine = ({**m.to_tables(), "simulation": None} for m in (run.model, self.model))
        if theirs != mine:
            rule = "must be a run of this dimensionless model"
            raise ModelError(Problem("run", f"one of {run.model.name!r}", rule, "simulate its .model"))
        settings = dimensional(run.model, self.scales).to_tables().get("simulation", {})
        used = self.original.with_simulation(settings)
        return Run(restored(run.trajectory, assemble(used).layout, self.scales), used)


def nondimensionalize(
    model: Model, *, frequency: float | None = None, length: float | None = None, radius: float | None = None
) -> Nondimensional:
    """Write a model in multiples of its characteristic quantities (Padmanabhan et al. 1995, sec. 5).

    Parameters
    ----------
    model
        the driveline, in SI.
    frequency
        characteristic frequency [rad/s]; None: the reference speed.
    length
        characteristic length x_c [m]; None: the half-backlash of the first mesh that has one, else such that
        the angle x_c / R_c is the smallest corner of a coupling.
    radius
        characteristic radius R_c [m]; None: the first gear's.

    Coefficients know harmonics and means only: a torque record counts as its mean, a sweep as its first speed.

    Raises
    ------
    ModelError
        a model that is dimensionless already, or a scale that is not positive.

    Examples
    --------
    >>> scaled = gr.nondimensionalize(gr.example("case3"))
    >>> scaled.model.units
    'dimensionless'
    """
    check_model(model)
    problems = [
        Problem(name, f"{value:g}", "must be positive")
        for name, value in (("frequency", frequency), ("length", length), ("radius", radius))
        if value is not None and not 0.0 < value < float("inf")
    ]
    if model.units != "SI":
        problems.append(Problem("units", model.units, "the model has no dimensions to take away", "give one in SI"))
    if problems:
        raise ModelError(problems)
    refuse_motions(model, "nondimensionalisation")
    driveline = assemble(steady(model))
    system = driveline.system
    layout = driveline.layout
    scales = characteristic(system, layout.is_mesh, frequency or layout.omega, length, radius)
    turning = system.size - len(layout.direction_names)
    named = coefficients(system, layout.is_mesh, layout.orders, layout.omega, scales, turning=turning)
    return Nondimensional(model, dimensionless(model, scales), named, scales)
