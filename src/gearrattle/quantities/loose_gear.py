"""Loose-gear test: the torque that an unloaded gear needs to follow its driver, over its drag torque.

To follow its driver through the mesh rigidly, a loose gear of inertia J_l needs the torque J_l (R_d/R_l) |theta_d''|;
the only torque that presses it to the flank is its drag torque T_d. The torque ratio

    J_l (R_d/R_l) peak |theta_d''| / T_d,      margin = 20 log10 of the ratio  [dB]

is the classical rattle threshold: above 0 dB the gear lifts off. The test uses the acceleration of the *driver*,
because the acceleration of the loose gear itself contains its impacts (Singh, Xie, Comparin 1989, J. Sound Vib. 131,
177-196; Wang, Manoj, Zhao 2001, Proc. IMechE D 215, 241-258). The ratio describes the motion with its rattle; it is not
a design target. When gears rattle, the driver's acceleration contains impacts, and a much smaller increase of the drag
torque than the ratio suggests may stop the rattle.

A gear is *loose* if it has a drag torque and the mesh is the only element with stiffness on its body. Along a sweep
over which the drag torque changes, the ratio is the largest ratio of all times, with the drag torque at that time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gearrattle.quantities.quantity import Quantity, Row, State, Sums
from gearrattle.signals import decibels, loose_gears, steady, torque_ratio
from gearrattle.signals.levels import extreme_errors
from gearrattle.signals.torque_ratios import changes_drag, largest_ratios
from gearrattle.trajectory import Trajectory

_FINE = 1e-3  # share of the peak: smaller sampling errors are not noted


@dataclass(frozen=True)
class LooseGear(Quantity[Sums]):
    """Inertia torque of a loose gear against its drag torque."""

    name: str = "loose_gear"
    title: str = "Loose-gear test"
    formula: str = (
        "20 log10( J_loose (R_driver/R_loose) peak|theta_driver''| / drag torque ), over [discard T, end]: "
        "torque ratio in the motion as it is; no design target: in a rattling motion the driver's acceleration "
        "contains the impacts"
    )
    unit: str = "dB"
    source: str = "Singh, Xie, Comparin 1989, J. Sound Vib. 131, 177-196; Wang, Manoj, Zhao 2001, Proc. IMechE D 215"
    sums: tuple[str, ...] = ("peaks",)
    merging: str = "exact: the peak of all is the largest peak"

    def rows(self, sums: Sums) -> list[Row]:
        """Return peak acceleration of the driver, ratio and margin for every loose gear, by mesh."""
        state = sums.states["peaks"]
        layout = sums.steady.layout
        peak = state["peak"]
        rows = []
        # torque ratio of the driver's peak acceleration
        for gear in loose_gears(layout):
            mesh, loose, driver, _ = gear
            beyond = float(state["miss"][driver]) / float(peak[driver]) if peak[driver] > 0.0 else 0.0
            if changes_drag(layout, gear):
                ratio = float(state["ratio"][loose])
                ratio_beyond = float(state["ratio_miss"][loose]) / ratio if 0.0 < ratio < math.inf else 0.0
            else:
                ratio = torque_ratio(layout, gear, float(peak[driver]))
                ratio_beyond = beyond
            # margin, and notes on peaks that samples may miss
            margin = decibels(ratio)
            element = layout.element_names[mesh]
            loose_name = layout.inertia_names[loose]
            driver_name = layout.inertia_names[driver]
            note = _short(element, "the peak between two of them", beyond)
            ratio_note = note
            if changes_drag(layout, gear):
                ratio_note = _short(element, "the ratio between two of them, as the drag torque changes,", ratio_beyond)
            by = f"J_{loose_name} (R_{driver_name}/R_{loose_name}) peak|theta_{driver_name}''| / drag torque"
            # peak acceleration, torque ratio and margin
            rows += [
                self.row(
                    element,
                    f"peak acceleration of the driver {driver_name}",
                    float(peak[driver]),
                    unit="rad/s^2",
                    formula="max |theta''| over [discard T, end]; of an exact motion between samples too",
                    note=note,
                    error=float(peak[driver]) * beyond,
                ),
                self.row(
                    element,
                    f"torque ratio of {loose_name}",
                    ratio,
                    unit="1",
                    formula=by,
                    note=ratio_note,
                    error=ratio * ratio_beyond,
                ),
                self.row(
                    element,
                    "margin",
                    margin,
                    formula=f"20 log10( {by} )",
                    note=ratio_note,
                    error=20.0 * math.log10(1.0 + ratio_beyond),
                ),
            ]
        return rows


def _short(element: str, what: str, beyond: float) -> str:
    """Note by which share a value may be too low; empty for a small share."""
    return f"{element}: by samples; {what} may lie {100.0 * beyond:.2g} % higher" if beyond > _FINE else ""


def add_peaks(trajectory: Trajectory, before: State | None) -> State:
    """Return the state "peaks" over a chunk and all chunks before it.

    Its arrays are peak (n,), the largest |theta''| of every inertia, and miss (n,), the amount by which the true peak
    of a driver may be larger [rad/s^2]. For drivers of loose gears, the peak is that of the exact motion if it is
    known. If drag torques of loose gears change, there are also ratio (n,), the largest torque ratio of every loose
    gear, and ratio_miss (n,), the amount by which the true ratio may be larger.
    """
    samples = steady(trajectory).closed(trajectory.acceleration)
    peak = np.max(np.abs(samples), axis=0)
    exact = _exact_peaks(trajectory)
    drivers = {gear.driver for gear in loose_gears(trajectory.layout)} - set(exact)
    miss = np.zeros(peak.size)
    for driver in drivers:
        miss[driver] = np.max(extreme_errors(samples[:, driver]))
    for driver, value in exact.items():
        peak[driver] = value
    state = {"peak": peak, "miss": miss}
    if ratios := largest_ratios(trajectory):
        state["ratio"] = np.zeros(peak.size)
        state["ratio_miss"] = np.zeros(peak.size)
        for loose, largest in ratios.items():
            state["ratio"][loose] = largest.value
            state["ratio_miss"][loose] = largest.miss
    return state if before is None else {name: np.maximum(before[name], new) for name, new in state.items()}


def _exact_peaks(trajectory: Trajectory) -> dict[int, float]:
    """Return by inertia the largest |theta''| of drivers of loose gears that are known between samples [rad/s^2]."""
    if trajectory.exact is None:
        return {}
    names = trajectory.layout.inertia_names
    known = trajectory.exact.signals(trajectory)
    drivers = dict.fromkeys(gear.driver for gear in loose_gears(trajectory.layout))
    wanted = [driver for driver in drivers if ("acceleration", names[driver]) in known]
    signals = [("acceleration", names[driver]) for driver in wanted]
    statistics = trajectory.exact.statistics(trajectory, signals, with_moments=False) if signals else None
    if statistics is None:
        return {}
    return dict(zip(wanted, np.maximum(statistics.high, -statistics.low).tolist(), strict=True))
