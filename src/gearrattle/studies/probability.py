"""How likely a part rattles: the share of samples above quiet, with an interval.

The interval is E. B. Wilson's (Probable inference, the law of succession, and statistical inference, Journal of the
American Statistical Association 22, 1927, pp. 209-212): all p whose own scatter, sqrt(p (1 - p) / n), explains the
share k/n that was seen,

    (k + z^2/2  -+  z sqrt(k (n - k) / n + z^2/4)) / (n + z^2)

It never leaves 0 to 1, and says something at k = 0. It holds for independent samples; Latin hypercubes and Sobol's
sequence scatter less, so there it is wide rather than narrow.

Takes counts, or the Dataset of a study; gives shares with limits.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.studies.layout import chosen_codes, output_in
from gearrattle.studies.plan import SAMPLE

if TYPE_CHECKING:
    import xarray as xr


def wilson(count: ArrayLike, among: ArrayLike, level: float = 0.95) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return Wilson's interval of a probability.

    Args:
        count: (...,) how often it happened.
        among: (...,) of how many; NaN comes back where that is 0.
        level: of confidence, between 0 and 1.

    Returns:
        Its lower and its upper limit, (...,) each.
    """
    from scipy.stats import norm

    z2 = float(norm.ppf(0.5 + 0.5 * level)) ** 2
    k, n = np.asarray(count, dtype=np.float64), np.asarray(among, dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        half = np.sqrt(z2 * (k * (n - k) / n + 0.25 * z2))
        low, high = (k + 0.5 * z2 - half) / (n + z2), (k + 0.5 * z2 + half) / (n + z2)
    low, high = np.where(k == 0.0, 0.0, low), np.where(k == n, 1.0, high)
    return np.where(n > 0.0, low, np.nan), np.where(n > 0.0, high, np.nan)


def rattle_probability(data: xr.Dataset, output: str | None = None, *, level: float = 0.95) -> xr.Dataset:
    """Return how likely each part rattles over the samples of a study.

    Args:
        data: what ``study`` returned, with samples.
        output: of codes, 0 for quiet: "regime" or "verdict"; None for the first of these that was kept.
        level: of confidence of the interval.

    Returns:
        A Dataset over the study's axes and the output's subjects: ``probability``, ``low`` and ``high`` (Wilson 1927),
        ``rattling`` of ``samples``; cases that failed are counted nowhere.

    Raises:
        ModelError: no samples, no such output, a level outside 0 to 1.
    """
    import xarray as xr

    codes = output_in(data, output if output is not None else chosen_codes(data) or "regime", codes=True)
    if SAMPLE not in codes.dims:
        raise ModelError(Problem("data", "", "a probability needs samples", "let values scatter: vary, samples"))
    if not 0.0 < level < 1.0:
        raise ModelError(Problem("level", f"{level:g}", "must lie between 0 and 1", "for example 0.95"))
    among, count = (codes >= 0).sum(SAMPLE), (codes > 0).sum(SAMPLE)
    low, high = wilson(count.values, among.values, level)
    return xr.Dataset(
        {
            "probability": count / among.where(among > 0), "low": (count.dims, low), "high": (count.dims, high),
            "rattling": count, "samples": among,
        },
        attrs={"output": str(codes.name), "level": level},
    )  # fmt: skip
