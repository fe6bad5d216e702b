"""Plan of a study: a grid of cases, each the model with some values changed, in chunks of neighbours.

The cases form a grid: a dimension for every axis, the last one, "sample", for the points of distributions. A chunk is a
box of that grid whose cases follow each other in order; a worker computes it, and the store keeps it, as a whole. Cases
and chunks are identified by their number alone, so that any worker can compute any chunk, in any order, to the same
bits.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from math import prod
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gearrattle.model import Model
from gearrattle.model.path_values import Varied
from gearrattle.studies.study_axes import Axis, check_once

SAMPLE = "sample"


@dataclass(frozen=True)
class Samples:
    """Points of uncertain values.

    Attributes
    ----------
    paths
        (d,) of the values, as they were asked for.
    points
        (count, d) SI, or factors.
    spread
        by plain path (count,) what the model is given; None: the points.
    """

    paths: tuple[str, ...]
    points: NDArray[np.float64]
    method: str = ""
    by_factor: frozenset[str] = frozenset()
    spread: Mapping[str, NDArray[np.float64]] | None = None

    @classmethod
    def of(cls, varied: Sequence[Varied], points: NDArray[np.float64], method: str, model: Model) -> Samples:
        """Make points of the values that scatter; patterns and factors become values of the model.

        ModelError: a pattern that matches nothing, a factor of what is no number, a value that is varied twice.
        """
        paths = tuple(one.path for one in varied)
        by_factor = frozenset(one.path for one in varied if one.by_factor)
        own = [one.targets(model) for one in varied]
        check_once([path for targets in own for path in targets])
        spread = {
            path: column if times is None else times * column
            for targets, column in zip(own, points.T, strict=True)
            for path, times in targets.items()
        }
        is_plain = not by_factor and tuple(spread) == paths
        return cls(paths, points, method, by_factor, None if is_plain else spread)

    @property
    def values(self) -> Mapping[str, NDArray[np.float64]]:
        """By plain path (count,) what the model is given."""
        return dict(zip(self.paths, self.points.T, strict=True)) if self.spread is None else self.spread


@dataclass(frozen=True)
class Plan:
    """Plan of a study: its cases.

    Attributes
    ----------
    samples
        what scatters; None for nothing.
    chunk_size
        cases a chunk holds, about.
    kind
        of study, its name (a class attribute: another kind of plan is a class of its own).
    is_grid
        whether the values of its axes and samples define a case completely (a class attribute).
    """

    kind: ClassVar[str] = "grid"
    is_grid: ClassVar[bool] = True

    model: Model
    axes: tuple[Axis, ...]
    samples: Samples | None
    chunk_size: int

    @property
    def attributes(self) -> dict[str, Any]:
        """Further settings that decide what is computed: plain values, kept as attributes of the Dataset."""
        if self.samples is None:
            return {}
        return {"sampling": self.samples.method, "sampled": list(self.samples.paths)}

    @property
    def dimensions(self) -> tuple[str, ...]:
        """Names of the grid's dimensions."""
        return (*(axis.name for axis in self.axes), *([SAMPLE] if self.samples is not None else []))

    @property
    def shape(self) -> tuple[int, ...]:
        """Their lengths."""
        return (*(len(axis) for axis in self.axes), *([len(self.samples.points)] if self.samples is not None else []))

    @property
    def count(self) -> int:
        """Number of cases."""
        return prod(self.shape)

    @cached_property
    def chunk_shape(self) -> tuple[int, ...]:
        """The box a chunk is: whole trailing dimensions, what fits of the one before them, one of the others."""
        left = max(1, self.chunk_size)
        box = []
        for length in reversed(self.shape):
            taken = min(length, left)
            box.append(taken)
            left = left // length if taken == length else 1
        return tuple(reversed(box))

    @property
    def chunks_along(self) -> tuple[int, ...]:
        """Number of chunks along every dimension."""
        return tuple(-(-length // taken) for length, taken in zip(self.shape, self.chunk_shape, strict=True))

    @property
    def chunks(self) -> int:
        """Number of chunks."""
        return prod(self.chunks_along)

    def box(self, chunk: int) -> tuple[slice, ...]:
        """Return where a chunk lies in the grid."""
        at = np.unravel_index(chunk, self.chunks_along)
        return tuple(
            slice(int(i) * taken, min((int(i) + 1) * taken, length))
            for i, taken, length in zip(at, self.chunk_shape, self.shape, strict=True)
        )

    def cases_in(self, chunk: int) -> int:
        """Return how many cases a chunk has."""
        return prod(part.stop - part.start for part in self.box(chunk))

    def columns(self, chunk: int) -> dict[str, NDArray[Any]]:
        """Return by path the value of every case of a chunk, (cases,) in the chunk's order; objects if no numbers."""
        grid = np.indices([part.stop - part.start for part in self.box(chunk)]).reshape(len(self.shape), -1)
        grid += np.array([part.start for part in self.box(chunk)])[:, None]
        columns: dict[str, NDArray[Any]] = {}
        for axis, at in zip(self.axes, grid, strict=False):
            for path, values in axis.values.items():
                chosen = [values[i] for i in at.tolist()]
                is_plain = all(type(value) is float for value in chosen)
                columns[path] = np.array(chosen) if is_plain else _objects(chosen)
        if self.samples is not None:
            columns |= {path: column[grid[-1]] for path, column in self.samples.values.items()}
        return columns

    def cases(self, chunk: int) -> Iterator[tuple[tuple[int, ...], dict[str, Any]]]:
        """Yield every case of a chunk: its place in the chunk's box, and its changes."""
        box = self.box(chunk)
        for inside in np.ndindex(*(part.stop - part.start for part in box)):
            yield inside, self.changes(tuple(i + part.start for i, part in zip(inside, box, strict=True)))

    def changes(self, at: tuple[int, ...]) -> dict[str, Any]:
        """Return what the case at one place of the grid changes, by path."""
        changes: dict[str, Any] = {}
        for axis, i in zip(self.axes, at, strict=False):
            changes |= axis.at(i)
        if self.samples is not None:
            changes |= {path: float(column[at[-1]]) for path, column in self.samples.values.items()}
        return changes

    @cached_property
    def fingerprint(self) -> str:
        """A digest of everything that decides what is computed."""
        digest = sha256(self.model.to_stored()[0].encode())
        digest.update(json.dumps([[axis.name, dict(axis.values)] for axis in self.axes], sort_keys=True).encode())
        if self.samples is not None:
            digest.update(json.dumps(self.samples.paths).encode() + self.samples.points.tobytes())
        asked: list[Any] = [[axis.asked, sorted(axis.by_factor)] for axis in self.axes if axis.asked is not None]
        asked += [sorted(self.samples.by_factor)] if self.samples is not None and self.samples.by_factor else []
        if asked:  # a pattern, or factors: coordinates of their own
            digest.update(json.dumps(asked, sort_keys=True).encode())
        if self.attributes:
            digest.update(json.dumps([self.kind, self.attributes], sort_keys=True).encode())
        return digest.hexdigest()


def _objects(values: list[Any]) -> NDArray[Any]:
    """An array of objects, whatever they are."""
    array = np.empty(len(values), dtype=object)
    array[:] = values
    return array
