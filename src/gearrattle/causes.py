"""Cause of rattle: the orders of the excitation that move a driver, and the mode through which they do.

A driveline that rattles is not linear. But at the orders of its excitation it moves much as one linear driveline does:
that with slope and damping of every element fitted to the element's own force along the motion
(``analysis.linear.equivalent``). Its response to every order of every source alone, a_jk, is an estimate of what the
source does, and their sum is compared with the motion's own amplitude at the order. Shares are of the mean square,

    share_jk = Re(a_jk conj(sum_k a_jk)) / sum_j |sum_k a_jk|^2

The contact state of most of the time is no such driveline: in it a rattling gear is free, and its shaft may be cut off
from the engine. But the impacts carry the gear along, and at these orders it moves almost as if it were tied.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.linear.equivalent import equivalent
from gearrattle.analysis.linear.modal_response import damped_modes
from gearrattle.analysis.linear.response import steady_angles, turning_rates
from gearrattle.assembly import (
    assemble,
    coordinate_names,
    deflection,
    deflection_rate,
    free_of,
    motion_amplitudes,
    prescribed_indices,
    unsteady_inputs,
)
from gearrattle.assembly.period import period_of
from gearrattle.assembly.prescribed_motion import motion_errors
from gearrattle.assembly.ripple import load_ripples
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Harmonic, Model
from gearrattle.model.table import did_you_mean, shown
from gearrattle.quantities.criteria import criteria
from gearrattle.quantities.metrics import inputs_of
from gearrattle.result import Result
from gearrattle.results import Run, check_run
from gearrattle.signals import is_same_mesh, loose_gears, region_at, steady
from gearrattle.wording import listed, numeral

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

ENOUGH = 0.8
"""Share of the mean square that the named orders make together, at least, if two suffice."""
MOST_NAMED = 2
POOR = 1.0
"""Relative error of the estimate beyond which it tells no mode: what it lacks is more than the motion has."""
_ALONE = 0.3  # of a mode's strain energy: an element with less gives it no name
_NEAR = 0.05  # of a mode's frequency: an order nearer than that is in resonance
_FAR = 0.3  # relative error of the estimate beyond which the driveline is called far from linear
_CANCELLED = 1.1  # of the share of its order: a source with more is said to be cancelled by others


@dataclass(frozen=True)
class Through:
    """The mode that has the largest part in a response.

    Attributes
    ----------
    elements
        in which most of its strain energy is, largest first; empty for rigid motion.
    frequency
        natural frequency, of overdamped motion the rate of its decay [rad/s]; 0 for rigid motion.
    damping_ratio
        1 for overdamped motion; NaN for rigid motion.
    share
        of its part, along the response, in the response; above 1 where other modes act against it.
    """

    elements: tuple[str, ...]
    frequency: float
    damping_ratio: float
    share: float


@dataclass(frozen=True)
class Contribution:
    """What one order of one source does to the body.

    Attributes
    ----------
    source
        "torque on NAME", "motion of NAME", "transmission error of NAME".
    order
        of the reference speed.
    frequency
        angular frequency [rad/s].
    acceleration
        complex amplitude a: the acceleration is the real part of a exp(i frequency t) [rad/s^2].
    share
        of the mean square of the acceleration by all of them; they add up to 1.
    through
        the mode it acts through; None for a body that moves as prescribed.
    """

    source: str
    order: float
    frequency: float
    acceleration: complex
    share: float
    through: Through | None


@dataclass(frozen=True)
class Cause(Result):
    """Which orders of the excitation accelerate a body, and through which mode, as an estimate.

    Attributes
    ----------
    model
        the driveline.
    body
        whose acceleration is explained.
    parts
        the meshes and clearances that rattle and that it drives, worst first; none where the body was chosen.
    contributions
        of every order of every source, largest share first.
    error
        of the estimate: by how much its amplitudes at the orders named miss the motion's own, over the latter, root
        mean square; NaN where the samples cannot show them.
    slopes, dampings
        by element, of the linear driveline [N m/rad or N/m, N m s/rad or N s/m].

    Examples
    --------
    >>> cause = gr.cause(gr.simulate(gr.example("case3")))
    >>> cause.body, cause.contributions[0].source, cause.contributions[0].order
    ('input_gear', 'torque on flywheel', 1.0)
    """

    kind: ClassVar[str] = "cause"
    notes: ClassVar[tuple[str, ...]] = ()
    model: Model = field(repr=False, compare=False)
    body: str
    parts: tuple[str, ...]
    contributions: tuple[Contribution, ...]
    error: float
    slopes: dict[str, float]
    dampings: dict[str, float]

    @property
    def orders(self) -> dict[float, float]:
        """Share of every order, all sources together, largest first."""
        return _orders(self.contributions)

    @property
    def named(self) -> tuple[float, ...]:
        """The orders that the sentence names: the largest, and a second where one does not do."""
        return _named(self.contributions)

    @property
    def is_poor(self) -> bool:
        """Whether the estimate misses the motion so far that no mode can be named."""
        return self.error > POOR

    @property
    def sentence(self) -> str:
        """The cause in one line."""
        words = [self._order(order, first=i == 0) for i, order in enumerate(self.named)]
        alternating = [element.name for element in self.model.elements if element.alternation is not None]
        left = f" What the alternating stiffness of {listed(alternating)} excites is left out." if alternating else ""
        return f"Cause (estimate): {'; '.join(words)}{self._trust()}.{left}"

    def _order(self, order: float, *, first: bool) -> str:
        """What one order does, whose it is, and through which mode."""
        si = self.model.units == "SI"
        acting = [item for item in self.contributions if item.order == order]
        share = self.orders[order]
        largest = acting[0]
        sources = [largest, *(item for item in acting[1:2] if largest.share < ENOUGH * share)]
        hertz = numeral(largest.frequency / (2.0 * np.pi), 3)
        own = numeral(largest.frequency, 3)
        at = f"{hertz} Hz" if si else f"frequency {own}"
        words = f"order {order:g} of {listed([f'the {item.source}' for item in sources])} at {at}"
        words += ", partly cancelled by other sources," if largest.share > _CANCELLED * share else ""
        words += f" makes {_percent(share)}" + (f" of the forced acceleration of {self.body}" if first else "")
        return words if self.is_poor else words + _through(largest, si=si)

    def _trust(self) -> str:
        """How well the estimate meets the motion."""
        if np.isnan(self.error):
            return ""
        which = f"order{'s' if len(self.named) > 1 else ''} {listed([f'{order:g}' for order in self.named])}"
        if self.is_poor:
            return f"; through which mode cannot be said, for no linear driveline moves like this one at {which}"
        if self.error > _FAR:
            missed = f"the estimate misses the motion's {which} by {_rounded(self.error)}"
            return f". The driveline is far from linear: {missed}"
        return f". The estimate meets the motion's {which} within {_rounded(self.error)}"


def _orders(contributions: Sequence[Contribution]) -> dict[float, float]:
    """Share of every order, all sources together, largest first."""
    shares: dict[float, float] = {}
    for item in contributions:
        shares[item.order] = shares.get(item.order, 0.0) + item.share
    return dict(sorted(shares.items(), key=lambda entry: -entry[1]))


def _named(contributions: Sequence[Contribution]) -> tuple[float, ...]:
    """The order of the largest share, and a second where one does not do."""
    shares = _orders(contributions)
    orders = tuple(shares)
    return orders[: 1 if shares[orders[0]] >= ENOUGH else MOST_NAMED]


def _through(item: Contribution, *, si: bool) -> str:
    """Mode through which an order acts, and how far the order is from its resonance."""
    mode = item.through
    if mode is None:
        return ", as prescribed"
    if not mode.elements:
        return ", which moves it as a rigid body"
    name = " and ".join(mode.elements)
    if mode.damping_ratio >= 1.0:
        return f", through overdamped motion of {name}"
    speed = mode.frequency / item.order
    if si:
        location = f"{numeral(mode.frequency / (2.0 * np.pi), 3)} Hz"
        hit = f"{numeral(speed * 30.0 / np.pi, 3)} rpm"
    else:
        location = f"frequency {numeral(mode.frequency, 3)}"
        hit = f"speed {numeral(speed, 3)}"
    ratio = item.frequency / mode.frequency
    distance = "in resonance with it" if abs(ratio - 1.0) <= _NEAR else f"at {numeral(ratio, 3)} times its frequency"
    return f", through the {name} mode at {location} ({hit} for order {item.order:g}), {distance}"


def _rounded(error: float) -> str:
    """Return an error in whole per cent, one at least."""
    return f"{max(1.0, 100.0 * error):.0f} %"


def _percent(share: float) -> str:
    """Return a share in per cent that reads 100 % only where it is."""
    percent = 100.0 * share
    return "more than 99.9 %" if 99.9 < percent < 99.9999 else f"{numeral(percent, 3)} %"


def cause(run: Run, body: str | None = None) -> Cause | None:
    """Estimate which orders of the excitation accelerate the driver of what rattles worst, and through which mode.

    Parameters
    ----------
    run
        a motion, of which the steady part counts.
    body
        the inertia whose acceleration is explained; None takes the one that drives most of the parts that rattle, of
        several the one of the worst part.

    Returns
    -------
    Cause | None
        The estimate. None where nothing rattles and no body is chosen, and where nothing repeats: under a record, along
        a sweep, without a harmonic that moves the body.

    Raises
    ------
    ModelError
        there is no such inertia, or no cycle is left to judge.

    Examples
    --------
    >>> cause = gr.cause(gr.simulate(gr.example("case3")))
    >>> cause.contributions[0].through.elements
    ('clutch',)
    """
    check_run(run, ())
    layout = run.trajectory.layout
    if body is not None and body not in layout.inertia_names:
        raise ModelError(
            Problem("body", shown(body), "is no inertia of the driveline", did_you_mean(body, layout.inertia_names))
        )
    if unsteady_inputs(run.model):
        return None
    if body is not None:
        return _explained(run, layout.inertia_names.index(body), (), equivalent_slopes(run))
    return cause_of(run, [part.name for part in criteria(run).parts if part.rattles])


def cause_of(run: Run, rattling: list[str]) -> Cause | None:
    """Return the cause of what drives most of the rattling parts, worst first; None as ``cause`` does."""
    if not rattling or unsteady_inputs(run.model):
        return None
    slopes = equivalent_slopes(run)
    drivers = [driver_of(run, part, slopes) for part in rattling]
    driver = max(drivers, key=drivers.count)
    driven = tuple(part for part, own in zip(rattling, drivers, strict=True) if own == driver)
    return _explained(run, driver, driven, slopes)


def driver_of(run: Run, part: str, slopes: tuple[Array, Array]) -> int:
    """Return the index of the body that drives a mesh or clearance.

    Of a loose gear's mesh it is the gear's driver, of a bearing the body that it holds. Else it is the end that the
    excitation moves with more force along the deflection while the element is open, J |a| / |w|, root mean square over
    the orders, in the equivalent driveline: one that is moved as prescribed before all others, of equals the first.
    """
    model = run.model
    layout = run.trajectory.layout
    element = layout.element_names.index(part)
    for gear in loose_gears(layout):
        if is_same_mesh(layout, gear.mesh, element):
            return gear.driver
    if layout.is_bearing[element]:
        return int(layout.between[element, 0])
    system = assemble(model).system
    stiffness, damping = (values.copy() for values in slopes)
    stiffness[element] = 0.0
    damping[element] = 0.0
    rates = turning_rates(system)
    angles = np.zeros((len(layout.inertia_names), rates.size), dtype=np.complex128)
    free = free_of(model)
    angles[free] = steady_angles(system, stiffness, damping)[: free.size]
    if model.motions:
        angles[prescribed_indices(model)] = motion_amplitudes(model)[:, system.inputs.cycles > 0.0]
    inertia = layout.inertia.copy()
    inertia[list(layout.prescribed)] = np.inf
    ends = np.flatnonzero(layout.rows[element])
    moved = np.linalg.norm(rates**2 * angles[ends], axis=1)
    force = np.where(moved > 0.0, inertia[ends], 0.0) * moved / np.abs(layout.rows[element, ends])
    return int(ends[np.argmax(force)])


class _Source(NamedTuple):
    """One order of one source: complex amplitudes of torques (N coordinates,) and of errors (m,)."""

    name: str
    order: float
    torque: Complex
    error: Complex


def _sources(model: Model) -> list[_Source]:
    """Every order of every source, those of one name and order together; what is zero is left out."""
    # sources of the free inertias and of the elements
    names = coordinate_names(model)
    sources: dict[tuple[str, float], _Source] = {}

    def add(name: str, harmonic: Harmonic, *, body: str = "", element: int = -1, factor: float = 1.0) -> None:
        empty = _Source(name, harmonic.order, np.zeros(len(names), complex), np.zeros(len(model.elements), complex))
        source = sources.setdefault((name, harmonic.order), empty)
        amplitude = -1j * factor * harmonic.amplitude * np.exp(1j * harmonic.phase)
        if body in names:
            source.torque[names.index(body)] += amplitude
        if element >= 0:
            source.error[element] += amplitude

    # torques, and joints on their driving shafts
    for table in model.torques:
        for harmonic in table.harmonics:
            add(f"torque on {table.on}", harmonic, body=table.on)
    for on, ripples in load_ripples(model).items():
        for ripple in ripples:
            add(f"torque of the joint on {on}", ripple, body=on)
    # transmission errors and prescribed motions
    for k, element in enumerate(model.elements):
        for error in element.errors:
            add(element.error_words, error, element=k)
    for k, factor, error, path in motion_errors(model):
        add(f"motion of {model.motions[int(path.split('.')[1])].on}", error, element=k, factor=factor)
    return [source for source in sources.values() if source.torque.any() or source.error.any()]


def _explained(run: Run, body: int, parts: tuple[str, ...], slopes: tuple[Array, Array]) -> Cause | None:
    """Return the cause of one body's acceleration; None of what nothing moves."""
    # response of the body to every order of every source alone
    model = run.model
    layout = run.trajectory.layout
    stiffness, damping = slopes
    if body in layout.prescribed:
        alone = _prescribed(model, body)
    else:
        alone = _responses(model, free_of(model).tolist().index(body), stiffness, damping)
    # what all sources do together at an order, and the share of each in it
    together: dict[float, complex] = {}
    for item in alone:
        together[item.order] = together.get(item.order, 0.0) + item.acceleration
    power = sum(abs(amplitude) ** 2 for amplitude in together.values())
    if power == 0.0:
        return None
    # shares of the mean square
    shares = [(item.acceleration * together[item.order].conjugate()).real / power for item in alone]
    shared = [replace(item, share=share) for item, share in zip(alone, shares, strict=True)]
    shared.sort(key=lambda item: -item.share)
    return Cause(
        model,
        layout.inertia_names[body],
        parts,
        tuple(shared),
        _error(run, body, {order: together[order] for order in _named(shared)}),
        dict(zip(layout.element_names, stiffness.tolist(), strict=True)),
        dict(zip(layout.element_names, damping.tolist(), strict=True)),
    )


