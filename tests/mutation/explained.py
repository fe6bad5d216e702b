"""Mutants that survive and why they may: of the first 150 of seed 0, of which 98 are noticed, and 40 of seed 41, 30.

A mutant is named by its file, function and the line before and after, so the list does not move with the lines above.
"""

from __future__ import annotations

WORK = "costs work and changes no result"
ROOM = "makes room that is not used"
DEAD = "changes a value that is overwritten before it is read"
MARGIN = "moves a limit inside its margin"

EXPLAINED = {
    "taylor_window.py: move_within: rounds = _STRIPS if chained[0] > 0 else 1"
    " -> rounds = _STRIPS if chained[1] > 0 else 1": WORK,
    "one_step_kernels.py: _midpoint: derivative(field, t + j * d, now, buffers.wave, at[0], at[1], at[2], at[3],"
    " slope, held)"
    " -> derivative(field, t + j * d, now, buffers.wave, at[0], at[1], at[3], at[3], slope, held)": DEAD,
    "one_step_kernels.py: extrapolate: factor = _SAFETY * (_AIM / max(error, 1e-10)) ** (1.0 / (2 * j + 1))"
    " -> factor = _SAFETY * (_AIM / max(error, 1e-10)) ** (1.0 / (2 * j + 2))": WORK,
    "one_step_kernels.py: next_of_extrapolation: best = min(reached + 1, COLUMNS - 2)"
    " -> best = min(reached + 1, COLUMNS - 3)": WORK,
    "deflection_bounds.py: exponential: for order in range(1, 16): -> for order in range(1, 17):": MARGIN,
    "corner_log.py: has_left: return (side == -1 and below > 4.0 * band) or (side == 1 and above > 4.0 * band)"
    " -> return (side == -1 and below > 5.0 * band) or (side == 1 and above > 4.0 * band)": MARGIN,
    "march.py: _counted: return 0.0 if gap <= 0.0 and rate > 0.0 else gap"
    " -> return 0.0 if gap <= 0.0 and rate > 1.0 else gap": MARGIN,
    "window_works.py: integrate_works: share = min(left, 1.0) -> share = min(left, 2.0)": WORK,
    "workspace.py: _shapes: forced=floats(4 * watched, inputs), -> forced=floats(5 * watched, inputs),": ROOM,
    "workspace.py: _shapes: watched=floats(3 * watched, z), -> watched=floats(4 * watched, z),": ROOM,
    "workspace.py: _shapes: Scratch(floats(rows, z), floats(rows, z), floats(rows, z), floats(rows, z),"
    " floats(ORDER + 1)),"
    " -> Scratch(floats(rows, z), floats(rows, z), floats(rows, z), floats(rows, z), floats(ORDER + 2)),": ROOM,
    "march.py: march_on: still = np.zeros(4 * watched) -> still = np.zeros(5 * watched)": ROOM,
    "march.py: march_on: counts[UNBOUNDED] = 0 -> counts[UNBOUNDED] = 1": WORK,
    "window_march.py: _cross: counts[STALLED] = counts[STALLED] + 1 if clock[0] + s == before else 0"
    " -> counts[STALLED] = counts[STALLED] + 1 if clock[0] + s == before else 1": MARGIN,
    "perturbation_series.py: flow_on: for m in range(1, _MOST_TERMS + 1): -> for m in range(1, _MOST_TERMS + 2):": WORK,
    "state_scaling.py: scale: inputs[j] = power_below(size) if size > 0.0 else 1.0"
    " -> inputs[j] = power_below(size) if size <= 0.0 else 1.0": "another scale changes rounding alone",
    "step_loop.py: step_on: k = -1 -> k = -2": DEAD,
}
"""By name the reason. Others of the 150 that survive are open: ``make mutation`` prints them."""
