"""The sketch places every body once and tells what rattles."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from gearrattle.report.plots.placement import place
from gearrattle.report.plots.sketch import sketch
from gearrattle.trajectory import Layout
from tests import synthetic
from tests.signals.handmade import rows_between


def driveline(count: int, elements: list[tuple[int, int, bool]], reference: int = 0) -> Layout:
    between, radii = np.array([(a, b) for a, b, _ in elements], dtype=int).reshape(-1, 2), np.ones((len(elements), 2))
    return replace(
        synthetic.layout(),
        inertia_names=tuple(f"i{k}" for k in range(count)),
        inertia=np.ones(count),
        drag_torque=np.zeros(count),
        element_names=tuple(f"e{k}" for k in range(len(elements))),
        is_mesh=np.array([mesh for _, _, mesh in elements], dtype=bool),
        between=between,
        radii=radii,
        rows=rows_between(between, radii, count),
        clearance=np.array([], dtype=int),
        corners=(),
        reference=reference,
    )


def test_a_chain_stands_on_one_line_and_a_mesh_leads_down() -> None:
    placement = place(synthetic.layout())
    assert placement.bodies == {0: (0, 0), 1: (1, 0), 2: (2, 0), 3: (2, 1)}
    assert placement.seats == {2: (2, 0)}


def test_a_body_with_two_gears_gets_a_longer_shaft() -> None:
    placement = place(driveline(5, [(0, 1, False), (1, 2, True), (1, 3, True), (1, 4, False)]))
    assert placement.seats == {1: (1, 0), 2: (2, 0)}
    assert placement.shafts[1] == 2
    assert (placement.bodies[2], placement.bodies[3]) == ((1, 1), (2, 1))
    assert placement.bodies[4] == (3, 0)


def test_trains_stand_below_each_other_and_ground_has_its_own_cell() -> None:
    placement = place(driveline(3, [(0, -1, False), (1, 2, False)]))
    assert placement.grounds == {0: (1, 0)}
    assert placement.bodies[1][1] > placement.bodies[0][1]


@st.composite
def drivelines(draw: st.DrawFn) -> Layout:
    count = draw(st.integers(1, 9))
    elements = [
        (draw(st.integers(0, k - 1)), k, draw(st.booleans())) for k in range(1, count) if draw(st.integers(0, 9)) > 0
    ]
    for _ in range(draw(st.integers(0, 3))):
        a = draw(st.integers(0, count - 1))
        b = draw(st.integers(-1, count - 1))
        if a != b:
            elements.append((a, b, b >= 0 and draw(st.booleans())))
    return driveline(count, elements, reference=draw(st.integers(0, count - 1)))


@given(drivelines())
def test_every_body_has_a_cell_of_its_own(layout: Layout) -> None:
    placement = place(layout)
    assert set(placement.bodies) == set(range(len(layout.inertia_names)))
    feet = [cell for cells in placement.feet.values() for cell in cells]
    own = [*placement.bodies.values(), *placement.grounds.values(), *feet]
    assert len(set(own)) == len(own)
    assert set(placement.grounds) == {k for k, pair in enumerate(layout.between.tolist()) if -1 in pair}
    extra = [seat for seat in placement.seats.values() if seat not in own]
    assert len(set(extra)) == len(extra)
    for element, (column, row) in placement.seats.items():
        ends = layout.between[element].tolist()
        assert sorted(placement.bodies[end][1] for end in ends) == [row, row + 1]
        on_shafts = [cell for end in ends for cell in (placement.bodies[end], *placement.feet.get(end, ()))]
        assert (column, row + 1) in on_shafts


@settings(max_examples=30)
@given(drivelines())
def test_any_driveline_can_be_drawn(layout: Layout) -> None:
    findings = synthetic.findings("quiet")
    model = findings.model
    bodies = tuple(model.inertias[0].model_copy(update={"name": name}) for name in layout.inertia_names)
    motion = replace(findings.motion.trajectory, layout=layout)
    other = replace(
        findings,
        model=model.model_copy(update={"inertias": bodies, "torques": ()}),
        motion=replace(findings.motion, trajectory=motion),
    )
    root = ElementTree.fromstring(sketch(other))
    words = ["".join(text.itertext()) for text in root.iter("text")]
    assert [w for w in words if w in layout.inertia_names].count(layout.inertia_names[-1]) == 1
    assert set(layout.element_names) <= set(words)


def test_what_rattles_says_so_in_words() -> None:
    words = sketch(synthetic.findings("double-sided"))
    root = ElementTree.fromstring(words)
    texts = ["".join(text.itertext()) for text in root.iter("text")]
    assert texts.count("double-sided") == 1
    assert "2 per cycle" in texts
    assert texts.count("quiet") == 2
    assert "drag 0.5 N m" in texts
    assert "↻ 10 N m, orders 1, 2" in texts
