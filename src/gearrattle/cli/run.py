"""``gearrattle run``: the whole procedure, from the model file to the report."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from gearrattle.cli.options import Json, Settings

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.pipeline import Findings

_DEFAULTS = Settings()


def run(
    model: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    settings: Settings = _DEFAULTS,
    json: Json = False,
) -> None:
    """Do everything: check, modes, simulate, judge, report.

    Writes report.html, results.nc, summary.json and figures/ into a folder, all or nothing.

    Parameters
    ----------
    model
        Model file (TOML).
    output
        Folder for the results; default: the model file's name with "-results", here.
    """
    import gearrattle
    from gearrattle.cli.background import watched
    from gearrattle.cli.page_folder import page_folder

    driveline = gearrattle.load(model)
    folder = output if output is not None else Path(f"{model.stem}-results")

    def work(watch: Watch) -> Findings:
        from gearrattle import pipeline, report

        findings = pipeline.run(driveline, **settings.arguments(), progress=watch, phase=watch.enter)
        watch.enter("writing the report")
        report.fill(findings, staging.path)
        return findings

    with page_folder(folder) as staging:
        findings = watched(work)
        text = (staging.path / "summary.json").read_text(encoding="utf-8") if json else ""
        staging.commit()
    if json:
        print(text, end="")
    else:
        print(f"{findings.verdict.verdict}: {findings.verdict.sentence}")
    from gearrattle.report.summary import notes

    for note in notes(findings):
        print(f"note: {note}", file=sys.stderr)
    print(f"report: {folder / 'report.html'}", file=sys.stderr if json else sys.stdout)
