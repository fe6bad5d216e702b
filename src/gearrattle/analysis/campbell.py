"""Campbell diagram: where the orders of the excitation meet natural frequencies as the speed varies.

    order x Omega = omega_r

(W. Campbell, Trans. ASME 46 (1924) 31). Natural frequencies of a torsional driveline do not depend on its speed, so a
crossing is a quotient. They do depend on how much of the time clearances are in contact: with a grid of contact
ratios, every state has its own frequencies. How much a crossing matters is given by the share of the energy of the
order's source that goes into the mode (see ``Modes.excitation``).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from itertools import product
from math import prod
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticCustomError

from gearrattle.analysis.statics import Modes, modes, motion_source, torque_source
from gearrattle.errors import ModelError, Problem
from gearrattle.json_types import Json
from gearrattle.model import Harmonic, Model, check_model, units
from gearrattle.model.table import shown
from gearrattle.model.value_kinds import Quantity
from gearrattle.result import Result

Array = NDArray[np.float64]
Ratios = Mapping[str, float | Sequence[float]]

MOST_STATES = 64


@dataclass(frozen=True)
class OrderLine:
    """One order of the excitation.

    Attributes
    ----------
    order
        multiple of the reference speed.
    sources
        what turns with it, by the names of ``Modes.sources``.
    """

    order: float
    sources: tuple[str, ...]


@dataclass(frozen=True)
class Crossing:
    """An order line meets a natural frequency.

    Attributes
    ----------
    speed
        speed of the reference shaft [rad/s].
    order
        order of the excitation.
    mode
        column of the mode in ``Modes.shapes``, from 0.
    frequency
        the natural frequency [rad/s].
    state
        index of the contact state.
    source
        the source of this order that excites the mode most.
    share
        share of the source's energy that goes into the mode.
    """

    speed: float
    order: float
    mode: int
    frequency: float
    state: int
    source: str
    share: float


@dataclass(frozen=True)
class Campbell(Result):
    """Natural frequencies and order lines over a range of speeds.

    Attributes
    ----------
    speeds
        lowest and highest speed of the reference shaft [rad/s].
    model_speed
        the model's own.
    states
        contact ratio by element name, one mapping for every state.
    frequencies
        (S states, n modes) [rad/s], ascending in each state; 0 for rigid motion.
    orders
        order lines, ascending.
    crossings
        crossings, by ascending speed.
    modes
        the modes of each state.
    units
        "SI", or "dimensionless": then speeds and frequencies are as in the model.

    Examples
    --------
    >>> len(gr.campbell(gr.example("case3"), "600:1200 rpm").crossings)
    3
    """

    kind: ClassVar[str] = "Campbell diagram"
    speeds: tuple[float, float]
    model_speed: float
    states: tuple[dict[str, float], ...]
    frequencies: Array
    orders: tuple[OrderLine, ...]
    crossings: tuple[Crossing, ...]
    modes: tuple[Modes, ...]
    units: str = "SI"

    @property
    def notes(self) -> tuple[str, ...]:
        """What the modes leave out."""
        return self.modes[0].notes

    def nearest(self) -> Crossing | None:
        """The crossing nearest to the model's speed by ratio; None if there are none."""
        return min(self.crossings, key=lambda c: abs(np.log(c.speed / self.model_speed)), default=None)

    def to_dict(self) -> dict[str, Json]:
        """Everything but the modes, in JSON types; speeds and frequencies as they are held, modes counted from 0."""
        return {
            "speeds": list(self.speeds),
            "model_speed": self.model_speed,
            "states": [dict(state) for state in self.states],
            "frequencies": self.frequencies.tolist(),
            "orders": [{"order": line.order, "sources": list(line.sources)} for line in self.orders],
            "crossings": [asdict(crossing) for crossing in self.crossings],
        }


