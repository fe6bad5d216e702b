"""Columns of a measured record: CSV whose header names the units.

    t [s], T [N*m]
    0.000, 12.1
    0.001, 12.4

Lines that begin with # are comments; columns are parted by commas, semicolons or tabs, decimals by a point. Numbers are
read in one go; only where that fails is the file walked line by line to say where.

Takes a path; gives columns in SI.
"""

from __future__ import annotations

import itertools
import math
import os
import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from gearrattle.model import units
from gearrattle.model.table import did_you_mean, listed, shown
from gearrattle.model.units import Dimension, UnitError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

LARGEST = 200_000_000
"""A record has at most so many bytes."""
_CELL = re.compile(r"\s*([^\[\]]*?)\s*(?:\[([^\]]*)\])?\s*")
_LONGEST_LINE = 100_000
T = TypeVar("T")


class RecordError(ValueError):
    """A file that is no such record.

    Attributes:
        place: file, line and column.
        found: what stands there.
        rule, remedy: as in ``errors.Problem``.
    """

    def __init__(self, place: str, found: str, rule: str, remedy: str = "") -> None:
        super().__init__(rule)
        self.place, self.found, self.rule, self.remedy = place, found, rule, remedy


class Head(NamedTuple):
    """Name and unit of a column; unit None where no brackets stand."""

    name: str
    unit: str | None


class Columns(NamedTuple):
    """What was read: name to values in SI, each (N,); ``path`` as it is named in messages."""

    path: Path
    values: dict[str, NDArray[np.float64]]

    def place(self, row: int, name: str) -> str:
        """File, line and column of one sample, counted from 0."""
        with open(self.path, encoding="utf-8-sig") as stream:
            number, _ = next(itertools.islice(_kept(stream), row + 1, None))
        return f"{self.path}:{number}: {name}"


def read_columns(path: Path, wanted: Mapping[str, Dimension], dimensionless: bool) -> Columns:
    """Read some columns of a record.

    Args:
        path: the file, UTF-8.
        wanted: name of a column to what it measures.
        dimensionless: whether the columns are plain numbers without units.

    Raises:
        RecordError: the file is missing or no text, a column is missing or without its unit, a unit has the wrong
            dimension, a value is no finite number.
    """
    return Columns(path, _guarded(path, lambda number, header: _read(path, number, header, wanted, dimensionless)))


def read_all(path: Path, use: Callable[[str, str], bool]) -> tuple[list[Head], NDArray[np.float64]]:
    """Read columns as they stand: no unit is asked for, and NaN is a value.

    Args:
        path: the file, UTF-8.
        use: tells from name and unit whether a column is wanted; others need not be numbers.

    Returns:
        All heads, and the values (N, columns wanted).

    Raises:
        RecordError: the file is missing or no text, two columns have one name, a value is no number.
    """

    def read(number: int, header: str) -> tuple[list[Head], NDArray[np.float64]]:
        mark, heads = _header(path, header, "such as: t [s], n [rpm]")
        names = [head.name for head in heads]
        twice = next((name for index, name in enumerate(names) if name in names[:index]), None)
        if twice is not None:
            raise RecordError(f"{path}:{number}", shown(twice), "two columns have this name", "rename one of them")
        chosen = {head.name: index for index, head in enumerate(heads) if use(head.name, head.unit or "")}
        return heads, _numbers(path, mark, len(heads), chosen)

    return _guarded(path, read)


def _guarded(path: Path, read: Callable[[int, str], T]) -> T:
    """Open a record, hand over number and text of its first line, and put what the machine refuses in our words."""
    try:
        if os.path.isdir(path):
            raise RecordError(str(path), "a folder", "must be a CSV file")
        if os.path.getsize(path) > LARGEST:
            raise RecordError(str(path), f"more than {LARGEST // 1_000_000} MB", "a record must be smaller than that")
        with open(path, encoding="utf-8-sig") as stream:
            number, header = next(_kept(stream), (1, ""))
        return read(number, header)
    except FileNotFoundError:
        raise RecordError(str(path), "", "no such file", "a path is relative to the model file") from None
    except UnicodeDecodeError:
        raise RecordError(str(path), "", "must be a text in UTF-8") from None
    except OSError as error:
        raise RecordError(str(path), "", f"cannot be read: {(error.strerror or str(error)).lower()}") from None


