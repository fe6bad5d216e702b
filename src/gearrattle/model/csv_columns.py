"""Columns of a measured record: CSV whose header names the units.

All numbers are read at once. Only if that fails, the file is read line by line to find the wrong lines. ``csv_layout``
determines encoding, separators and rows of the file.
"""

from __future__ import annotations

import itertools
import math
import os
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from gearrattle.files import Refused, within_limit
from gearrattle.model import units
from gearrattle.model.csv_layout import Layout, RecordError, count_lines, layout_of
from gearrattle.model.table import did_you_mean, listed, shown
from gearrattle.model.time_stamps import FromFirst, over_midnight
from gearrattle.model.units import Dimension, UnitError
from gearrattle.wording import counted

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_MOST_SEARCHED = 100_000  # lines after the first wrong line that are searched for more wrong lines: 0.5 s
T = TypeVar("T")
Ask = Callable[[int, int], None]
"""Checks whether so many rows and columns of numbers may be read; raises ``Refused``."""


def _ask(rows: int, columns: int) -> None:
    """Check that the memory for a table of numbers is within the limit."""
    within_limit(8 * rows * columns)


class Columns(NamedTuple):
    """Columns of a record: values (N,) in SI by name; ``path`` is the name of the file in messages."""

    path: Path
    values: dict[str, NDArray[np.float64]]
    layout: Layout

    def unit(self, name: str) -> str:
        """Return the unit of a column in the file; empty if it has none."""
        return next(head.unit or "" for head in self.layout.heads if head.name == name)

    def place(self, row: int, name: str) -> str:
        """Return file, line and column of one sample, whose row counts from 0."""
        number, _ = next(itertools.islice(self.layout.rows(self.path), row, None))
        return f"{self.path}:{number}: {name}"


def read_columns(path: Path, wanted: Mapping[str, Dimension], dimensionless: bool) -> Columns:
    """Read some columns of a record.

    RecordError for a missing file or a file that is not text, a missing column or a column without unit, two columns
    with the same name, a unit of the wrong dimension, and a value that is not a finite number.
    """
    return _guarded(path, lambda layout, rows: _read(path, layout, rows, wanted, dimensionless))


def read_all(path: Path, use: Callable[[str, str], bool], ask: Ask = _ask) -> tuple[Layout, NDArray[np.float64]]:
    """Read the columns (N, columns) for which ``use(name, unit)`` is true, without converting units; with the layout.

    Units may be missing; NaN is allowed, and an empty entry is NaN. ``ask`` is called before the numbers are read.
    RecordError for a missing file or a file that is not text, two columns with the same name, or a value that is not a
    number.
    """

    def read(layout: Layout, rows: int) -> tuple[Layout, NDArray[np.float64]]:
        chosen = {head.name: index for index, head in enumerate(layout.heads) if use(head.name, head.unit or "")}
        table, notes = _numbers(path, layout, chosen, lambda columns: ask(rows, columns), gaps=True)
        return layout._replace(notes=(*layout.notes, *notes)), table

    return _guarded(path, read)


def _guarded(path: Path, read: Callable[[Layout, int], T]) -> T:
    """Determine the layout of a record and call ``read`` with it and the number of lines; errors become RecordError."""
    try:
        if os.path.isdir(path):
            raise RecordError(str(path), "a folder", "must be a CSV file")
        lines = count_lines(path)
        layout = layout_of(path)
        first: dict[str, int] = {}
        for index, (name, _) in enumerate(layout.heads):
            if name and (before := first.setdefault(name, index)) < index:
                rule = f"columns {before + 1} and {index + 1} have this name"
                raise RecordError(f"{path}:{layout.names_line}", shown(name), rule, "rename one of them")
        return read(layout, lines - layout.first_row)
    except FileNotFoundError:
        raise RecordError(str(path), "", "no such file", "a path is relative to the model file") from None
    except Refused as error:
        raise RecordError(str(path), "", error.rule, error.remedy) from None
    except OSError as error:
        raise RecordError(str(path), "", f"cannot be read: {(error.strerror or str(error)).lower()}") from None