def equivalent_slopes(run: Run) -> tuple[Array, Array]:
    """Return (m,) slope and (m,) damping of every element along the steady part of a motion.

    They are those of its piece where it stays in one and has no friction; else they are fitted to its force.
    """
    model = run.model
    trajectory = run.trajectory
    layout = trajectory.layout
    laws = assemble(model).system.laws
    window = steady(trajectory)
    log = trajectory.events
    crossing = set(layout.clearance[log.clearance[window.contains(log.time)]].tolist())
    fitted = crossing | {auxiliary.element for auxiliary in assemble(model).system.auxiliaries}
    position = {k: i for i, k in enumerate(layout.clearance.tolist())}
    stiffness = np.empty(len(laws))
    damping = np.empty(len(laws))
    for k, law in enumerate(laws):
        if k in fitted and (line := _line(run, k, position.get(k))) is not None:
            stiffness[k], damping[k] = line
            continue
        piece = region_at(trajectory, position[k], window.start) - law.first_label if k in position else 0
        stiffness[k] = law.stiffness[piece]
        damping[k] = law.damping[piece]
    return stiffness, damping


def _line(run: Run, element: int, clearance: int | None) -> tuple[float, float] | None:
    """Slope and damping fitted to the force of an element; None where it does not move."""
    model = run.model
    trajectory = run.trajectory
    moved = deflection(model, trajectory, element) if clearance is None else trajectory.deflection[:, clearance]
    rate = deflection_rate(model, trajectory, element)
    if clearance is not None:
        force = trajectory.force[:, clearance]
    elif trajectory.layout.is_bearing[element]:
        return None  # linear: its law is known
    else:
        force = trajectory.element_torque[:, element] / trajectory.layout.radii[element, 0]
    return equivalent(*(steady(trajectory).periodic(values) for values in (moved, rate, force)))


