"""Hold a run of the program against the fifty-digit solution: every crossing, every sample.

Accuracy promised: 1e-8 of a quantity's scale, or 1e-11 times the growth of a perturbation where that is more. The
scale of a deflection is the larger of its size in the response and its largest corner; of any other quantity, the
largest of its kind in the response, and what an allowed error of the deflections makes of it. The growth is measured
by the oracle itself, only when 1e-8 alone does not hold.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import gearrattle as gr
from tests.oracles.driveline import Driveline
from tests.oracles.exact_mp import Event, Solution, growth, solve
from tests.oracles.fixed_point import to_float
from tests.oracles.law import law_of

ABSOLUTE = 1e-8
GROWING = 1e-11
HORIZON = 1e-6
"""Where a perturbation has grown until the tolerance passes this, crossings that barely touch may differ rightly."""


@dataclass(frozen=True)
class Scales:
    """What errors are measured against, one entry a column."""

    deflection: np.ndarray
    rate: np.ndarray
    force: np.ndarray
    angle: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    time: float


@dataclass(frozen=True)
class Outcome:
    """Measured errors, relative to scale; ``tolerance``: what was allowed at the end of the run."""

    errors: dict[str, float]
    events: int
    tolerance: float
    faults: tuple[str, ...]

    @property
    def worst(self) -> float:
        """Largest relative error."""
        return max(self.errors.values())


def scales(model: Driveline, exact: Solution) -> Scales:
    """Return the scale of every column."""
    laws = [law_of(e) for e in model.elements]
    radii = np.array([[float(r) for r in e.radii] for e in model.elements])
    largest = np.array([max([abs(to_float(c)) for c in law.corners], default=0.0) for law in laws])
    deflection = _nonzero(np.maximum(_size(exact, "deflection"), largest))
    rate = _nonzero(_size(exact, "rate"))
    k = np.array([max(to_float(x) for x in law.stiffness) for law in laws])
    c = np.array([max(to_float(x) for x in law.damping) for law in laws])
    force = _nonzero(np.maximum(_size(exact, "force"), k * deflection + c * rate))
    torque = np.zeros(len(model.bodies))
    names = [body.name for body in model.bodies]
    for element, f, (ra, rb) in zip(model.elements, force, radii, strict=True):
        for end, radius in zip(element.between, (ra, rb), strict=True):
            if end != "ground":
                torque[names.index(end)] += radius * f
    J = np.array([float(body.J) for body in model.bodies])
    return Scales(
        deflection,
        rate,
        force,
        _nonzero(_size(exact, "angle")),
        _nonzero(_size(exact, "velocity")),
        _nonzero(np.maximum(_size(exact, "acceleration"), torque / J)),
        to_float(exact.time[-1]),
    )


def _size(exact: Solution, name: str) -> np.ndarray:
    return np.abs(exact.array(name)).max(axis=0)


def _nonzero(x: np.ndarray) -> np.ndarray:
    """What is zero but for the oracle's own rounding has the scale 1."""
    return np.where(x > 1e-40, x, 1.0)


def compare(model: Driveline, cycles: int, samples_per_cycle: int, run: gr.Run | None = None) -> Outcome:
    """Simulate (unless a run is given), solve to fifty digits, and return every fault found.

    Parameters
    ----------
    model
        the driveline, in decimals.
    cycles, samples_per_cycle
        the output grid.
    run
        a finished run on the same grid, to be judged instead of a fresh one.
    """
    if run is None:
        run = gr.simulate(
            gr.loads(model.toml()), algorithm="exact", cycles=cycles, samples_per_cycle=samples_per_cycle, discard=0
        )
    exact = solve(model, cycles, samples_per_cycle)
    scale = scales(model, exact)
    outcome = judge(model, run, exact, scale, np.full(len(exact.time), ABSOLUTE))
    if not outcome.faults:
        return outcome
    grown = growth(model, cycles, samples_per_cycle, exact, np.array([scale.deflection, scale.rate]))
    return judge(model, run, exact, scale, np.maximum(ABSOLUTE, GROWING * grown))


def judge(model: Driveline, run: gr.Run, exact: Solution, scale: Scales, tolerance: np.ndarray) -> Outcome:
    """Hold samples, regions and crossings of a run against a solution; ``tolerance`` (time,), relative to scale."""
    faults: list[str] = []
    errors: dict[str, float] = {}
    clear = list(model.clearances)
    expected = {
        "angle": (exact.array("angle"), scale.angle),
        "velocity": (exact.array("velocity"), scale.velocity),
        "acceleration": (exact.array("acceleration"), scale.acceleration),
        "deflection": (exact.array("deflection")[:, clear], scale.deflection[clear]),
        "force": (exact.array("force")[:, clear], scale.force[clear]),
        "element_torque": (exact.array("force") * _radii(model), scale.force * _radii(model)),
    }
    data = run.data
    if not np.allclose(data.time.values, exact.array("time"), rtol=4e-16 * 8, atol=0):
        faults.append("time grid differs")
    for name, (want, unit) in expected.items():
        actual = data[name].values
        if actual.shape != want.shape:
            faults.append(f"{name}: shape {actual.shape}, expected {want.shape}")
            continue
        error = np.abs(actual - want) / unit
        errors[name] = float(np.nanmax(error)) if np.all(np.isfinite(actual)) and error.size else 0.0
        bad = ~(error <= tolerance[:, None])
        if bad.any():
            i, j = np.argwhere(bad)[0]
            faults.append(
                f"{name}[{i}, {j}] at t = {data.time.values[i]:.17g}: {actual[i, j]:.17g}, exact {want[i, j]:.17g}, "
                f"{error[i, j]:.2g} of scale, allowed {tolerance[i]:.2g}"
            )
    _judge_regions(model, run, exact, scale, tolerance=tolerance, faults=faults)
    _judge_events(model, run, exact, scale, tolerance=tolerance, errors=errors, faults=faults)
    return Outcome(errors, len(exact.events), float(tolerance[-1]), tuple(faults))


