"""``contact_ratio``: one slope for every clearance, of a run, or forecast from a model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.contact_ratios import ROUTES
from gearrattle.analysis.contact_ratios.forecast import forecast
from gearrattle.analysis.statics import named_equilibrium
from gearrattle.assembly import assemble, left_out, refuse_recorded_motions, steady, unsteady_inputs
from gearrattle.errors import ConvergenceError, ModelError, Problem
from gearrattle.model import Model
from gearrattle.result import KIND
from gearrattle.results import Run, check_run

if TYPE_CHECKING:
    import pandas as pd

    from gearrattle.analysis.contact_ratios.forecast import FixedPoint

_LINEARISED = {"mean-slope": "mean_slope", "describing": "gain"}
_MEANING = {
    "stable": "it leads to a stable periodic motion, whose ratios these are; other stable motions may exist too",
    "unstable": "it leads to a periodic motion that is not stable: the true motion is another, simulate it",
    "not found": "no periodic motion was found from it: the motion may be sub-harmonic or chaotic, simulate it",
    "not sought": "no periodic motion was sought from it",
}
_QUANTITY = {"mean-slope": "mean slope", "describing": "equivalent gain"}


def contact_ratio(run_or_model: Run | Model, method: str = "mean-slope") -> pd.Series[float]:
    """Stiffness contact ratio of every clearance (Padmanabhan et al. 1995, sec. 6).

    Parameters
    ----------
    run_or_model
        a motion, judged over its steady part; or a model, whose ratios are forecast by equivalent
        linearisation without simulating it.
    method
        "mean-slope": time average of df/d(delta), from event times; "spectral": equivalent gain from cross and
        auto densities (H1), with a 95 % interval, of a run only; "describing": equivalent gain of the response, by
        least squares.

    Returns
    -------
    pd.Series[float]
        The ratio by clearance, relative to the largest slope of its law. ``attrs``: quantity ("mean slope" or
        "equivalent gain": they agree for Gaussian motions only) and notes; of a run low and high, the interval; of a
        model fixed_points, all that were found, the one returned first: those that lead to a stable periodic motion
        ("motion": "stable"; then that motion's ratios are returned, as "motion_gain" and "motion_mean_slope") stand
        before all others ("unstable": it leads to a motion that is not; "not found", "not sought"). There may be
        several, and other motions as well; only a simulation shows which one occurs.

    Raises
    ------
    ModelError
        a method there is not, no cycle left to judge, or no static equilibrium.
    ConvergenceError
        a forecast that found no fixed point.

    Examples
    --------
    >>> run = gr.simulate(gr.example("case3"), cycles=20, discard=10)
    >>> round(float(gr.contact_ratio(run)["gear"]), 4)
    0.1595
    """
    if method not in ROUTES:
        raise ModelError(Problem("method", f'"{method}"', f"must be one of {', '.join(ROUTES)}"))
    if isinstance(run_or_model, Model):
        ratios, attributes = forecast_ratios(run_or_model, method)
        return _series(ratios, method, attributes)
    check_run(run_or_model, (Model,))
    estimate = ROUTES[method](run_or_model.trajectory)
    names = run_or_model.trajectory.layout.clearance_names
    left_out_notes = () if method == "spectral" else left_out(run_or_model.model)
    interval = {"low": _by_name(names, estimate.low), "high": _by_name(names, estimate.high)}
    attributes = {"quantity": estimate.quantity, **interval, "notes": [*estimate.notes, *left_out_notes]}
    return _series(_by_name(names, estimate.value), method, attributes)


def forecast_ratios(model: Model, method: str, *, thorough: bool = True) -> tuple[dict[str, float], dict[str, Any]]:
    """Return ratios forecast by equivalent linearisation, by clearance, and the ``attrs`` of ``contact_ratio``.

    From two starts if not thorough.
    """
    # refuse what cannot be forecast
    if method not in _LINEARISED:
        raise ModelError(Problem("method", f'"{method}"', "needs a motion, not a model", "simulate it first"))
    refuse_recorded_motions(model, "a forecast")
    # fixed points of equivalent linearisation
    left = unsteady_inputs(model)
    model = steady(model)
    driveline = assemble(model)
    named_equilibrium(driveline)
    prediction = forecast(driveline.system, thorough=thorough)
    names = driveline.layout.clearance_names
    if not prediction.points:
        raise ConvergenceError(
            f"equivalent linearisation found no fixed point in {prediction.searches} searches",
            remedy="simulate the model and give the run",
        )
    # ratio of the first fixed point, and its notes
    points = [_described(names, point) for point in prediction.points]
    first = prediction.points[0]
    ratios = dict(zip(("gain", "mean_slope"), first.ratios, strict=True))[_LINEARISED[method]]
    notes = [f"forecast by equivalent linearisation: {first.starts} of {prediction.searches} searches end here"]
    if len(points) > 1:
        notes.append(f"there are {len(points)} fixed points; which one is nearest to the motion only a run tells")
    notes.append(_MEANING[points[0]["motion"]])
    notes += left
    if prediction.failed:
        notes.append(f"{prediction.failed} searches found none")
    notes += left_out(model)
    attributes = {"quantity": _QUANTITY[method], "fixed_points": points, "notes": notes}
    return _by_name(names, ratios), attributes


def _described(names: tuple[str, ...], point: FixedPoint) -> dict[str, Any]:
    """A fixed point as the ``attrs`` of ``contact_ratio`` describe it."""
    keys = ("gain", "mean_slope", "mean", "deviation")
    described = {**{key: _by_name(names, getattr(point, key)) for key in keys}, "starts": point.starts}
    motion = point.motion
    if motion is None or not motion.settled:
        return {**described, "motion": "not sought" if motion is None else "not found"}
    ratios = {"motion_gain": _by_name(names, motion.gain), "motion_mean_slope": _by_name(names, motion.mean_slope)}
    return {**described, "motion": "stable" if motion.stable else "unstable", **ratios}


def _by_name(names: tuple[str, ...], values: NDArray[np.float64]) -> dict[str, float]:
    return dict(zip(names, values.tolist(), strict=True))


def _series(ratios: dict[str, float], name: str, attrs: dict[str, Any]) -> pd.Series[float]:
    import pandas as pd

    series = pd.Series([*ratios.values()], index=pd.Index([*ratios], name="clearance"), name=name, dtype=np.float64)
    series.attrs.update({KIND: "contact ratio", **attrs})
    return series
