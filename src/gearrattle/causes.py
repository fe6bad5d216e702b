"""Cause of rattle: the orders of the excitation that accelerate a driver, and the mode through which they act.

A driveline that rattles is not linear. But at the orders of its excitation it moves much as an equivalent linear
driveline does, in which the slope and damping of every element are fitted to the force of the element along the motion
(``analysis.linear.equivalent``). The response of the equivalent driveline to order j of source k alone, a_jk, estimates
the effect of this source. The sum over the sources is compared with the amplitude of the motion at order j. Every
source and order has a share of the mean square of the acceleration,

    share_jk = Re(a_jk conj(sum_k a_jk)) / sum_j |sum_k a_jk|^2

The linear driveline of the most frequent contact state is not a good equivalent: in it a rattling gear is free, and its
shaft may have no connection to the engine. In the motion the impacts carry the gear along, and at these orders it moves
almost as if it were tied to its driver.
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
from gearrattle.model.element_groups import element_groups
from gearrattle.model.table import did_you_mean, shown
from gearrattle.quantities.criteria import criteria
from gearrattle.quantities.metrics import inputs_of
from gearrattle.result import Result
from gearrattle.results import Run, check_run
from gearrattle.signals import is_same_mesh, loose_gears, parts_of, region_at, steady
from gearrattle.wording import listed, numeral

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

ENOUGH = 0.8
"""Share of the mean square that the named orders must reach together, unless that takes more than ``MOST_NAMED``."""
MOST_NAMED = 2
"""Largest number of orders that the sentence names."""
POOR = 1.0
"""Relative error of the estimate above which no mode is named: the error is then larger than the motion itself."""
_ALONE = 0.3  # share of a mode's strain energy: an element with less does not name the mode
_NEAR = 0.05  # share of a mode's frequency: an order within this distance is called in resonance
_FAR = 0.3  # relative error of the estimate above which the driveline is called far from linear
_CANCELLED = 1.1  # multiple of the share of an order: a source above it is called partly cancelled by others


@dataclass(frozen=True)
class Through:
    """The mode with the largest share in a response.

    Attributes
    ----------
    elements
        names of the elements with most of its strain energy, largest first; empty for rigid motion.
    frequency
        natural frequency [rad/s]; for overdamped motion its decay rate; 0 for rigid motion.
    damping_ratio
        1 for overdamped motion; NaN for rigid motion.
    share
        component of its response in phase with the whole response, over the latter; above 1 where other modes oppose.
    """

    elements: tuple[str, ...]
    frequency: float
    damping_ratio: float
    share: float


@dataclass(frozen=True)
class Contribution:
    """The acceleration of the body by one order of one source.

    Attributes
    ----------
    source
        "torque on NAME", "motion of NAME", "transmission error of NAME".
    order
        multiple of the reference speed.
    frequency
        angular frequency [rad/s].
    acceleration
        complex amplitude a: the acceleration is the real part of a exp(i frequency t) [rad/s^2].
    share
        of the mean square of the acceleration by all orders of all sources; all shares add up to 1.
    through
        the mode through which this order acts; None for a body whose motion is prescribed.
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
        the inertia whose acceleration is explained.
    parts
        the rattling meshes and clearances that the body drives, worst first; none where the user chose the body.
    contributions
        of every order of every source, largest share first.
    error
        relative error of the estimate: root mean square difference between its amplitudes and the motion's at the
        orders named, over the motion's amplitudes; NaN where the samples are too coarse for these orders.
    slopes, dampings
        of every element of the equivalent linear driveline [N m/rad or N/m, N m s/rad or N s/m].

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
        """The orders that the sentence names: the one with the largest share, and a second if that is too little."""
        return _named(self.contributions)

    @property
    def is_poor(self) -> bool:
        """Whether the error of the estimate is so large that no mode can be named."""
        return self.error > POOR

    @property
    def sentence(self) -> str:
        """The cause in one line."""
        words = [self._order(order, first=i == 0) for i, order in enumerate(self.named)]
        alternating = [element.name for element in self.model.elements if element.alternation is not None]
        left = f" What the alternating stiffness of {listed(alternating)} excites is left out." if alternating else ""
        return f"Cause (estimate): {'; '.join(words)}{self._trust()}.{left}"

    def _order(self, order: float, *, first: bool) -> str:
        """The effect of one order in words, with its sources and the mode through which it acts."""
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
        """The error of the estimate in words."""
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
    """The order with the largest share, and a second one if the first has less than ``ENOUGH``."""
    shares = _orders(contributions)
    orders = tuple(shares)
    return orders[: 1 if shares[orders[0]] >= ENOUGH else MOST_NAMED]


