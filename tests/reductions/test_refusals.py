"""What reduce refuses, and what it will not do of its own accord."""

from __future__ import annotations

from typing import Any

import pytest

import gearrattle as gr
from tests.reductions.test_lumping import EIGHT

STIFF = 1e9


def driveline(**tables: Any) -> gr.Model:
    base: dict[str, Any] = {"schema": 1, "excitation": {"speed": 10.0}}
    return gr.Model.from_tables({**base, **tables})


def body(name: str, J: float = 1.0) -> dict[str, Any]:
    return {"name": name, "J": J}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"merge": ["clutch"]}, r"merge: found clutch; puts a frequency in the band off by .* %.*5 % is allowed"),
        ({"merge": ["mesh_5"]}, r'no such element.*did you mean "mesh_56"'),
        ({"keep": ["mesh_56"], "merge": ["mesh_56"]}, "is in keep and in merge"),
        ({"limit": 0.0}, "limit: found 0.0; must lie between 0 and 1"),
        ({"margin": 0.5}, "margin: found 0.5"),
        ({"check": "twice"}, 'must be "simulate"'),
    ],
)
def test_wrong_options(options: dict[str, Any], said: str) -> None:
    with pytest.raises(gr.ModelError, match=said):
        gr.reduce(gr.load(EIGHT), "75 Hz", **options)


@pytest.mark.parametrize("up_to", ["75 rpm", "75", 0.0, -3, "fast", True, float("nan")])
def test_a_band_must_be_a_frequency(up_to: Any) -> None:
    with pytest.raises(gr.ModelError, match="up_to"):
        gr.reduce(gr.load(EIGHT), up_to)


def test_all_wrong_names_at_once() -> None:
    with pytest.raises(gr.ModelError) as caught:
        gr.reduce(gr.load(EIGHT), "75 Hz", keep=["x"], merge=["y", "z"])
    assert len(caught.value.problems) == 3


def test_a_loop_of_meshes_that_would_lock() -> None:
    ring = [("a", "b", [1.0, 2.0]), ("b", "c", [1.0, 1.0]), ("c", "a", [1.0, 1.0])]
    meshes = [{"name": a + b, "between": [a, b], "radii": r, "stiffness": STIFF} for a, b, r in ring]
    model = driveline(inertia=[body(x) for x in "abc"], mesh=meshes)
    small = gr.reduce(model, 1.0)
    assert len(small.model.inertias) == 2
    assert [f.reason for f in small.elements.values() if not f.merged] == ["a closed loop of meshes would lock"] * 2
    with pytest.raises(gr.ModelError, match="would lock"):
        gr.reduce(model, 1.0, merge=["ab", "bc", "ca"])


def test_a_clearance_in_parallel_is_not_silenced() -> None:
    pair = ["a", "b"]
    stiff = {"name": "stiff", "between": pair, "stiffness": STIFF}
    loose = {"name": "loose", "between": pair, "stiffness": 10.0, "clearance": 0.1}
    model = driveline(inertia=[body("a"), body("b")], coupling=[stiff, loose])
    small = gr.reduce(model, 1.0)
    assert len(small.model.inertias) == 2
    assert small.elements["stiff"].reason.startswith("an element beside it")
    assert len(gr.reduce(model, 1.0, keep=["loose"]).model.inertias) == 2
    assert len(gr.reduce(model, 1.0, keep=[]).model.inertias) == 1


def test_staged_couplings_stay_between_equal_speeds() -> None:
    gears = {"name": "gears", "between": ["a", "b"], "radii": [0.02, 0.06], "stiffness": 1e13}
    stages = [{"stiffness": 1.0, "until": 0.1}, {"stiffness": 300.0}]
    shafts = [{"name": f"damper_{x}", "between": [x, y], "stages": stages} for x, y in ("ac", "bd")]
    model = driveline(inertia=[body(x) for x in "abcd"], coupling=shafts, mesh=[gears])
    small = gr.reduce(model, 2.0)
    assert len(small.model.inertias) == 4
    assert "different speeds" in small.elements["gears"].reason
    with pytest.raises(gr.ModelError, match="different speeds"):
        gr.reduce(model, 2.0, merge=["gears"])
    one = driveline(inertia=[body(x) for x in "abd"], coupling=shafts[1:], mesh=[gears])
    assert [inertia.name for inertia in gr.reduce(one, 2.0).model.inertias] == ["b", "d"]


def test_a_transmission_error_inside_the_band_keeps_its_mesh() -> None:
    gears = {
        "name": "gears",
        "between": ["a", "b"],
        "radii": [0.05, 0.05],
        "stiffness": 1e13,
        "transmission_error": [{"order": 20, "amplitude": 5e-6}],
    }
    model = driveline(inertia=[body("a"), body("b")], mesh=[gears])  # 20 x 10 rad/s = 31.8 Hz
    assert "excites the band" in gr.reduce(model, 40.0).elements["gears"].reason
    low = gr.reduce(model, 10.0)
    assert low.elements["gears"].merged
    assert any("transmission errors above the band" in note for note in low.notes)


def test_the_ground_is_not_merged() -> None:
    mount = {"name": "mount", "between": ["a", "ground"], "stiffness": STIFF}
    model = driveline(inertia=[body("a")], coupling=[mount])
    small = gr.reduce(model, 1.0)
    assert not small.elements["mount"].merged
    assert any("nothing could be merged" in note for note in small.notes)
    with pytest.raises(gr.ModelError, match="tied to the ground"):
        gr.reduce(model, 1.0, merge=["mount"])


def test_a_start_state_keeps_its_momentum() -> None:
    model = gr.load(EIGHT).with_({"simulation.initial": {"angle": [0.1] * 8, "velocity": [float(i) for i in range(8)]}})
    small = gr.reduce(model, "75 Hz").model

    def momentum(entry: gr.Model) -> float:
        velocity = entry.simulation.initial.velocity  # type: ignore[union-attr]
        return sum(b.J * v for b, v in zip(entry.inertias, velocity, strict=True))

    assert momentum(small) == pytest.approx(momentum(model), rel=1e-13)
    assert small.simulation.initial.angle == pytest.approx([0.1] * 6, rel=1e-14)  # type: ignore[union-attr]


def test_both_motions_are_judged_on_request() -> None:
    model = gr.load(EIGHT).with_({"simulation.cycles": 4, "simulation.discard": 1, "simulation.samples_per_cycle": 64})
    small = gr.reduce(model, "75 Hz", check="simulate")
    assert small.simulated is not None
    assert {entry.subject for entry in small.simulated.entries} >= {"mesh_34", "mesh_56", "mesh_78", "clutch"}
    assert "full model simulated" in small.report
    assert small.to_dict()["simulated"]["entries"]
