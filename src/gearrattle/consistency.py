"""Checks whether the arrays of a stored motion are consistent; otherwise the file is refused and the fault named."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.trajectory import Array, IntArray, Layout, Trajectory

_SAME_TIME = 1e-6  # share of a step or a period: times that differ by less are the same
_ROUNDING = 1e-12  # share of a time
_LARGEST = 1e100  # SI; products of larger numbers overflow
_MAY_MISS = ("energy_residual", "smallest_step")  # fields of ``Cost`` that may be absent


def check_stored(trajectory: Trajectory, source: object) -> None:
    """Refuse a motion from a file whose arrays do not fit together, for example after the file was changed.

    The ModelError names the first number, length, label or time that is impossible for a motion of this layout.
    """
    for checked in (_of_grid, _of_samples, _of_events, _of_auxiliaries, _of_records):
        for name, value, rule in checked(trajectory):
            remedy = "the file was changed or is damaged: save the run again"
            raise ModelError(Problem(f"{source}: {name}", value, rule, remedy))


_Fault = tuple[str, str, str]
"""Name of an array, its wrong value, and the rule for it."""


def _of_grid(t: Trajectory) -> Iterator[_Fault]:
    """Yield faults of the grid of samples."""
    for name, value, least in (
        ("samples_per_cycle", t.samples_per_cycle, 1),
        ("cycles", t.cycles, 1),
        ("discard", t.discard, 0),
        ("first_cycle", t.first_cycle, 0),
    ):
        if value < least:
            yield name, f"{value}", f"must be {least} or more"
    if t.discard > t.cycles:  # all of them are left out of a chunk that is start-up
        yield "discard", f"{t.discard}", f"must be at most the {t.cycles} cycles"
    samples = t.cycles * t.samples_per_cycle + 1
    yield from _of_shape("time", t.time, (samples,))
    step = t.layout.period / t.samples_per_cycle
    grid = (t.first_cycle * t.samples_per_cycle + np.arange(samples)) * step
    off = np.abs(t.time - grid) > _SAME_TIME * step + _ROUNDING * np.abs(grid)
    if off.any():
        at = int(np.argmax(off))
        yield "time", f"{t.time[at]:.9g} s at sample {at}", f"must be {grid[at]:.9g} s: the grid of the model's period"


def _of_samples(t: Trajectory) -> Iterator[_Fault]:
    """Yield faults of the samples."""
    count = t.time.size
    bodies = len(t.layout.inertia_names)
    elements = len(t.layout.element_names)
    clearances = t.layout.clearance.size
    widths = {"angle": bodies, "velocity": bodies, "acceleration": bodies, "element_torque": elements}
    widths |= dict.fromkeys(("deflection", "force", "region"), clearances)
    for name, width in widths.items():
        yield from _of_shape(name, getattr(t, name), (count, width))
    if t.sideways is not None:
        for name in ("displacement", "velocity", "acceleration"):
            width = len(t.layout.direction_names)
            yield from _of_shape(f"sideways {name}", getattr(t.sideways, name), (count, width))
        forces = (count, len(t.layout.bearing_names))
        yield from _of_shape("bearing_force", t.sideways.bearing_force, forces)
        yield from _of_shape("casing_force", t.sideways.casing_force, (count, 2))
    yield from _of_shape("initial_region", t.initial_region, (clearances,))
    yield from _of_shape("final_force_integral", t.final_force_integral, (clearances,), may_be_unknown=True)
    for k in range(clearances):
        yield from _of_labels(t.layout, k, "region", t.region[:, k])
        yield from _of_labels(t.layout, k, "initial_region", t.initial_region[k : k + 1])


def _of_events(t: Trajectory) -> Iterator[_Fault]:
    """Yield faults of the log of crossings."""
    log = t.events
    count = log.time.size
    for name in ("time", "velocity", "clearance", "from_region", "to_region", "force_integral"):
        yield from _of_shape(f"events/{name}", getattr(log, name), (count,), may_be_unknown=name == "force_integral")
    yield from _of_times("events/time", log.time, t)
    yield from _of_indices("events/clearance", log.clearance, t.layout.clearance.size)
    for k in range(t.layout.clearance.size):
        own = np.flatnonzero(log.clearance == k)
        froms = log.from_region[own]
        tos = log.to_region[own]
        yield from _of_labels(t.layout, k, "events/from_region", froms)
        yield from _of_labels(t.layout, k, "events/to_region", tos)
        before = np.append(t.initial_region[k], tos[:-1])[: own.size]
        broken = (froms != before) | (np.abs(tos - froms) != 1)
        if broken.any():
            at = int(np.argmax(broken))
            value = f"from region {froms[at]} to {tos[at]} of {t.layout.clearance_names[k]}, crossing {own[at]}"
            yield "events", value, f"must lead from region {before[at]}, where it was, to one beside it"


def _of_auxiliaries(t: Trajectory) -> Iterator[_Fault]:
    """Yield faults of the states of sliders and limiters, and of the order of all crossings."""
    count = len(t.layout.auxiliary_names)
    if t.auxiliaries is None:
        if count:
            yield "auxiliaries", "missing", f"the model has {', '.join(t.layout.auxiliary_names)}"
        return
    # states of sliders and limiters at the samples
    log = t.auxiliaries.passages
    for name, array in (("slider_force", t.auxiliaries.force), ("slider_stretch", t.auxiliaries.memory)):
        yield from _of_shape(name, array, (t.time.size, count))
    yield from _of_shape("auxiliaries/state", t.auxiliaries.piece, (t.time.size, count))
    yield from _of_shape("auxiliaries/initial", t.auxiliaries.initial, (count,))
    for k, words in enumerate(t.layout.auxiliary_words):
        yield from _of_indices("auxiliaries/state", t.auxiliaries.piece[:, k], len(words))
        yield from _of_indices("auxiliaries/initial", t.auxiliaries.initial[k : k + 1], len(words))
    # crossings of their corners
    for name in ("time", "watch", "upward", "velocity"):
        column = getattr(log, name)
        yield from _of_shape(f"auxiliaries/{name}", column, (log.time.size,), may_be_unknown=name == "velocity")
    yield from _of_times("auxiliaries/time", log.time, t)
    yield from _of_indices("auxiliaries/watch", log.watch, t.layout.clearance.size + count)
    yield from _of_indices("auxiliaries/upward", log.upward, 2)
    # crossings of clearances, as in the log of events
    for k, name in enumerate(t.layout.clearance_names):
        crossed = t.events.clearance == k
        upward = (t.events.to_region > t.events.from_region)[crossed]
        if not np.array_equal(log.upward[log.watch == k], upward):
            yield "auxiliaries/watch", f"other crossings of {name}", "must be those of events, in their order"
    # stretch of the sliders' springs at every crossing
    if log.memory.ndim != 2 or len(log.memory) != log.time.size or not np.isfinite(log.memory).all():
        yield "auxiliaries/stretched", f"{log.memory.shape}", "must be finite numbers, one row a crossing"


def _of_records(t: Trajectory) -> Iterator[_Fault]:
    """Yield faults of the cost, the notes and the energy."""
    for name, value in vars(t.cost).items():
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        fits = isinstance(value, str) if name == "algorithm" else is_number or (value is None and name in _MAY_MISS)
        if not fits:
            yield f"cost: {name}", repr(value)[:60], "must be a name" if name == "algorithm" else "must be a number"
    if not all(isinstance(note, str) for note in t.notes):
        yield "notes", repr(t.notes)[:60], "must be texts"
    if t.energy is not None:
        sizes = {"torque_work": 0, "drag_loss": 0, "error_work": 1, "element_loss": 1, "friction_loss": 1}
        free = len(t.layout.inertia_names) - len(t.layout.prescribed) + len(t.layout.direction_names)
        lengths = (free, len(t.layout.element_names))
        for name, kind in sizes.items():
            array = getattr(t.energy, name)
            if name != "friction_loss" or array.size:
                yield from _of_shape(f"energy: {name}", array, (lengths[kind],))
        yield from _of_shape("energy: stored", np.asarray(t.energy.stored), (2,))


def _of_shape(
    name: str, array: Array | IntArray, shape: tuple[int, ...], *, may_be_unknown: bool = False
) -> Iterator[_Fault]:
    """Yield a wrong shape, a value that is not a number, and a value that is not finite."""
    if array.dtype.kind not in "fiu":
        yield name, f"of type {array.dtype}", "must be numbers"
    if array.shape != shape:
        yield (
            name,
            f"{' x '.join(map(str, array.shape)) or 'one number'}",
            f"must be {' x '.join(map(str, shape))}, by the other arrays",
        )
    wrong = np.abs(array) > _LARGEST if may_be_unknown else ~(np.abs(array) <= _LARGEST)
    if wrong.any():
        yield name, f"{array[wrong][0]}", "must be finite numbers, below 1e100"


def _of_labels(layout: Layout, clearance: int, name: str, labels: IntArray) -> Iterator[_Fault]:
    """Yield a label that no region of a clearance has."""
    first = int(layout.region_of_first_piece[clearance])
    last = first + layout.corners[clearance].size
    wrong = (labels < first) | (labels > last)
    if wrong.any():
        yield name, f"{labels[wrong][0]}", f"regions of {layout.clearance_names[clearance]} are {first} to {last}"


def _of_indices(name: str, indices: IntArray, count: int) -> Iterator[_Fault]:
    """Yield an index that is out of range."""
    wrong = (indices < 0) | (indices >= count)
    if wrong.any():
        yield name, f"{indices[wrong][0]}", f"must be less than {count}, and not below 0"


def _of_times(name: str, time: Array, t: Trajectory) -> Iterator[_Fault]:
    """Yield a time of a crossing that is outside the samples, or earlier than the crossing before it."""
    slack = _SAME_TIME * t.layout.period
    wrong = (time < t.time[0] - slack) | (time > t.end + slack)
    wrong[1:] |= time[1:] < time[:-1] - slack
    if wrong.any():
        at = int(np.argmax(wrong))
        rule = f"must ascend between {t.time[0]:.9g} and {t.end:.9g} s"
        yield name, f"{time[at]:.9g} s at crossing {at}", rule
