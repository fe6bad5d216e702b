"""Quantity: the base class of criteria and metrics, the sums that quantities read, and the rows that they return.

A quantity returns *rows*: a row is one number (or word) about one inertia, mesh or coupling, with its unit and source.
A quantity states its formula, the inputs it needs, and how values of consecutive chunks merge into the value of the
whole motion. Criteria read ``Sums`` over the chunks of a motion; metrics read ``Inputs``, which recordings have as
well. A new quantity is a file in this package with a frozen dataclass derived from ``Quantity``, one line in
``quantity_table``, and its test.

A sum over a motion is a *state*: named arrays that ``add`` extends by the next chunk. Its size does not grow with the
number of chunks. Quantities that name the same sum share it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from gearrattle.signals import Window, parts_of, steady
from gearrattle.trajectory import Array, Layout, Trajectory

PAPER = "Padmanabhan, Barlow, Rook, Singh 1995, ASME J. Mech. Des. 117, 185-192"
SINGH = "Singh, Xie, Comparin 1989, J. Sound Vib. 131, 177-196; Wang, Manoj, Zhao 2001, Proc. IMechE D 215, 241-258"
PFEIFFER = "Karagiannis, Pfeiffer 1991, Nonlinear Dynamics 2, 367-387: Newton's restitution between two bodies"
WITHOUT_DIMENSION = frozenset({"", "1", "1/cycle", "dB"})
"""Units that are the same in a dimensionless model."""

State = Mapping[str, Array]
"""A sum over the chunks so far, as named arrays."""
Values = Mapping[tuple[str, str], Array]
"""Values by subject and quantity: one number, or an array over many motions along leading axes."""
Data_contra = TypeVar("Data_contra", contravariant=True)


@dataclass(frozen=True)
class Row:
    """One value of a quantity with its formula and source.

    Attributes
    ----------
    name
        of the criterion or metric in the table.
    subject
        name of the inertia, mesh, coupling or measuring point; empty in a row for a metric without values.
    quantity
        name of the value in words.
    value
        the number, NaN if it does not exist; or a word (a regime).
    unit
        SI unit; "1" for pure numbers, "" for words.
    formula
        formula of the value.
    window
        part of the motion that was used; empty for criteria, whose formula states it.
    source
        source of the formula.
    note
        what the user must know about this value; may be empty.
    error
        estimated sampling error of the value, in its unit: 0 for a value from the exact motion or from the log of
        crossings, NaN without an estimate.
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
        """Return the row for a table: of a "criterion" with its formula, of a "metric" with its window."""
        where = {"formula": self.formula} if kind == "criterion" else {"window": self.window}
        of = {kind: self.name, "subject": self.subject, "quantity": self.quantity, "value": self.value}
        return of | {"unit": self.unit} | where | {"source": self.source, "note": self.note, "error": self.error}


@dataclass(frozen=True)
class Scope:
    """The driveline, its clearances by the parts of the verdict, and the steady part that sums cover.

    The window covers all chunks together, with sample indices as if they were one motion.
    """

    layout: Layout
    window: Window
    samples_per_cycle: int
    algorithm: str


