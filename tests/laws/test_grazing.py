"""Near-grazing pairs: one driveline just touches a corner, its twin just misses it, by a stated part of the clearance.

The largest deflections were found by the oracle (``oracles.grazing``) with the corner out of reach, to 25 digits. The
touching twin must log the crossing out and back, the missing one none, and both must follow the fifty-digit motion.
"""

from __future__ import annotations

from math import sqrt

import pytest
from mpmath import mp, mpf

from tests.laws.motion import crossings, simulate
from tests.oracles.compare import assert_exact
from tests.oracles.driveline import Body, Coupling, Driveline, Harmonic, Torque
from tests.oracles.grazing import largest_deflection, with_gap
from tests.oracles.random_drivelines import random_problem

PEAKS = [
    ("undamped", 200, 1, "0.3750307553986829659130851"),
    ("everything", 201, 0, "0.295750244466810611146567"),
    ("tree", 203, 0, "22.83295080652783386020725"),
    ("static", 203, 0, "0.9024624371277878369462404"),
    ("half-order", 204, 1, "5.734697712231299417344912"),
    ("free-flight", 205, 0, "1.145350553631070264834482"),
    ("chain", 209, 1, "0.4940147266916857753585564"),
    ("mesh", 211, 0, "0.5069256493750360716166678"),
]
"""Family, seed, element, largest |delta| of that element over two periods."""

CYCLES = 2
peaks = pytest.mark.parametrize(("family", "seed", "element", "peak"), PEAKS)


def twin(family: str, seed: int, element: int, peak: str, part: str) -> Driveline:
    with mp.workdps(50):
        half = mp.nstr(mpf(peak) * (1 + mpf(part)), 30)
    return with_gap(random_problem(family, seed).model, element, half)


def visits(model: Driveline, element: int) -> list[tuple[int, int]]:
    return crossings(simulate(model, CYCLES), model.elements[element].name)


@peaks
@pytest.mark.parametrize("part", [pytest.param("1e-6", marks=pytest.mark.long), "1e-10"])
def test_just_touches(family, seed, element, peak, part):
    model = twin(family, seed, element, peak, f"-{part}")
    assert visits(model, element) in ([(0, 1), (1, 0)], [(0, -1), (-1, 0)])
    assert_exact(model, CYCLES, 12)


@peaks
@pytest.mark.parametrize("part", [pytest.param("1e-6", marks=pytest.mark.long), "1e-10"])
def test_just_misses(family, seed, element, peak, part):
    model = twin(family, seed, element, peak, part)
    assert visits(model, element) == []
    assert_exact(model, CYCLES, 12)


@peaks
@pytest.mark.parametrize("part", ["1e-7", "1e-8", "1e-9", "1e-11"])
@pytest.mark.long
def test_touches_and_misses_in_between(family, seed, element, peak, part):
    assert len(visits(twin(family, seed, element, peak, f"-{part}"), element)) == 2
    assert visits(twin(family, seed, element, peak, part), element) == []


def test_a_peak_is_what_the_oracle_finds():
    family, seed, element, peak = PEAKS[-1]
    with mp.workdps(50):
        actual, _ = largest_deflection(random_problem(family, seed).model, element, CYCLES)
        assert abs(actual - mpf(peak)) < mpf(10) ** -22


@pytest.mark.parametrize("load", ["0.3", "0.30000001", "0.29999999"])
def test_grazing_at_every_cycle(load):
    """x'' + 0.4 x' + dz(x, 1) = 0.3 + Fa sin(1.7 t): the steady motion touches the corner once a cycle, for ever."""
    om = 1.7
    gain = sqrt((1 - om**2) ** 2 + (0.4 * om) ** 2)
    model = Driveline(
        "grazing",
        (Body("x", "1.0", drag="0.4"),),
        (Coupling("gap", ("x", "ground"), "1.0", clearance="1.0"),),
        torques=(Torque("x", "0.3", (Harmonic("1", repr(float(load) * gain)),)),),
        speed="1.7",
    ).start(("1.3",), ("0.0",))
    run = simulate(model, 400, 4)
    late = run.events[run.events["time"] > 200 * run.data.attrs["period"]]
    if load == "0.29999999":
        assert len(late) == 0
    elif load == "0.30000001":
        assert len(late) == 400
    assert run.data["deflection"].values[-800:].min() >= 0.99
