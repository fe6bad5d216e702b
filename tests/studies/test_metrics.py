"""Metrics as outputs of studies: the numbers of single runs, by subject."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr

NAMES = ["separation margin", "mean impact intensity", "rattle level of all meshes", "transmissibility at order 1"]


def test_a_metric_in_a_study_is_that_of_the_run() -> None:
    """Of parts, of inertias and of the whole driveline; beside outputs of criteria."""
    model = gr.load("examples/paper/case1.toml").with_({"simulation.cycles": 6, "simulation.discard": 3})
    gaps = [5e-5, 2e-4]
    found = gr.study(model, {"mesh.gear.backlash": gaps}, [*NAMES, "regime"], workers=1)
    for i, gap in enumerate(gaps):
        run = gr.simulate(model.with_({"mesh.gear.backlash": gap}), audit=False)
        table = gr.metrics(run).set_index(["quantity", "subject"]).value
        for name in NAMES:
            values = found[name].isel({"mesh.gear.backlash": i})
            if name == "rattle level of all meshes":
                assert values.dims == ()
                assert float(values) == table[name, "all meshes"]
                continue
            (dimension,) = values.dims
            for subject in map(str, values[dimension].values):
                value = float(values.sel({dimension: subject}))
                assert value == table[name, subject] if (name, subject) in table.index else np.isnan(value)
    assert np.all(np.isfinite(found["separation margin"].sel(part="gear")))
    assert found["separation margin"].attrs["sampling_error"] == "none"
    assert found["transmissibility at order 1"].attrs["sampling_error"].startswith("of samples, about")
    assert np.all(np.isnan(found["separation margin"].sel(part="clutch")))


def test_what_needs_an_audit_is_no_output() -> None:
    """Studies run without; the refusal lists what there is."""
    with pytest.raises(gr.ModelError, match=r"contact work rate.*separation margin"):
        gr.study(gr.load("examples/paper/case1.toml"), {"mesh.gear.backlash": [1e-4]}, ["contact work rate"])
