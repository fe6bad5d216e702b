"""``gearrattle loop``: stages, hysteresis and preload of a damper from its measured torque-angle loop."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

import gearrattle
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Json, OutputPath, Whole
from gearrattle.errors import ModelError, Problem
from gearrattle.wording import listed

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.measured.identification.loop_result import LoopFit


@Parameter(name="*")
@dataclass(frozen=True)
class Reading:
    """How the file is read, the fit done and the coupling named."""

    stages: Annotated[str | None, Parameter(help="On each side: 3, or 3,2 (drive, coast); default: by BIC.")] = None
    angle: Annotated[str, Parameter(help="Name of the angle's column.")] = "angle"
    torque: Annotated[str, Parameter(help="Name of the torque's column.")] = "torque"
    name: Annotated[str, Parameter(help="Of the coupling.")] = "damper"
    between: Annotated[str, Parameter(help="The inertias it joins, parted by a comma.")] = "flywheel,hub"
    bootstrap: Annotated[Whole, Parameter(help="Resample residuals so many times to check the errors.")] = 0
    seed: Annotated[Whole, Parameter(help="Of the resampling.")] = 0

    def arguments(self) -> dict[str, Any]:
        """Return the settings as keyword arguments of ``fit_loop``."""
        return {**vars(self), "stages": _numbers(self.stages), "between": _pair(self.between)}


_DEFAULTS = Reading()


def loop(
    data: Path,
    /,
    *,
    output: OutputPath = None,
    figure: Path | None = None,
    reading: Reading = _DEFAULTS,
    json: Json = False,
) -> None:
    """Fit the stages of a coupling to a measured torque-angle loop, with standard errors.

    Parameters
    ----------
    data
        CSV file with a header that names the units, such as: angle [deg], torque [N*m]. One whole slow cycle at least.
    output
        File for the fitted [[coupling]], ending in .toml; or a folder for report.html, summary.json, results.nc and
        figures/; or a file for the numbers, ending in .nc or .csv, or for the figure. Default: the answer on the
        terminal only.
    figure
        File for the fitted law drawn over the loop, ending in .svg; for print .pdf, .eps, .png or .tiff.
    """
    _check_figure(figure)

    def work(_watch: Watch) -> LoopFit:
        fit = gearrattle.identification.fit_loop(data, **reading.arguments())
        if figure is not None:
            fit.save(figure)
        return fit

    emit("loop fit", work, output, json=json, inputs=[data])
    if figure is not None:
        print(f"saved: {figure}", file=sys.stderr if json else sys.stdout)


def _check_figure(figure: Path | None) -> None:
    from gearrattle.report.presentation import FIGURE_ENDINGS
    from gearrattle.report.saved import check_target

    if figure is None:
        return
    if figure.suffix.lower() not in FIGURE_ENDINGS:
        raise ModelError(Problem("--figure", f'"{figure}"', f"must end in {listed(FIGURE_ENDINGS, 'or')}"))
    check_target(figure, FIGURE_ENDINGS, "--figure")


def _numbers(text: str | None) -> int | tuple[int, int] | None:
    """Return how many stages a text asks for."""
    if text is None:
        return None
    try:
        numbers = [int(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 2):
        rule = "must be one whole number, or two parted by a comma: drive side and coast side"
        raise ModelError(Problem("--stages", f'"{text}"', rule, "such as --stages 3,2"))
    return numbers[0] if len(numbers) == 1 else (numbers[0], numbers[1])


def _pair(text: str) -> tuple[str, str]:
    """Return the two names of a text."""
    first, comma, second = (part.strip() for part in text.partition(","))
    if not (first and comma and second) or "," in second:
        raise ModelError(
            Problem("--between", f'"{text}"', "must be two names parted by a comma", "such as flywheel,hub")
        )
    return first, second
