"""``gearrattle look``: list the contents of a measured file, and write a first mapping file for it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import gearrattle
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Json, OutputPath, number_or_text
from gearrattle.errors import ModelError, Problem

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.measured.look import Contents


def look(
    source: Path,
    /,
    *,
    output: OutputPath = None,
    time: str = "",
    sampled: str | None = None,
    json: Json = False,
) -> None:
    """List the channels of a measured file: units, rates, first samples; write a first mapping file.

    Parameters
    ----------
    source
        CSV, MAT, HDF5, ASAM MDF, UFF, WAV, or a saved run; or a mapping, whose file is looked at.
    output
        File for the mapping, ending in .toml; every command that takes a measured file takes it. Or a folder for
        report.html, summary.json, results.nc and figures/; or a file for the table, ending in .nc or .csv.
    time
        Name of the time column, if the file does not define it.
    sampled
        Rate of a file without times, such as "10 kHz".
    """
    if output is not None and output.is_file() and output.suffix.lower() == ".toml" and not _is_same(output, source):
        raise ModelError(Problem("-o", f'"{output}"', "already exists", "remove it, or choose another name"))
    rate = None if sampled is None else _rate(sampled)

    def work(_watch: Watch) -> Contents:
        return gearrattle.measured.look(source, time=time, sampled=rate)

    emit("contents", work, output, json=json, inputs=[source])


def _is_same(path: Path, other: Path) -> bool:
    return other.exists() and path.samefile(other)


def _rate(text: str) -> float:
    """Return a rate [Hz]."""
    from pydantic_core import PydanticCustomError

    from gearrattle.model import units
    from gearrattle.model.value_kinds import Quantity

    try:
        return Quantity(units.FREQUENCY, "positive").read(number_or_text(text), False)
    except PydanticCustomError as error:
        context = error.context or {}
        raise ModelError(Problem("--sampled", f'"{text}"', context["rule"], context["remedy"])) from None
