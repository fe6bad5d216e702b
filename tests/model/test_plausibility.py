"""Values that no driveline has are told of with their range; no shipped model has any."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.model.plausibility import RANGES, plausibility_notes

ROOT = Path(__file__).parents[2]
MODELS = sorted(
    path
    for folder in ("examples", "tests", "docs")
    for path in (ROOT / folder).rglob("*.toml")
    if "\n[[inertia]]" in path.read_text(encoding="utf-8", errors="replace")
)


def test_there_are_models_to_look_at() -> None:
    assert len(MODELS) >= 10


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.name)
def test_no_shipped_model_is_told_of(path: Path) -> None:
    try:
        model = gr.load(path)
    except gr.ModelError:
        pytest.skip("no model that can be loaded")
    assert plausibility_notes(model) == ()


@pytest.mark.parametrize(
    ("path", "value", "subject", "said"),
    [
        ("inertia.flywheel.J", 140e3, "inertia.flywheel.J", "between 10⁻¹⁰ and 20000 kg m²"),
        ("inertia.flywheel.J", 1e-11, "inertia.flywheel.J", "moments of inertia"),
        ("mesh.gear.radii.0", 33.0, "mesh.gear.radii", "number without a unit is in metres"),
        ("mesh.gear.backlash", 0.1, "mesh.gear", "backlashes"),
        ("excitation.speed", 1e5, "excitation.speed", "turbochargers"),
        ("torque.0.mean", 1e9, "torque.0.mean", "torques"),
    ],
)
def test_what_lies_outside_is_told_of(path: str, value: float, subject: str, said: str) -> None:
    notes = plausibility_notes(gr.example("case3").with_({path: value}))
    (note,) = [note for note in notes if subject in note]
    assert said in note
    assert "Is the unit right?" in note


def test_a_dimensionless_model_has_no_ranges() -> None:
    model = gr.nondimensionalize(gr.example("case3").with_({"inertia.flywheel.J": 140e3})).model
    assert plausibility_notes(model) == ()


def test_every_range_has_a_reason() -> None:
    for known in RANGES.values():
        assert 0.0 <= known.low < known.high
        assert len(known.reason) > 20


def test_check_tells_them_and_says_ok(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "large.toml"
    path.write_text(gr.example("case3").with_({"inertia.flywheel.J": 140e3}).to_toml(), encoding="utf-8")
    assert main(["check", str(path)]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("ok\n")
    assert "inertia.flywheel.J is 140000 kg m²" in err.replace("1.4 × 10⁵", "140000")
    assert main(["check", str(path), "--json"]) == 0
    assert "inertia.flywheel.J" in json.loads(capsys.readouterr().out)["notes"][0]
