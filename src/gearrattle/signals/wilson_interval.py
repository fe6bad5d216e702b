"""The share of independent trials in which something happens, with an interval.

The interval is E. B. Wilson's (Probable inference, the law of succession, and statistical inference, Journal of the
American Statistical Association 22, 1927, pp. 209-212): all p whose own scatter, sqrt(p (1 - p) / n), explains the
share k/n that was seen,

    (k + z^2/2  -+  z sqrt(k (n - k) / n + z^2/4)) / (n + z^2)

It never leaves 0 to 1, and says something at k = 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def wilson(count: ArrayLike, among: ArrayLike, level: float = 0.95) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return Wilson's interval of a probability.

    Parameters
    ----------
    count
        (...,) number of trials in which it happened.
    among
        (...,) number of trials; the limits are NaN where it is 0.
    level
        of confidence, between 0 and 1.

    Returns
    -------
    tuple[NDArray[np.float64], NDArray[np.float64]]
        Its lower and its upper limit, (...,) each.
    """
    from scipy.special import ndtri

    z2 = float(ndtri(0.5 + 0.5 * level)) ** 2
    k = np.asarray(count, dtype=np.float64)
    n = np.asarray(among, dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        half = np.sqrt(z2 * (k * (n - k) / n + 0.25 * z2))
        low = (k + 0.5 * z2 - half) / (n + z2)
        high = (k + 0.5 * z2 + half) / (n + z2)
    low = np.where(k == 0.0, 0.0, low)
    high = np.where(k == n, 1.0, high)
    return np.where(n > 0.0, low, np.nan), np.where(n > 0.0, high, np.nan)