def _responses(model: Model, body: int, stiffness: Array, damping: Array) -> list[Contribution]:
    """What every order of every source alone does to a free body, by its index among these."""
    driveline = assemble(model)
    system = driveline.system
    names = driveline.layout.element_names
    modes = damped_modes(system, stiffness, damping)
    responses = []
    for source in _sources(model):
        omega = source.order * model.excitation.omega
        torque = source.torque + system.rows.T @ ((stiffness + 1j * omega * damping) * source.error)
        parts = modes.parts(omega, torque)
        total = complex(sum(complex(part.acceleration[body]) for part in parts))
        along = [(complex(part.acceleration[body]) * total.conjugate()).real for part in parts]
        largest = parts[int(np.argmax(along))]
        through = Through(
            _working(names, largest.strain_energy),
            largest.frequency,
            largest.damping_ratio,
            max(along) / abs(total) ** 2 if total else 0.0,
        )
        responses.append(Contribution(source.name, source.order, omega, total, 0.0, through))
    return responses


def _prescribed(model: Model, body: int) -> list[Contribution]:
    """What every order of its own motion is to a body whose motion is prescribed."""
    amplitudes = motion_amplitudes(model)[prescribed_indices(model).tolist().index(body)]
    name = model.inertias[body].name
    speed = model.excitation.omega
    return [
        Contribution(f"motion of {name}", order, order * speed, -((order * speed) ** 2) * amplitude, 0.0, None)
        for order, amplitude in zip(period_of(model).orders.tolist(), amplitudes.tolist(), strict=True)
        if amplitude
    ]


def _working(names: tuple[str, ...], strain: Array) -> tuple[str, ...]:
    """Elements that give a mode its name: that with most strain energy, and another with much of it."""
    order = np.argsort(-strain, kind="stable")[:2].tolist()
    return tuple(names[k] for j, k in enumerate(order) if strain[k] > (0.0 if j == 0 else _ALONE))


def _error(run: Run, body: int, estimate: Mapping[float, complex]) -> float:
    """How far amplitudes by order miss those of the motion, over the latter, root mean square."""
    inputs = inputs_of(run)
    velocities = inputs.velocities_at(run.trajectory.layout.inertia_names[body])
    if velocities is None:
        return float("nan")
    known = inputs.orders.tolist()
    # the amplitude c of a sine is -i c of exp(i omega t), and its derivative i omega (-i c)
    motion = [order * inputs.speed * complex(velocities[known.index(order)]) for order in estimate]
    missed = sum(abs(value - own) ** 2 for value, own in zip(estimate.values(), motion, strict=True))
    size = sum(abs(own) ** 2 for own in motion)
    return math.sqrt(missed / size) if size > 0.0 else float("nan")
