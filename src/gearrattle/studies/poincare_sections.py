"""Sections of a run: chosen quantities once a period, and the kind of motion that they show.

A *section* is taken at t = (k + phase) T, T the common period of all orders. Its quantities are by name

    deflection.ELEMENT, rate.ELEMENT    delta = W q - e(t) and delta' = W q' - e'(t) [rad, rad/s; m, m/s for a mesh]
    angle.INERTIA, velocity.INERTIA     [rad, rad/s]

by default the deflection and rate of every clearance. Whether the motion repeats is asked of all clearances, whatever
was chosen, in units of half the clearance b (of the largest corner) and of b 2 pi / T; those of a law whose corners are
all at zero in units of the sum of all loads over its largest slope, or without loads of the amplitudes of prescribed
angles.

The kinds of motion are:

* *periodic*: it repeats after n periods (``signals.strobe``); its Floquet multipliers are the eigenvalues of the flow's
  gradient over the last n periods, products of exponentials and saltations (``system.perturbation_growth``): as exact
  as the motion. It is stable if all lie inside the unit circle; one at -1 doubles the period. Its largest Lyapunov
  exponent is ln |mu_1| / (n T).
* *chaotic*: it does not, and a small perturbation grows over the periods kept to more than ``GROWN`` times itself and
  to more than 100 times their number, still growing over the last half: a perturbation that neither shrinks nor grows
  exponentially (a free rigid body's, a quasi-periodic motion's) grows at most like that number.
* *undecided*: neither was shown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import assemble, coordinates_of, free_names, own_mean, period_of
from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.path_labels import path_label
from gearrattle.model.table import breach, did_you_mean, shown
from gearrattle.model.value_kinds import Plain
from gearrattle.results import Run
from gearrattle.signals.strobe import period_number
from gearrattle.studies.output import Output
from gearrattle.studies.outputs import Outputs, unit_in

Array = NDArray[np.float64]

MOTIONS = ("periodic", "chaotic", "undecided")
PERIODIC, CHAOTIC, UNDECIDED = range(3)
GROWN = 1e3
_FINEST = 360
EXPONENT = "largest Lyapunov exponent"


@dataclass(frozen=True)
class Nearness(Plain):
    """A distance below which two points, or two motions, count as one; in units of half the clearance."""

    def read(self, value: Any, dimensionless: bool, /) -> float:
        """Return the number."""
        number = super().read(value, dimensionless)
        if not 0.0 < number < 0.1:
            raise breach("must be above 0 and below 0.1, in units of half the clearance", "for example 1e-6")
        return number

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema of the number."""
        return {"type": "number", "exclusiveMinimum": 0.0, "exclusiveMaximum": 0.1}


NEARNESS = Nearness()


@dataclass(frozen=True)
class Section:
    """Quantities that are kept once a period, and the phase.

    Attributes
    ----------
    tested
        names of the quantities that decide the period: deflections and rates of all clearances.
    scale
        unit of every quantity, by name.
    """

    names: tuple[str, ...]
    tested: tuple[str, ...]
    scale: dict[str, float]
    phase: Fraction

    def values(self, run: Run, names: Sequence[str]) -> Array:
        """Return (K, q) quantities at (k + phase) T of the periods that are not discarded."""
        t = run.trajectory
        system = assemble(run.model).system
        first = t.discard * t.samples_per_cycle + round(self.phase * t.samples_per_cycle)
        stops = np.arange(first, len(t.time), t.samples_per_cycle)
        columns = [_quantity(name, run, system, float(self.phase), stops) for name in names]
        return np.column_stack(columns)

    def scaled(self, run: Run) -> Array:
        """Return (K, q) the quantities by which periods are tested, in their own units."""
        return np.asarray(self.values(run, self.tested) / np.array([self.scale[name] for name in self.tested]))


