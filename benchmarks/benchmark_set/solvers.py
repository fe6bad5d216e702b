"""Solvers on the problems, as a careful user would set it: samples, events and cost of every run.

A *plain* solver takes the right-hand side with its corners as it is and reports events it passes; a *restarted* one
stops at every corner, takes the law of the next region and begins anew. Absolute tolerances are the relative one times
the half gap for angles and times the largest velocity for velocities.
"""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from time import process_time
from types import ModuleType
from typing import Any

import numpy as np

HOME = Path(__file__).resolve().parents[2] / "clearance-benchmarks" / "problems"
MOST = 300_000
"""Right-hand sides after which a run is given up."""
TOLERANCE = 1e-8
FIRST = 1000
"""A first step behind a corner is a sample over this: a longer one may end behind the way back, and no sign changes."""
SHORTEST = 1e-12
"""Shortest first step behind a corner, as a share of a sample."""


class GaveUp(Exception):
    """A run ended before its time."""


class TooLong(Exception):
    """A run took more processor time than it may."""


@dataclass
class Outcome:
    """Sampled states, events (time, element, from, to), cost; ``failed`` says why a run ended early."""

    times: list[float] = field(default_factory=list)
    states: list[Any] = field(default_factory=list)
    events: list[tuple[float, str, int, int]] | None = field(default_factory=list)
    rhs: int = 0
    steps: int = 0
    seconds: float = 0.0
    failed: str = ""


@dataclass(frozen=True)
class Solver:
    """A row of the table."""

    name: str
    package: str
    setting: str
    run: Callable[[str], Outcome]


