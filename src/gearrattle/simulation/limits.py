"""Limits of a run, checked before it begins: rates beyond double precision, and memory."""

from __future__ import annotations

import os
from functools import cache

from gearrattle.assembly import Driveline, coordinate_names
from gearrattle.derived_values import kept
from gearrattle.engine.solvers.scheme_choice import is_large
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.wording import counted

FASTEST = 1e15
"""Decays or radians per period: what is as fast as that changes by rounding alone within the rounding of the period."""
_SHARE = 0.5  # of the machine's memory
_MATRICES = 400  # of states x states, that tables take at most: measured 377 with 210 inertias, 325 with 300
_UNKNOWN = 8 << 30  # bytes, where the machine does not say


@kept
def check_rates(driveline: Driveline) -> None:
    """Refuse elements and drags whose own motion is too fast for double precision, and inputs of too high an order; the
    ModelError names every value, and the largest that is taken.
    """
    model = driveline.model
    system = driveline.system
    period = system.inputs.period
    problems = []
    lightness = (system.rows**2 / system.inertia).sum(axis=1)
    for element, law, light in zip(model.elements, system.laws, lightness.tolist(), strict=True):
        for name, power in (("damping", 1), ("stiffness", 2)):
            largest = float(getattr(law, name).max())
            rate = period * (largest * light) ** (1.0 / power)
            if rate > FASTEST:
                most = largest * (FASTEST / rate) ** power
                problems.append(_too_fast(f"{element.path}.{name}", largest, most, rate, period))
    for name, inertia, drag in zip(coordinate_names(model), system.inertia.tolist(), system.drag.tolist(), strict=True):
        if (rate := period * drag / inertia) > FASTEST:
            problems.append(_too_fast(f"inertia.{name}.drag", drag, drag * FASTEST / rate, rate, period))
    problems += _too_high(model, period)
    if problems:
        raise ModelError(problems)


def _too_fast(location: str, value: float, most: float, rate: float, period: float) -> Problem:
    rule = f"what it acts on would change {rate:.3g} times a period of {period:.3g} s; at most {FASTEST:g} are taken"
    remedy = f"{most:.3g} or less in SI units, more inertia, a rigid connection in its place, or a higher speed"
    return Problem(location, f"{value:.6g}", rule, remedy)


def _too_high(model: Model, period: float) -> list[Problem]:
    """Orders whose phase would be lost to rounding within a period."""
    most = FASTEST / (model.excitation.omega * period)
    orders = [
        (f"{kind}.{i}.harmonics.{j}.order", harmonic.order)
        for kind, sines in (
            ("torque", [t.harmonics for t in model.torques]),
            ("motion", [m.harmonics for m in model.motions]),
        )
        for i, harmonics in enumerate(sines)
        for j, harmonic in enumerate(harmonics)
    ]
    orders += [(f"{element.path}: order", error.order) for element in model.elements for error in element.errors]
    rule = f"would turn by more than {FASTEST:g} rad in a period of {period:.3g} s, and its phase be lost to rounding"
    return [
        Problem(location, f"{order:.6g}", rule, f"{most:.3g} or less") for location, order in orders if order > most
    ]


def check_memory(system: PiecewiseSystem, cycles: int, samples_per_cycle: int, location: str) -> None:
    """Refuse a run whose samples, as many as are in memory at a time, would not fit into half of the machine's memory;
    the ModelError names the setting ``location``, what the run would take and what fits.
    """
    need = bytes_of_sample(system) * cycles * samples_per_cycle
    most = _SHARE * memory()
    if need <= most:
        return
    fits = max(1, int(cycles * most / need))
    took = need / 2**30
    available = most / 2**30
    rule = f"{cycles} cycles of {samples_per_cycle} samples would take {took:.3g} GiB of memory"
    rule += f", of {available:.3g} at most"
    fewer = f"{counted(fits, 'cycle')} or fewer, fewer samples_per_cycle"
    remedy = f"{fewer}, or gearrattle stream, which holds a chunk at a time"
    raise ModelError(Problem(location, f"{cycles}", rule, remedy))


@kept
def check_tables(system: PiecewiseSystem) -> None:
    """Refuse ``exact`` for a driveline too large for tables that the sweep does not need (``solvers.scheme_choice``).

    The ModelError says what they would take, and what fits.
    """
    states = 2 * system.size
    most = _SHARE * memory()
    need = 8.0 * _MATRICES * states**2
    if need <= most or is_large(system):
        return
    fits = int(0.5 * (most / (8.0 * _MATRICES)) ** 0.5)
    rule = (
        f"exact needs tables for friction, clipped damping, alternation, inputs over time and elements of three "
        f"bodies; those of {system.size} inertias would take {need / 2**30:.3g} GiB, of {most / 2**30:.3g} at most"
    )
    remedy = f"{fits} inertias or fewer (gearrattle reduce), or none of these: then any number"
    raise ModelError(Problem("inertia", str(system.size), rule, remedy))


def bytes_of_sample(system: PiecewiseSystem) -> int:
    """Memory a sample takes while a run is made into a trajectory, at most, about [bytes]."""
    inputs = 1 + 2 * system.inputs.count + (0 if system.signals is None else system.signals.chain)
    return 8 * (16 * system.size + 16 * len(system.laws) + 4 * len(system.auxiliaries) + 3 * inputs)


@cache
def memory() -> int:
    """Memory of this machine, or what its container may take [bytes]."""
    limits = [_UNKNOWN]
    if hasattr(os, "sysconf") and {"SC_PHYS_PAGES", "SC_PAGE_SIZE"} <= set(os.sysconf_names):
        limits = [os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")]
    for limit in ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"):
        try:
            with open(limit, encoding="ascii") as file:
                limits.append(int(file.read()))
        except (OSError, ValueError):  # none, or "max"
            continue
    return min(size for size in limits if size > 0)