def _kept(lines: Iterator[str]) -> Iterator[tuple[int, str]]:
    """Yield number and text of the lines that are neither blank nor comments."""
    for number, line in enumerate(lines, 1):
        if line.strip() and not line.lstrip().startswith("#"):
            yield number, line


def _read(
    path: Path, number: int, header: str, wanted: Mapping[str, Dimension], dimensionless: bool
) -> dict[str, NDArray[np.float64]]:
    import numpy as np

    place = f"{path}:{number}"
    example = "such as: " + ", ".join(f"{name} [{d.si}]" for name, d in wanted.items())
    mark, heads = _header(path, header, example)
    found = {head.name: (index, head.unit) for index, head in enumerate(heads)}
    missing = [name for name in wanted if name not in found]
    if missing:
        rule = f"no column has this name; there are {listed(shown(name) for name in found)}"
        raise RecordError(place, shown(missing[0]), rule, did_you_mean(missing[0], found) or example)
    factors = [_factor(place, name, found[name][1], d, dimensionless) for name, d in wanted.items()]
    use = {name: found[name][0] for name in wanted}
    table = _numbers(path, mark, len(heads), use)
    if table.size and not np.isfinite(table).all():
        raise _first_wrong(path, mark, use)
    return {name: table[:, k] * factor for k, (name, factor) in enumerate(zip(wanted, factors, strict=True))}


def _header(path: Path, header: str, example: str) -> tuple[str, list[Head]]:
    """Return the mark between columns, and their heads."""
    if not header or len(header) > _LONGEST_LINE:
        raise RecordError(str(path), "", "must begin with a line of column names and units", example)
    mark = next((mark for mark in (";", "\t") if mark in header), ",")
    cells = header.rstrip("\n").split(mark)
    matches = [(_CELL.fullmatch(cell), cell) for cell in cells]
    return mark, [Head(match[1].strip(), match[2]) if match else Head(cell.strip(), None) for match, cell in matches]


def _numbers(path: Path, mark: str, count: int, use: Mapping[str, int]) -> NDArray[np.float64]:
    """Read columns (N, columns) in one go; only where that fails the first wrong line is looked for."""
    import numpy as np

    try:
        with open(path, encoding="utf-8-sig") as stream, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a header without rows: too few points, which is said elsewhere
            rows = _rows(path, stream, mark, count)
            table = np.loadtxt(rows, delimiter=mark, usecols=list(use.values()), ndmin=2, comments=None)
    except RecordError:
        raise
    except ValueError:
        raise _first_wrong(path, mark, use) from None
    return table.reshape(-1, len(use))


def _rows(path: Path, stream: Iterator[str], mark: str, count: int) -> Iterator[str]:
    """Yield the lines below the header; each must have as many entries, for a decimal comma is easily overlooked."""
    for number, line in itertools.islice(_kept(stream), 1, None):
        if line.count(mark) != count - 1:
            remedy = "decimals are parted by a point" if line.count(mark) >= count else ""
            rule = f"must have {count}, as the header has"
            raise RecordError(f"{path}:{number}", f"{line.count(mark) + 1} entries", rule, remedy)
        yield line


def _factor(place: str, name: str, unit: str | None, dimension: Dimension, dimensionless: bool) -> float:
    """Return the factor of a column to SI."""
    if dimensionless:
        if unit:
            raise RecordError(place, f"{name} [{unit}]", "must have no unit: this model is dimensionless")
        return 1.0
    if not unit:
        rule = f"must name its unit of {dimension.name} in brackets"
        raise RecordError(place, name, rule, f"such as: {name} [{dimension.si}]")
    try:
        return units.convert(f"1 {unit}", dimension)
    except UnitError as error:
        raise RecordError(place, f"{name} [{unit}]", error.rule, error.remedy) from None


def _first_wrong(path: Path, mark: str, columns: Mapping[str, int]) -> RecordError:
    """Find the first line that cannot be read."""
    with open(path, encoding="utf-8-sig") as stream:
        for number, line in itertools.islice(_kept(stream), 1, None):
            cells = line.rstrip("\n").split(mark)
            for name, index in columns.items():
                place = f"{path}:{number}: {name}"
                try:
                    value = float(cells[index])
                except ValueError:
                    value = math.nan
                if not math.isfinite(value):
                    remedy = "decimals are parted by a point" if "," in cells[index] else ""
                    return RecordError(place, shown(cells[index].strip()), "must be a finite number", remedy)
    return RecordError(str(path), "", "must be a table of numbers")
