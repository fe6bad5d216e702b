"""One dimension for parts, one for inertias, whatever the outputs of a study apply to; labels and failures kept."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr

ROOT = Path(__file__).parents[2]
SHORT = {"simulation.cycles": 12, "simulation.discard": 6, "simulation.samples_per_cycle": 32}
OUTPUTS = ["regime", "margin", "contact share"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("study") / "kept"


@pytest.fixture(scope="module")
def data(folder: Path) -> xr.Dataset:
    model = gr.load(ROOT / "examples/paper/case1.toml")
    gaps = [0.5e-4, 1e-4, 1.5e-4]
    return gr.study(model, {"mesh.gear.backlash": gaps}, OUTPUTS, fixed=SHORT, output=folder, workers=1)


def test_outputs_of_different_parts_share_one_dimension(data: xr.Dataset) -> None:
    assert not [name for name in data.dims if str(name).endswith("_2")]
    own = {str(name): str(v.attrs["applies_to"]).split() for name, v in data.items() if "applies_to" in v.attrs}
    assert own, "no output of this study applies to some parts only"
    for name, subjects in own.items():
        dimension = str(data[name].dims[-1])
        others = [part for part in data[dimension].values.tolist() if part not in subjects]
        assert others
        values = data[name].sel({dimension: others}).values
        nothing = values == -1 if values.dtype.kind == "i" else np.isnan(values)
        assert nothing.all()
        assert np.isfinite(data[name].sel({dimension: subjects}).values).all()
    assert gr.studies.regime_boundary(data)["part"].dtype.kind in "UOT"


def test_coordinates_carry_their_label_and_unit(data: xr.Dataset) -> None:
    assert data["mesh.gear.backlash"].attrs == {"long_name": "backlash of mesh gear", "units": "m"}


def test_open_study_says_why_cases_failed(tmp_path: Path) -> None:
    def fragile(run: gr.Run) -> dict[str, float]:
        gap = run.model.meshes[0].backlash
        if gap > 1.2e-4:
            raise ValueError("gap too wide for this function")
        return {"gap": gap}

    model = gr.load(ROOT / "examples/paper/case1.toml")
    kept = tmp_path / "study"
    axes = {"mesh.gear.backlash": [0.5e-4, 1e-4, 1.5e-4], "torque.0.mean": [10.0, 11.0]}
    values = gr.study(
        model, axes, ["regime"], fixed=SHORT, function=fragile, output=kept, scheduler="threads", workers=1
    )
    expected = [f"({i}, {j}): gap too wide for this function" for i, j in ((2, 0), (2, 1))]
    assert values.attrs["failures"] == expected
    assert gr.open_study(kept).attrs["failures"] == expected
    assert gr.open_study(kept)["outcome"].values[2].tolist() == [4, 4]