def _read(path: Path, layout: Layout, rows: int, wanted: Mapping[str, Dimension], dimensionless: bool) -> Columns:
    import numpy as np

    location = f"{path}:{layout.names_line}"
    example = "such as: " + ", ".join(f"{name} [{d.si}]" for name, d in wanted.items())
    columns = {head.name: (index, head.unit) for index, head in enumerate(layout.heads)}
    missing = [name for name in wanted if name not in columns]
    if missing:
        rule = f"no column has this name; there are {listed(shown(name) for name in columns)}"
        raise RecordError(location, shown(missing[0]), rule, did_you_mean(missing[0], columns) or example)
    factors = [_factor(location, name, columns[name][1], d, dimensionless) for name, d in wanted.items()]
    use = {name: columns[name][0] for name in wanted}
    table, notes = _numbers(path, layout, use, lambda columns: _ask(rows, columns))
    if table.size and not np.isfinite(table).all():
        raise _first_wrong(path, layout, use)
    table *= factors
    values = {name: table[:, k] for k, name in enumerate(wanted)}
    return Columns(path, values, layout._replace(notes=(*layout.notes, *notes)))


def _numbers(
    path: Path, layout: Layout, use: Mapping[str, int], ask: Callable[[int], None], *, gaps: bool = False
) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Read columns (N, columns) at once, and notes on them; if that fails, find the first wrong line.

    ``ask`` is called before the numbers are read. With ``gaps`` an empty entry is NaN, otherwise it is refused.
    """
    import numpy as np

    if not use:
        return np.empty((0, 0)), ()
    # columns of numbers and of time stamps
    stamps = _stamps(layout, use)
    wanted = list(dict.fromkeys([*use.values(), *stamps]))
    ask(len(wanted) + bool(stamps))  # one more column for the steps of time stamps, by which midnights are found
    # first as plain numbers, then with empty entries as NaN
    ways: list[Any] = [stamps or None, dict.fromkeys(wanted, _or_nan) | stamps] if gaps else [stamps or None]
    for converters in ways:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # a header without rows: the error "too few points" is raised elsewhere
                table = np.loadtxt(
                    _rows(path, layout),
                    delimiter=layout.delimiter,
                    usecols=wanted,
                    ndmin=2,
                    comments=None,
                    quotechar='"',
                    converters=converters,
                )
        except RecordError:  # of a row, as the others are that are wrong
            break
        except ValueError:
            continue
        return _since_first(table.reshape(-1, len(wanted)), layout, use, stamps)
    # find the first wrong line
    raise _first_wrong(path, layout, use, gaps=gaps)


def _stamps(layout: Layout, use: Mapping[str, int]) -> dict[int, FromFirst]:
    """Return by index the readers of the wanted columns of time stamps."""
    stamps = layout.stamps
    if stamps is None or stamps.column not in use.values():
        return {}
    readers = {stamps.column: FromFirst(stamps.first)}
    if stamps.day_index is not None:
        readers[stamps.day_index] = FromFirst(stamps.first_day)
    return readers


def _since_first(
    table: NDArray[np.float64], layout: Layout, use: Mapping[str, int], stamps: Mapping[int, FromFirst]
) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Add the dates of the rows to their clock times, or a day at every midnight; remove the column of dates."""
    if not stamps or layout.stamps is None or not table.size:
        return table[:, : len(use)], ()
    own = list(use.values()).index(layout.stamps.column)
    midnights = 0
    if len(stamps) > 1:
        table[:, own] += table[:, len(use)]
    elif stamps[layout.stamps.column].first.day is None:
        table[:, own], midnights = over_midnight(table[:, own])
    name = layout.heads[layout.stamps.column].name
    note = f"{name}: the clock passes midnight {counted(midnights, 'time')}; a day is added at each"
    return table[:, : len(use)], (note,) if midnights else ()


def _or_nan(cell: str) -> float:
    """Return a number; NaN for an empty entry."""
    if "_" in cell:  # Python reads 1_0 as ten
        raise ValueError(cell)
    return float(cell.strip() or "nan")