def load(name: str) -> ModuleType:
    """Import ``rhs.py`` of a problem."""
    spec = importlib.util.spec_from_file_location(f"rhs_{name}", HOME / name / "rhs.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Task:
    """A problem with its right-hand side counted, its regions, its scales."""

    def __init__(self, name: str) -> None:
        self.rhs = load(name)
        self.calls = 0
        self.outcome = Outcome()
        n = self.rhs.INERTIA.size
        corners = np.where(np.isfinite(self.rhs.CORNERS), np.abs(self.rhs.CORNERS), 0.0).max(axis=1)
        reach = [
            min((c / abs(row[i]) for c, row in zip(corners, self.rhs.ROWS, strict=True) if c and row[i]), default=1.0)
            for i in range(n)
        ]
        reference = json.loads((HOME / name / "reference.json").read_text(encoding="utf-8"))
        fastest = np.abs(np.array(reference["states"])[:, n:]).max(axis=0)
        self.scale = np.array([*reach, *np.maximum(fastest, 1e-3 * fastest.max())])
        self.index = self._start()

    def _start(self) -> Any:
        """Pieces at the start: on a corner the rate decides, then the acceleration."""
        index = self.rhs.region(0.0, self.rhs.START)
        slightly = 1e-6 * self.rhs.TIMES[1]
        moved = self.rhs.START + slightly * self.rhs.rhs(0.0, self.rhs.START, index)
        on = np.abs(self.rhs.events(0.0, self.rhs.START)) < 1e-15
        for k, c in self.rhs.WATCHED[on]:
            delta = self.rhs.deflection(slightly, moved)[0][k]
            if delta != self.rhs.CORNERS[k, c]:
                index[k] = c + 1 if delta > self.rhs.CORNERS[k, c] else c
        return index

    def smooth(self, t: float, y: Any) -> Any:
        """The right-hand side of the regions in force."""
        self._count()
        return self.rhs.rhs(t, y, self.index)

    def cornered(self, t: float, y: Any) -> Any:
        """The right-hand side with its corners."""
        self._count()
        return self.rhs.rhs(t, y)

    def _count(self) -> None:
        self.calls += 1
        if self.calls > MOST:
            raise GaveUp(f"more than {MOST} right-hand sides")

    def ways(self) -> list[tuple[int, int, int]]:
        """Element, corner, direction: how every element may leave its region."""
        counts = np.isfinite(self.rhs.CORNERS).sum(axis=1)
        up = [(k, int(r), 1) for k, r in enumerate(self.index) if r < counts[k]]
        return up + [(k, int(r) - 1, -1) for k, r in enumerate(self.index) if r > 0]

    def distance(self, t: float, y: Any, element: int, corner: int) -> float:
        """Deflection beyond a corner."""
        return self.rhs.deflection(t, y)[0][element] - self.rhs.CORNERS[element, corner]

    def cross(self, t: float, element: int, corner: int, direction: int) -> None:
        """Enter the next region and note the event."""
        label = self.rhs.FIRST[element] + corner
        ends = (label, label + 1) if direction > 0 else (label + 1, label)
        assert self.outcome.events is not None
        self.outcome.events.append((t, self.rhs.ELEMENTS[element], *ends))
        self.index[element] = corner + 1 if direction > 0 else corner

    def legs(self) -> list[float]:
        """Ends of the pieces in which the input has no kink."""
        end = float(self.rhs.TIMES[-1])
        return [*(t for t in self.rhs.KINKS if t < end), end]

    def samples(self, after: float, until: float) -> Any:
        """Sample times in an interval, its end included."""
        times = self.rhs.TIMES
        inside = (times > after) & (times <= until)
        return times[inside]

    def keep(self, times: Any, states: Any) -> None:
        """Keep samples (rows)."""
        self.outcome.times += list(map(float, times))
        self.outcome.states += list(states)


def timed(work: Callable[[Task], None]) -> Callable[[str], Outcome]:
    """Run on a fresh task; what it kept until it failed counts."""

    def run(name: str) -> Outcome:
        task = Task(name)
        task.keep([0.0], [task.rhs.START])
        began = process_time()
        try:
            with np.errstate(all="ignore"):
                work(task)
        except (TooLong, SystemError):  # the second where compiled code was interrupted
            task.outcome.failed = "more than its processor time"
        except (GaveUp, ArithmeticError, ValueError, RuntimeError) as why:
            task.outcome.failed = " ".join(str(why).split())[:120] or type(why).__name__
        task.outcome.seconds = process_time() - began
        task.outcome.rhs = task.calls
        return task.outcome

    return run


def scipy_plain(method: str, tolerance: float) -> Callable[[str], Outcome]:
    """SciPy over the corners."""

    def work(task: Task) -> None:
        from scipy.integrate import solve_ivp

        watched = [(int(k), int(c)) for k, c in task.rhs.WATCHED]
        events = [lambda t, y, k=k, c=c: task.distance(t, y, k, c) for k, c in watched]
        jac = {"jac": task.rhs.jacobian} if method in ("Radau", "LSODA") else {}
        done = solve_ivp(
            task.cornered,
            (0.0, task.rhs.TIMES[-1]),
            task.rhs.START,
            method,
            t_eval=task.rhs.TIMES[1:],
            events=events,
            rtol=max(tolerance, 1e-13),
            atol=tolerance * task.scale,
            **jac,
        )
        task.keep(done.t, done.y.T)
        crossings = [
            (t, k, c, np.sign(task.rhs.deflection(t, y)[1][k]))
            for (k, c), times, states in zip(watched, done.t_events, done.y_events, strict=True)
            for t, y in zip(times, states, strict=True)
            if t > 0
        ]
        for t, k, c, direction in sorted(crossings, key=lambda crossing: crossing[0]):
            task.cross(float(t), k, c, int(direction) or 1)
        if done.status < 0:
            raise GaveUp(done.message)

    return timed(work)


def scipy_restarted(method: str, tolerance: float) -> Callable[[str], Outcome]:
    """SciPy from corner to corner."""

    def work(task: Task) -> None:
        from scipy.integrate import solve_ivp

        time, y, first = 0.0, task.rhs.START, task.rhs.TIMES[1] / FIRST
        shortest = SHORTEST * task.rhs.TIMES[1]
        for end in task.legs():
            while time < end:
                ways = task.ways()
                events = []
                for k, c, direction in ways:
                    events.append(lambda t, y, k=k, c=c: task.distance(t, y, k, c))
                    events[-1].terminal, events[-1].direction = True, direction  # type: ignore[attr-defined]
                more: dict[str, Any] = {"first_step": min(first, end - time)}
                if method in ("Radau", "LSODA"):
                    index = task.index.copy()
                    more["jac"] = lambda t, y, index=index: task.rhs.jacobian(t, y, index)
                wanted = task.samples(time, end)
                grid = np.unique(np.append(wanted, end))
                done = solve_ivp(
                    task.smooth, (time, end), y, method, t_eval=grid, events=events or None,
                    rtol=max(tolerance, 1e-13), atol=tolerance * task.scale, **more,
                )  # fmt: skip
                if done.status < 0:
                    raise GaveUp(done.message)
                stop = end if done.status == 0 else max(float(t.max()) for t in done.t_events if t.size)
                if done.status == 1 and stop == time:
                    first /= 10
                    if first < shortest:
                        raise GaveUp(f"stalls on a corner at {time:.9g}")
                    continue
                if len(done.t):
                    kept = np.isin(done.t, wanted)
                    task.keep(done.t[kept], done.y.T[kept])
                first = task.rhs.TIMES[1] / FIRST
                if done.status == 0:
                    time, y = end, done.y[:, -1]
                    continue
                for (k, c, direction), times, states in zip(ways, done.t_events, done.y_events, strict=True):
                    if times.size:
                        time, y = float(times[-1]), states[-1]
                        task.cross(time, k, c, direction)

    return timed(work)


def cvode(method: str, tolerance: float) -> Callable[[str], Outcome]:
    """SUNDIALS CVODE by scikit-sundae, from corner to corner."""

    def work(task: Task) -> None:
        from sksundae.cvode import CVODE

        def field_(t: float, y: Any, dy: Any) -> None:
            dy[:] = task.smooth(t, y)

        def matrix(t: float, y: Any, _dy: Any, out: Any) -> None:
            out[:, :] = task.rhs.jacobian(t, y, task.index)

        time, y = 0.0, task.rhs.START
        for end in task.legs():
            while time < end:
                ways = task.ways()
                more = {"eventsfn": _distances(task, ways), "num_events": len(ways)} if ways else {}
                solver = CVODE(
                    field_, method=method, rtol=tolerance, atol=tolerance * task.scale, jacfn=matrix,
                    max_num_steps=10**8, **more,
                )  # fmt: skip
                solver.init_step(time, y)
                wanted = task.samples(time, end)
                for target in np.unique(np.append(wanted, end)):
                    piece = solver.step(target, tstop=target)
                    if piece.status < 0:
                        raise GaveUp(piece.message)
                    time, y = float(piece.t), piece.y.copy()
                    if piece.status == 2:
                        for way, met in zip(ways, piece.i_events[-1], strict=True):
                            if met == way[2]:
                                task.cross(time, *way)
                        break
                    if target in wanted:
                        task.keep([time], [y])

    return timed(work)


def _distances(task: Task, ways: list[tuple[int, int, int]]) -> Any:
    """The event function of scikit-sundae for the ways out of a region."""

    def distance(t: float, y: Any, out: Any) -> None:
        delta = task.rhs.deflection(t, y)[0]
        for i, (k, c, _) in enumerate(ways):
            out[i] = delta[k] - task.rhs.CORNERS[k, c]

    distance.terminal = [True] * len(ways)  # type: ignore[attr-defined]
    distance.direction = [way[2] for way in ways]  # type: ignore[attr-defined]
    return distance


def heyoka(tolerance: float) -> Callable[[str], Outcome]:
    """Taylor series with terminal events; laws are run-time parameters. It counts steps, not right-hand sides."""

    def work(task: Task) -> None:
        import heyoka as hy

        m = task.rhs
        n, elements = m.INERTIA.size, len(m.ELEMENTS)
        q, v = (hy.make_vars(*(f"{letter}{i}" for i in range(n))) for letter in "qv")
        if n == 1:
            q, v = [q], [v]
        waves = [[hy.expression(0.0)] for _ in range(elements)]
        rates = [[hy.expression(0.0)] for _ in range(elements)]
        for k, order, amplitude, phase in m.ERROR.T:
            angle = order * m.SPEED * hy.time + phase
            waves[int(k)].append(amplitude * hy.sin(angle))
            rates[int(k)].append(amplitude * order * m.SPEED * hy.cos(angle))
        delta = [
            hy.sum([w * x for w, x in zip(m.ROWS[k], q, strict=True) if w] + [-x for x in waves[k]])
            for k in range(elements)
        ]
        rate = [
            hy.sum([w * x for w, x in zip(m.ROWS[k], v, strict=True) if w] + [-x for x in rates[k]])
            for k in range(elements)
        ]
        force = [hy.par[3 * k] * delta[k] + hy.par[3 * k + 1] * rate[k] + hy.par[3 * k + 2] for k in range(elements)]
        push = [[hy.par[3 * elements + 2 * i] + hy.par[3 * elements + 2 * i + 1] * hy.time] for i in range(n)]
        for i, order, amplitude, phase in m.HARMONICS.T:
            push[int(i)].append(amplitude * hy.sin(order * m.SPEED * hy.time + phase))
        equations = list(zip(q, v, strict=True))
        for i in range(n):
            terms = push[i] + [-m.DRAG[i] * v[i]] + [-m.ROWS[k, i] * force[k] for k in range(elements) if m.ROWS[k, i]]
            equations.append((v[i], hy.sum(terms) / m.INERTIA[i]))

        def parameters(t: float) -> list[float]:
            laws = [float(m.LAWS[j, k, task.index[k]]) for k in range(elements) for j in range(3)]
            means = []
            for i in range(n):
                mean, slope = float(m.MEAN[i]), 0.0
                for body, begin, over, change in m.RAMPS:
                    if body == i and begin <= t < begin + over:
                        slope += change / over
                        mean -= begin * change / over
                    elif body == i and t >= begin + over:
                        mean += change
                means += [mean, slope]
            return laws + means

        def callback(k: int, c: int) -> Callable[[Any, int], bool]:
            def crossed(integrator: Any, sign: int) -> bool:
                if (task.index[k] == c) == (sign > 0) and task.index[k] in (c, c + 1):
                    task.cross(integrator.time, k, c, sign)
                    integrator.pars[:] = parameters(integrator.time)
                return True

            return crossed

        cooldown = 1e-9 * m.TIMES[1]
        events = [
            hy.t_event(delta[k] - float(m.CORNERS[k, c]), callback=callback(int(k), int(c)), cooldown=cooldown)
            for k, c in m.WATCHED
        ]
        integrator = hy.taylor_adaptive(
            equations, list(m.START), t_events=events, pars=parameters(0.0), tol=tolerance, compact_mode=n > 2
        )
        began = process_time()
        end = 0.0
        for leg in task.legs():
            integrator.pars[:] = parameters(end)
            wanted = task.samples(end, leg)
            for target in np.unique(np.append(wanted, leg)):
                outcome = integrator.propagate_until(target)
                task.outcome.steps += outcome[3]
                if outcome[0] != hy.taylor_outcome.time_limit:
                    raise GaveUp(f"heyoka stopped: {outcome[0]}")
                if target in wanted:
                    task.keep([target], [integrator.state.copy()])
            end = leg
        task.outcome.seconds = process_time() - began

    return timed(work)


def ross(share: float) -> Callable[[str], Outcome]:
    """ROSS's Newmark integrator with the matrices of the region that the last step ended in.

    It begins at rest in zero, so that it gets y = q - q(0) - q'(0) t. Its step is a whole part of a sample, at most
    ``share``/max |lambda|.
    """

    def work(task: Task) -> None:
        from ross.utils import newmark

        m = task.rhs
        n = m.INERTIA.size
        outer = np.isfinite(m.CORNERS).sum(axis=1)
        fastest = max(np.abs(np.linalg.eigvals(m.jacobian(0.0, m.START, i))).max() for i in (outer, task.index))
        parts = int(np.ceil(m.TIMES[1] * fastest / share))
        time = m.TIMES[1] / parts * np.arange(parts * (m.TIMES.size - 1) + 2)
        mass = np.diag(m.INERTIA)
        places: Any = m.region

        def equations(step: int, y: Any, ydot: Any, **_: Any) -> Any:
            drift = m.START[:n] + m.START[n:] * time[step]
            state = np.concatenate([m.START[:n] + m.START[n:] * time[step - 1] + y, m.START[n:] + ydot])
            if step > 1:
                _follow(task, time[step - 1], places(time[step - 1], state))
            if (step - 1) % parts == 0 and step > 1:
                task.keep([time[step - 1]], [state])
            task.smooth(time[step], state)
            k, c, f = m.LAWS[:, m.ALL, task.index]
            error, rate = np.zeros((2, len(m.ELEMENTS)))
            if m.ERROR.size:
                value, change = m._waves(time[step], m.ERROR)
                element = m.ERROR[0].astype(int)
                error, rate = np.bincount(element, value, k.size), np.bincount(element, change, k.size)
            force = k * (m.ROWS @ drift - error) + c * (m.ROWS @ m.START[n:] - rate) + f
            damping = (m.ROWS.T * c) @ m.ROWS + np.diag(m.DRAG)
            push = m.torque(time[step]) - m.DRAG * m.START[n:] - m.ROWS.T @ force
            return mass, damping, (m.ROWS.T * k) @ m.ROWS, push

        newmark(equations, time, n, tol=1e-10)

    return timed(work)


def _follow(task: Task, time: float, index: Any) -> None:
    """Note what corners lie between the regions of two steps, in order from the first."""
    for k in np.flatnonzero(index != task.index):
        while task.index[k] != index[k]:
            up = index[k] > task.index[k]
            task.cross(float(time), int(k), int(task.index[k]) - (0 if up else 1), 1 if up else -1)


def ours(algorithm: str, tolerance: float | None) -> Callable[[str], Outcome]:
    """gearrattle on its model file."""

    def run(name: str) -> Outcome:
        import gearrattle as gr

        m = load(name)
        model = gr.load(HOME / name / "model.toml")
        settings = {} if tolerance is None else {"tolerance": tolerance}
        began = process_time()
        try:
            done = gr.simulate(model, algorithm, audit=False, **settings)
        except gr.GearRattleError as why:
            return Outcome([0.0], [m.START], [], 0, 0, process_time() - began, " ".join(str(why).split())[:120])
        seconds = process_time() - began
        states = np.hstack([done.data.angle.values, done.data.velocity.values])[: m.TIMES.size]
        events = [
            (float(t), str(k), int(a), int(b))
            for t, k, a, b in done.events[["time", "clearance", "from_region", "to_region"]].itertuples(index=False)
            if t <= m.TIMES[-1]
        ]
        steps = int(done.cost.steps) if algorithm == "exact" else 0
        calls = 0 if steps else int(done.cost.function_calls)
        return Outcome(list(m.TIMES), list(states), events, calls, steps, seconds)

    return run


def solvers() -> list[Solver]:
    """All rows of the table."""
    rows = [Solver("gearrattle exact", "gearrattle", "default", ours("exact", None))]
    rows += [
        Solver(f"gearrattle {name}", "gearrattle", f"{TOLERANCE:g}", ours(name, TOLERANCE))
        for name in ("rkf", "rkv", "adams", "gear", "bulirsch-stoer", "rkv-events", "gear-events", "dop853", "radau")
    ]
    rows += [Solver(f"gearrattle {name}", "gearrattle", "default step", ours(name, None)) for name in ("rk2", "rk4")]
    rows += [Solver("heyoka, events", "heyoka", f"{e:g}", heyoka(e)) for e in (TOLERANCE, 1e-14)]
    rows += [
        Solver(f"SciPy {method}", "scipy", f"{TOLERANCE:g}", scipy_plain(method, TOLERANCE))
        for method in ("RK45", "DOP853", "LSODA", "Radau")
    ]
    rows += [
        Solver(f"SciPy {method}, restarted", "scipy", f"{e:g}", scipy_restarted(method, e))
        for method, e in (
            ("RK45", TOLERANCE),
            ("DOP853", TOLERANCE),
            ("DOP853", 1e-12),
            ("LSODA", TOLERANCE),
            ("Radau", TOLERANCE),
        )
    ]
    rows += [
        Solver(f"CVODE {method}, restarted", "scikit-sundae", f"{TOLERANCE:g}", cvode(method, TOLERANCE))
        for method in ("Adams", "BDF")
    ]
    rows.append(Solver("ROSS Newmark", "ross-rotordynamics", "step 0.05/fastest", ross(0.05)))
    return rows