def section_of(model: Model, names: Sequence[str] | None, phase: float) -> Section:
    """Choose the quantities of a section, and its phase.

    Parameters
    ----------
    model
        the driveline; its clearances are the scale of the whole study.
    names
        of quantities; None for deflection and rate of every clearance.
    phase
        of the period, from 0 to below 1, a fraction with a denominator up to 360.

    Raises
    ------
    ModelError
        no clearance, a name there is not, a phase that is no such fraction.
    """
    system = assemble(model).system
    elements = model.elements
    parts = [e.name for e in elements]
    inertias = [inertia.name for inertia in model.inertias]
    known = [f"{kind}.{name}" for name in parts for kind in ("deflection", "rate")]
    known += [f"{kind}.{name}" for name in inertias for kind in ("angle", "velocity")]
    tested = tuple(f"{kind}.{parts[k]}" for k in system.clearances for kind in ("deflection", "rate"))
    problems = []
    if not tested:
        rule = "the driveline has no clearance: it has one motion, and linear analysis tells it"
        problems.append(Problem("model", model.name, rule, "gr.modes, gr.campbell"))
    chosen = tested if names is None else tuple(names)
    for name in (name for name in chosen if name not in known):
        rule = "there is no such quantity; there are deflection and rate of elements, angle and velocity of inertias"
        problems.append(Problem("section", f'"{name}"', rule, did_you_mean(name, known)))
    if names is not None and not chosen:
        problems.append(Problem("section", "[]", "needs at least one quantity", "leave it out for all clearances"))
    problems += [p for p in [_wrong_phase(phase)] if p is not None]
    if problems:
        raise ModelError(problems)
    scale = _scales(model, system)
    return Section(tuple(dict.fromkeys(chosen)), tested, scale, Fraction(phase).limit_denominator(_FINEST))


def _wrong_phase(phase: Any) -> Problem | None:
    rule = f"must be a fraction of the period from 0 to below 1, with a denominator up to {_FINEST}"
    if isinstance(phase, bool) or not isinstance(phase, int | float) or not 0.0 <= phase < 1.0:
        return Problem("phase", shown(phase), rule, "for example 0.25")
    near = Fraction(phase).limit_denominator(_FINEST)
    if abs(float(near) - phase) > 1e-9 or near >= 1:
        return Problem("phase", f"{phase:g}", rule, f"the nearest is {near}")
    return None


def _scales(model: Model, system: PiecewiseSystem) -> dict[str, float]:
    """Unit of every quantity: half the clearance, and that times 2 pi / T; for inertias the smallest about them."""
    load = sum(
        abs(own_mean(model, i)) + sum(abs(h.amplitude) for h in torque.harmonics)
        for i, torque in enumerate(model.torques)
    )
    swing = sum(abs(h.amplitude) for motion in model.motions for h in motion.harmonics)
    rate = 2.0 * np.pi / period_of(model).period
    scales: dict[str, float] = {}
    angles = np.full(system.size, np.inf)
    for k, element in enumerate(model.elements):
        law = system.laws[k]
        corner = float(np.abs(law.corners).max(initial=0.0))
        arms = np.abs(system.rows[k])
        slope = float(law.stiffness.max()) * float(arms.max())
        size = corner or (load / slope if load > 0.0 and slope > 0.0 else swing * float(arms.max()) or 1.0)
        scales[f"deflection.{element.name}"] = size
        scales[f"rate.{element.name}"] = size * rate
        angles[arms > 0.0] = np.minimum(angles[arms > 0.0], size / arms[arms > 0.0])
    for name, angle in zip(free_names(model), np.where(np.isfinite(angles), angles, 1.0).tolist(), strict=False):
        scales[f"angle.{name}"] = angle
        scales[f"velocity.{name}"] = angle * rate
    for motion in model.motions:
        angle = swing or 1.0
        scales[f"angle.{motion.on}"] = angle
        scales[f"velocity.{motion.on}"] = angle * rate
    return scales


def _quantity(name: str, run: Run, system: PiecewiseSystem, phase: float, stops: NDArray[np.int64]) -> Array:
    kind, _, subject = name.partition(".")
    t = run.trajectory
    if kind in ("angle", "velocity"):
        return np.asarray(getattr(t, kind)[stops, t.layout.inertia_names.index(subject)])
    k = t.layout.element_names.index(subject)
    inputs = system.inputs
    turn = 2.0 * np.pi * inputs.cycles
    sine = inputs.error_sine[k]
    cosine = inputs.error_cosine[k]
    if kind == "deflection":
        error = float(sine @ np.sin(turn * phase) + cosine @ np.cos(turn * phase))
        return np.asarray(coordinates_of(run.model, t, 0, stops) @ system.rows[k] - error)
    swift = turn / inputs.period
    error = float((sine * swift) @ np.cos(turn * phase) - (cosine * swift) @ np.sin(turn * phase))
    return np.asarray(coordinates_of(run.model, t, 1, stops) @ system.rows[k] - error)


def own_units(model: Model) -> tuple[str, str, str]:
    """Return the units of the exponent, of angles and of velocities."""
    return unit_in(model, "1/s"), unit_in(model, "rad"), unit_in(model, "rad/s")


def states_of(model: Model) -> int:
    """Return the number of relative states: independent deflections, velocities, stretches of sliders."""
    system = assemble(model).system
    return len(relative_coordinates(system).elements) + system.size + len(system.memories)


