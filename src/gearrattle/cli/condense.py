"""``gearrattle condense``: small matrices that serve a band, clearances free to open and close."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from gearrattle.cli.options import Json, number_or_text

if TYPE_CHECKING:
    from gearrattle.calls.condense import Condensed

_ENDINGS = (".npz", ".mat")


def condense(
    model: Path,
    /,
    *,
    up_to: str,
    method: str = "craig-bampton",
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    keep: Annotated[Sequence[str], Parameter(negative="")] = (),
    limit: float = 0.05,
    margin: float = 3.0,
    json: Json = False,
) -> None:
    """Write a driveline in few coordinates: mass, damping and stiffness matrices, and their error in the band.

    Parameters
    ----------
    model
        Model file (TOML).
    up_to
        End of the band, e.g. "75 Hz".
    method
        "craig-bampton", "guyan", "modal" or "lumping".
    output
        File for the matrices, ending in .npz (NumPy) or .mat (MATLAB).
    keep
        Name of an element whose ends stay free. May be repeated. Default: every element with a clearance.
    limit
        Largest relative error of a natural frequency in the band.
    margin
        Modes up to margin times the band's end are represented.
    """
    import gearrattle
    from gearrattle.cli.background import watched
    from gearrattle.json_types import json_text

    _check(output)
    driveline = gearrattle.load(model)
    band = number_or_text(up_to)

    def work(_watch: Any) -> Condensed:
        return gearrattle.condense(
            driveline,
            up_to if band is None else band,
            method=method,
            keep=keep or None,
            limit=limit,
            margin=margin,
        )

    condensed = watched(work)
    if output is not None:
        _save(condensed, output)
    if json:
        print(json_text({**condensed.to_dict(), "output": None if output is None else str(output)}))
        return
    print(condensed.report)
    if output is not None:
        print(f"saved: {output}")


def _check(output: Path | None) -> None:
    """Refuse a file of another format before anything is computed."""
    from gearrattle.errors import ModelError, Problem

    if output is None:
        return
    if output.suffix not in _ENDINGS:
        raise ModelError(Problem("-o", f'"{output}"', f"must end in {' or '.join(_ENDINGS)}"))
    if output.is_dir():
        raise ModelError(Problem("-o", f'"{output}"', "is a folder; a file is needed"))


def _save(condensed: Condensed, output: Path) -> None:
    """Write the matrices and the names of their rows and columns, whole or not at all."""
    import numpy as np
    from scipy.io import savemat

    from gearrattle.formats import format_name
    from gearrattle.writing import Staging

    names = {
        key: np.array(getattr(condensed, key), dtype=np.str_) for key in ("inertia_names", "coordinates", "clearances")
    }
    names["format"] = np.array([format_name("matrices")])
    with Staging(output.parent) as staging:
        target = staging.path / output.name
        if output.suffix == ".npz":
            arrays: dict[str, Any] = {**condensed.matrices, **names}
            np.savez(target, **arrays)
        else:
            savemat(target, {**condensed.matrices, **{key: value.astype(object) for key, value in names.items()}})
        staging.commit()
