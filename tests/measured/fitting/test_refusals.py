"""What cannot be fitted, and what a recording leaves open: in words, with place, value, rule and remedy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from tests.measured.fitting import made

FREE = ["coupling.gap.stiffness"]


def problems(data: Any, free: list[str] = FREE, model: gr.Model | None = None, **keys: Any) -> str:
    with pytest.raises(gr.ModelError) as refused:
        gr.identification.fit(model or made.model(), data, free, starts=1, **keys)
    return str(refused.value)


def test_a_clearance_that_is_never_reached_is_named() -> None:
    """Loaded on one side, the flank is never left."""
    loaded = {"torque.0.mean": 200.0}
    truth = made.model(**loaded)
    record = made.recording(source=truth)
    fit = gr.identification.fit(truth, record, ["coupling.gap.clearance", *FREE], starts=2)
    clearance, stiffness = fit.parameters
    assert clearance.standard_error == np.inf
    assert [list(c.exponents) for c in fit.undetermined] == [["coupling.gap.clearance"]]
    assert "no datum depends on it" in fit.undetermined[0].words
    assert clearance.value == pytest.approx(clearance.start, rel=1e-12)
    assert stiffness.relative_error < 0.05


@pytest.mark.parametrize(
    ("path", "rule"),
    [
        ("excitation.frequency", "sets the period"),
        ("torque.0.harmonics.0.order", "sets the period"),
        ("simulation.cycles", "is a setting of the simulation"),
    ],
)
def test_what_is_no_value_of_the_driveline_is_refused(path: str, rule: str) -> None:
    assert rule in problems(made.recording(), [path])


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"settings": {"cycle": 30}}, ["recording.settings.cycle", "did you mean", "cycles"]),
        ({"settings": {"cycles": 24, "discard": 20}}, ["at least 8 cycles"]),
        ({"match": {"n_gear": 3}}, ["recording.match.n_gear", "in quotes"]),
        ({"match": {"n_geer": "velocity.gear"}}, ["n_geer", "is no channel of rig"]),
        ({"band": ["1 kHz"]}, ["recording.band", "lowest and the highest"]),
        ({"clock": "phase"}, ["recording.clock", '"cycle" or "none"']),
        ({"noise": {"n_gear": 1e3}}, ["recording.noise.n_gear", "must be below the rms in the band"]),
        ({"noise": {"a": 1.0}}, ["noise", "is no measured channel that is compared"]),
        ({"start": "3 s", "end": "2 s"}, ["start, end", "must ascend"]),
        ({"phases": "yes"}, ["recording.phases", "true or false"]),
        ({"kind": 1}, ["recording.kind"]),
    ],
)
def test_every_key_has_its_rule(keys: dict[str, Any], words: list[str]) -> None:
    message = problems({"recording": {"file": made.recording(), **keys}})
    assert all(word in message for word in words), message


def test_a_record_without_any_order_of_the_model_is_refused() -> None:
    still = made.model(**{"torque.0.harmonics.0.amplitude": 0.0, "torque.0.harmonics.1.amplitude": 0.0})
    record = made.recording()
    rest = np.full(record.time.size, 5.0)
    quiet = record.with_(channels=(gr.measured.Channel("n_gear", "velocity", "gear", "rad/s", rest),))
    assert "stands out" in problems(quiet, model=still)


def test_modes_and_a_recording_are_two_fits() -> None:
    data = {"recording": {"file": made.recording()}, "mode": [{"number": 2, "frequency": "20 Hz"}]}
    assert "fitted by themselves" in problems(data)


def test_states_are_of_modes() -> None:
    assert "contact_ratio" in problems(made.recording(), contact_ratio={"gap": 0.5})


def test_a_file_is_fitted_as_the_recording_it_holds(tmp_path: Path) -> None:
    record = made.recording(names=("gear",))
    gr.write(record, tmp_path / "rig.csv")
    data = tmp_path / "data.toml"
    data.write_text('[recording]\nfile = "rig.csv"\n[recording.match]\nn_gear = "velocity.gear"\n', encoding="utf-8")
    mapping = tmp_path / "measurement.toml"
    mapping.write_text(gr.measured.look(tmp_path / "rig.csv").mapping(tmp_path), encoding="utf-8")
    start = made.model(**{FREE[0]: 1000.0})
    wanted = gr.identification.fit(start, record, FREE, starts=1).parameters[0].value
    for source in (data, {"recording": {"file": str(tmp_path / "rig.csv"), "match": {"n_gear": "velocity.gear"}}}):
        actual = gr.identification.fit(start, source, FREE, starts=1).parameters[0].value
        assert actual == pytest.approx(wanted, rel=1e-9)
    assert "channel" in mapping.read_text(encoding="utf-8")


def test_progress_rises_and_ends_the_fit() -> None:
    shares: list[float] = []
    gr.identification.fit(made.model(), made.recording(), FREE, starts=2, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0

    def stop(_share: float) -> None:
        raise gr.Cancelled

    with pytest.raises(gr.Cancelled):
        gr.identification.fit(made.model(), made.recording(), FREE, progress=stop)
