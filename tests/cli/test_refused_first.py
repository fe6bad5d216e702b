"""What can be refused is refused before anything is simulated: places, files, channels, outputs, existing studies."""

from __future__ import annotations

from pathlib import Path

import pytest

from gearrattle.cli import main
from tests.studies.drivelines import TOML

STUDY = 'model = "two.toml"\noutputs = ["TR rms"]\n[axis]\n"torque.0.mean" = [0.3, 0.6]\n'
OPTIMIZATION = (
    'kind = "optimization"\nmodel = "two.toml"\n[variable]\n"torque.0.mean" = { from = 0.3, to = 0.6 }\n'
    '[objective]\n"crossings per cycle" = "min"\n'
)
BASINS = 'kind = "basins"\nmodel = "two.toml"\n[over]\n"angle.engine" = [0.0, 0.1]\n'
BIFURCATION = 'kind = "bifurcation"\nmodel = "two.toml"\n[sweep]\n"torque.0.mean" = [0.3, 0.6]\n'
STUDIES = {"grid": STUDY, "optimization": OPTIMIZATION, "basins": BASINS, "bifurcation": BIFURCATION}
RECORD = "t [s], v [rad/s]\n" + "".join(f"{0.01 * k:.2f},{k % 7}\n" for k in range(400))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a model, studies, a record, a file called "taken" and a folder called "full"."""
    monkeypatch.chdir(tmp_path)
    Path("two.toml").write_text(TOML, encoding="utf-8")
    for name, text in STUDIES.items():
        Path(f"{name}.toml").write_text(text, encoding="utf-8")
    Path("rig.csv").write_text(RECORD, encoding="utf-8")
    Path("taken").write_text("a file", encoding="utf-8")
    Path("full").mkdir()
    Path("full/other.txt").write_text("something else", encoding="utf-8")
    return tmp_path


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the algorithms that have been started."""
    started: list[str] = []

    def refuse(*_: object, **__: object) -> None:
        started.append("a run")
        raise RuntimeError("simulated")

    monkeypatch.setattr("gearrattle.solvers.simulate.finish", refuse)
    return started


WORDS = [
    ("run two.toml -o taken", "taken"),
    ("simulate two.toml -o full", "must end in .nc or .csv"),
    ("simulate two.toml -o taken/run.nc", "taken"),
    ("stream two.toml -o taken", "taken"),
    ("compare two.toml -a rk4 -o taken", "taken"),
    ("compare two.toml -a rk5", "rk5"),
    ("validate two.toml rig.csv -o taken", "taken"),
    ("validate two.toml none.csv", "none.csv"),
    ("validate two.toml rig.csv --match w=velocity.engine", "w"),
    ("validate two.toml rig.csv --match v=velocity.motor", "velocity.motor"),
    ("validate two.toml rig.csv", "no channel in common"),
    ("validate two.toml rig.csv --match v=velocity.engine --threshold gear=1", "gear"),
    ("validate two.toml rig.csv --match v=velocity.engine --noise w=1", "w"),
    ("validate two.toml rig.csv --match v=velocity.engine --uncertain inertia.motor.J=1", "inertia.motor"),
    ("listen two.toml -o taken", "taken"),
    ("listen two.toml --path none.wav", "none.wav"),
    ("listen two.toml --element joints", "joints"),
    ("spectra two.toml --channel velocity.engine -o taken", "taken"),
    ("spectra two.toml --channel velocity.motor", "velocity.motor"),
    ("spectra two.toml --channel velocity.engine --against velocity.motor", "velocity.motor"),
    ("screen two.toml --simulate -o taken", "taken"),
    ("reduce two.toml --up-to 20Hz --check simulate -o taken/small.toml", "taken"),
    ("advise two.toml --up-to 20kg", "20kg"),
    *((f"study {kind}.toml -o taken", "taken") for kind in STUDIES),
    *((f"study {kind}.toml -o full", "full") for kind in STUDIES),
    *((f"study {kind}.toml --scheduler slurm", "slurm") for kind in STUDIES),
    *((f"study {kind}.toml --workers 0", "workers") for kind in STUDIES),
]


@pytest.mark.parametrize(("words", "told"), WORDS, ids=[words for words, _ in WORDS])
def test_what_can_be_refused_is_refused_before_anything_runs(
    words: str, told: str, folder: Path, runs: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    before = sorted(path.relative_to(folder) for path in folder.rglob("*"))
    code = main(words.split())
    err = capsys.readouterr().err
    assert runs == [], err
    assert code == 2, err
    assert told in err
    assert sorted(path.relative_to(folder) for path in folder.rglob("*")) == before