def _through(item: Contribution, *, si: bool) -> str:
    """The mode through which an order acts in words, and the ratio of the order's frequency to that of the mode."""
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
    """Return a share in per cent; only an exact 1 is shown as 100 %."""
    percent = 100.0 * share
    return "more than 99.9 %" if 99.9 < percent < 99.9999 else f"{numeral(percent, 3)} %"


def cause(run: Run, body: str | None = None) -> Cause | None:
    """Estimate which orders of the excitation accelerate the driver of what rattles worst, and through which mode.

    Parameters
    ----------
    run
        a motion; only its steady part is used.
    body
        the inertia whose acceleration is explained; None takes the inertia that drives most of the rattling parts; if
        several drive the same number, the driver of the worst part.

    Returns
    -------
    Cause | None
        The estimate. None if nothing rattles and no body is chosen, if the motion does not repeat (under a record or
        along a sweep), and if no harmonic moves the body.

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
    """Cause for the body that drives most of the rattling parts, which are worst first; None as ``cause``."""
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
    element = parts_of(layout).element_names.index(part)
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
    """Every order of every source without zeros; harmonics of the same source and order are added up."""
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
    """Return the cause of one body's acceleration; None for a body that no harmonic moves."""
    # response of the body to every order of every source alone
    model = run.model
    layout = run.trajectory.layout
    stiffness, damping = slopes
    if body in layout.prescribed:
        alone = _prescribed(model, body)
    else:
        alone = _responses(model, free_of(model).tolist().index(body), stiffness, damping)
    # sum of the responses at every order, and the share of every source in it
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

    An element that stays in one piece and has no friction has those of its piece; for all others they are fitted to the
    force.
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
    """Response of a free body (by its index among the free ones) to every order of every source alone."""
    driveline = assemble(model)
    system = driveline.system
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
            _working(model, largest.strain_energy),
            largest.frequency,
            largest.damping_ratio,
            max(along) / abs(total) ** 2 if total else 0.0,
        )
        responses.append(Contribution(source.name, source.order, omega, total, 0.0, through))
    return responses


def _prescribed(model: Model, body: int) -> list[Contribution]:
    """Acceleration by every order of the prescribed motion of a body."""
    amplitudes = motion_amplitudes(model)[prescribed_indices(model).tolist().index(body)]
    name = model.inertias[body].name
    speed = model.excitation.omega
    return [
        Contribution(f"motion of {name}", order, order * speed, -((order * speed) ** 2) * amplitude, 0.0, None)
        for order, amplitude in zip(period_of(model).orders.tolist(), amplitudes.tolist(), strict=True)
        if amplitude
    ]


def _working(model: Model, strain: Array) -> tuple[str, ...]:
    """Elements that name a mode: the one with most strain energy, and a second with at least ``_ALONE`` of it.

    The faces of a bearing count together, under its name.
    """
    position = {element.name: k for k, element in enumerate(model.elements)}
    energy = {
        name: float(sum(strain[position[element.name]] for element in elements))
        for name, elements in element_groups(model).items()
    }
    largest = sorted(energy, key=lambda name: -energy[name])[:2]
    return tuple(name for j, name in enumerate(largest) if energy[name] > (0.0 if j == 0 else _ALONE))


def _error(run: Run, body: int, estimate: Mapping[float, complex]) -> float:
    """Root mean square difference between estimated amplitudes and those of the motion, over the latter."""
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
