"""The kernels that are compiled ahead, each with arguments of the types with which a run calls it."""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature
from multiprocessing.connection import Connection
from typing import Any, NamedTuple, get_args, get_type_hints

import numpy as np

from gearrattle.engine.kernels import (
    extremes,
    flow_gradient,
    march,
    quadrature,
    region_stages,
    rigid_response,
    sample_notes,
    sampling,
    state_scaling,
    tallies,
    variant_common,
)
from gearrattle.engine.kernels._ahead import PLAN, task_of
from gearrattle.engine.kernels._jit import compact, prepared, vectorised
from gearrattle.engine.kernels.arrays import Array3, Array4, BoolMatrix, IntMatrix, IntVector, Matrix, Vector
from gearrattle.engine.kernels.march_arrays import Inputs, Log, March, Notes, Regions, Samples
from gearrattle.engine.kernels.variant_arrays import Coefficients, Crossings, Frame, Judged, Scales, Statics, Tallies


class Planned(NamedTuple):
    """A kernel to be compiled ahead."""

    prepare: Callable[..., None]  # compiles the kernel
    function: Callable[..., Any]  # the Python function
    arguments: tuple[Any, ...]  # samples of the arguments' types


def compile_ahead(connection: Connection) -> None:
    """Compile the kernels of the plan that the process at the other end of the pipe has not reserved."""
    plan = planned()
    for name in PLAN:
        prepare, function, arguments = plan[name]
        connection.send(task_of(function, arguments))
        if connection.recv():
            prepare(*arguments)


def planned() -> dict[str, Planned]:
    """Every kernel of ``_ahead.PLAN`` by its name."""
    # samples of the arguments' types
    addresses = region_stages.Stages(*(0 for _ in region_stages.Stages._fields))
    words = IntVector
    parts = (extremes.Parts, extremes.Rows)
    three = (Vector, Vector, Vector)
    # for every kernel: its compiler, its function, the types of its arguments
    entries: list[tuple[Any, Any, tuple[Any, ...]]] = [
        (vectorised, march.march_on, (Regions, Inputs, None, March, Samples, Notes, Log, int)),
        (vectorised, sample_notes.store_noted_samples, (Regions, Inputs, Notes, Samples, IntVector)),
        (
            vectorised,
            quadrature.integrate_moments,
            (quadrature.Moves, IntMatrix, Vector, Matrix, quadrature.Room, Vector),
        ),
        (
            vectorised,
            sampling.quantities_at,
            (sampling.Lines, Matrix, IntMatrix, Matrix, int, sampling.Quantities, int),
        ),
        (
            vectorised,
            flow_gradient.gradient_segments,
            (Array4, Array3, Vector, IntVector, int, IntMatrix, Vector, Matrix, BoolMatrix, Matrix, Array3),
        ),
        (_plainly, tallies.add_crossings, (Judged, Crossings, Vector, IntVector, Vector, bool, int, Tallies)),
        (_plainly, extremes.extremes, (*parts, int, int, Matrix, Vector, Vector)),
        (_plainly, extremes.moments, (*parts, int, int, IntVector, Vector, Matrix, Matrix, Matrix)),
        (_plainly, extremes.reaches, (*parts, int, int, int, Matrix, Vector, Vector)),
        (_plainly, extremes.time_above, (*parts, IntVector, int, float, Matrix)),
        (compact, state_scaling.scale, (Coefficients, Frame, Scales)),
        (compact, rigid_response.respond_rigidly, (Coefficients, Frame, Statics, *three)),
        (compact, variant_common.lay_out, (words, Coefficients, Frame, Scales)),
        (compact, region_stages.limit_states, (addresses, words)),
        (compact, region_stages.build_region, (addresses, int, words)),
        (compact, region_stages.pack, (addresses, words, Regions, int, int)),
        *((compact, stage, _arguments_of(stage)) for stage in region_stages.Stages()),
    ]
    # by the names in the plan
    known = {}
    for compiled_with, entry, kinds in entries:
        function = getattr(entry, "py_func", entry)
        arguments = tuple(map(_sample, kinds))
        known[task_of(function, arguments)[0]] = Planned(prepared(compiled_with(entry)), function, arguments)
    return known


def _plainly(entry: Any) -> Any:
    """The entry itself: compiled with numba's default settings."""
    return entry


def _arguments_of(stage: Any) -> tuple[Any, ...]:
    """The types of a stage's arguments, by the names of its parameters (see ``region_stages.stages``)."""
    kinds: dict[str, Any] = {"workspace": IntVector, "rows": Matrix, "h": float}
    kinds |= dict.fromkeys(("stack", "tables", "powers", "series"), Array4)
    return tuple(kinds.get(name, int) for name in signature(stage).parameters)


def _sample(kind: Any) -> Any:
    """A sample of a type: an array with one entry, a number, a NamedTuple of these; other objects are returned."""
    if get_args(kind):
        shape, entry = get_args(kind)
        return np.zeros((1,) * len(get_args(shape)), get_args(entry)[0])
    if isinstance(kind, type):
        hints = get_type_hints(kind) if issubclass(kind, tuple) else {}
        return kind(*map(_sample, hints.values()))
    return kind