def _radii(model: Driveline) -> np.ndarray:
    return np.array([float(e.radii[0]) for e in model.elements])


def _judge_regions(model, run, exact: Solution, scale: Scales, *, tolerance, faults: list[str]) -> None:
    clear = list(model.clearances)
    if not clear:
        return
    want, actual = exact.array("region")[:, clear], run.data.region.values
    laws = [law_of(model.elements[k]) for k in clear]
    deflection = exact.array("deflection")[:, clear]
    for i, j in np.argwhere(want != actual):
        distance = min(abs(deflection[i, j] - to_float(c)) for c in laws[j].corners)
        if distance > tolerance[i] * scale.deflection[clear[j]]:
            faults.append(f"region[{i}, {j}] is {actual[i, j]}, exact {want[i, j]}, {distance:.3g} from a corner")
            return


def _judge_events(model, run, exact: Solution, scale: Scales, *, tolerance, errors, faults: list[str]) -> None:
    """Compare the crossings clearance by clearance; the log's order; times by the deflection left at them.

    The velocity at a crossing answers to a perturbation of the deflection by the more, the nearer to grazing it is:
    there this is the growth that counts.
    """
    log = run.events
    times = log["time"].to_numpy()
    if np.any(np.diff(times) < 0):
        faults.append("events are not in order of time")
    grid = exact.array("time")
    errors.setdefault("event position", 0.0)
    errors.setdefault("event velocity", 0.0)
    for k in model.clearances:
        name = model.elements[k].name
        want = [e for e in exact.events if e.element == k]
        mine = log[log["clearance"] == name]
        seen = list(zip(mine["from_region"], mine["to_region"], strict=True))
        if seen != [(e.from_region, e.to_region) for e in want]:
            faults.append(_first_difference(name, want, mine))
            continue
        for event, time, velocity in zip(want, mine["time"], mine["velocity"], strict=True):
            allowed = float(np.interp(to_float(event.time), grid, tolerance))
            late = time - to_float(event.time)
            rate, curvature = to_float(event.rate), to_float(event.curvature)
            position = (abs(rate * late) + 0.5 * abs(curvature) * late**2) / scale.deflection[k]
            speed = abs(velocity - rate) / scale.rate[k]
            shift = _shift(rate, curvature, GROWING * scale.deflection[k]) / scale.rate[k]
            errors["event position"] = max(errors["event position"], position)
            errors["event velocity"] = max(errors["event velocity"], speed)
            if not (position <= allowed and speed <= max(allowed, shift)):
                faults.append(
                    f"{name}: crossing {event.from_region} -> {event.to_region} at {time:.17g} with {velocity:.17g}, "
                    f"exact {to_float(event.time):.17g} with {rate:.17g}: {position:.2g}, {speed:.2g} of scale, "
                    f"allowed {allowed:.2g}"
                )
                break


def _shift(rate: float, curvature: float, reach: float) -> float:
    """Return how far a perturbation ``reach`` of the deflection moves the velocity at a crossing.

    delta''/delta' times it, but no more than what a body at rest gains over that distance.
    """
    from_rest = (2 * abs(curvature) * reach) ** 0.5
    return min(abs(curvature) * reach / abs(rate), from_rest) if rate else from_rest


def _first_difference(name: str, want: list[Event], mine) -> str:
    rows = list(zip(mine["time"], mine["from_region"], mine["to_region"], strict=True))
    for i in range(max(len(want), len(rows))):
        ours = (want[i].from_region, want[i].to_region) if i < len(want) else None
        theirs = rows[i][1:] if i < len(rows) else None
        if ours != theirs:
            at = f"{to_float(want[i].time):.17g}" if i < len(want) else "-"
            return (
                f"{name}: {len(rows)} crossings, exact {len(want)}; the first difference is number {i}: "
                f"{theirs} at {rows[i][0] if i < len(rows) else '-'}, exact {ours} at {at}"
            )
    return f"{name}: crossings differ"


def assert_exact(model: Driveline, cycles: int, samples_per_cycle: int = 24) -> Outcome:
    """Fail with the model and every fault, or return what was measured.

    A run that outlasts its own predictability is refused: it would compare chance with chance.
    """
    outcome = compare(model, cycles, samples_per_cycle)
    assert outcome.tolerance <= HORIZON, f"{model.name}: perturbations grow too much in {cycles} cycles"
    assert not outcome.faults, "\n".join([f"{model.name}, {cycles} cycles", *outcome.faults, "", model.toml()])
    return outcome


def assert_exact_inside_horizon(model: Driveline, cycles: int, samples_per_cycle: int = 24) -> Outcome:
    """The same for a run cut short, cycle by half, until it is predictable."""
    while cycles > 1 and compare(model, cycles, samples_per_cycle).tolerance > HORIZON:
        cycles //= 2
    return assert_exact(model, cycles, samples_per_cycle)
