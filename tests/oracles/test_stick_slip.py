"""The program against fifty digits on random drivelines with friction and clipped damping; the oracle against V10."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mpmath import mp, mpf

import gearrattle as gr
from tests.oracles.dressed import FAMILIES, dressed_problem, hold, switch_faults
from tests.oracles.driveline import Body, Coupling, Driveline
from tests.oracles.fixed_point import real
from tests.oracles.stick_slip import solve

RIGHT_ANGLE = "1.57079632679489661923132169163975144209858469968755291048747229615390820314310449931"
EIGHTH = "0.392699081698724154807830422909937860524646174921888227621868074038477050785776124828"
SECOND = "6.28318530717958647692528676655900576839433879875021164194988918461563281257241799725606965"


def backlash() -> Driveline:
    """Modelica ``Rotational.Examples.Backlash`` (VALIDATION V10)."""
    gap = Coupling("gap", ("x", "ground"), "2e4", "50", EIGHTH, contact_damping="clipped")
    return Driveline("V10", (Body("x", "5"),), (gap,), speed=SECOND, angle=(RIGHT_ANGLE,), velocity=("0",))


def test_v10_end_state_and_region_changes():
    exact = solve(backlash(), 1, 50)
    assert len(exact.events) + len(exact.switches) == 42
    with mp.workdps(50):  # the digits printed are right to some 1e-15
        assert abs(real(exact.angle[-1][0]) - mpf("-0.155581413573607560")) < 3e-15
        assert abs(real(exact.velocity[-1][0]) - mpf("-7.02293727583834856")) < 3e-15
    run = gr.simulate(gr.loads(backlash().toml()), cycles=1, samples_per_cycle=50, discard=0)
    assert run.data.angle.values[-1, 0] == pytest.approx(-0.155581413573607560, abs=1e-13)
    assert run.data.velocity.values[-1, 0] == pytest.approx(-7.02293727583834856, abs=1e-12)
    assert len(run.trajectory.auxiliaries.passages.time) == 42
    assert not switch_faults(run, exact)
    assert np.abs(run.data.angle.values[:, 0] - exact.array("angle")[:, 0]).max() < 1e-13


def test_a_missing_switch_is_noticed():
    """The comparison itself: one switch taken out of the solution, and one moved."""
    exact = solve(backlash(), 1, 4)
    run = gr.simulate(gr.loads(backlash().toml()), cycles=1, samples_per_cycle=4, discard=0)
    switch = exact.switches.pop(3)
    assert switch_faults(run, exact)
    exact.switches.insert(3, switch._replace(time=switch.time * 1001 // 1000))
    assert switch_faults(run, exact)
    exact.switches[3] = switch
    assert not switch_faults(run, exact)


SLOW = ("everything", "half-order", "tree")


@pytest.mark.parametrize(
    "family", [pytest.param(name, marks=pytest.mark.long) if name in SLOW else name for name in FAMILIES]
)
def test_random_driveline(family):
    problem = dressed_problem(family, 0)
    outcome, exact = hold(replace(problem, cycles=1))
    assert outcome.worst < 1e-9
    assert exact.events or exact.switches


@pytest.mark.long
@pytest.mark.parametrize("seed", range(41))
@pytest.mark.parametrize("family", FAMILIES)
def test_many_random_drivelines(family, seed):
    hold(dressed_problem(family, seed))
