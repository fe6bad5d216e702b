"""Layout of a study's Dataset: its axes, the values that scatter, and the outputs that are codes.

The grid is the dimensions of ``outcome``; an output may have one more, its subjects (parts, inertias).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.model.table import did_you_mean
from gearrattle.studies.case_runs import DONE
from gearrattle.studies.designs import DESIGNS, ONE_AT_A_TIME
from gearrattle.studies.output import REGIME, SEVERITY, VERDICT, VERDICT_SEVERITY
from gearrattle.studies.plan import SAMPLE
from gearrattle.studies.stored_studies import OUTCOME

if TYPE_CHECKING:
    import xarray as xr


RATTLES = "rattles"


def axes_in(data: xr.Dataset) -> tuple[str, ...]:
    """Names of the axes, without samples."""
    return tuple(str(name) for name in data[OUTCOME].dims if name != SAMPLE)


def scattered(data: xr.Dataset) -> tuple[str, ...]:
    """Paths of the values that scatter, by name: Zarr keeps no order."""
    return tuple(
        sorted(str(name) for name, values in data.coords.items() if values.dims == (SAMPLE,) and name != SAMPLE)
    )


def sampling_of(data: xr.Dataset) -> str:
    """Name of the method that chose the samples; empty if it is not stated."""
    return str(data.attrs.get("sampling", ""))


def sampled_in(data: xr.Dataset) -> tuple[str, ...]:
    """Paths of the values that scatter, in the order of the design."""
    return tuple(str(name) for name in data.attrs.get("sampled", ())) or scattered(data)


def independent(data: xr.Dataset) -> xr.Dataset:
    """Return the samples of a study that are independent of each other; all cases of one without samples."""
    method = sampling_of(data)
    if SAMPLE not in data.dims or method not in DESIGNS:
        return data
    independent_cases = data.isel({SAMPLE: DESIGNS[method].independent(len(scattered(data)), data.sizes[SAMPLE])})
    return independent_cases.assign_attrs(sampling="")  # what is left is no whole design


def base_case(data: xr.Dataset) -> xr.Dataset:
    """Return the case of the model itself in a study of one value at a time; other studies as they are."""
    if SAMPLE not in data.dims or sampling_of(data) != ONE_AT_A_TIME:
        return data
    return data.isel({SAMPLE: 0}).drop_vars(scattered(data)).assign_attrs(sampling="")


def has_probabilities(data: xr.Dataset) -> bool:
    """Whether some samples are independent of each other, so that shares of them are probabilities."""
    return SAMPLE in data.dims and sampling_of(data) != ONE_AT_A_TIME


def outputs_in(data: xr.Dataset) -> tuple[str, ...]:
    """Names of the outputs."""
    return tuple(str(name) for name in data.data_vars if name != OUTCOME)


def words_of(values: xr.DataArray) -> tuple[str, ...]:
    """Meanings of the codes of an output; empty for numbers."""
    return tuple(str(values.attrs.get("flag_meanings", "")).split())


def subject_of(data: xr.Dataset, output: str) -> str:
    """The dimension of an output's subjects; empty if it is one number per case."""
    return next((str(name) for name in data[output].dims if name not in data[OUTCOME].dims), "")


def values_of(data: xr.Dataset, output: str) -> xr.DataArray:
    """An output for the subjects it applies to: the Dataset has NaN, or no code (-1), for the others."""
    values = data[output]
    applies = str(data[output].attrs.get("applies_to", "")).split()
    return values.sel({subject_of(data, output): applies}) if applies else values


def subject_names(data: xr.Dataset, output: str) -> list[str]:
    """Names of the subjects an output applies to; one empty name if it is one number per case."""
    subject = subject_of(data, output)
    return [str(name) for name in values_of(data, output)[subject].values] if subject else [""]