def campbell(
    model: Model,
    speeds: str | Sequence[float | str] | None = None,
    contact_ratio: Ratios | None = None,
    region: Mapping[str, int] | None = None,
) -> Campbell:
    """Natural frequencies, order lines and their crossings over a range of speeds.

    Orders are those of the model's torque harmonics and transmission errors. Damping plays no part.

    Parameters
    ----------
    model
        the driveline.
    speeds
        lowest and highest speed of the reference shaft: ``"800:3000 rpm"``, ``"800 rpm:3000 rpm"``, or a pair
        of such words; plain numbers are in rad/s; default: from 0 to twice the model's.
    contact_ratio
        Gamma by element name, or a list of them: every combination is a state.
    region
        region label by element name, the same in all states.

    Raises
    ------
    ModelError
        a range that is not valid, more than 64 states, or what ``modes`` refuses.

    Examples
    --------
    >>> diagram = gr.campbell(gr.example("case3"), "600:1200 rpm")
    >>> [(c.order, c.mode, round(c.speed, 1)) for c in diagram.crossings[:3]]
    [(5.0, 1, 67.8), (4.0, 1, 84.7), (3.0, 1, 112.9)]
    """
    check_model(model)
    sweep = model.excitation.sweep
    fastest = model.excitation.omega if sweep is None else max(sweep.begin, sweep.end)
    low, high = (0.0, 2.0 * fastest) if speeds is None else _range(model, speeds)
    states = _states(contact_ratio or {})
    modes_of_states = tuple(modes(model, contact_ratio=state, region=region) for state in states)
    orders = _orders(model)
    crossings = [
        Crossing(
            float(frequency) / line.order, line.order, mode, float(frequency), j, *_strongest(state_modes, line, mode)
        )
        for j, state_modes in enumerate(modes_of_states)
        for line in orders
        for mode, frequency in enumerate(state_modes.frequencies.tolist())
        if frequency > 0.0 and low <= frequency / line.order <= high
    ]
    crossings.sort(key=lambda c: (c.speed, c.state, c.order, c.mode))
    frequencies = np.array([state_modes.frequencies for state_modes in modes_of_states])
    return Campbell(
        (low, high), model.excitation.omega, states, frequencies, orders, tuple(crossings), modes_of_states, model.units
    )


def _range(model: Model, speeds: str | Sequence[float | str]) -> tuple[float, float]:
    """Read the range of speeds [rad/s]."""
    rule = 'must be a lowest and a highest speed, such as "800:3000 rpm"'
    example = "the first below the second"
    ends = units.with_last_unit(speeds.split(":")) if isinstance(speeds, str) else list(speeds)
    if len(ends) != 2:
        raise ModelError(Problem("speeds", shown(speeds), rule, example))
    low, high = (_speed(model, end) for end in ends)
    if not low < high:
        raise ModelError(Problem("speeds", shown(speeds), rule, example))
    return low, high


def _speed(model: Model, speed: float | str) -> float:
    """Read one speed; a text without a unit is a plain number."""
    value: float | str = speed.strip() if isinstance(speed, str) else speed
    with suppress(ValueError):
        value = float(value)
    try:
        return float(Quantity(units.ANGULAR_VELOCITY, "non-negative").read(value, model.units == "dimensionless"))
    except PydanticCustomError as error:
        context = error.context or {}
        raise ModelError(Problem("speeds", shown(speed), context["rule"], context["remedy"])) from None


def _states(contact_ratio: Ratios) -> tuple[dict[str, float], ...]:
    """Every combination of the ratios given."""
    grid = {
        name: [float(ratio)] if isinstance(ratio, int | float) else [float(share) for share in ratio]
        for name, ratio in contact_ratio.items()
    }
    empty = [name for name, ratios in grid.items() if not ratios]
    if empty:
        raise ModelError(Problem(f"contact_ratio: {empty[0]}", "no ratio", "needs at least one"))
    count = prod(len(ratios) for ratios in grid.values())
    if count > MOST_STATES:
        raise ModelError(
            Problem(
                "contact_ratio",
                f"{count} combinations",
                f"at most {MOST_STATES} states fit into one diagram",
                "give fewer ratios",
            )
        )
    return tuple(dict(zip(grid, chosen, strict=True)) for chosen in product(*grid.values()))


def _orders(model: Model) -> tuple[OrderLine, ...]:
    """Orders of all harmonics that are not zero, each with what turns with it."""
    sources: dict[float, list[str]] = {}
    pairs: list[tuple[str, tuple[Harmonic, ...]]] = [(torque_source(t.on), t.harmonics) for t in model.torques]
    pairs += [(motion_source(motion.on), motion.harmonics) for motion in model.motions]
    pairs += [(element.error_words, element.errors) for element in model.elements]
    for source, harmonics in pairs:
        for harmonic in harmonics:
            if harmonic.amplitude and harmonic.order:
                named = sources.setdefault(harmonic.order, [])
                named += [source] * (source not in named)
    return tuple(OrderLine(order, tuple(sources[order])) for order in sorted(sources))


def _strongest(linear_modes: Modes, line: OrderLine, mode: int) -> tuple[str, float]:
    """The source of an order that excites a mode most, and its share."""
    shares = {
        source: float(linear_modes.excitation[linear_modes.sources.index(source), mode]) for source in line.sources
    }
    source = max(shares, key=lambda name: shares[name])
    return source, shares[source]
