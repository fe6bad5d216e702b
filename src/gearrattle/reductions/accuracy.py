"""Error of a reduced system against the full one inside the band, computed and not estimated.

Frequencies
    |omega_red - omega| / omega of every elastic mode of the full system up to the end of the band, paired by rank (by
    Courant and Fischer omega_red >= omega); the largest over all ``contact_states``. From the worst states a search
    over single contact ratios follows, because a mode may pass the end of the band between two of these states.
Shapes
    the modal assurance criterion with the mass as weight, (phi^T M T psi)^2, both modes of unit modal mass, psi the
    best partner among the reduced modes; all clearances in contact (Allemang and Brown 1982, with M for the identity).
Responses
    accelerance from every driven inertia to every inertia watched, on a grid and at the resonances of both systems,
    then on finer grids around the largest errors; all clearances in contact, the model's own damping. Levels count only
    where the response is above 1 % of its peak, not in an antiresonance. Near a sharp resonance a small shift of
    frequency is a large error of the response, so the errors of both are given.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.linear.matrices import LinearSystem, frequencies_of, linearised
from gearrattle.analysis.linear.response import accelerance
from gearrattle.reductions.reduction_request import Request
from gearrattle.reductions.states import State, contact_states, most_states, neighbours

Array = NDArray[np.float64]

_GRID = 200  # frequencies of a response on a logarithmic grid; twice as many on a linear one
_DECADES = 3.0  # decades of the logarithmic grid, up to the end of the band
_ROUNDS = 5  # grids, each finer around the largest errors of the one before
_BETWEEN = 9  # frequencies between two neighbours of the grid before
_AUDIBLE = 0.01  # share of a response's peak: a lower level does not count
_SILENT = 1e-12  # share of the largest response: a smaller response is rounding
_TOGETHER = 32  # contact states whose frequencies are computed at once
_STARTS = 3  # contact states from which the search for the worst one begins
_MOST_STATES = 3000  # number of contact states, as ``most_states``, from which on no search begins
_SEARCH = (False, False, False, True, True, True)  # whether a round of the search takes fine steps


@dataclass(frozen=True)
class Accuracy:
    """Errors inside the band.

    Attributes
    ----------
    frequencies, reduced_frequencies
        elastic modes of the full system in the band, all in contact, and their
        partners [rad/s]; inf where the reduced system has no mode left.
    frequency_error
        the largest relative error of a frequency in the band, over all contact states.
    worst
        frequency of the full system with the largest error [rad/s]; NaN if no elastic mode lies in the band.
    worst_state
        contact state with the largest error: (element, factor on its last slope); empty: all in contact.
    states
        number of contact states compared.
    mac
        modal assurance criterion of every elastic mode in the band, all in contact.
    response_error_db
        largest difference of levels where a response is above 1 % of its peak [dB]; NaN if no inertia is driven.
    response_error_peak
        largest error of a response over its peak in the band; NaN if no inertia is driven.
    """

    frequencies: Array
    reduced_frequencies: Array
    frequency_error: float
    worst: float
    worst_state: tuple[tuple[int, float], ...]
    states: int
    mac: Array
    response_error_db: float
    response_error_peak: float


def accuracy(request: Request, basis: Array, watched: tuple[int, ...], worst: Worst | None = None) -> Accuracy:
    """Return the errors of a system reduced by a basis T (n, r); responses are those of the ``watched`` inertias."""
    worst = frequency_error(request, basis) if worst is None else worst
    closed = contact_states(request.system, request.clearances)[0]
    ((full, partners),) = paired(request, basis, [closed])
    linear = linearised(request.system, closed.stiffness, closed.damping)
    reduced = linear.within(basis)
    decibels, peak = _response_errors(request, linear, reduced, basis, watched)
    mac = _assurance(linear, reduced, basis, full.size)
    return Accuracy(full, partners, *worst, mac, decibels, peak)


class Worst(NamedTuple):
    """The largest relative error of a frequency in the band."""

    error: float
    frequency: float  # of the full system [rad/s]
    words: tuple[tuple[int, float], ...]  # contact state: (element, factor on its last slope)
    states: int  # number of contact states compared


def error_within(request: Request, basis: Array, limit: float) -> Worst | None:
    """Return the largest error of a frequency in the band; None at the first contact state that exceeds ``limit``."""
    states = contact_states(request.system, request.clearances, request.up_to)
    for begin in range(0, len(states), _TOGETHER):
        if any(worst.error > limit for worst in _worst_in(request, basis, states[begin : begin + _TOGETHER])):
            return None
    worst = frequency_error(request, basis)
    return None if worst.error > limit else worst


def frequency_error(request: Request, basis: Array) -> Worst:
    """Find the largest relative error of a frequency in the band over all contact states."""
    states = contact_states(request.system, request.clearances, request.up_to)
    first = _worst_in(request, basis, states)
    most = min(_MOST_STATES, most_states(request.system))
    order = sorted(range(len(states)), key=lambda i: (first[i].error, not np.isnan(first[i].frequency)), reverse=True)
    worst = first[order[0]]
    tried = len(states)
    if worst.error in (0.0, np.inf):
        return worst._replace(states=tried)
    for begin in order[:_STARTS]:
        best = first[begin]
        here = states[begin]
        for fine in _SEARCH if tried < most else ():
            near = neighbours(request.system, request.clearances, here, fine)
            tried += len(near)
            for state, there in zip(near, _worst_in(request, basis, near), strict=True):
                if there.error > best.error:
                    best = there
                    here = state
        worst = max(worst, best, key=lambda candidate: candidate.error)
    return worst._replace(states=tried)


def _worst_in(request: Request, basis: Array, states: Sequence[State]) -> list[Worst]:
    """The largest error of a frequency in every state."""
    worst = []
    for state, (full, partners) in zip(states, paired(request, basis, states), strict=True):
        errors = np.abs(partners - full) / full
        k = int(np.argmax(errors)) if full.size else -1
        worst.append(Worst(float(errors[k]), float(full[k]), state.words, 1) if k >= 0 else _none_in(state))
    return worst


def _none_in(state: State) -> Worst:
    """The result if no elastic mode lies in the band."""
    return Worst(0.0, np.nan, state.words, 1)


def paired(request: Request, basis: Array, states: Sequence[State]) -> Iterator[tuple[Array, Array]]:
    """Yield for every state the elastic frequencies in the band: full system, and same rank of the reduced one."""
    slopes = np.array([state.stiffness for state in states]).reshape(len(states), len(request.system.laws))
    full = frequencies_of(request.system, slopes, np.eye(request.system.size))
    for omega, reduced in zip(full, frequencies_of(request.system, slopes, basis), strict=True):
        rigid = int(np.count_nonzero(omega == 0.0))
        inside = omega[rigid:][omega[rigid:] <= request.up_to]
        partners = np.full(inside.size, np.inf)
        matched = reduced[rigid : rigid + inside.size]
        partners[: matched.size] = matched
        yield inside, partners


def _assurance(linear: LinearSystem, reduced: LinearSystem, basis: Array, count: int) -> Array:
    omega, shapes = linear.natural()
    rigid = int(np.count_nonzero(omega == 0.0))
    expanded = basis @ reduced.natural()[1]
    return np.asarray(np.max((shapes[:, rigid : rigid + count].T @ linear.mass @ expanded) ** 2, axis=1))


def _response_errors(
    request: Request, linear: LinearSystem, reduced: LinearSystem, basis: Array, watched: tuple[int, ...]
) -> tuple[float, float]:
    """Largest error of a level [dB], and of an amplitude over the peak."""
    if not request.driven:
        return np.nan, np.nan
    end = request.up_to
    watch = np.eye(request.system.size)[list(watched)]
    grids = [np.logspace(-_DECADES, 0.0, _GRID) * end, np.linspace(0.0, end, 2 * _GRID + 1)[1:]]
    peaks = np.concatenate([linear.frequencies(), reduced.frequencies()])
    start = np.unique(np.concatenate([*grids, peaks[(peaks >= grids[0][0]) & (peaks <= end)]]))
    worst = []
    for driven in request.driven:
        drive = np.eye(request.system.size)[driven]

        def errors(omega: Array, drive: Array = drive) -> tuple[Array, Array, Array]:
            """Errors of level, of amplitude, and amplitudes, (F, p) each."""
            with np.errstate(all="ignore"):
                exact = accelerance(linear, omega, drive, watch)
                response = accelerance(reduced, omega, basis.T @ drive, watch @ basis)
                levels = 20.0 * np.abs(np.log10(np.abs(response) / np.abs(exact)))
            return levels, np.abs(response - exact), np.abs(exact)

        worst.append(_refined(errors, start))
    return max(level for level, _ in worst), max(share for _, share in worst)


def _refined(errors: Callable[[Array], tuple[Array, Array, Array]], omega: Array) -> tuple[float, float]:
    """Largest error of a level, and of an amplitude over the peak, on grids ever finer around both maxima."""
    level = 0.0
    share = 0.0
    tops = np.zeros(1)
    for _ in range(_ROUNDS):
        levels, differences, amplitudes = errors(omega)
        tops = np.maximum(tops, amplitudes.max(axis=0))
        reached = tops > _SILENT * tops.max()
        levels = np.where(reached & np.isfinite(levels) & (amplitudes >= _AUDIBLE * tops), levels, 0.0)
        shares = np.where(reached, differences / np.where(reached, tops, 1.0), 0.0)
        level = max(level, float(levels.max()))
        share = max(share, float(shares.max()))
        at = np.unique([np.argmax(curve, axis=0) for curve in (levels, shares)])
        sides = [(omega[max(i - 1, 0)], omega[min(i + 1, omega.size - 1)]) for i in at]
        omega = np.unique(np.concatenate([np.linspace(*side, _BETWEEN) for side in sides]))
    return level, share