@dataclass(frozen=True)
class Sums:
    """Sums over the chunks of a motion so far; their size does not grow with the number of chunks.

    The scope is None as long as all cycles are discarded.
    """

    scope: Scope | None
    states: Mapping[str, Any]

    @property
    def steady(self) -> Scope:
        """The scope, if at least one cycle is not discarded."""
        assert self.scope is not None
        return self.scope

    def packed(self) -> dict[str, NDArray[Any]]:
        """Return the sums as named arrays for a file; without a window as long as all cycles are discarded."""
        flat = {f"{name}/{key}": array for name, state in self.states.items() for key, array in state.items()}
        if self.scope is None:
            return flat
        window = self.scope.window
        span = np.array([window.start, window.end])
        grid = np.array([window.first, window.last, window.cycles, self.scope.samples_per_cycle])
        return {"span": span, "grid": grid, **flat}

    @classmethod
    def unpacked(cls, arrays: Mapping[str, NDArray[Any]], layout: Layout, algorithm: str) -> Sums | None:
        """Return the sums from the arrays of ``packed``; None if they are empty."""
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
        formula of its values.
    unit
        unit of its main value.
    source
        source of the formula; or that it is a definition, or practice without a source.
    merging
        how the values of consecutive chunks merge into the value of the whole motion, and which values cannot.
    sums
        names of the sums that it reads; quantities that name the same sum share it. Inputs of a motion in chunks are
        made from the sums "crossings" and "signals".
    needs
        for a metric, the inputs that it needs.
    of_crossings
        for a metric, whether it follows from the crossings of a simulated motion without samples.
    of_events
        for a metric, whether it applies to events: it is then no average over cycles.
    window
        for a metric, the part of the motion that it uses.
    sampling
        for a metric, the sampling that it needs.
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
        """Return the values, in element or inertia order; only called if all ``needs`` are met."""
        raise NotImplementedError

    def occasional(self, _layout: Layout) -> list[Row]:
        """Return the rows that only some motions or variants of a driveline have.

        ``value`` of such a row is the value for a motion without it: without impacts, the largest is 0 and the mean
        NaN. ``note`` says what the motion lacks ("no impact"); it may be empty.
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
        """Return a row of this quantity; unit and formula default to those of the quantity."""
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
    """A criterion that depends on the crossings alone; its values can be computed for many motions at once."""

    sums: tuple[str, ...] = ("crossings",)

    def values(self, state: State, layout: Layout, cycles: int, duration: Array) -> Values:
        """Return all values in the order of the rows, NaN where a value does not exist.

        Parameters
        ----------
        state
            sums over the crossings of one motion, or of many along leading axes.
        layout
            the driveline's layout; for many motions, the layout of any of them.
        cycles
            length of the steady part in periods.
        duration
            length of the steady part [s], with the leading axes.
        """
        raise NotImplementedError

    def values_of(self, sums: Sums) -> Values:
        """Return the values for one motion."""
        scope = sums.steady
        duration = np.asarray(scope.window.duration)
        return self.values(sums.states["crossings"], scope.layout, scope.window.cycles, duration)


def scope_of(trajectory: Trajectory, before: Scope | None = None) -> Scope:
    """Return the scope of a chunk's steady part and of all chunks before it; ModelError if all cycles are discarded."""
    window = steady(trajectory)
    per_cycle = trajectory.samples_per_cycle
    end = (trajectory.first_cycle + trajectory.cycles) * per_cycle
    cycles = window.cycles + (0 if before is None else before.window.cycles)
    start = window.start if before is None else before.window.start
    whole = Window(start, window.end, end - cycles * per_cycle, end, cycles)
    return Scope(parts_of(trajectory.layout), whole, per_cycle, trajectory.cost.algorithm)


def deflection_rate_unit(layout: Layout, element: int) -> str:
    """Return the unit of an element's deflection rate: m/s for a mesh, rad/s for a coupling."""
    return "m/s" if layout.is_mesh[element] else "rad/s"


def impulse_unit(layout: Layout, element: int) -> str:
    """Return the unit of an element's momenta and impulses: N s for a mesh, N m s for a coupling."""
    return "N s" if layout.is_mesh[element] else "N m s"


def judged_elements(layout: Layout) -> list[tuple[int, int | None]]:
    """Return every mesh and every element with a corner, in element order, with its index into ``layout.clearance``;
    a bearing without clearance is none.

    The index is None for a mesh without a corner: it cannot rattle, but the verdict lists it.
    """
    index = {int(element): k for k, element in enumerate(layout.clearance)}
    meshes = layout.is_mesh & ~layout.is_bearing
    return [(k, index.get(k)) for k in range(len(layout.element_names)) if k in index or bool(meshes[k])]
