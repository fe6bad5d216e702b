"""What is typed for every kind of model: each command with small settings, and the files that it reads."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

from tests.compositions.calls import Kit

Words = Callable[[Kit, Path], list[str]]
SHORT = ["--cycles", "2", "--samples-per-cycle", "16"]

STUDIES: Mapping[str, str] = {
    "grid": '[axis]\n"inertia.engine.J" = {values}\n',
    "bifurcation": '[sweep]\n"inertia.engine.J" = {values}\n',
    "basins": '[over]\n"angle.engine" = [0.0, 0.001]\n',
    "conditions": '[temperature]\npath = "inertia.engine.drag"\nvalues = [0.01, 0.02]\n'
    '[speed]\npath = "inertia.engine.J"\nvalues = {values}\n',
    "optimization": "population = 8\ngenerations = 1\n"
    '[variable]\n"inertia.engine.J" = {{ from = {low}, to = {high} }}\n[objective]\n"crossings per cycle" = "min"\n',
}
"""By kind of study, its file."""


def _study_line(kind: str, kit: Kit, out: Path) -> list[str]:
    """Write a study file of a kind, and compute it."""
    low, high = kit.model.inertias[0].J, 1.1 * kit.model.inertias[0].J
    text = STUDIES[kind].format(values=[low, high], low=low, high=high)
    path = kit.folder / f"{kind}.toml"
    path.write_text(f'model = "{kit.model_file.name}"\nkind = "{kind}"\n{text}', encoding="utf-8")
    return ["study", str(path), "-o", str(out), "--workers", "1"]


COMMAND_LINES: Mapping[str, Words] = {
    "check": lambda kit, _: ["check", str(kit.model_file)],
    "export": lambda kit, out: ["export", str(kit.model_file), "-o", str(out / "equations.c")],
    "import": lambda kit, _: ["import", str(kit.modelica)],
    "modes": lambda kit, _: ["modes", str(kit.model_file)],
    "modes -o": lambda kit, out: ["modes", str(kit.model_file), "-o", str(out)],
    "scale": lambda kit, out: ["scale", str(kit.model_file), "-o", str(out / "scaled.toml")],
    "stiffness": lambda kit, _: ["stiffness", str(kit.model_file), "--visited"],
    "reduce": lambda kit, _: ["reduce", str(kit.model_file), "--up-to", str(kit.band)],
    "condense": lambda kit, _: ["condense", str(kit.model_file), "--up-to", str(kit.band)],
    "fit": lambda kit, _: ["fit", str(kit.model_file), _data(kit), "--free", "inertia.engine.J", "--starts", "1"],
    "advise": lambda kit, _: ["advise", str(kit.model_file), *SHORT],
    "run": lambda kit, out: ["run", str(kit.model_file), "-o", str(out)],
    "fmu": lambda kit, out: ["fmu", str(kit.model_file), "-o", str(out / "x.fmu")],
    "simulate": lambda kit, out: ["simulate", str(kit.model_file), "-o", str(out / "run.csv"), *SHORT],
    "stream": lambda kit, out: ["stream", str(kit.model_file), "-o", str(out / "stream"), "--chunk", "4"],
    "periodic": lambda kit, _: ["periodic", str(kit.model_file)],
    "periodic -o": lambda kit, out: ["periodic", str(kit.model_file), "-o", str(out)],
    "continue": lambda kit, _: [
        "continue",
        str(kit.model_file),
        "--path",
        "inertia.engine.J",
        "--range",
        ":".join(map(str, kit.span)),
    ],
    "compare": lambda kit, _: ["compare", str(kit.model_file), "-a", "rk4", *SHORT],
    "compare -o": lambda kit, out: ["compare", str(kit.model_file), "-a", "rk4", *SHORT, "-o", str(out)],
    "validate": lambda kit, _: ["validate", str(kit.run_file), str(kit.recording_file), *_turns(kit)],
    "validate -o": lambda kit, out: [
        "validate",
        str(kit.run_file),
        str(kit.recording_file),
        *_turns(kit),
        "-o",
        str(out),
    ],
    "screen": lambda kit, _: ["screen", str(kit.model_file), "--speeds", "80,90"],
    "screen --simulate -o": lambda kit, out: [
        "screen",
        str(kit.model_file),
        "--speeds",
        "80,90",
        "--simulate",
        "--workers",
        "1",
        "-o",
        str(out),
    ],
    "threshold": lambda kit, _: [
        "threshold",
        str(kit.model_file),
        "--path",
        "inertia.engine.J",
        "--range",
        "x1:x1.002",
        "--count",
        "3",
        "--workers",
        "1",
    ],
    "remedy": lambda kit, _: ["remedy", str(kit.model_file), str(_remedies(kit)), "--singles", "--workers", "1"],
    "prove-quiet -o": lambda kit, out: [
        "prove-quiet",
        str(kit.model_file),
        "--range",
        f"inertia.engine.J={kit.span[0]}:{kit.span[1]}",
        "--boxes",
        "50",
        "-o",
        str(out),
    ],
    "look": lambda kit, _: ["look", str(kit.recording_file)],
    "orders": lambda kit, _: ["orders", str(kit.run_file), "acceleration.engine", "--turns", "1"],
    "orders -o": lambda kit, out: [
        "orders",
        str(kit.run_file),
        "acceleration.engine",
        "--spectra",
        "-o",
        str(out / "orders.svg"),
    ],
    "spectra": lambda kit, _: ["spectra", str(kit.model_file), "--channel", "acceleration.engine"],
    "spectra -o": lambda kit, out: [
        "spectra",
        str(kit.run_file),
        "--channel",
        "acceleration.engine",
        "--against",
        "velocity.engine",
        "-o",
        str(out),
    ],
    "share": lambda kit, out: ["share", str(kit.run_file), "-o", f"{out}.zip"],
    "figures": lambda kit, out: ["figures", str(kit.run_file), "-o", str(out), "--as", "svg"],
    "criteria": lambda kit, _: ["criteria", str(kit.run_file), "--json"],
    "metrics": lambda kit, _: ["metrics", str(kit.run_file), "--json"],
    "metrics: recording": lambda kit, _: ["metrics", str(kit.recording_file), "--model", str(kit.model_file)],
    "listen": lambda kit, out: ["listen", str(kit.run_file), "-o", str(out)],
    **{f"study: {kind}": partial(_study_line, kind) for kind in STUDIES},
}
"""By command, with a word where one command is typed in several ways."""

WITHOUT_MODEL = frozenset({"examples", "loop", "reproduce", "schema", "serve"})
"""Commands that take neither a model nor anything made of one."""


def _remedies(kit: Kit) -> Path:
    """A remedy file with one candidate."""
    path = kit.folder / "remedies.toml"
    path.write_text('speeds = []\n[candidates]\n"inertia.engine.J" = { factor = [0.99, 1.01] }\n', encoding="utf-8")
    return path


def _data(kit: Kit) -> str:
    """A data file of a fit: the highest natural frequency."""
    from tests.compositions.calls import modes_data

    (row,) = modes_data(kit.model)["mode"]
    frequency = row["frequency"] if isinstance(row["frequency"], float) else f'"{row["frequency"]}"'
    path = kit.folder / "data.toml"
    path.write_text(f"[[mode]]\nnumber = {row['number']}\nfrequency = {frequency}\n", encoding="utf-8")
    return str(path)


def _turns(kit: Kit) -> list[str]:
    return ["--turns", "1", "--order", "1"] if kit.model.excitation.sweep is not None else []