def unit_of(name: str, model: Model) -> str:
    """Return the unit of a quantity [SI]."""
    return path_label(name, model).unit or "1"


@dataclass(frozen=True)
class Sections(Outputs):
    """Outputs of every case: the section's last points, the kind of motion, and chosen outputs of criteria.

    Attributes
    ----------
    points
        number of last periods whose points are kept.
    tolerance
        tolerance of the test for a period, in the units of the section.
    most
        largest period number that is tested.
    states
        largest number of relative states of a case, for the Floquet multipliers, NaN beyond those of a case; 0: none
        are kept.
    inertias
        inertias whose final angles and velocities are kept; empty for none.
    own_units
        units of the exponent, and of the final angles and velocities.
    """

    section: Section = Section((), (), {}, Fraction(0))
    units: tuple[str, ...] = ()
    points: int = 1
    tolerance: float = 1e-6
    most: int = 16
    states: int = 0
    inertias: tuple[str, ...] = ()
    own_units: tuple[str, str, str] = ("1/s", "rad", "rad/s")

    @property
    def all(self) -> tuple[Output, ...]:
        """Those of criteria, the section's, and those of the motion."""
        last = tuple(range(-self.points + 1, 1))
        outputs = [
            Output(name, "cycle", last, (unit,)) for name, unit in zip(self.section.names, self.units, strict=True)
        ]
        outputs += [Output("motion", "", (), ("",), MOTIONS), Output("period", "", (), ("cycles",))]
        outputs += [Output(EXPONENT, "", (), (self.own_units[0],))]
        numbers = tuple(range(1, self.states + 1))
        parts = ("real", "imaginary") if self.states else ()
        outputs += [Output(f"multiplier {part}", "multiplier", numbers, ("1",)) for part in parts]
        ends = ("angle at the end", self.own_units[1]), ("velocity at the end", self.own_units[2])
        outputs += [Output(name, "inertia", self.inertias, (unit,)) for name, unit in ends if self.inertias]
        own = {output.name for output in outputs}
        return (*outputs, *(output for output in self.chosen if output.name not in own))

    def of(self, run: Run) -> dict[str, NDArray[Any]]:
        """Return every output of one run."""
        values = Outputs(self.chosen).of(run)
        shown = self.section.values(run, self.section.names)[-self.points :]
        values |= {name: column.copy() for name, column in zip(self.section.names, shown.T, strict=True)}
        n = period_number(self.section.scaled(run), self.tolerance, self.most)
        values["period"] = np.array(float(n) if n else np.nan)
        exponent, grows = (np.nan, False) if n else _growth(run)
        values["motion"] = np.array(PERIODIC if n else CHAOTIC if grows else UNDECIDED, dtype=np.int8)
        if self.states:
            eigenvalues = np.full(self.states, complex(np.nan, np.nan))
            if n:
                own = multipliers(run, n)[: self.states]
                eigenvalues[: own.size] = own
                # exact, where an average over finite time is not
                exponent = float(np.log(max(abs(own[0]), 1e-300))) / (n * run.trajectory.layout.period)
            values |= {"multiplier real": eigenvalues.real.copy(), "multiplier imaginary": eigenvalues.imag.copy()}
        values[EXPONENT] = np.array(exponent)
        t = run.trajectory
        if self.inertias:
            values |= {"angle at the end": t.angle[-1].copy(), "velocity at the end": t.velocity[-1].copy()}
        return {output.name: values[output.name] for output in self.all}


def _gradient(run: Run, cycles: int) -> Array:
    """(N, N) gradient of the flow over the last cycles, balanced: deflections, velocities, stretches of sliders."""
    variation = run.variation
    t = run.trajectory
    begin = (t.cycles - cycles) * t.layout.period
    return variation.since(begin)


def multipliers(run: Run, cycles: int) -> NDArray[np.complex128]:
    """Return (N,) eigenvalues of the gradient of the flow over the last cycles, the largest first."""
    eigenvalues = np.linalg.eigvals(_gradient(run, cycles)).astype(np.complex128)
    return np.asarray(eigenvalues[np.lexsort((-eigenvalues.imag, -np.round(np.abs(eigenvalues), 12)))])


def _growth(run: Run) -> tuple[float, bool]:
    """The largest Lyapunov exponent over the periods kept, and whether it is one of chaos."""
    t = run.trajectory
    period = t.layout.period
    kept = t.cycles - t.discard
    whole = run.largest_lyapunov_exponent
    late = run.variation.largest_exponent((t.cycles - kept // 2) * period) if kept > 1 else whole
    return whole, bool(whole * kept * period > np.log(max(GROWN, 100.0 * kept)) and late > 0.0)
