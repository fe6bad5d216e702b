"""The report: findings as a page for people, a file for machines, and a file of results.

``write`` puts into a folder:

    report.html     one self-contained page, verdict first
    summary.json    the same for machines
    results.nc      the whole motion, netCDF-4
    figures/        every figure as SVG, and the charts themselves, for ``figures``

all of it or nothing. Takes Findings from the pipeline.
"""

from __future__ import annotations

import os
from pathlib import Path

from gearrattle.pipeline import Findings
from gearrattle.report.saved import write_json
from gearrattle.report.summary import summary
from gearrattle.writing import Staging

__all__ = ["fill", "summary", "write"]


def write(findings: Findings, folder: str | os.PathLike[str]) -> Path:
    """Write the report into a folder, which need not exist; what else is in it stays.

    Returns:
        The path of report.html.

    Raises:
        OSError: the folder cannot be written, or the disk is full; then nothing has changed.
    """
    with Staging(folder) as staging:
        fill(findings, staging.path)
        staging.commit()
    return staging.destination / "report.html"


def fill(findings: Findings, folder: Path) -> None:
    """Write all files of the report into an existing empty folder."""
    from gearrattle.report.page import fill_page
    from gearrattle.report.run_report import run_report

    fill_page(run_report(findings), folder)
    write_json(summary(findings), folder / "summary.json", "run summary")
    findings.run.save(folder / "results.nc")
