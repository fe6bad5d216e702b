"""Choice of the lines of a recorded motion that are compared with a simulated one.

The choice must not depend on the noise in the lines. If lines were chosen by their measured amplitude, those that noise
has raised would be preferred, and the fit would be biased. During the search lines are chosen by the measured and the
simulated amplitude (``of_both``), because a start may be far from the data. The final fit uses the lines that are
strong in the fitted motion (``of_fitted``), and measured lines that this motion cannot explain; a true model leaves no
such lines.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.measured.validation import order_agreement

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Indices = NDArray[np.int64]

_BY_CHANCE = 1e-4
"""Probability that a line which the fitted motion explains is counted as unexplained."""


@dataclass(frozen=True)
class Chosen:
    """Lines and channels that are compared.

    Attributes
    ----------
    line
        (n,) index, from 0.
    channel
        (n,) index.
    by_rms
        (m,) indices of channels whose rms is compared as well.
    phases
        whether phases are compared; otherwise only amplitudes.
    delay
        delay between the clocks [s]; None: fitted.
    """

    line: Indices
    channel: Indices
    by_rms: Indices
    phases: bool
    delay: float | None


def of_both(measured: order_agreement.Lines, simulated: Complex, within: NDArray[np.bool_]) -> tuple[Indices, Indices]:
    """Return lines and channels that a validation of the simulated motion would report.

    Parameters
    ----------
    measured
        lines of the K of C channels.
    simulated
        (K, C).
    within
        (K,) which lines lie in the band.
    """
    errors = measured.draws.error(measured.along())
    return _strongest((np.abs(measured.mean), np.abs(simulated)), (errors, np.zeros_like(errors)), within)


def of_fitted(
    measured: order_agreement.Lines, fitted: Complex, known: Array, within: NDArray[np.bool_], *, phases: bool
) -> tuple[Indices, Indices]:
    """Return lines and channels that are strong in the fitted motion, and those measured that it cannot explain.

    Parameters
    ----------
    measured
        lines of the K of C channels.
    fitted
        (K, C), on the measured clock.
    known
        (K, C) standard errors besides the scatter of the cycles.
    within
        (K,) which lines lie in the band.
    phases
        whether phases are compared. Noise raises amplitudes: without phases only lines that stand out of it count.
    """
    from scipy.stats import f

    scatter = measured.draws.error_of_parts(measured.replicates)
    off = np.abs(measured.mean - fitted) if phases else np.abs(np.abs(measured.mean) - np.abs(fitted))
    reach = np.sqrt(2.0 * f.isf(_BY_CHANCE, 2, measured.draws.freedom))
    unexplained = off > reach * np.hypot(scatter, known)
    sizes = np.where(unexplained, np.abs(measured.mean), 0.0), np.abs(fitted)
    return _strongest(sizes, (scatter, np.zeros_like(scatter) if phases else scatter), within)


def _strongest(
    sizes: tuple[Array, Array], errors: tuple[Array, Array], within: NDArray[np.bool_]
) -> tuple[Indices, Indices]:
    """Return lines and channels with the strongest lines of either side, from (K, C) sizes and standard errors."""
    line: list[int] = []
    channel: list[int] = []
    first, second = (np.where(within[:, None], size, 0.0) for size in sizes)
    for c in range(first.shape[1]):
        picked, _ = order_agreement.strongest((first[:, c], second[:, c]), (errors[0][:, c], errors[1][:, c]))
        line += picked
        channel += [c] * len(picked)
    return np.array(line, dtype=np.int64), np.array(channel, dtype=np.int64)
