"""Probability that a part rattles: the share of samples in which it does, with an interval.

By severity a part that touches does not rattle; by regime, where a study kept that alone, every part that separates
does. Only a gap can separate: a staged spring with stiffness in all its stages changes stage, and is left out.

The interval is Wilson's (``signals.wilson_interval``). It holds for independent samples; Latin hypercubes and Sobol's
sequence scatter less, so there it is wide rather than narrow.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.model.table import shown
from gearrattle.result import KIND
from gearrattle.signals.wilson_interval import wilson
from gearrattle.studies.dataset_layout import (
    chosen_codes,
    gaps_of,
    independent,
    output_in,
    rattling_from,
    sampling_of,
    subject_of,
)
from gearrattle.studies.output import SEVERITY
from gearrattle.studies.plan import SAMPLE

if TYPE_CHECKING:
    import xarray as xr


def samples_needed(half_width: float, probability: float = 0.5, level: float = 0.95) -> int:
    """Return how many independent samples tell a probability to a wished half-width of its interval.

    Parameters
    ----------
    half_width
        half the length of Wilson's interval, 0 to 0.5.
    probability
        about what it is; 0.5 needs the most.
    level
        of confidence of the interval.

    Raises
    ------
    ModelError
        a number outside its range.

    Examples
    --------
    >>> gr.studies.samples_needed(0.05)
    381
    """
    from scipy.special import ndtri

    # numbers within their ranges
    arguments = {
        "half_width": (half_width, 1e-9, 0.5),
        "probability": (probability, 0.0, 1.0),
        "level": (level, 0.0, 1.0),
    }
    problems = [
        Problem(name, shown(value), f"must lie between {least:g} and {most:g}", "for example 0.05")
        for name, (value, least, most) in arguments.items()
        if isinstance(value, bool) or not isinstance(value, int | float) or not least < value < most
    ]
    if problems:
        raise ModelError(problems)
    # half-width of Wilson's interval by number of samples
    z2 = float(ndtri(0.5 + 0.5 * level)) ** 2
    scatter = probability * (1.0 - probability)

    def half(n: float) -> float:
        return float(np.sqrt(z2 * (n * scatter + 0.25 * z2)) / (n + z2))

    # smallest number by doubling, then halving
    below = 0
    enough = 1
    while half(enough) > half_width:
        below = enough
        enough = 2 * enough
    while enough - below > 1:  # it falls as n grows
        middle = (below + enough) // 2
        below, enough = (below, middle) if half(middle) <= half_width else (middle, enough)
    return enough


def running(codes: NDArray[np.int_], lowest: int = 1, level: float = 0.95) -> tuple[NDArray[np.float64], ...]:
    """Return the estimate as samples are added: share of the first 1 to n that rattle, and Wilson's limits.

    Codes (n,) are -1 for a case that failed, which is not counted; from ``lowest`` on a part rattles. Returned are the
    number of samples counted, share, lower and upper limit, (m,) each, m <= n.
    """
    there = codes[codes >= 0]
    among = np.arange(1, there.size + 1)
    count = np.cumsum(there >= lowest)
    return (among.astype(np.float64), count / among, *wilson(count, among, level))


def rattle_probability(data: xr.Dataset, output: str | None = None, *, level: float = 0.95) -> xr.Dataset:
    """Return how likely each part rattles over the samples of a study.

    Parameters
    ----------
    data
        what ``study`` returned, with samples.
    output
        of codes: "severity" or "verdict severity", by which a touch is no rattle; "regime" or "verdict", by which
        all that separates rattles; None for the first of these that was kept.
    level
        of confidence of the interval.

    Returns
    -------
    xr.Dataset
        A Dataset over the study's axes and those of the output's subjects that can separate: ``probability``, ``low``
        and ``high`` (Wilson 1927), ``rattling`` of ``samples``; cases that failed are counted nowhere.

    Raises
    ------
    ModelError
        no samples, no such output, a level outside 0 to 1.

    Examples
    --------
    >>> vary = {"mesh.gear.backlash": {"distribution": "uniform", "from": "0.05 mm", "to": "0.2 mm"}}
    >>> data = gr.study(gr.example("case3"), outputs=["verdict severity"], vary=vary, samples=16, workers=1)
    >>> float(gr.studies.rattle_probability(data)["probability"])
    1.0
    """
    import xarray as xr

    # codes of gaps over independent samples
    codes = output_in(data, output if output is not None else chosen_codes(data) or SEVERITY, codes=True)
    codes = gaps_of(codes if SAMPLE not in codes.dims else output_in(independent(data), str(codes.name)))
    if SAMPLE not in codes.dims:
        raise ModelError(Problem("data", "", "a probability needs samples", "let values scatter: vary, samples"))
    if not codes.sizes[SAMPLE]:
        rule = f"a probability needs samples that are independent; these are {sampling_of(data)}"
        raise ModelError(Problem("data", "", rule, 'for example method = "sobol"'))
    if not 0.0 < level < 1.0:
        raise ModelError(Problem("level", f"{level:g}", "must lie between 0 and 1", "for example 0.95"))
    # share of samples that rattle, with Wilson's interval
    among = (codes >= 0).sum(SAMPLE)
    count = (codes >= rattling_from(codes)).sum(SAMPLE)
    low, high = wilson(count.values, among.values, level)
    subject = subject_of(data, str(codes.name))
    return xr.Dataset(
        {
            "probability": count / among.where(among > 0),
            "low": (count.dims, low),
            "high": (count.dims, high),
            "rattling": count,
            "samples": among,
        },
        attrs={KIND: "rattle probability", "output": str(codes.name), "subject": subject, "level": level},
    )
