"""``fit_drags``: the values of drag parts with which their laws meet measured drag torques best.

    r = (sum of f_i T_i(speed, temperature) - torque) / sigma,        f_i: ``factor`` of part i, T_i: its law

Mostly the factors are free: how far each law is from the truth. Any other value of a part may be.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.measured.identification.data_file import Data
from gearrattle.measured.identification.data_problem import DataProblem, Residual
from gearrattle.measured.identification.drag_data import DRAG_ERROR, MeasuredDrags, read_drags
from gearrattle.measured.identification.estimates import SearchResult, Settings, estimates
from gearrattle.measured.identification.fit_result import Fit
from gearrattle.measured.identification.free_parameters import Parameters, free_parameters
from gearrattle.measured.identification.identifiability import Combination
from gearrattle.measured.identification.multi_start import search
from gearrattle.measured.identification.multi_start import starts as starts_of
from gearrattle.model import Model

Array = NDArray[np.float64]

_STEP = 1e-5  # of a logarithm, for derivatives by values that are no factors
_FACTOR = ".factor"


def fit_drags(model: Model, data: Data, free: Sequence[str], settings: Settings) -> Fit:
    """Find the values of drag parts with which they meet measured torques best; arguments as of ``fit``.

    ModelError as of ``fit``, for a free value that no measured torque depends on, and for measured points that a part
    does not cover.
    """
    measured = read_drags(data, model)
    # factors that the file leaves out are 1, and may be free
    bodies = {drags.body for drags in measured}
    factors = {
        f"inertia.{inertia.name}.drag_parts.{index}{_FACTOR}": part.factor
        for inertia in model.inertias
        if inertia.name in bodies
        for index, part in enumerate(inertia.drag_parts)
    }
    written = model.with_(factors)
    parameters = free_parameters(written, free, settings.bounds, settings.factor)
    problem = DragProblem(written, measured, parameters, settings.prior)
    # refuse what no torque depends on
    idle = ~np.any(problem.data_residuals(np.zeros(len(parameters.paths)))[1] != 0.0, axis=0)
    if idle.any():
        rule = "no measured drag torque depends on it"
        unused = [path for path, is_idle in zip(parameters.paths, idle.tolist(), strict=True) if is_idle]
        raise ModelError(Problem(f"free: {path}", "", rule, "leave it out of free") for path in unused)
    # least squares from many starts
    points = starts_of(problem.residuals, parameters.box, settings.starts, settings.seed)
    minima, failed = search(problem.residuals, points, parameters.box, progress=settings.progress)
    searched = SearchResult(minima, settings.starts, failed)
    return estimates(written, problem, parameters, searched, settings, notes=())


@dataclass(frozen=True)
class DragProblem(DataProblem):
    """Measured drag torques, and the model whose parts shall meet them."""

    model: Model
    measured: tuple[MeasuredDrags, ...]
    parameters: Parameters
    prior: float | None = None
    _kept: dict[bytes, list[Array]] = field(default_factory=dict, repr=False)

    @property
    def scales(self) -> int:
        """None: drag torques are absolute."""
        return 0

    @property
    def assumed(self) -> tuple[str, ...]:
        """Bodies whose torques have no standard error of their own, in words."""
        return tuple(f"{m.body}: {100 * DRAG_ERROR:g} % of each drag torque" for m in self.measured if m.assumed)

    def data_residuals(self, x: Array) -> tuple[Array, Array]:
        """(N,) residuals of the data and (N, P) Jacobian."""
        fitted, gradient = self._torques(x)
        error = np.concatenate([m.error for m in self.measured])
        torque = np.concatenate([m.torque for m in self.measured])
        return (fitted - torque) / error, gradient / error[:, None]

    def residuals_of(self, x: Array) -> tuple[Residual, ...]:
        """Every torque with its fitted value."""
        fitted = self._torques(x)[0]
        rows = self.data_residuals(x)[0]
        unit = "N m" if self.model.units == "SI" else ""
        data = [
            (label, torque, error)
            for m in self.measured
            for label, torque, error in zip(
                self._labels(m),
                m.torque.tolist(),
                m.error.tolist(),
                strict=True,
            )
        ]
        return tuple(
            Residual(label, unit, torque, value, error, row)
            for (label, torque, error), value, row in zip(data, fitted.tolist(), rows.tolist(), strict=True)
        )

    def remarks(self, x: Array, _open: Sequence[Combination], /) -> list[str]:
        """Say how far the laws are from the measurement, before and after."""
        ends = np.cumsum([m.torque.size for m in self.measured])[:-1]
        before, after = (np.split(self._torques(point)[0], ends) for point in (np.zeros(x.size), x))
        return [
            f"{m.body}: what was measured is {_range(m.torque, start)} times what the model said, and "
            f"{_range(m.torque, end)} times what it says with the fitted values."
            for m, start, end in zip(self.measured, before, after, strict=True)
        ]

    def _labels(self, measured: MeasuredDrags) -> Iterator[str]:
        """Yield what every torque is of."""
        turning = 30.0 / np.pi if self.model.units == "SI" else 1.0
        unit = " rpm" if self.model.units == "SI" else ""
        for index, speed in enumerate((measured.speed * turning).tolist()):
            at = "" if measured.temperature is None else f", {measured.temperature[index]:.4g} °C"
            yield f"drag of {measured.body} at {speed:.4g}{unit}{at}"

    def _torques(self, x: Array) -> tuple[Array, Array]:
        """(N,) drag torques at logarithms x, and (N, P) their derivatives."""
        paths = self.parameters.paths
        columns = np.zeros((sum(m.torque.size for m in self.measured), len(paths)))
        fitted = self._fitted(x)
        values = dict(zip(paths, self.parameters.values(x).tolist(), strict=True))
        laws = self._laws(x)
        for p, path in enumerate(paths):
            if path.endswith(_FACTOR):
                shares = [
                    values[path] * laws[k][:, i] if path == part + _FACTOR else np.zeros(m.torque.size)
                    for k, m in enumerate(self.measured)
                    for i, part in enumerate(m.paths)
                ]
                columns[:, p] = self._by_datum(shares)
            else:
                step = _STEP * np.eye(x.size)[p]
                columns[:, p] = (self._fitted(x + step) - self._fitted(x - step)) / (2.0 * _STEP)
        return fitted, columns

    def _by_datum(self, shares: Sequence[Array]) -> Array:
        """(N,) sums over the parts of every body."""
        sums = []
        at = 0
        for m in self.measured:
            sums.append(np.sum(shares[at : at + len(m.paths)], axis=0))
            at += len(m.paths)
        return np.concatenate(sums)

    def _fitted(self, x: Array) -> Array:
        """(N,) drag torques at logarithms x."""
        values = dict(zip(self.parameters.paths, (self.parameters.start * np.exp(x)).tolist(), strict=True))
        sums = []
        for m, own, laws in zip(self.measured, self._own_factors, self._laws(x), strict=True):
            factors = [values.get(path + _FACTOR, factor) for path, factor in zip(m.paths, own, strict=True)]
            sums.append(laws @ np.array(factors))
        return np.concatenate(sums)

    @cached_property
    def _own_factors(self) -> list[list[float]]:
        """Factors of the parts in the model, by body."""
        return [[part.factor for part in m.parts(self.model)] for m in self.measured]

    def _laws(self, x: Array) -> list[Array]:
        """(N, parts) torques of the laws themselves, of every body; kept, for factors change them not."""
        shapes = np.array([not path.endswith(_FACTOR) for path in self.parameters.paths])
        key = x[shapes].tobytes()
        if key not in self._kept:
            changed = dict(zip(self.parameters.paths, (self.parameters.start * np.exp(x)).tolist(), strict=True))
            model = self.model.with_({path: value for path, value in changed.items() if not path.endswith(_FACTOR)})
            self._kept[key] = [_law_torques(model, m) for m in self.measured]
        return self._kept[key]


def _law_torques(model: Model, measured: MeasuredDrags) -> Array:
    """(N, parts) torques of the laws at the measured points."""
    temperatures = [None] * measured.speed.size if measured.temperature is None else measured.temperature.tolist()
    torques = np.empty((measured.speed.size, len(measured.paths)))
    problems = []
    for i, (path, part) in enumerate(zip(measured.paths, measured.parts(model), strict=True)):
        at_reference = part.at_reference(model.excitation.omega)
        for row, (speed, temperature) in enumerate(zip(measured.speed.tolist(), temperatures, strict=True)):
            oil = model.oil
            if oil is not None and temperature is not None:
                oil = oil.model_copy(update={"temperature": temperature})
            try:
                torques[row, i] = at_reference.law(speed, oil).torque
            except ModelError as error:
                problems += [replace(problem, place=f"{path}.{problem.place}") for problem in error.problems]
    if problems:
        raise ModelError(dict.fromkeys(problems))
    return torques


def _range(measured: Array, law: Array) -> str:
    """Return the smallest and the largest ratio in words."""
    ratios = measured / np.where(law > 0.0, law, np.nan)
    low = np.nanmin(ratios)
    high = np.nanmax(ratios)
    return f"{low:.3g}" if f"{low:.3g}" == f"{high:.3g}" else f"{low:.3g} to {high:.3g}"
