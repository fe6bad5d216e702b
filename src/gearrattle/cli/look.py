"""``gearrattle look``: what a measured file holds, and a mapping file to begin with."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from gearrattle.cli.options import Json

if TYPE_CHECKING:
    from gearrattle.calls.look import Contents

_HEADS = ("channel", "unit", "quantity", "samples", "rate [Hz]", "from [s]", "to [s]", "smallest", "largest", "first")


def look(
    source: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    time: str = "",
    sampled: str | None = None,
    json: Json = False,
) -> None:
    """List the channels of a measured file: units, rates, first samples; write a mapping file to begin with.

    Parameters
    ----------
    source
        CSV, MAT, HDF5, ASAM MDF, UFF, WAV, or a saved run.
    output
        File for the mapping, ending in .toml; every command that takes a measured file takes it.
    time
        Name of the column of times, where the file does not tell.
    sampled
        Rate of a file without times, such as "10 kHz".
    """
    import gearrattle
    from gearrattle.cli.model_output import check_output
    from gearrattle.errors import ModelError, Problem
    from gearrattle.json_types import json_text

    check_output(output, source)
    if output is not None and output.exists():
        raise ModelError(Problem("-o", f'"{output}"', "is there already", "remove it, or choose another name"))
    contents = gearrattle.look(source, time=time, sampled=None if sampled is None else _rate(sampled))
    if output is not None:
        _save(contents, output)
    if json:
        print(json_text({**contents.to_dict(), "output": None if output is None else str(output)}))
        return
    print(f"{contents.source}: {contents.format}")
    _print_table(contents)
    for note in contents.notes:
        print(f"note: {note}", file=sys.stderr)
    if output is not None:
        print(f"saved: {output}")


def _print_table(contents: Contents) -> None:
    """Print a line a channel."""
    from gearrattle.cli.columns import columns

    rows = []
    for row in contents.table.to_dict("records"):
        quantity = f"{row['quantity'] or '?'}{' of ' + row['subject'] if row['subject'] else ''}"
        rate = f"{row['rate']:.6g}{'' if row['uniform'] else ' (mean)'}"
        numbers = (f"{row[key]:.6g}" for key in ("begin", "end", "smallest", "largest"))
        first = " ".join(f"{value:.4g}" for value in row["first"])
        rows.append((row["channel"], row["unit"], quantity, str(row["samples"]), rate, *numbers, first))
    print(columns(_HEADS, rows))


def _save(contents: Contents, output: Path) -> None:
    """Write the mapping, whole or not at all."""
    from gearrattle.writing import Staging

    with Staging(output.parent) as staging:
        (staging.path / output.name).write_text(contents.mapping(output.parent), encoding="utf-8")
        staging.commit()


def _rate(text: str) -> float:
    """Return a rate [Hz]."""
    from pydantic_core import PydanticCustomError

    from gearrattle.cli.options import number_or_text
    from gearrattle.errors import ModelError, Problem
    from gearrattle.model import units
    from gearrattle.model.quantity import Quantity

    try:
        return Quantity(units.FREQUENCY, "positive").read(number_or_text(text), False)
    except PydanticCustomError as error:
        context = error.context or {}
        raise ModelError(Problem("--sampled", f'"{text}"', context["rule"], context["remedy"])) from None
