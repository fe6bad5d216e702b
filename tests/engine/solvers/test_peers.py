"""Each peer of the benchmark, where installed, agrees with ``exact`` on the first cycle of loaded case 2."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks.peers.cvode import ADAMS, BDF
from benchmarks.peers.exact import EXACT
from benchmarks.peers.fixed_step import RK2, RK4
from benchmarks.peers.plant import plant
from benchmarks.peers.scipy_ivp import DOP853, RADAU
from benchmarks.peers.sundae import SUNDAE
from benchmarks.peers.taylor import AUTOMATIC, HEYOKA

pytestmark = pytest.mark.compiled

TRIED = [
    (RK2, "0.001/150 s", 3e-3),
    (RK4, "0.002/150 s", 3e-3),
    (HEYOKA, "1e-10", 1e-9),
    (ADAMS, "1e-10", 1e-6),
    (BDF, "1e-10", 1e-6),
    (SUNDAE, "1e-10", 1e-6),
    (DOP853, "1e-10", 1e-8),
    (RADAU, "1e-08", 1e-6),
]


@pytest.mark.parametrize(("peer", "setting", "error"), TRIED, ids=[peer.name for peer, _, _ in TRIED])
def test_agrees_over_the_first_cycle(peer, setting, error):
    if not peer.version:
        pytest.skip(f"{peer.package} is not installed: pip install '.[peers]'")
    case = plant("case2_loaded")
    ours = EXACT.build(case).run(1)
    theirs = peer.build(case, **dict(peer.settings)[setting]).run(1)
    assert theirs.events in (ours.events, -1)
    assert np.allclose(theirs.deflection, ours.deflection, rtol=0, atol=error)


def test_the_automatic_cooldown_of_a_loose_tolerance_loses_crossings():
    pytest.importorskip("heyoka")
    case = plant("case3_loaded")
    assert HEYOKA.build(case, 1e-4, cooldown=AUTOMATIC).run(4).events < EXACT.build(case).run(4).events / 2
