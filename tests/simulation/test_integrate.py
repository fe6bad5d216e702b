"""The loop that drives every solver: what it tells of a march that is slow."""

from __future__ import annotations

import pytest

import gearrattle as gr
from gearrattle.cli.background import Watch, _Display
from gearrattle.simulation import integrate


class Reasons:
    """Takes shares, and why the work takes so long; stops it then."""

    def __init__(self) -> None:
        self.words: list[str] = []

    def because(self, reason: str) -> None:
        self.words.append(reason)
        if reason:
            raise gr.Cancelled(reason)

    def __call__(self, share: float) -> None:
        del share


def test_a_march_of_minutes_a_cycle_says_which_element_is_so_fast(monkeypatch: pytest.MonkeyPatch) -> None:
    """A gear of 50 km radius: 2e10 steps a cycle, and nothing but "about 2 h left" was told."""
    monkeypatch.setattr(integrate, "_UNTIL_JUDGED", 0.2)
    changes = {"mesh.gear.radii": ["50000 m", "50 mm"], "coupling.clutch.damping": 2.25e11}
    model = gr.example("case3").with_(changes)
    progress = Reasons()
    with pytest.raises(gr.Cancelled):
        gr.simulate(model, cycles=1, discard=0, initial="static", progress=progress)
    assert progress.words == ["a cycle takes minutes: gear moves very fast for its inertias"]


def test_a_long_run_of_quick_cycles_has_no_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(integrate, "_UNTIL_JUDGED", 0.0)
    progress = Reasons()
    gr.simulate(gr.example("case3"), cycles=400, progress=progress)
    assert progress.words == [""]


def test_the_reason_stands_in_the_lines_of_progress(capsys: pytest.CaptureFixture[str]) -> None:
    watch = Watch()
    watch.enter("simulating")
    watch.because("a cycle takes minutes: gear moves very fast for its inertias")
    display = _Display(watch)
    display._print()
    watch.enter("judging")
    display._print()
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["simulating, a cycle takes minutes: gear moves very fast for its inertias", "judging"]
