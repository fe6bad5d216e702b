"""``gearrattle condense``: the report, files of matrices, JSON, wrong input."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

import gearrattle as gr
from gearrattle.cli import main

EIGHT = Path(__file__).parents[2] / "examples" / "paper" / "eight_dof.toml"
BAND = ("--up-to", "75 Hz")


@pytest.mark.parametrize("ending", [".npz", ".mat"])
def test_the_file_has_the_matrices_of_the_call(ending: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / f"matrices{ending}"
    assert main(["condense", str(EIGHT), *BAND, "--method", "modal", "-o", str(target)]) == 0
    condensed = gr.condense(gr.load(EIGHT), "75 Hz", method="modal")
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith(f"8 bodies become {len(condensed.coordinates)} coordinates by modal. ")
    assert lines[-1] == f"saved: {target}"
    stored = np.load(target) if ending == ".npz" else loadmat(target)
    for name, matrix in condensed.matrices.items():
        np.testing.assert_array_equal(stored[name], matrix)
    assert "mesh_34" in str(stored["clearances"])


def test_json_has_matrices_and_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["condense", str(EIGHT), *BAND, "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    condensed = gr.condense(gr.load(EIGHT), "75 Hz")
    np.testing.assert_array_equal(record["stiffness"], condensed.stiffness)
    assert record["error"]["frequency"] == float(condensed.error)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("-o", "matrices.toml"), "or a file that ends in .nc, .csv, .pdf, .pptx, .xlsx, .npz or .mat"),
        (("--method", "craig"), "craig-bampton"),
        (("--keep", "nothing"), "there is no such element"),
    ],
)
def test_wrong_input(words: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["condense", str(EIGHT), *BAND, *words]) == 2
    assert message in capsys.readouterr().err
