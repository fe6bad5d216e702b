"""Starts that are none are refused by the argument's own name."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearrattle as gr


@pytest.mark.parametrize("start", ["foo", 5, [1, 2], np.zeros(2)])
def test_a_start_that_is_none_is_refused_with_all_that_are(start: Any) -> None:
    with pytest.raises(gr.ModelError) as refused:
        gr.periodic(gr.example("rattle_oscillator"), start=start)
    message = str(refused.value)
    assert message.startswith("start: ")
    for word in ("static", "zero", "linear", "run", "orbit", "angle"):
        assert word in message


def test_a_start_in_a_table_of_another_size_names_the_table() -> None:
    with pytest.raises(gr.ModelError, match="angle"):
        gr.periodic(gr.example("rattle_oscillator"), start={"angle": [0.0, 0.0], "velocity": [0.0, 0.0]})


def test_an_orbit_of_other_inertias_is_refused() -> None:
    other = gr.periodic(gr.example("backlash_oscillator").with_({"excitation.speed": 1.2}))
    with pytest.raises(gr.ModelError, match=r"start: .*same inertias, flywheel"):
        gr.periodic(gr.example("case1"), start=other)
