"""The nouns of the shelf: a criterion, the entries it gives, and the parts that are judged by them.

A criterion measures one thing on a trajectory and says it in *entries*: one number (or word) each, about one inertia,
mesh or coupling, with its unit, its formula and where the formula comes from. It does so in two steps, because a long
motion comes in chunks that nobody keeps: it *gathers* from every chunk what it needs into a tally of bounded size, and
*tells* the entries from the tally. A new criterion is a file beside this one with a frozen class that satisfies
``Criterion``, one line in the table of ``__init__``, and its test page; the laws over the table hold it to what a tally
promises.

Each mesh and each clearance is a *part* of the verdict, judged by its regime in the steady part; the whole is the worst
of the parts that rattle. The rule is stated in words (``RULE``) wherever the verdict is shown.

Takes trajectories; gives entries and parts to the verdict.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from gearrattle.signals import Regime, Window, steady
from gearrattle.trajectory import Array, Layout, Trajectory

PAPER = "Padmanabhan, Barlow, Rook, Singh 1995, ASME J. Mech. Des. 117, 185-192"


@dataclass(frozen=True)
class Entry:
    """One result of a criterion.

    Attributes:
        criterion: name of the criterion in the table.
        subject: name of the inertia, mesh or coupling it is about.
        quantity: what the value is, in words.
        value: the number, NaN where it does not exist; or a word (a regime).
        unit: SI unit; "1" for pure numbers, "" for words.
        formula: how it comes about.
        source: where the formula comes from.
        note: what the user must know about this value; may be empty.
        error: by how much the value may be off because it is of samples, estimated, in its unit: 0 where it is of the
            exact motion, NaN where there is no estimate.
    """

    criterion: str
    subject: str
    quantity: str
    value: float | str
    unit: str
    formula: str
    source: str
    note: str = ""
    error: float = 0.0


Tally = Mapping[str, Array]
"""What a criterion keeps of the chunks so far: named arrays, whose size does not grow with the number of chunks."""


@dataclass(frozen=True)
class Scope:
    """What a tally is of.

    Attributes:
        layout: the driveline's name plate.
        window: the steady part of all chunks together; sample indices as if they were one.
        samples_per_cycle: output grid.
        algorithm: what made the motion.
    """

    layout: Layout
    window: Window
    samples_per_cycle: int
    algorithm: str


class Criterion(Protocol):
    """A criterion: what it is called, what it computes and from where, and the computation."""

    @property
    def name(self) -> str:
        """Key in the table, the ``criterion`` of its entries."""

    @property
    def title(self) -> str:
        """Heading in reports."""

    @property
    def formula(self) -> str:
        """What is computed, over which window."""

    @property
    def unit(self) -> str:
        """Unit of its main quantity."""

    @property
    def source(self) -> str:
        """Where the formula comes from."""

    @property
    def sums(self) -> str:
        """Which sums it reads: criteria of one name gather the same, and it is gathered once for all of them."""

    @property
    def merging(self) -> str:
        """How the values of consecutive chunks become those of the whole, and what of them cannot."""

    def occasional(self, layout: Layout) -> list[Entry]:
        """Return the entries that only some motions or variants of a driveline have.

        ``value`` is what stands where a motion lacks the entry: the largest of no impacts is 0, their mean is NaN.
        ``note`` says what it lacks ("no impact"); empty where that need not be told.
        """

    def gather(self, trajectory: Trajectory, before: Tally | None) -> Tally:
        """Return the tally of a chunk's steady part and of all chunks before it (None: there are none)."""

    def tell(self, tally: Tally, scope: Scope) -> list[Entry]:
        """Return the entries, in element or inertia order."""

    def evaluate(self, trajectory: Trajectory) -> list[Entry]:
        """Return the entries of one trajectory."""


Measures = Mapping[tuple[str, str], Array]
"""Values by subject and quantity: one number each, or one for each of many tallies along leading axes."""


class Measuring(Criterion, Protocol):
    """A criterion whose tally can be one of many: every array of the tally may have leading axes."""

    def measure(self, tally: Tally, layout: Layout, cycles: int, duration: Array) -> Measures:
        """Return every value, NaN where it does not exist, in the order of the entries.

        Args:
            tally: of one motion, or of many along leading axes.
            layout: the driveline's name plate; of many, that of any one of them.
            cycles: length of the steady part in periods.
            duration: the same [s], with the leading axes.
        """


def measured(criterion: Measuring, tally: Tally, scope: Scope) -> Measures:
    """Return the values of one motion's tally."""
    return criterion.measure(tally, scope.layout, scope.window.cycles, np.asarray(scope.window.duration))


class Telling:
    """A criterion's ``evaluate``: gather once, then tell. Every motion has all entries but ``occasional`` ones."""

    def occasional(self, _layout: Layout) -> list[Entry]:
        """Return the entries that only some motions have: none."""
        return []

    def evaluate(self: Criterion, trajectory: Trajectory) -> list[Entry]:
        """Return the entries, in element or inertia order."""
        return self.tell(self.gather(trajectory, None), scope_of(trajectory))


