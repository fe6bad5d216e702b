"""V5: a preloaded pair under a sine stays in contact iff Fa <= Fm sqrt((1 - Om^2)^2 + (2 zeta Om)^2).

The start lies on the steady contact solution, so that there is no transient: the least distance from the corner is
known in closed form, and pairs of loads that just touch and just miss differ by a stated part of it.
"""

from __future__ import annotations

import pytest
from mpmath import mp, mpf

import gearrattle as gr
from tests.literature import systems

ZETA, MEAN = "0.05", "0.1"
CASES = [("0.5", "0.300665927567458"), ("0.9", "0.0259553037550971"), ("2", "0.0751664818918646")]


def threshold(order: str) -> mpf:
    om = mpf(order)
    return mpf(MEAN) * mp.sqrt((1 - om**2) ** 2 + (2 * mpf(ZETA) * om) ** 2)


def events(order: str, relative: str, cycles: int = 20):
    """Run from the steady contact solution with the threshold load times (1 + relative)."""
    with mp.workdps(40):
        om = mpf(order)
        load = mp.nstr(threshold(order) * (1 + mpf(relative)), 25)
        response = mpf(load) / (1 - om**2 + 2j * mpf(ZETA) * om)
        angle = mp.nstr(1 + mpf(MEAN) + response.imag, 25)
        velocity = mp.nstr(om * response.real, 25)
    model = systems.loose_pair(order, load).start((angle,), (velocity,))
    run = gr.simulate(gr.loads(model.toml()), algorithm="exact", cycles=cycles, samples_per_cycle=16, discard=0)
    return run.events


@pytest.mark.parametrize(("order", "printed"), CASES)
def test_printed_thresholds(order, printed):
    with mp.workdps(40):
        assert abs(threshold(order) / mpf(order) ** 2 / mpf(printed) - 1) < 1e-14


@pytest.mark.parametrize("relative", ["-1e-3", "-1e-6", "-1e-8", "-1e-10"])
@pytest.mark.parametrize("order", [case[0] for case in CASES])
def test_just_misses(order, relative):
    assert len(events(order, relative)) == 0


@pytest.mark.parametrize("relative", ["1e-3", "1e-6", "1e-8", "1e-10"])
@pytest.mark.parametrize("order", [case[0] for case in CASES])
def test_just_touches(order, relative):
    log = events(order, relative)
    assert len(log) >= 2
    assert list(log["from_region"][:2]) == [1, 0]
    assert list(log["to_region"][:2]) == [0, 1]
    with mp.workdps(40):  # the first visit: x = 1.1 + A sin(Om t + phi) < 1 once a cycle, about its lowest point
        om, excess = mpf(order), mpf(relative)
        phase = mp.arg(1 / (1 - om**2 + 2j * mpf(ZETA) * om))
        lowest = mp.fmod(3 * mp.pi / 2 - phase, 2 * mp.pi) / om
        enters = lowest - mp.acos(1 / (1 + excess)) / om
        speed = mpf(MEAN) * (1 + excess) * om * mp.sin(mp.acos(1 / (1 + excess)))
    assert log["velocity"][0] == pytest.approx(-float(speed), abs=1e-15 / float(speed) + 1e-12)
    assert log["time"][0] == pytest.approx(float(enters), abs=1e-14 / float(speed))
