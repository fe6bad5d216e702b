"""Safe reading of files in the folder of a job, which somebody else may have made; damage is named."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from gearrattle.errors import GearRattleError, ModelError, Problem
from gearrattle.files import Refused, opened
from gearrattle.json_types import parsed_json
from gearrattle.writing import disk_is_full

_LARGEST = 100_000_000  # bytes: a view of a large study has a tenth


def problem_of(error: OSError) -> Problem:
    """Return what the machine refused as a problem."""
    words = (error.strerror or str(error)).lower()
    if disk_is_full(error):
        return Problem("disk", "", f"takes no more: {words}", "make room on the disk of the folder, and try again")
    return Problem("files", str(error.filename or ""), words, "see that the folder can be read and written")


def stored_text(path: Path, largest: int = _LARGEST) -> str:
    """Return the text of a file in the folder of a job; ModelError if it is no regular file, has more than so many
    bytes or holds no text, FileNotFoundError if there is none.
    """
    try:
        with opened(path) as stream:
            if os.fstat(stream.fileno()).st_size > largest:
                raise _damaged(path, f"is larger than {largest / 1e6:.0f} MB")
            return stream.read().decode("utf-8")
    except Refused as refused:
        raise _damaged(path, refused.rule) from None
    except FileNotFoundError:
        raise
    except (OSError, UnicodeDecodeError) as error:
        words = (error.strerror or "cannot be read").lower() if isinstance(error, OSError) else "holds no text"
        raise _damaged(path, words) from None


def stored_json(path: Path, largest: int = _LARGEST) -> Any:
    """Return what a JSON file in the folder of a job says; raises as ``stored_text``, and ModelError for no JSON."""
    try:
        return parsed_json(stored_text(path, largest))
    except ValueError as error:
        raise _damaged(path, f"is damaged: {error}") from None


def stored_object(path: Path, largest: int = _LARGEST) -> dict[str, Any]:
    """Return the object that a JSON file in the folder of a job holds; raises as ``stored_json``."""
    value = stored_json(path, largest)
    if not isinstance(value, dict):
        raise _damaged(path, "must hold a JSON object")
    return value


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn what a library raises on a damaged file into a ModelError that names the file; errors of this package pass
    unchanged.
    """
    try:
        yield
    except (GearRattleError, MemoryError, FileNotFoundError, PermissionError):
        raise
    except Exception as error:  # libraries that read a damaged file complain as they like
        if disk_is_full(error):
            raise
        raise _damaged(path, f"is damaged ({type(error).__name__})") from error


def _damaged(path: Path, rule: str) -> ModelError:
    return ModelError(Problem(f"{path.parent.name}/{path.name}", "", rule, "delete the run, and start it again"))