def _rows(path: Path, layout: Layout) -> Iterator[str]:
    """Yield the rows; each must have as many entries as there are names."""
    plain = not (layout.quoted or layout.decimal_comma)
    separators = len(layout.heads) - 1
    for number, line in layout.rows(path):
        is_doubtful = line.count(layout.separator) != separators or '"' in line
        if is_doubtful and (error := _wrong_count(f"{path}:{number}", line, layout)):
            raise error
        yield line if plain else layout.readable(line)


def _wrong_count(location: str, line: str, layout: Layout) -> RecordError | None:
    """Return the error of a row whose number of entries differs from the number of names."""
    separator = layout.separator
    count = len(layout.heads)
    entries = line.count(separator) + 1 if '"' not in line else len(layout.cells(line))
    if entries == count:
        return None
    several = separator == "," and entries > count
    remedy = "decimals need a point where commas part columns" if several else ""
    return RecordError(location, f"{entries} entries", f"must have {count}, as the header has", remedy)


def _factor(location: str, name: str, unit: str | None, dimension: Dimension, dimensionless: bool) -> float:
    """Return the factor of a column to SI."""
    if dimensionless:
        if unit:
            raise RecordError(location, f"{name} [{unit}]", "must have no unit: this model is dimensionless")
        return 1.0
    if not unit:
        rule = f"must name its unit of {dimension.name} in brackets"
        raise RecordError(location, name, rule, f"such as: {name} [{dimension.si}]")
    try:
        return units.convert(f"1 {unit}", dimension)
    except UnitError as error:
        raise RecordError(location, f"{name} [{unit}]", error.rule, error.remedy) from None


def _first_wrong(path: Path, layout: Layout, columns: Mapping[str, int], *, gaps: bool = False) -> RecordError:
    """Return the error of the first line that cannot be read, with the numbers of the other wrong lines."""
    wrong = _wrong_rows(path, layout, columns, gaps=gaps)
    _, error = next(wrong, (0, RecordError(str(path), "", "must be a table of numbers")))
    others = []
    with suppress(RecordError):  # of a line too long, which is reported once all before it are mended
        for number, _ in wrong:
            others.append(str(number))
    if others:
        count = f"{len(others):,} lines more are".replace(",", " ") if len(others) > 1 else "one line more is"
        error.rule += f"; {count} wrong: {listed(others)}"
    return error


def _wrong_rows(
    path: Path, layout: Layout, columns: Mapping[str, int], *, gaps: bool
) -> Iterator[tuple[int, RecordError]]:
    """Yield number and first error of lines that cannot be read, searching ``_MOST_SEARCHED`` lines after the first."""
    stamps = _stamps(layout, columns)
    last = math.inf
    for number, line in layout.rows(path):
        if number > last:
            return
        if error := _wrong_row(f"{path}:{number}", line, layout, columns, stamps, gaps=gaps):
            last = min(last, number + _MOST_SEARCHED)
            yield number, error


def _wrong_row(
    location: str,
    line: str,
    layout: Layout,
    columns: Mapping[str, int],
    stamps: Mapping[int, FromFirst],
    *,
    gaps: bool,
) -> RecordError | None:
    """Return the first error of a line; None if the line can be read."""
    if error := _wrong_count(location, line, layout):
        return error
    cells = layout.cells(line)
    for name, index in columns.items():
        cell = cells[index]
        if index in stamps:
            if not _is_read(cell, stamps[index]):
                rule = f"must be a time stamp like the first, {layout.stamps.first if layout.stamps else ''}"
                return RecordError(f"{location}: {name}", shown(cell), rule)
            continue
        value = _number(layout.with_points(cell))
        if not math.isfinite(value) and not (gaps and cell in ("", "nan")):
            other = math.isfinite(_number(cell.replace(",", ".")))
            remedy = "part decimals by a point, or by a comma, in all rows alike" if other else ""
            return RecordError(f"{location}: {name}", shown(cell), "must be a finite number", remedy)
    return None


def _is_read(cell: str, stamp: FromFirst) -> bool:
    """Whether an entry is a time stamp like the first."""
    try:
        stamp(cell)
    except ValueError:
        return False
    return True


def _number(text: str) -> float:
    """Return a number; NaN for a text that is no number."""
    try:
        return _or_nan(text)
    except ValueError:
        return math.nan
