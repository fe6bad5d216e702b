"""What a mean that says "balance" counts, what is written and shown of it, and which trains are refused with it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble, lumped_model, own_mean, steady
from gearrattle.cli import main
from gearrattle.model import json_schema
from gearrattle.report.plots.sketch import torque_words
from gearrattle.report.result_kinds import presentation_of

GEARS = """
schema = 1
[[inertia]]
name = "flywheel"
J = 0.1
[[inertia]]
name = "shaft"
J = 0.01
drag_torque = 1.0
[[inertia]]
name = "gear"
J = 0.01
drag_torque = 0.5
[[coupling]]
name = "damper"
between = ["flywheel", "shaft"]
stiffness = 100.0
damping = 0.1
[[mesh]]
name = "mesh"
between = ["shaft", "gear"]
radii = [0.03, 0.06]
stiffness = 1e6
damping = 100.0
backlash = 1e-4
[excitation]
speed = 80.0
[[torque]]
on = "flywheel"
mean = "balance"
harmonics = [{ order = 2, amplitude = 3.0 }]
[[torque]]
on = "shaft"
mean = 0.2
"""
MEAN = 1.0 + 0.5 * 0.03 / 0.06 - 0.2
HOLD = '[[coupling]]\nname = "hold"\nbetween = ["gear", "ground"]\nstiffness = 10.0\n'
LOCK = '[[mesh]]\nname = "lock"\nbetween = ["shaft", "gear"]\nradii = [0.03, 0.05]\nstiffness = 1e6\n'
ANOTHER = '[[torque]]\non = "gear"\nmean = "balance"\n'
SET = """
schema = 1
inertia = [
  {{ name = "s", J = 0.1, drag_torque = 1.0 }}, {{ name = "r", J = 0.3 }},
  {{ name = "c", J = 0.2, drag_torque = {drag} }}, {{ name = "p", J = 1e-3 }},
]
excitation = {{ speed = 80.0 }}
torque = [{{ on = "{on}", mean = "balance" }}]
[[planetary]]
name = "set"
sun = "s"
ring = "{ring}"
carrier = "c"
planets = ["p"]
radii = {{ sun = 0.03, planet = 0.02, ring = 0.07 }}
stiffness = {{ sun = 1e7, ring = 1e7 }}
"""
ENGINE = {
    "cylinders": 4,
    "bore": "80 mm",
    "stroke": "90 mm",
    "rod": "140 mm",
    "pressure": {"angle": ["0 deg", "240 deg", "480 deg", "720 deg"], "value": ["30 bar", "2 bar", "1 bar", "30 bar"]},
}


def gears(**torque: Any) -> gr.Model:
    """The gears with further keys in the torque that balances."""
    tables = gr.loads(GEARS).to_tables()
    tables["torque"][0] |= torque
    return gr.Model.from_tables(tables)


def refused(text: str) -> str:
    """The words in which a model is refused that is used."""
    with pytest.raises(gr.ModelError) as caught:
        gr.equilibrium(gr.loads(text))
    (problem,) = caught.value.problems
    assert problem.location[0] == "torque"
    assert problem.location[2] == "mean"
    assert problem.remedy
    return str(problem)


def test_all_other_means_and_drags_count_by_their_ratios() -> None:
    rest = gr.equilibrium(gr.loads(GEARS))
    assert rest.balance == {"flywheel": pytest.approx(MEAN, rel=1e-15)}
    assert rest.notes == ()
    assert not rest.acceleration.any()


def test_the_mean_of_a_record_is_taken_off() -> None:
    """The straight line from 1 to 3 N m has the mean 2 N m; with ``static`` the start counts that."""
    record = {"time": [0.0, 4.0], "value": [1.0, 3.0], "interpolation": "linear"}
    for more, counted in (({}, 2.0), ({"static": 5.0}, 5.0)):
        model = gears(signal={**record, **more})
        assert own_mean(model, 0) == pytest.approx(MEAN - counted, rel=1e-14)
        assert gr.equilibrium(model).notes == ()
        assert own_mean(steady(model), 0) == pytest.approx(MEAN, rel=1e-15)
        np.testing.assert_allclose(assemble(model).system.inputs.mean, [MEAN, -0.8, -0.5], rtol=1e-14)


def test_an_engine_gives_the_sines_and_not_the_mean_that_balances() -> None:
    tables = gr.loads(GEARS).to_tables()
    tables["torque"][0] = {"on": "flywheel", "mean": "balance", "engine": ENGINE}
    model = gr.Model.from_tables(tables)
    assert own_mean(model, 0) == pytest.approx(MEAN, rel=1e-15)
    assert [sine.order for sine in model.torques[0].harmonics][:2] == [2.0, 4.0]
    assert gr.loads(model.to_toml()) == model
    # in a torque of its own the engine's mean is one of the others
    tables["torque"] = [*gr.loads(GEARS).to_tables()["torque"], {"on": "flywheel", "engine": ENGINE}]
    apart = gr.Model.from_tables(tables)
    assert own_mean(apart, 0) == pytest.approx(MEAN - apart.torques[2].mean, rel=1e-14)


def test_it_stands_and_goes_by_its_path() -> None:
    model = gr.loads(GEARS)
    number = model.with_({"torque.0.mean": "2 N*m"})
    assert number.torques[0].mean == 2.0
    assert gr.equilibrium(number).balance == {}
    assert number.with_({"torque.0.mean": "balance"}) == model
    assert 'mean = "balance"' in model.to_toml()


def test_without_dimensions() -> None:
    bare = gr.loads('units = "dimensionless"\n' + GEARS)
    assert gr.equilibrium(bare).balance["flywheel"] == pytest.approx(MEAN, rel=1e-15)
    scaled = gr.nondimensionalize(gr.loads(GEARS))
    torque = scaled.scales.units()["torque"]
    assert own_mean(scaled.model, 0) * torque == pytest.approx(MEAN, rel=1e-12)


def test_a_lumped_train_balances_too() -> None:
    """The flywheel goes into the gear, which turns half as fast: twice the torque."""
    model = gr.loads(GEARS)
    lumped = lumped_model(model, [2, 2, 2], [2.0, 2.0, 1.0], [0, 1], "one")
    assert own_mean(lumped, 0) == pytest.approx(2.0 * MEAN, rel=1e-14)


def test_a_study_over_a_drag_keeps_the_balance() -> None:
    settings = {"simulation.cycles": 8, "simulation.discard": 4, "simulation.samples_per_cycle": 64}
    model = gr.loads(GEARS).with_({**settings, "torque.0.harmonics.0.amplitude": 20.0})
    drags, outputs = [0.1, 0.4, 2.0], ["largest approach speed", "rms acceleration"]
    numbers = [0.8 + 0.5 * drag for drag in drags]
    followed = gr.study(model, {"inertia.gear.drag_torque": drags}, outputs, workers=1)
    both = {"load": {"inertia.gear.drag_torque": drags, "torque.0.mean": numbers}}
    by_hand = gr.study(model.with_({"torque.0.mean": 1.0}), both, outputs, workers=1)
    for name in outputs:
        np.testing.assert_allclose(followed[name].values, by_hand[name].values, rtol=1e-9)
    assert (followed["largest approach speed"] > 0.0).any()


def test_what_is_no_number_and_nearly_the_word_is_answered_with_it() -> None:
    with pytest.raises(gr.ModelError, match=r'"balanced"; must be a number.*did you mean "balance"'):
        gr.loads(GEARS.replace('"balance"', '"balanced"'))
    table = '{ speed = [50.0, 100.0], value = ["balance", 1.0] }'
    with pytest.raises(gr.ModelError, match=r"torque\.0\.mean"):
        gr.loads(GEARS.replace('"balance"', table))


def test_editors_know_the_word() -> None:
    mean = json_schema()["$defs"]["Torque"]["properties"]["mean"]
    assert [option["const"] for option in mean["anyOf"] if "const" in option] == ["balance"]
    assert len(mean["anyOf"]) == 4  # beside a number, a text with a unit, a table over speed


def test_one_torque_of_a_train_balances_it() -> None:
    assert "torque.0.mean balances this train already" in refused(GEARS + ANOTHER)


def test_two_trains_have_one_each() -> None:
    text = GEARS + '[[inertia]]\nname = "pump"\nJ = 0.1\ndrag_torque = 3.0\n' + ANOTHER.replace("gear", "pump")
    assert gr.equilibrium(gr.loads(text)).balance == {"flywheel": pytest.approx(MEAN), "pump": 3.0}


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (HOLD, "coupling.hold holds the train of flywheel to ground"),
        (LOCK, "the ratios of its elements let the train of flywheel turn in no way"),
        (HOLD + ANOTHER, "coupling.hold holds the train of flywheel to ground"),
    ],
)
def test_a_train_that_cannot_turn_is_refused(more: str, words: str) -> None:
    if ANOTHER in more:
        with pytest.raises(gr.ModelError) as caught:
            gr.equilibrium(gr.loads(GEARS + more))
        assert len(caught.value.problems) == 2
        assert words in str(caught.value)
    else:
        assert words in refused(GEARS + more)


def test_a_prescribed_motion_holds_its_train() -> None:
    text = GEARS.replace('on = "shaft"\nmean = 0.2', 'on = "gear"\nmean = 0.2')
    motion = '[[motion]]\non = "shaft"\nharmonics = [{ order = 2, amplitude = 0.01 }]\n'
    assert "the prescribed motion of shaft holds the train of flywheel" in refused(text + motion)


def test_a_planetary_set_on_the_ground_turns_in_one_way() -> None:
    """Willis: the carrier of a held ring turns by R_s / (R_s + R_r) of the sun, 0.3."""
    on_sun = gr.equilibrium(gr.loads(SET.format(drag=3.0, on="s", ring="ground")))
    assert on_sun.balance == {"s": pytest.approx(1.0 + 0.3 * 3.0, rel=1e-14)}
    on_carrier = gr.equilibrium(gr.loads(SET.format(drag=3.0, on="c", ring="ground")))
    assert on_carrier.balance == {"c": pytest.approx(3.0 + 1.0 / 0.3, rel=1e-14)}
    assert not on_carrier.acceleration.any()


def test_of_two_freedoms_one_torque_balances_one() -> None:
    """With the sun at rest the ring turns by (R_s + R_r) / R_r = 10/7 of the carrier, whose 3 N m are 2.1 N m there."""
    words = refused(SET.format(drag=3.0, on="s", ring="r"))
    assert "turns in 2 ways" in words
    assert "with s at rest, 2.1 N m are lacking at r" in words
    rest = gr.equilibrium(gr.loads(SET.format(drag=0.0, on="s", ring="r")))  # nothing is left for another
    assert rest.balance == {"s": pytest.approx(1.0, rel=1e-14)}
    assert not rest.acceleration.any()


def test_check_shows_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "gears.toml"
    path.write_text(GEARS, encoding="utf-8")
    assert main(["check", str(path)]) == 0
    out, err = capsys.readouterr()
    assert "balance     1.05 N m at flywheel" in out.splitlines()
    assert err == ""
    assert main(["check", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["balance"] == {"flywheel": pytest.approx(MEAN)}
    path.write_text(GEARS + HOLD, encoding="utf-8")
    assert main(["check", str(path)]) == 2
    assert "torque.0.mean" in capsys.readouterr().err


def test_pages_show_it() -> None:
    model = gr.loads(GEARS)
    page = presentation_of(gr.equilibrium(model))
    assert page.answer()[-1].rows == (("flywheel", "1.05 N m"),)
    assert page.content()["balance"] == {"flywheel": pytest.approx(MEAN)}
    assert torque_words(model.torques[0], is_si=True) == "balance, order 2"
    assert torque_words(model.torques[0], is_si=True, mean=own_mean(model, 0)) == "balance: 1.05 N m, order 2"
