"""Quantity: the base of criteria and metrics, the sums that it reads, and the rows that it gives.

A quantity measures one thing and gives *rows*: one number (or word) each, about one inertia, mesh or coupling, with
its unit and source. It says its formula, what it needs, and how its values over consecutive chunks become those of the
whole. Criteria, which judge a motion, read ``Sums`` over its chunks; metrics read ``Inputs``, which recordings have as
well. A new quantity is a file in this package with a frozen dataclass derived from ``Quantity``, one line in the
table of ``__init__``, and its test; the laws over the table hold for each.

A sum over a motion is a *state*: named arrays that ``add`` extends by the next chunk and whose size does not grow with
the number of chunks. Quantities that name the same sum share it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from gearrattle.signals import Window, steady
from gearrattle.trajectory import Array, Layout, Trajectory

PAPER = "Padmanabhan, Barlow, Rook, Singh 1995, ASME J. Mech. Des. 117, 185-192"
SINGH = "Singh, Xie, Comparin 1989, J. Sound Vib. 131, 177-196; Wang, Manoj, Zhao 2001, Proc. IMechE D 215, 241-258"
PFEIFFER = "Karagiannis, Pfeiffer 1991, Nonlinear Dynamics 2, 367-387: Newton's restitution between two bodies"
WITHOUT_DIMENSION = frozenset({"", "1", "1/cycle", "dB"})
"""Units that a dimensionless model has as well."""

State = Mapping[str, Array]
"""A sum over the chunks so far: named arrays, whose size does not grow with the number of chunks."""
Values = Mapping[tuple[str, str], Array]
"""Values by subject and quantity: one number each, or one for each of many motions along leading axes."""
Data_contra = TypeVar("Data_contra", contravariant=True)


@dataclass(frozen=True)
class Row:
    """One value of a quantity, with where it comes from.

    Attributes
    ----------
    name
        of the criterion or metric in the table.
    subject
        name of the inertia, mesh, coupling or place it is about; empty where a metric has nothing.
    quantity
        what the value is, in words.
    value
        the number, NaN where it does not exist; or a word (a regime).
    unit
        SI unit; "1" for pure numbers, "" for words.
    formula
        how it is computed.
    window
        over what it was taken; empty for criteria, whose formula says it.
    source
        where the formula comes from.
    note
        what the user must know about this value; may be empty.
    error
        by how much the value may be off because it is of samples, estimated, in its unit: 0 where it is of the
        exact motion or of the log of crossings, NaN where there is no estimate.
    """

    name: str
    subject: str
    quantity: str
    value: Any
    unit: str
    formula: str
    window: str
    source: str
    note: str = ""
    error: float = 0.0

    def table_row(self, kind: str) -> dict[str, Any]:
        """Return the row as tables have it: of a "criterion" with its formula, of a "metric" with its window."""
        where = {"formula": self.formula} if kind == "criterion" else {"window": self.window}
        of = {kind: self.name, "subject": self.subject, "quantity": self.quantity, "value": self.value}
        return of | {"unit": self.unit} | where | {"source": self.source, "note": self.note, "error": self.error}


@dataclass(frozen=True)
class Scope:
    """Driveline and steady part that sums are over.

    The window is that of all chunks together, with sample indices as if they were one.
    """

    layout: Layout
    window: Window
    samples_per_cycle: int
    algorithm: str


@dataclass(frozen=True)
class Sums:
    """Sums over the chunks of a motion so far; their size does not grow with the number of chunks.

    The scope is None while every cycle was discarded.
    """

    scope: Scope | None
    states: Mapping[str, Any]

    @property
    def steady(self) -> Scope:
        """The scope, where some cycle is not discarded."""
        assert self.scope is not None
        return self.scope

    def packed(self) -> dict[str, NDArray[Any]]:
        """Return the same as named arrays, for a file; without a window while every cycle was discarded."""
        flat = {f"{name}/{key}": array for name, state in self.states.items() for key, array in state.items()}
        if self.scope is None:
            return flat
        window = self.scope.window
        span = np.array([window.start, window.end])
        grid = np.array([window.first, window.last, window.cycles, self.scope.samples_per_cycle])
        return {"span": span, "grid": grid, **flat}

    @classmethod
    def unpacked(cls, arrays: Mapping[str, NDArray[Any]], layout: Layout, algorithm: str) -> Sums | None:
        """Return the sums that were packed, from arrays of ``packed``; None for empty ones."""
        if not arrays:
            return None
        states: dict[str, dict[str, NDArray[Any]]] = {}
        for name in set(arrays) - {"span", "grid"}:
            sums, _, key = name.partition("/")
            states.setdefault(sums, {})[key] = arrays[name]
        if "span" not in arrays:
            return cls(None, states)
        (start, end) = arrays["span"].tolist()
        (first, last, cycles, per_cycle) = arrays["grid"].tolist()
        return cls(Scope(layout, Window(start, end, first, last, cycles), per_cycle, algorithm), states)


class Quantity(Generic[Data_contra]):
    """A quantity of a motion: a criterion, which reads ``Sums``, or a metric, which reads ``Inputs``.

    Attributes
    ----------
    name
        key in the table, the ``name`` of its rows.
    title
        heading in reports.
    formula
        what is computed.
    unit
        of its main quantity.
    source
        where the formula comes from, or that it is a definition or folklore.
    merging
        how the values of consecutive chunks become those of the whole, and what of them cannot.
    sums
        names of the sums over a motion that it reads; each is added once for all quantities that name it. Inputs
        of a motion in chunks are made of those of crossings and signals.
    needs
        of a metric, what its inputs must hold.
    of_crossings
        of a metric, whether it follows from the crossings of a simulated motion, without any sample.
    of_events
        of a metric, whether it means something of an event, that is, averages over no cycles.
    window
        of a metric, over what it is taken.
    sampling
        of a metric, what sampling it asks for.
    """

    name: str
    title: str
    formula: str
    unit: str
    source: str
    merging: str
    sums: tuple[str, ...] = ("crossings", "signals")
    needs: tuple[str, ...] = ()
    of_crossings: bool = False
    of_events: bool = False
    window: str = ""
    sampling: str = ""

    def rows(self, data: Data_contra) -> list[Row]:
        """Return the values, in element or inertia order; only asked where every need is met."""
        raise NotImplementedError

    def occasional(self, _layout: Layout) -> list[Row]:
        """Return the rows that only some motions or variants of a driveline have.

        ``value`` is what stands where a motion lacks the row: the largest of no impacts is 0, their mean is NaN.
        ``note`` says what it lacks ("no impact"); empty where that need not be said.
        """
        return []

    def row(  # noqa: PLR0917 - in the order of the columns
        self,
        subject: str,
        quantity: str,
        value: float | str,
        unit: str | None = None,
        note: str = "",
        error: float = 0.0,
        *,
        formula: str | None = None,
    ) -> Row:
        """Return a row of this quantity; unit and formula are its own unless they are named."""
        return Row(
            name=self.name,
            subject=subject,
            quantity=quantity,
            value=value if isinstance(value, str) else float(value),
            unit=self.unit if unit is None else unit,
            formula=self.formula if formula is None else formula,
            window=self.window,
            source=self.source,
            note=note,
            error=float(error),
        )


class CrossingQuantity(Quantity[Sums]):
    """A criterion of the crossings alone: its values can be computed of many motions at once."""

    sums: tuple[str, ...] = ("crossings",)

    def values(self, state: State, layout: Layout, cycles: int, duration: Array) -> Values:
        """Return every value, NaN where it does not exist, in the order of the rows.

        Parameters
        ----------
        state
            sums over the crossings of one motion, or of many along leading axes.
        layout
            the driveline's layout; of many, that of any one of them.
        cycles
            length of the steady part in periods.
        duration
            the same [s], with the leading axes.
        """
        raise NotImplementedError

    def values_of(self, sums: Sums) -> Values:
        """Return the values of one motion."""
        scope = sums.steady
        duration = np.asarray(scope.window.duration)
        return self.values(sums.states["crossings"], scope.layout, scope.window.cycles, duration)


def scope_of(trajectory: Trajectory, before: Scope | None = None) -> Scope:
    """Return the scope of a chunk's steady part and of all chunks before it.

    ModelError if no cycle remains after the discarded ones.
    """
    window = steady(trajectory)
    per_cycle = trajectory.samples_per_cycle
    end = (trajectory.first_cycle + trajectory.cycles) * per_cycle
    cycles = window.cycles + (0 if before is None else before.window.cycles)
    start = window.start if before is None else before.window.start
    whole = Window(start, window.end, end - cycles * per_cycle, end, cycles)
    return Scope(trajectory.layout, whole, per_cycle, trajectory.cost.algorithm)


def deflection_rate_unit(layout: Layout, element: int) -> str:
    """Return the unit of an element's deflection rate: m/s for a mesh, rad/s for a coupling."""
    return "m/s" if layout.is_mesh[element] else "rad/s"


def impulse_unit(layout: Layout, element: int) -> str:
    """Return the unit of an element's momenta and impulses: N s for a mesh, N m s for a coupling."""
    return "N s" if layout.is_mesh[element] else "N m s"


def judged_elements(layout: Layout) -> list[tuple[int, int | None]]:
    """Return every mesh and every element with a corner, in element order, with its index into ``layout.clearance``;
    a bearing without clearance is none.

    The index is None for a mesh that has no corner: it cannot rattle, but it is judged all the same.
    """
    index = {int(element): k for k, element in enumerate(layout.clearance)}
    meshes = layout.is_mesh & ~layout.is_bearing
    return [(k, index.get(k)) for k in range(len(layout.element_names)) if k in index or bool(meshes[k])]
