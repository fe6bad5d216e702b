"""A path where a model or a run is needed is refused with the call that reads it."""

from __future__ import annotations

import inspect
from pathlib import Path

import pytest

import gearrattle as gr
from tests.architecture.public import FUNCTIONS

FIRST = {name: next(iter(inspect.signature(call).parameters), "") for name, call in FUNCTIONS.items()}
OF_MODELS = [name for name, first in FIRST.items() if first in ("model", "run_or_model") and "validate" not in name]
OF_RUNS = [
    name
    for name, first in FIRST.items()
    if first in ("run", "source") and name not in ("measured.look", "read", "import_model", "share")
]


def needed(name: str) -> dict[str, object]:
    """Return something for every argument that a call needs after the first."""
    _, *others = inspect.signature(FUNCTIONS[name]).parameters.values()
    return {p.name: {} for p in others if p.default is p.empty and p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)}


@pytest.mark.parametrize("name", OF_MODELS)
@pytest.mark.parametrize("value", ["case3.toml", Path("case3.toml"), 3])
def test_a_call_of_a_model_says_how_to_get_one(name: str, value: object) -> None:
    remedy = "gr.open_run" if name == "contact_ratio" else "gr.load"
    with pytest.raises(gr.ModelError, match=rf"must be a gr\..*{remedy}"):
        FUNCTIONS[name](value, **needed(name))


@pytest.mark.parametrize("name", OF_RUNS)
@pytest.mark.parametrize("value", ["run.nc", Path("run.nc"), 3])
def test_a_call_of_a_run_says_how_to_get_one(name: str, value: object) -> None:
    with pytest.raises(gr.ModelError, match=r"must be a gr\.Run.*gr\.open_run"):
        FUNCTIONS[name](value, **needed(name))


def test_both_lists_hold_what_they_should() -> None:
    assert {"simulate", "modes", "study", "optimize", "advise", "measured.drive"} <= set(OF_MODELS)
    assert {"criteria", "metrics", "spectral.psd", "spectral.order_map", "spectral.waterfall", "spectra"} <= set(
        OF_RUNS
    )
