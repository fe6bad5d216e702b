"""What a call treats does not grow with the regions that a motion visits: work is counted, not seconds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from importlib import import_module
from typing import Any

import pytest
from benchmarks.growth.models import gearbox

import gearrattle as gr
from gearrattle.advice.other_motions_advice import ADVISED, PILOTS, SMALL, others_of
from gearrattle.advice.pilot import run_pilot
from gearrattle.analysis.contact_ratios.forecast import Linearisation
from gearrattle.analysis.stiffness import regions_visited
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.solvers.step_stability import most_regions
from gearrattle.engine.system.perturbations import Perturbed
from gearrattle.orbits.settling_limits import BLOCK
from gearrattle.signals import dwell_of_regions
from gearrattle.simulation.settings import settled

SIZES = ((4, 2), *(pytest.param(*size, marks=pytest.mark.long) for size in ((16, 8), (64, 20), (128, 64))))


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """How often eigenvalues of a region, frequencies of a contact state and gains of a linearisation are found."""
    count: Counter[str] = Counter()

    def watch(position: str, word: str) -> None:
        module, name = position.rsplit(".", 1)
        home = import_module(module)
        original: Callable[..., Any] = getattr(home, name)

        def counted(*arguments: Any, **named: Any) -> Any:
            count[word] += 1
            return original(*arguments, **named)

        monkeypatch.setattr(home, name, counted)

    watch("gearrattle.analysis.stiffness.eigenvalues_of", "eigenvalues")
    watch("gearrattle.reductions.accuracy.paired", "contact states")
    answer = Linearisation.answer

    def counted(self: Linearisation, shares: Any) -> Any:
        count["gains"] += 1
        return answer(self, shares)

    monkeypatch.setattr(Linearisation, "answer", counted)
    return count


@pytest.mark.parametrize(("n", "clearances"), SIZES)
def test_advice_treats_a_bounded_number_of_systems(n: int, clearances: int, calls: Counter[str]) -> None:
    model = gearbox(n, clearances, cycles=4)
    gr.advise(model)
    assert 0 < calls["eigenvalues"] <= most_regions(2 * n - 1) + 3
    assert 0 < calls["contact states"] <= 8000
    assert calls["contact states"] * n**3 <= 3e9
    assert 0 < calls["gains"] <= 1000


@pytest.mark.parametrize(("n", "clearances"), SIZES)
def test_other_motions_follow_a_bounded_number_of_periods(
    n: int, clearances: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In function calls times the square of the size, with no more than twice the pilot's periods in any case."""
    model = settled(gearbox(n, clearances, cycles=8), {})
    pilot = run_pilot(model, 8)
    followed = Counter[str]()
    marched = PeriodMap.marched

    def counted(self: PeriodMap, state: Any, passes: int = 1, *rest: Any, **named: Any) -> Any:
        followed["periods"] += BLOCK if passes == BLOCK else 0
        return marched(self, state, passes, *rest, **named)

    monkeypatch.setattr(PeriodMap, "marched", counted)
    others_of(model, pilot, is_asked=True)
    cycles = pilot.run.trajectory.cycles
    a_period = pilot.run.cost.function_calls / cycles
    allowed = ADVISED / max(1.0, n / SMALL) ** 2 / a_period
    assert followed["periods"] <= max(allowed, 0.1 * cycles, PILOTS * cycles)


def test_regions_beyond_those_treated_are_counted_and_said() -> None:
    run = gr.simulate(gearbox(64, 20), cycles=8, discard=2, audit=False)
    visited, dwell = regions_visited(run), dwell_of_regions(run.trajectory)
    assert visited.count == len(dwell) > len(visited.regions) == most_regions(2 * 64 - 1)
    longest = sorted(dwell.values(), reverse=True)[: len(visited.regions)]
    share = sum(longest) / sum(dwell.values())
    assert sum(region.share for region in visited.regions) == pytest.approx(share, rel=1e-12)
    assert visited.words == (
        f"the {len(longest)} regions visited longest, {100.0 * share:.3g} % of the time, of {len(dwell)} visited"
    )


def test_the_gradient_of_a_large_driveline_keeps_no_table_of_a_region() -> None:
    variation = gr.simulate(gearbox(64, 20), cycles=2, discard=0, audit=False).variation
    assert isinstance(variation, Perturbed)
    held = sum(array.nbytes for array in (*variation.regions, *variation.path))
    intervals = len(variation.path.duration)
    assert held <= 64 * intervals * len(variation.scale)


def test_progress_rises_in_every_part_of_advice() -> None:
    reports: list[float] = []
    gr.advise(gearbox(4, 2, cycles=4), progress=reports.append)
    assert reports == sorted(reports)
    assert reports[-1] == 1.0
    assert {int(7.0 * share + 1e-9) for share in reports} >= set(range(7))


def test_advice_can_be_stopped_in_every_part() -> None:
    class Stop(Exception):
        pass

    for part in range(7):

        def stop(share: float, part: int = part) -> None:
            if 7.0 * share + 1e-9 >= part:
                raise Stop

        with pytest.raises(Stop):
            gr.advise(gearbox(4, 2, cycles=2), progress=stop)
