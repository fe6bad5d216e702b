"""The least-squares problem: residuals in standard errors, and their exact Jacobian.

    frequency   r = (omega_model - omega) / sigma
    shape       r = -P (y / sigma),  P = 1 - u u^T / u^T u,  u = phi / sigma: what no multiple of phi explains
    response    r = (Re H_model - Re H) / sigma,  (Im H_model - Im H) / sigma

The scale of a shape is eliminated (variable projection: Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413), so it
costs one degree of freedom and the covariance of the parameters knows it. Modes without a number are those whose
modal assurance criterion with the measured shape is largest, each taken once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.measured.identification.data_problem import DataProblem, Residual
from gearrattle.measured.identification.free_parameters import Coefficients
from gearrattle.measured.identification.identifiability import Combination
from gearrattle.measured.identification.measured_modes import MeasuredMode, MeasuredResponse, Measurements, State
from gearrattle.measured.identification.modal_sensitivity import Spectrum
from gearrattle.wording import counted

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FitProblem(DataProblem):
    """Data, and the states in which they were measured.

    ``prior`` is the standard deviation of every ln(parameter / start); None: no prior.
    """

    data: Measurements
    names: tuple[str, ...]
    states: dict[State, Coefficients]
    count: int
    prior: float | None = None
    units: bool = True

    def data_residuals(self, x: Array) -> tuple[Array, Array]:
        """(N,) residuals of the data and (N, P) Jacobian."""
        blocks = [block for block, _ in self._evaluated(x)]
        return np.concatenate([block[0] for block in blocks]), np.vstack([block[1] for block in blocks])

    def residuals_of(self, x: Array) -> tuple[Residual, ...]:
        """Every datum with its fitted value."""
        return tuple(record for _, residuals in self._evaluated(x) for record in residuals())

    @cached_property
    def scales(self) -> int:
        """Number of shapes: each has a scale of its own."""
        return sum(1 for mode in self.data.modes if mode.inertias)

    @property
    def assumed(self) -> tuple[str, ...]:
        """Data without a standard error of their own, in words."""
        return self.data.assumed

    def remarks(self, _x: Array, open_ones: Sequence[Combination], /) -> list[str]:
        """Notes on these data alone."""
        if self.data.responses or not any(_is_scale(c) for c in open_ones):
            return []
        return [
            "frequencies and shapes fix no absolute inertia or stiffness: leave one known inertia out of free, or add "
            "a frequency response, whose unit holds a torque. What is open keeps the start's value."
        ]

    def _evaluated(self, x: Array) -> Iterator[tuple[tuple[Array, Array], Callable[[], list[Residual]]]]:
        """Yield residuals and Jacobian of one datum after another, and the entries of its records."""
        spectra = {state: Spectrum(c, x) for state, c in self.states.items()}
        for mode, index in zip(self.data.modes, self._matched(spectra), strict=True):
            if mode.omega is not None:
                yield self._frequency(mode, mode.omega, spectra[mode.state], index)
            if mode.inertias:
                yield self._shape(mode, spectra[mode.state], index)
        for response in self.data.responses:
            yield self._response(response, spectra[response.state])

    def _matched(self, spectra: dict[State, Spectrum]) -> list[int]:
        """Return the index of the model's mode for each measured one."""
        indices = [-1 if mode.number is None else mode.number - 1 for mode in self.data.modes]
        for state, spectrum in spectra.items():
            unknown = [k for k, mode in enumerate(self.data.modes) if indices[k] < 0 and mode.state == state]
            if not unknown:
                continue
            from scipy.optimize import linear_sum_assignment

            taken = {indices[k] for k, mode in enumerate(self.data.modes) if mode.state == state and mode.number}
            elastic = [j for j in range(spectrum.omega.size) if spectrum.omega[j] > 0.0 and j not in taken]
            assurance = np.array([self._assurance(self.data.modes[k], spectrum)[elastic] for k in unknown])
            for row, column in zip(*linear_sum_assignment(-assurance), strict=True):
                indices[unknown[row]] = elastic[column]
        return indices

    def _at(self, mode: MeasuredMode) -> list[int]:
        return [self.names.index(name) for name in mode.inertias]

    def _assurance(self, mode: MeasuredMode, spectrum: Spectrum) -> Array:
        """(r,) modal assurance criterion of a measured shape with every mode (Allemang and Brown 1982)."""
        shapes = spectrum.shapes[self._at(mode)]
        norm = (mode.shape @ mode.shape) * np.einsum("ij,ij->j", shapes, shapes)
        squares = (mode.shape @ shapes) ** 2
        return np.asarray(np.divide(squares, norm, out=np.zeros_like(norm), where=norm > 0.0))

    def _frequency(
        self, mode: MeasuredMode, measured: float, spectrum: Spectrum, index: int
    ) -> tuple[tuple[Array, Array], Callable[[], list[Residual]]]:
        error = mode.omega_error
        fitted = float(spectrum.omega[index])
        row = np.array([(fitted - measured) / error])
        unit = "rad/s" if self.units else ""
        label = f"{mode.label}: frequency"
        return (row, spectrum.omega_gradient(index)[None] / error), lambda: [
            Residual(label, unit, measured, fitted, error, float(row[0]))
        ]

    def _shape(
        self, mode: MeasuredMode, spectrum: Spectrum, index: int
    ) -> tuple[tuple[Array, Array], Callable[[], list[Residual]]]:
        at = self._at(mode)
        u = spectrum.shapes[at, index] / mode.shape_error
        du = spectrum.shape_gradient(index)[at] / mode.shape_error[:, None]
        y = mode.shape / mode.shape_error
        square = max(float(u @ u), np.finfo(float).tiny)
        scale = u @ y / square
        residual = scale * u - y
        across = du - np.outer(u, u @ du) / square
        jacobian = scale * across - np.outer(u, residual @ du) / square
        columns = (mode.inertias, mode.shape, scale * u * mode.shape_error, mode.shape_error, residual)
        return (residual, jacobian), lambda: [
            Residual(f"{mode.label}: {name}", "", float(y), float(f), float(e), float(r))
            for name, y, f, e, r in zip(*columns, strict=True)
        ]

    def _response(
        self, measured: MeasuredResponse, spectrum: Spectrum
    ) -> tuple[tuple[Array, Array], Callable[[], list[Residual]]]:
        at = self.names.index(measured.at)
        on = self.names.index(measured.torque_on)
        value, gradient = spectrum.response(at, on, measured.derivatives, measured.omega)
        away = (value - measured.value) / measured.error
        change = gradient / measured.error[:, None]
        unit = f"rad{('', '/s', '/s^2')[measured.derivatives]}/(N*m)" if self.units else ""

        def residuals() -> list[Residual]:
            return [
                Residual(f"{measured.label}: {part} at {w:.6g}", unit, float(y), float(f), float(e), float(r))
                for part in ("real", "imag")
                for w, y, f, e, r in zip(
                    measured.omega,
                    getattr(measured.value, part),
                    getattr(value, part),
                    measured.error,
                    getattr(away, part),
                    strict=True,
                )
            ]

        return (np.concatenate([away.real, away.imag]), np.vstack([change.real, change.imag])), residuals


