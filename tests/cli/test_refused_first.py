"""What can be refused is refused before anything is simulated: places, files, channels, outputs, existing studies."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import gearrattle as gr
import gearrattle.simulation.integrate
from gearrattle.cli import main
from gearrattle.studies.outputs import check_names
from tests.studies.drivelines import TOML, model

EXAMPLES = Path(__file__).parents[2] / "examples"
MODELS = sorted([*EXAMPLES.glob("*.toml"), *EXAMPLES.glob("paper/*.toml")])

STUDY = 'model = "two.toml"\noutputs = ["TR rms"]\n[axis]\n"torque.0.mean" = [0.3, 0.6]\n'
OPTIMIZATION = (
    'kind = "optimization"\nmodel = "two.toml"\n[variable]\n"torque.0.mean" = { from = 0.3, to = 0.6 }\n'
    '[objective]\n"crossings per cycle" = "min"\n'
)
BASINS = 'kind = "basins"\nmodel = "two.toml"\n[over]\n"angle.engine" = [0.0, 0.1]\n'
BIFURCATION = 'kind = "bifurcation"\nmodel = "two.toml"\n[sweep]\n"torque.0.mean" = [0.3, 0.6]\n'
CONDITIONS = (
    'kind = "conditions"\nmodel = "two.toml"\n[temperature]\npath = "inertia.wheel.drag_torque"\nvalues = [0.3, 0.6]\n'
    "[speed]\nvalues = [70, 80]\n"
)
STUDIES = {
    "grid": STUDY,
    "optimization": OPTIMIZATION,
    "basins": BASINS,
    "bifurcation": BIFURCATION,
    "conditions": CONDITIONS,
}
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

    for module in ("stream", "integrate"):  # a stream imported later would keep the replacement
        monkeypatch.setattr(f"gearrattle.simulation.{module}.finish", refuse)
    return started


WORDS = [
    ("run two.toml -o taken", "taken"),
    ("simulate two.toml -o full", "other.txt"),
    ("simulate two.toml -o taken/run.nc", "taken"),
    ("stream two.toml -o taken", "taken"),
    ("stream two.toml -o full", "other.txt"),
    ("stream two.toml -o full --resume", "other.txt"),
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


@pytest.mark.parametrize(("words", "message"), WORDS, ids=[words for words, _ in WORDS])
def test_what_can_be_refused_is_refused_before_anything_runs(
    words: str, message: str, folder: Path, runs: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    before = sorted(path.relative_to(folder) for path in folder.rglob("*"))
    code = main(words.split())
    err = capsys.readouterr().err
    assert runs == [], err
    assert code == 2, err
    assert message in err
    assert sorted(path.relative_to(folder) for path in folder.rglob("*")) == before


@pytest.fixture
def cycles(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Periods simulated, run by run."""
    simulated: list[int] = []
    finish = gearrattle.simulation.integrate.finish

    def counted(march: Any, task: Any, *rest: Any, **settings: Any) -> Any:
        simulated.append(task.cycles)
        return finish(march, task, *rest, **settings)

    for module in ("stream", "integrate"):  # a stream imported later would keep the replacement
        monkeypatch.setattr(f"gearrattle.simulation.{module}.finish", counted)
    return simulated


UNKNOWN = {
    "grid": STUDY.replace("TR rms", "TR rsm"),
    "optimization": OPTIMIZATION.replace("crossings per cycle", "TR rsm"),
    "basins": BASINS.replace("[over]", 'outputs = ["TR rsm"]\n[over]'),
    "bifurcation": BIFURCATION.replace("[sweep]", 'outputs = ["TR rsm"]\n[sweep]'),
}


@pytest.mark.parametrize("kind", list(UNKNOWN))
def test_an_unknown_output_is_refused_after_one_period_at_most(
    kind: str, folder: Path, cycles: list[int], capsys: pytest.CaptureFixture[str]
) -> None:
    Path("unknown.toml").write_text(UNKNOWN[kind], encoding="utf-8")
    assert main(["study", "unknown.toml", "-o", "out"]) == 2
    err = capsys.readouterr().err
    assert "TR rsm" in err
    assert "TR rms" in err
    assert sum(cycles) <= 1
    assert not (folder / "out").exists()


@pytest.mark.parametrize("outputs", [[], "verdict", ["verdict", 3], ["noise", "crossings per cycle"]])
def test_python_refuses_outputs_after_one_period_at_most(outputs: Any, cycles: list[int]) -> None:
    with pytest.raises(gr.ModelError, match="output"):
        gr.study(model(), {"torque.0.mean": [0.3, 0.6]}, outputs)
    assert sum(cycles) <= 1


def test_the_defaults_are_not_looked_for(cycles: list[int]) -> None:
    gr.study(model(), {"torque.0.mean": [0.3, 0.6]})
    assert min(cycles) == model().simulation.cycles


QUICK = [path for path in MODELS if path.stem not in ("alternating_mesh", "clutch_friction")]
"""Examples whose 20 periods take no time to speak of; the others are rattling meshes and clutches as well."""


@pytest.mark.parametrize("path", QUICK, ids=[path.stem for path in QUICK])
def test_whatever_a_long_motion_has_is_accepted(path: Path, cycles: list[int]) -> None:
    example = gr.load(path)
    run = gr.simulate(example, cycles=min(20, example.simulation.cycles or 20), discard=4, audit=False)
    quantities = {entry.quantity for entry in gr.criteria(run).entries}
    table = gr.metrics(run)
    names = sorted(quantities | set(table.quantity[table.subject != ""]))
    before = len(cycles)
    check_names(names, [example])
    assert cycles[before:] == [1]
