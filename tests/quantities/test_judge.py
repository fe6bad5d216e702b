"""The verdict: its rule, its order, its words, its JSON."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from gearrattle.errors import ModelError
from gearrattle.quantities.evaluation import judge
from gearrattle.quantities.quantity_table import CRITERIA
from gearrattle.quantities.verdict_parts import rule_of
from gearrattle.trajectory import Layout, NegligibleImpacts
from tests import synthetic
from tests.signals.handmade import Row, chain, layout, sine, staged, still, trajectory, two_gaps


@pytest.mark.parametrize("kind", synthetic.DEFLECTIONS)
def test_known_motions(kind: str) -> None:
    verdict = judge(synthetic.trajectory(kind))
    assert verdict.verdict == kind
    assert verdict.rule == rule_of(NegligibleImpacts())
    assert {part.name for part in verdict.parts} == {"clutch", "spline", "gear"}
    assert verdict.parts[0].regime == kind
    assert {item.name for item in verdict.entries} == {criterion.name for criterion in CRITERIA}


def test_part_of_a_mesh() -> None:
    rows: list[Row] = [
        (1.0, 0, 0, 1, 0.5, 0.0),
        (1.5, 0, 1, 0, -0.5, 3.0),
        (2.0, 0, 0, -1, -1.0, 3.0),
        (2.5, 0, -1, 0, 1.0, 2.0),
    ]
    (part,) = judge(trajectory(rows=rows, accelerations=(sine(4.0), still))).parts
    assert (part.name, part.kind, part.gap, part.regime) == ("gear", "mesh", True, "double-sided")
    assert (part.impacts_per_cycle, part.impacts_per_second) == (0.5, 0.5)
    assert (part.drive_impacts_per_cycle, part.coast_impacts_per_cycle) == (0.25, 0.25)
    assert (part.mean_contact_impulse, part.max_contact_impulse, part.max_approach_speed) == (2.0, 3.0, 1.0)
    assert part.max_impact_energy == pytest.approx(0.5 / 0.0026, rel=1e-14)
    assert (part.impulse_unit, part.energy_unit, part.speed_unit) == ("N s", "J", "m/s")
    assert part.contact_share == 0.25
    assert part.margin_db == pytest.approx(20 * math.log10(2.0), rel=1e-13)


def test_parts_count_the_steady_impacts_only() -> None:
    rows = chain([0, 1, 0, 1, 0, 1, 0], [0.1, 0.2, 0.3, 0.4, 2.5, 3.0])
    (part,) = judge(trajectory(rows=rows, cycles=4, discard=2)).parts
    assert (part.impacts_per_cycle, part.contact_share) == (0.5, 0.25)


def test_double_sided_is_worse_than_single_sided_however_frequent() -> None:
    often = chain([0, 1, 0, 1, 0, 1, 0], [0.1, 0.2, 0.3, 0.4, 0.5, 0.6], clearance=0)
    rarely = chain([0, 1, 0, -1, 0], [1.1, 1.2, 1.3, 1.4], clearance=1)
    verdict = judge(trajectory(two_gaps(), sorted(often + rarely)))
    assert [part.name for part in verdict.parts] == ["gear", "spring"]
    assert verdict.verdict == "double-sided"


def test_same_regime_is_ranked_by_rate() -> None:
    once = chain([0, 1, 0], [0.1, 0.2], clearance=0)
    twice = chain([0, -1, 0, -1, 0], [0.3, 0.4, 0.5, 0.6], clearance=1)
    verdict = judge(trajectory(two_gaps(), sorted(once + twice)))
    assert [part.name for part in verdict.parts] == ["gear", "spring"]
    assert verdict.verdict == "single-sided"


def test_mesh_without_a_gap_is_a_quiet_part_with_its_margin() -> None:
    plate = staged([-1.0, 1.0], -1, [5.0, 1.0, 5.0])
    verdict = judge(trajectory(plate, accelerations=(sine(4.0), still)))
    gear = next(part for part in verdict.parts if part.name == "gear")
    assert (gear.regime, gear.contact_share, gear.gap) == ("quiet", 1.0, False)
    assert gear.margin_db == pytest.approx(20 * math.log10(2.0), rel=1e-13)
    assert "gear stays in contact." in verdict.sentence


def test_the_larger_margin_of_two_loose_gears_counts() -> None:
    plate = layout(
        element_names=("gear",),
        is_mesh=np.array([True]),
        between=np.array([[0, 1]]),
        radii=np.array([[0.05, 0.05]]),
        clearance=np.array([0]),
        drag_torque=np.array([1.0, 1.0]),
    )
    (part,) = judge(trajectory(plate, accelerations=(sine(4.0), sine(8.0)))).parts
    assert part.margin_db == pytest.approx(20 * math.log10(2.0 * 8.0), rel=1e-12)


def test_nothing_that_could_rattle() -> None:
    plate = layout(
        element_names=("spring",),
        is_mesh=np.array([False]),
        between=np.array([[0, 1]]),
        radii=np.array([[1.0, 1.0]]),
        clearance=np.empty(0, dtype=np.int64),
        corners=(),
        region_of_first_piece=np.empty(0, dtype=np.int64),
        stiffness_of_piece=(),
        damping_of_piece=(),
    )
    verdict = judge(trajectory(plate))
    assert (verdict.verdict, verdict.parts) == ("quiet", ())
    assert verdict.sentence == "There is no mesh and no clearance: nothing can rattle."


def test_sentence_of_rattle() -> None:
    rows: list[Row] = [
        (1.0, 0, 0, 1, 0.5, 0.0),
        (1.5, 0, 1, 0, -0.5, 3.0),
        (2.0, 0, 0, -1, -1.0, 3.0),
        (2.5, 0, -1, 0, 1.0, 2.0),
    ]
    verdict = judge(trajectory(rows=rows, accelerations=(sine(4.0), still)))
    assert str(verdict) == (
        "double-sided: Rattle over the 4 cycles judged: gear hits both flanks, 0.5 impacts per cycle, approach speed "
        "up to 1 m/s, impact energy up to 192 J, in contact 25 % of the time."
    )


@pytest.mark.parametrize(
    ("plate", "regions", "words"),
    [
        (layout(), [0, -1, 0], "gear hits its coast flank only, 0.25 impacts per cycle"),
        (layout(), [1, 0], "gear leaves contact and does not hit again"),
        (layout(), [0], "Quiet over the 4 cycles judged: gear floats free in its gap"),
        (
            staged([-1.0, 1.0], -1, [5.0, 1.0, 5.0]),
            [0, 1, 0],
            "No gap rattles over the 4 cycles judged. Spring changes",
        ),
        (staged([-1.0, 1.0], -1, [5.0, 1.0, 5.0]), [0, 1, 0, -1], "changes stage on both sides, entering an outer"),
        (staged([-1.0, 1.0], -1, [5.0, 0.0, 5.0]), [0, 1, 0], "spring hits its drive side only"),
        (staged([-1.0, 1.0], -1, [5.0, 1.0, 5.0]), [0], "spring stays in its first stage"),
        (staged([-1.0, 1.0], -1, [5.0, 1.0, 5.0]), [1], "spring stays in an outer stage"),
        (staged([-1.0, 0.0, 1.0], -2, [5.0, 1.0, 2.0, 5.0]), [0, -1], "spring stays in its first stage"),
    ],
)
def test_sentence_tells_where(plate: Layout, regions: list[int], words: str) -> None:
    times = [0.5 * (k + 1) for k in range(len(regions) - 1)]
    assert words in judge(trajectory(plate, chain(regions, times), initial=regions[:1])).sentence


def test_notes_are_said_once() -> None:
    verdict = judge(trajectory(accelerations=(sine(4.0), sine(1.0)), cycles=4))
    assert len(verdict.notes) == len(set(verdict.notes))
    assert [note for note in verdict.notes if note.startswith("transmissibility")] == [
        "transmissibility over fewer than 8 cycles: 4 cycles remain after the discarded ones"
    ]


def test_dictionary_is_pure_json_without_numbers_that_are_none() -> None:
    verdict = judge(trajectory(rows=[(0.5, 0, 0, 1, 0.5, math.nan)], final=math.nan, cycles=2, samples=1))
    text = json.dumps(verdict.to_dict(), allow_nan=False)
    read = json.loads(text)
    words = {"verdict", "severity", "headline", "sentence", "rule"}
    assert set(read) == words | {"negligible", "parts", "entries", "notes", "window"}
    assert read["window"] == {"start": 0.0, "end": 2.0, "cycles": 2}
    assert read["parts"][0]["mean_contact_impulse"] is None
    assert read["parts"][0]["margin_db"] is None  # the driver is at rest: minus infinity
    assert any(item["value"] is None for item in read["entries"])


def test_numpy_integers_for_cycles_stay_json() -> None:
    motion = trajectory(cycles=np.int64(4), discard=np.int64(1))
    assert json.loads(json.dumps(judge(motion).to_dict()))["window"]["cycles"] == 3


def test_a_model_without_units_has_units_of_one() -> None:
    verdict = judge(synthetic.trajectory(), units="dimensionless")
    assert {item.unit for item in verdict.entries} == {"", "1", "1/cycle", "dB"}
    assert {part.impulse_unit for part in verdict.parts} == {"1"}
    assert "N s" not in verdict.sentence


def test_entries_of_one_criterion_and_subject() -> None:
    verdict = judge(synthetic.trajectory())
    assert {item.name for item in verdict.of("contact")} == {"contact"}
    assert [item.value for item in verdict.of("regime", "gear")] == ["double-sided"]


def test_nothing_left_to_judge() -> None:
    with pytest.raises(ModelError, match="at least one cycle must remain"):
        judge(trajectory(cycles=2, discard=2))