def scope_of(trajectory: Trajectory, before: Scope | None = None) -> Scope:
    """Return the scope of a chunk's steady part and of all chunks before it.

    Raises:
        ModelError: if no cycle remains after the discarded ones.
    """
    window, per_cycle = steady(trajectory), trajectory.samples_per_cycle
    end = (trajectory.first_cycle + trajectory.cycles) * per_cycle
    cycles = window.cycles + (0 if before is None else before.window.cycles)
    start = window.start if before is None else before.window.start
    whole = Window(start, window.end, end - cycles * per_cycle, end, cycles)
    return Scope(trajectory.layout, whole, per_cycle, trajectory.cost.algorithm)


def entry(
    criterion: Criterion,
    subject: str,
    quantity: str,
    value: float | str,
    *,
    unit: str | None = None,
    formula: str | None = None,
    note: str = "",
    error: float = 0.0,
) -> Entry:
    """Return an entry of a criterion; unit and formula are the criterion's own where they are not given."""
    return Entry(
        criterion=criterion.name,
        subject=subject,
        quantity=quantity,
        value=value if isinstance(value, str) else float(value),
        unit=criterion.unit if unit is None else unit,
        formula=criterion.formula if formula is None else formula,
        source=criterion.source,
        note=note,
        error=float(error),
    )


def deflection_rate_unit(layout: Layout, element: int) -> str:
    """Return the unit of an element's deflection rate: m/s for a mesh, rad/s for a coupling."""
    return "m/s" if layout.is_mesh[element] else "rad/s"


def impulse_unit(layout: Layout, element: int) -> str:
    """Return the unit of an element's momenta and impulses: N s for a mesh, N m s for a coupling."""
    return "N s" if layout.is_mesh[element] else "N m s"


def judged_elements(layout: Layout) -> list[tuple[int, int | None]]:
    """Return every mesh and every element with a corner, in element order, with its index into ``layout.clearance``.

    The index is None for a mesh that has no corner: it cannot rattle, but it is judged all the same.
    """
    index = {int(element): k for k, element in enumerate(layout.clearance)}
    return [(k, index.get(k)) for k in range(len(layout.element_names)) if k in index or bool(layout.is_mesh[k])]


RULE = (
    "Each mesh and each clearance is judged over the steady part, from the discarded cycles to the end: quiet if it "
    "crosses no corner there, single-sided if it crosses corners on its drive side only or on its coast side only, "
    "double-sided if it crosses corners on both sides. Of a gap, whose centre has no stiffness, the corners of the "
    "centre count: crossing them it separates, and rattles. A staged spring with stiffness in all its stages changes "
    "stage and does not rattle. The whole is the worst of the parts that rattle, and quiet if none does. Parts that "
    "rattle come first, then double-sided before single-sided, then the larger impact energy m_eff v^2 / 2 of the "
    "hardest impact. The margin is that of the loose-gear test, 20 log10 of the loose gear's "
    "inertia torque over its drag torque: above 0 dB the drag cannot hold the gear against its flank."
)

SEVERITY: Mapping[Regime, int] = {"quiet": 0, "single-sided": 1, "double-sided": 2}


@dataclass(frozen=True)
class Part:
    """One mesh or clearance, judged over the steady part.

    Attributes:
        name: of the mesh or coupling.
        kind: "mesh" or "coupling".
        gap: whether its centre is free of stiffness, so that it can separate; else its corners are those of a staged
            spring.
        regime: "quiet", "single-sided" or "double-sided"; of a gap: where it separates.
        impacts_per_cycle, impacts_per_second: rate of impacts.
        drive_impacts_per_cycle, coast_impacts_per_cycle: the same, side by side.
        max_approach_speed: ``|v|`` of the fastest impact [m/s or rad/s]; None without impacts.
        max_impact_momentum: ``m_eff |v|`` of the same [N s or N m s]; None without impacts, or if no body is free.
        mean_impact_energy, max_impact_energy: m_eff v^2 / 2 [J]; None as above. The largest one ranks parts.
        mean_exchanged_momentum, max_exchanged_momentum: ``m_eff (|v| + |v'|)`` [N s or N m s]; None as above.
        mean_contact_impulse, max_contact_impulse: magnitude of the integral of the force over the contact, static load
            included [N s or N m s]; None without impacts or without a force integral.
        contact_share: share of time in contact, 0 to 1.
        margin_db: of the loose-gear test [dB]; None where there is no loose gear.
        impulse_unit, energy_unit, speed_unit: units of the above.
    """

    name: str
    kind: str
    gap: bool
    regime: Regime
    impacts_per_cycle: float
    impacts_per_second: float
    drive_impacts_per_cycle: float
    coast_impacts_per_cycle: float
    max_approach_speed: float | None
    max_impact_momentum: float | None
    mean_impact_energy: float | None
    max_impact_energy: float | None
    mean_exchanged_momentum: float | None
    max_exchanged_momentum: float | None
    mean_contact_impulse: float | None
    max_contact_impulse: float | None
    contact_share: float
    margin_db: float | None
    impulse_unit: str
    energy_unit: str
    speed_unit: str

    @property
    def rattles(self) -> bool:
        """Whether it separates and meets again: a gap that is not quiet."""
        return self.gap and self.regime != "quiet"


def worst_first(parts: list[Part]) -> tuple[Part, ...]:
    """Return those that rattle first, by falling regime, then largest impact energy; element order decides ties."""
    return tuple(
        sorted(parts, key=lambda part: (not part.rattles, -SEVERITY[part.regime], -(part.max_impact_energy or 0.0)))
    )
