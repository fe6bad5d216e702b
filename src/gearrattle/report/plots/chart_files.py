"""Charts as a file, so that figures can be drawn again with another width or format, without computing again.

The file is a NumPy archive (``.npz``: NumPy Enhancement Proposal 1, in a ZIP file). One entry is JSON with the charts,
in which ``{"array": k}`` is the k-th array of the archive. Reading the file executes nothing in it.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.files import Refused, check_archive
from gearrattle.formats import check_format, format_name
from gearrattle.report.plots.chart import Band, Bars, Cells, Chart, Heat, Key, Label, Line, Panel, Rule
from gearrattle.trajectory import Array

_NOUNS = {noun.__name__: noun for noun in (Band, Bars, Cells, Chart, Heat, Key, Label, Line, Panel, Rule)}


def packed_charts(charts: Sequence[Chart]) -> bytes:
    """Return charts as an archive; the same charts give the same bytes."""
    arrays: list[Array] = []
    description = {"format": format_name("charts"), "charts": [_packed(chart, arrays) for chart in charts]}
    words = np.frombuffer(json.dumps(description, ensure_ascii=False).encode("utf-8"), np.uint8)
    content = BytesIO()
    entries: dict[str, Any] = {"charts": words, **{str(k): array for k, array in enumerate(arrays)}}
    np.savez_compressed(content, **entries)
    return content.getvalue()


def read_charts(path: Path) -> list[Chart]:
    """Read what ``packed_charts`` wrote.

    ModelError for another kind of file, a damaged file or one of a later version; OSError if it cannot be read.
    """
    try:
        check_archive(path)
        with np.load(path, allow_pickle=False) as archive:
            content = json.loads(archive["charts"].tobytes().decode("utf-8"))
            arrays = {int(name): archive[name] for name in archive.files if name != "charts"}
        name = content["format"]
        check_format(f"gearrattle charts {name}" if isinstance(name, int) else name, path, "charts")
        made = [_made(packed, arrays) for packed in content["charts"]]
        if not all(isinstance(chart, Chart) for chart in made):
            raise TypeError("not a chart")
        return made
    except Refused as error:
        raise ModelError(Problem(str(path), "", error.rule, error.remedy)) from None
    except (ModelError, MemoryError, FileNotFoundError, PermissionError):
        raise
    except Exception as error:  # for a damaged archive, the readers of its parts raise many types
        rule = f"holds no charts, or is damaged ({type(error).__name__})"
        raise ModelError(Problem(str(path), "", rule, "run the command that wrote the folder again")) from None


def _packed(value: Any, arrays: list[Array]) -> Any:
    """Return a value in JSON types; arrays are appended to ``arrays``."""
    if is_dataclass(value):
        return {
            "noun": type(value).__name__,
            **{f.name: _packed(getattr(value, f.name), arrays) for f in fields(value)},
        }
    if isinstance(value, np.ndarray):
        arrays.append(value)
        return {"array": len(arrays) - 1}
    if isinstance(value, tuple | list):
        return [_packed(entry, arrays) for entry in value]
    return value.item() if isinstance(value, np.generic) else value


def _made(value: Any, arrays: dict[int, Array]) -> Any:
    """Return the value that ``_packed`` has converted."""
    if isinstance(value, list):
        return tuple(_made(entry, arrays) for entry in value)
    if not isinstance(value, dict):
        return value
    if "array" in value:
        return arrays[value["array"]]
    return _NOUNS[value["noun"]](**{name: _made(entry, arrays) for name, entry in value.items() if name != "noun"})