def check_modes(problem: FitProblem) -> None:
    """Refuse modes that the model does not have in their state, or that are rigid motion there.

    The ModelError has all of them, and shapes without a number for which no elastic mode is left.
    """
    # modes with a number: the model has them, and they are elastic
    problems = []
    spectra = {state: Spectrum(c, np.zeros(problem.count)) for state, c in problem.states.items()}
    waiting = dict.fromkeys(spectra, 0)
    for mode in problem.data.modes:
        omega = spectra[mode.state].omega
        if mode.number is None:
            waiting[mode.state] += 1
        elif mode.number > omega.size:
            rule = f"the model has {counted(omega.size, 'mode')} in this state"
            problems.append(Problem(mode.label, str(mode.number), rule, "fewer elements may be rigid"))
        elif omega[mode.number - 1] == 0.0:
            rule = "is rigid motion, whatever the parameters: its frequency is zero and its shape kinematic"
            remedy = f"the first elastic mode has number {np.count_nonzero(omega == 0.0) + 1}"
            problems.append(Problem(mode.label, str(mode.number), rule, remedy))
    # shapes without a number: enough elastic modes are left for them
    for state, count in waiting.items():
        omega = spectra[state].omega
        taken = {m.number for m in problem.data.modes if m.state == state and m.number is not None}
        left = int(np.count_nonzero(omega)) - len(taken)
        if count > max(left, 0):
            rule = f"only {left} elastic modes of the model are left for them"
            problems.append(Problem("shapes without a number", str(count), rule))
    if problems:
        raise ModelError(problems)


def _is_scale(combination: Combination) -> bool:
    """Whether a combination is a common factor of several parameters."""
    powers = combination.exponents.values()
    return combination.structural and len(powers) > 1 and set(powers) == {1.0}