def units_of(data: xr.Dataset, output: str) -> dict[str, str]:
    """Units of an output by subject, "" for a plain number; one entry without a name if it has no subjects."""
    names = subject_names(data, output)
    unit = str(data[output].attrs.get("units", ""))
    units = unit.split(", ") if ", " in unit else [unit] * len(names)
    return {name: "" if one == "1" else one for name, one in zip(names, units, strict=True)}


def numbers_of(values: xr.DataArray) -> xr.DataArray:
    """An output as floats, NaN where there is none."""
    floats = values.astype(np.float64)
    return floats.where(floats >= 0.0) if words_of(values) else floats


def output_in(data: xr.Dataset, output: str, *, codes: bool = False) -> xr.DataArray:
    """Return an output, for the subjects it applies to.

    ModelError: this is no study's Dataset, it has no such output, or ``codes`` are wanted and it holds numbers.
    """
    if OUTCOME not in data:
        raise ModelError(Problem("data", "", "is no study's Dataset: it has no outcome", "give what study returns"))
    known = [name for name in outputs_in(data) if words_of(data[name]) or not codes]
    if output not in known:
        kind = "output of codes" if codes else "output"
        rule = f"the study keeps no such {kind}; it keeps {', '.join(known) or 'none'}"
        raise ModelError(Problem("output", f'"{output}"', rule, did_you_mean(output, known)))
    return values_of(data, output)


def lacking_in(data: xr.Dataset) -> dict[tuple[str, str], int]:
    """Number of computed cases whose motion lacks the quantity of an output, by subject and lack.

    A case without impacts has 0 for the largest impact energy, and NaN for the mean: both count as "no impact".
    """
    counts: dict[tuple[str, str], int] = {}
    for output in outputs_in(data):
        lacking = str(data[output].attrs.get("lacking", ""))
        absent = data[output].attrs.get("absent")
        subject = subject_of(data, output)
        for name in subject_names(data, output) if lacking else ():
            values = values_of(data, output).sel({subject: name}) if subject else data[output]
            missing = (values.isnull() if isinstance(absent, str) else values == absent) & (data[OUTCOME] == DONE)
            counts.setdefault((name, lacking), int(missing.sum()))
    return {key: count for key, count in counts.items() if count}


def gaps_of(codes: xr.DataArray) -> xr.DataArray:
    """An output of codes, of the parts alone that can separate; itself where that is not known, or without parts."""
    if "part" not in codes.dims or "can_rattle" not in codes.attrs:
        return codes
    gaps = str(codes.attrs["can_rattle"]).split()
    return codes.sel(part=[name for name in codes["part"].values.tolist() if str(name) in gaps])


def chosen_codes(data: xr.Dataset) -> str:
    """The output of codes to show: severity before regime, of every part before the whole; empty for none."""
    return next((name for name in (SEVERITY, VERDICT_SEVERITY, REGIME, VERDICT) if name in data), "")


def headlines_in(data: xr.Dataset) -> NDArray[np.str_]:
    """Return the state of the driveline in every case in one word: its regime if it rattles, else its severity.

    Empty words where there is no value, or where no verdict was kept; the regime where no severity was.
    """
    if VERDICT not in data:
        return np.full(data[OUTCOME].shape, "", dtype=np.str_)
    words = _words_in(data[VERDICT])
    if VERDICT_SEVERITY not in data:
        return words
    severities = _words_in(data[VERDICT_SEVERITY])
    return np.where(severities == RATTLES, words, severities)


def _words_in(codes: xr.DataArray) -> NDArray[np.str_]:
    """Return the word of every code; an empty one where there is no value."""
    words: NDArray[np.str_] = np.array([*words_of(codes), ""], dtype=np.str_)[codes.values]
    return words


def rattling_from(codes: xr.DataArray) -> int:
    """Return the smallest code of a part that rattles: of a severity "rattles", of a regime all but "quiet"."""
    words = words_of(codes)
    return words.index(RATTLES) if RATTLES in words else 1
