"""Axis, unit, counted values and scaling, declared for every reader.

A reader that gets one of these wrong gives wrong numbers without a message. So each format has one row here. The table
of docs/howto/measured-data.md is this one, and every cell has its test.
"""

from __future__ import annotations

from typing import NamedTuple


class Answers(NamedTuple):
    """Times and values of a format: what its reader takes for them."""

    axis: str
    unit: str
    counts: str
    scaled: str


ANSWERS: dict[str, Answers] = {
    "run": Answers("the variable `time`", "s", "all", "not scaled"),
    "hdf5": Answers(
        "the only dimension scale of its length that is of times, else a vector called `time` or `t`, or in s, ms or "
        "us, that is as long and nearest in the tree",
        "attribute `units`, also `seconds since ...`; else s",
        "all but `_FillValue`, `missing_value`, netCDF's own fill values, and what lies outside of `valid_range`, "
        "`valid_min`, `valid_max`: gaps",
        "`scale_factor` times the stored number, plus `add_offset`; `_Unsigned` is obeyed",
    ),
    "netcdf3": Answers(
        "the variable called as the dimension, else as HDF5",
        "attribute `units`, also `seconds since ...`; else s",
        "as HDF5; netCDF's own fill values for numbers of two bytes and more",
        "as HDF5",
    ),
    "mat": Answers(
        "a variable called `time` or `t` that is as long; `X.Data` beside `Y(k).Data`; `Tstart` and `Tinterval`",
        "`Unit` beside `Data`; else s",
        "all; NaN is a gap",
        "not scaled",
    ),
    "mdf4": Answers(
        "the master channel of time of the group; one of an angle or a distance is left out, or refused; without one: "
        "`sampled` or `time` of a mapping",
        "of the master channel; s if it has none",
        "all but those marked invalid, one by one or all of a channel: gaps",
        "by the conversion rule of the channel",
    ),
    "tdms": Answers(
        "`wf_increment` and `wf_start_offset` of the channel, else a channel called `time` or `t`, or in s, ms or us",
        "s; of a channel of times `unit_string`, else s",
        "all; NaN is a gap",
        "by the scaling rule of the channel",
    ),
    "xlsx": Answers(
        "as CSV; cells with dates and clock times count as time stamps",
        "as CSV",
        "all; an empty cell and an error such as `#N/A` are gaps; of a formula the value that Excel stored",
        "not scaled",
    ),
    "wav": Answers(
        "the number of the sample",
        "the rate of the header",
        "all; without a length in the header those up to the end of the file",
        "whole numbers: full scale is 1",
    ),
    "uff": Answers(
        "the abscissa of the dataset, of type 17 or in a unit of time; another one (frequency, speed, order) is left "
        "out, or refused",
        "of record 8",
        "as many as the header counts",
        "not scaled; the unit of a ratio is numerator over denominator",
    ),
    "lvm": Answers(
        "the X column before the channel, else `X0` and `Delta_X`; segments that begin at the same X are parted by "
        "their dates and clock times",
        "s; another `X_Dimension` than time is refused",
        "the first `Samples` rows of a segment; an empty entry is a gap",
        "not scaled",
    ),
    "csv": Answers(
        "the column called `time` or `t`, or in s, ms or us, or of time stamps",
        "in the names or in a row of units; else s",
        "all; an empty entry and NaN are gaps",
        "not scaled",
    ),
}
"""The answers of every reader, by the name of its format."""
