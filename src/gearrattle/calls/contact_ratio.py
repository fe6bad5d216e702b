"""``contact_ratio``: one slope for every clearance of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearrattle.contact_ratios import ROUTES
from gearrattle.errors import ModelError, Problem
from gearrattle.results import Run

if TYPE_CHECKING:
    import pandas as pd


def contact_ratio(run: Run, method: str = "mean-slope") -> pd.Series[float]:
    """Stiffness contact ratio of every clearance, over the steady part of a run (Padmanabhan et al. 1995, sec. 6).

    Args:
        run: a motion.
        method: "mean-slope": time average of df/d(delta), from event times; "spectral": equivalent gain from cross and
            auto densities (H1), with a 95 % interval; "describing": equivalent gain of the response, by least squares.

    Returns:
        The ratio by clearance, relative to the largest slope of its law. ``attrs``: quantity ("mean slope" or
        "equivalent gain": they agree for Gaussian motions only), low, high (of the interval), notes.

    Raises:
        ModelError: a method there is not, or no cycle left to judge.
    """
    import pandas as pd

    if method not in ROUTES:
        raise ModelError(Problem("method", f'"{method}"', f"must be one of {', '.join(ROUTES)}"))
    found, names = ROUTES[method](run.trajectory), list(run.trajectory.layout.clearance_names)
    series = pd.Series(found.value, index=pd.Index(names, name="clearance"), name=method)
    low, high = (dict(zip(names, bound.tolist(), strict=True)) for bound in (found.low, found.high))
    series.attrs = {"quantity": found.quantity, "low": low, "high": high, "notes": list(found.notes)}
    return series
