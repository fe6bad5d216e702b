"""A run for users: labelled arrays, tables, files.

``Run`` holds a ``Trajectory`` and its model. xarray and pandas are imported when they are first needed. Files are
written with h5netcdf to a temporary file in the same folder and then renamed, so no file is ever incomplete. A netCDF
file holds the whole model, so ``open_run`` returns a complete run, for which criteria can be evaluated.
"""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.assembly import assemble, coordinate_names, drive_torque, ramp_of
from gearrattle.assembly.friction_sliders import WORDS, switches
from gearrattle.assembly.statistics_by_name import exact_between
from gearrattle.consistency import check_stored
from gearrattle.engine.system import perturbation_growth as growth
from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.engine.system.crossings_in_order import Passages
from gearrattle.engine.system.energy_audit import EnergyAudit
from gearrattle.engine.system.flow import flow_of
from gearrattle.engine.system.perturbations import Gradient
from gearrattle.errors import ModelError, Problem
from gearrattle.files import Refused, opened_hdf5
from gearrattle.formats import check_format, format_name, version_of
from gearrattle.model import Model, loads, readable_text
from gearrattle.model.table import did_you_mean, shown
from gearrattle.result import Result
from gearrattle.run_groups import (
    AUXILIARY_VALUES,
    check_names,
    has_auxiliaries,
    read_auxiliaries,
    read_points,
    write_auxiliaries,
    write_points,
)
from gearrattle.trajectory import Array, Cost, EventLog, Sideways, Trajectory
from gearrattle.wording import counted

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

_SAMPLED = {
    "angle": ("inertia", "rad"),
    "velocity": ("inertia", "rad/s"),
    "acceleration": ("inertia", "rad/s^2"),
    "deflection": ("clearance", "rad, or m for a mesh"),
    "force": ("clearance", "N m, or N for a mesh"),
    "region": ("clearance", "1"),
    "element_torque": ("element", "N m"),
}
_TABLES = {
    "bodies": ("angle", "velocity", "acceleration"),
    "elements": ("deflection", "force", "region", "element_torque"),
}
_SIDEWAYS = {
    "displacement": ("displacement", "body_direction", "m"),
    "displacement_velocity": ("velocity", "body_direction", "m/s"),
    "displacement_acceleration": ("acceleration", "body_direction", "m/s^2"),
    "bearing_force": ("bearing_force", "bearing_direction", "N"),
    "casing_force": ("casing_force", "casing_direction", "N"),
}
_WHOLE = {"region": "i2", "slider": "i1"}
_Samples = dict[str, tuple[tuple[str, ...], Array, str]]
"""Axes, values and SI unit of every variable, by its name."""


class Run(Result):
    """A simulated motion with its model.

    Attributes
    ----------
    trajectory
        plain arrays (see ``Trajectory``).
    model
        the model with the settings this run used.

    Examples
    --------
    >>> run = gr.simulate(gr.example("case3"), cycles=20, discard=10)
    >>> run.data["deflection"].dims
    ('time', 'clearance')
    """

    kind = "motion"

    def __init__(self, trajectory: Trajectory, model: Model) -> None:
        self.trajectory = exact_between(model, trajectory)
        self.model = model

    def __repr__(self) -> str:
        t = self.trajectory
        cycles = counted(t.cycles, "cycle")
        crossings = counted(len(t.events), "crossing")
        return f"<Run of {self.model.name!r}: {t.cost.algorithm}, {cycles}, {crossings}>"

    @cached_property
    def data(self) -> xr.Dataset:
        """Labelled samples.

        angle, velocity, acceleration (time, inertia) [rad, rad/s, rad/s^2]; deflection, force, region
        (time, clearance) [rad or m, N m or N, -]; element_torque (time, element) [N m]. With friction or clipped
        contact damping also slider, the state of each (its words in flag_meanings), slider_stretch of its spring and
        slider_force (time, auxiliary) [-, rad, N m or N]; along a sweep also speed (time) [rad/s]; with prescribed
        motions drive_torque (time, motion), what keeps them up [N m]; with bodies that move sideways displacement,
        displacement_velocity, displacement_acceleration (time, body_direction) [m, m/s, m/s^2], bearing_force
        (time, bearing_direction), of bearings on their bodies, and casing_force (time, casing_direction), of all of
        them on the casing [N]. Attributes: period, units, provenance; of a
        dimensionless model every unit reads "1". The arrays are read-only, for criteria and figures are made of them;
        ``run.data.copy(deep=True)`` may be changed.
        """
        import xarray as xr

        variables, coordinates = self._labelled()
        return xr.Dataset(variables, coordinates, self._attributes())

    def _labelled(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Samples and labels by name, as in ``data`` and netCDF files, without importing xarray."""
        # samples by name, and labels of their axes
        t = self.trajectory
        samples: _Samples = {name: (("time", axis), getattr(t, name), unit) for name, (axis, unit) in _SAMPLED.items()}
        labels = {
            "inertia": t.layout.inertia_names,
            "clearance": t.layout.clearance_names,
            "element": t.layout.element_names,
        }
        # friction and alternating stiffness
        if t.auxiliaries is not None:
            labels["auxiliary"] = t.layout.auxiliary_names
            for name, (value, unit) in AUXILIARY_VALUES.items():
                samples[name] = (("time", "auxiliary"), getattr(t.auxiliaries, value), unit)
            codes = [np.array([WORDS.index(word) for word in words]) for words in t.layout.auxiliary_words]
            states = np.stack([code[s] for code, s in zip(codes, t.auxiliaries.piece.T, strict=True)], axis=1)
            samples["slider"] = (("time", "auxiliary"), states, "1")
        # displacements, and forces of bearings and on the casing
        if t.sideways is not None:
            labels["body_direction"] = t.layout.direction_names
            labels["bearing_direction"] = t.layout.bearing_names
            labels["casing_direction"] = ("x", "y")
            for name, (value, axis, unit) in _SIDEWAYS.items():
                samples[name] = (("time", axis), getattr(t.sideways, value), unit)
        # driving torque of prescribed motions, and speed along a sweep
        if self.model.motions:
            labels["motion"] = tuple(motion.on for motion in self.model.motions)
            samples["drive_torque"] = (("time", "motion"), drive_torque(self.model, t), "N m")
        if self.speed is not None:
            samples["speed"] = (("time",), self.speed, "rad/s")
        # units of the variables
        variables: dict[str, Any] = {
            name: (axes, _read_only(values), {"units": self._unit(unit)})
            for name, (axes, values, unit) in samples.items()
        }
        if "slider" in variables:
            variables["slider"][2]["flag_meanings"] = ", ".join(WORDS)
        coordinates = {axis: (axis, list(names)) for axis, names in labels.items()}
        return variables, {"time": ("time", t.time, {"units": self._unit("s")}), **coordinates}

    def _unit(self, unit: str) -> str:
        """Return an SI unit, or "1" for a run of a dimensionless model."""
        return unit if self.model.units == "SI" else "1"

    @cached_property
    def events(self) -> pd.DataFrame:
        """Every corner crossing: time [s], clearance (name), from_region, to_region, velocity, force_integral."""
        import pandas as pd

        t = self.trajectory
        log = self.trajectory.events
        names = np.array(t.layout.clearance_names, dtype=object)
        return pd.DataFrame(
            {
                "time": log.time,
                "clearance": names[log.clearance] if len(log) else np.array([], dtype=object),
                "from_region": log.from_region,
                "to_region": log.to_region,
                "velocity": log.velocity,
                "force_integral": log.force_integral,
            }
        )

    @cached_property
    def switches(self) -> pd.DataFrame:
        """Every switch of a slider or a limit of contact damping: time [s], auxiliary (name), state (words)."""
        import pandas as pd

        rows = list(switches(assemble(self.model).system, self.trajectory))
        return pd.DataFrame(rows, columns=["time", "auxiliary", "state"])

    @property
    def speed(self) -> Array | None:
        """(Nt,) reference speed at the samples along a sweep [rad/s]; None if the speed is constant."""
        ramp = ramp_of(self.model)
        return None if ramp is None else ramp.speed(self.trajectory.time)

    @cached_property
    def variation(self) -> Gradient:
        """Growth of small perturbations along this motion (see ``Variation``), from the log of crossings."""
        t = self.trajectory
        flow = flow_of(assemble(self.model).system)
        first = t.layout.region_of_first_piece
        log = t.events
        auxiliaries = t.auxiliaries
        pieces = dict(zip(flow.system.places, t.initial_region - first, strict=False))
        start = t.first_cycle * t.layout.period
        if auxiliaries is None:
            unknown = np.zeros((len(log), 0))
            upward = (log.to_region > log.from_region).astype(np.int64)
            passages = Passages(log.time - start, log.clearance, upward, log.velocity, unknown)
        else:
            pieces |= dict(zip(flow.system.places[len(first) :], auxiliaries.initial, strict=True))
            passages = replace(auxiliaries.passages, time=auxiliaries.passages.time - start)
        count = len(flow.system.laws) + len(flow.system.auxiliaries)
        return growth.variation(flow, tuple(int(pieces.get(k, 0)) for k in range(count)), passages, end=t.end - start)

    @cached_property
    def flow_gradient(self) -> xr.DataArray:
        """d y(end) / d y(0) over relative coordinates, (state, start) [SI].

        y are independent deflections (``deflection.NAME`` [rad or m]), then velocities (``velocity.NAME`` [rad/s],
        ``velocity.NAME.x`` and ``.y`` of sideways motion [m/s]),
        then the stretch of sliders (``slider.NAME`` [rad]);
        the rigid-body angles play no part. Entries overflow to infinity over many cycles of a chaotic motion.
        """
        import xarray as xr

        t = self.trajectory
        elements = relative_coordinates(assemble(self.model).system).elements
        names = [f"deflection.{t.layout.element_names[k]}" for k in elements]
        names += [f"velocity.{name}" for name in coordinate_names(self.model)]
        names += [f"slider.{t.layout.auxiliary_names[c]}" for c in assemble(self.model).system.memories]
        return xr.DataArray(self.variation.gradient(), {"state": names, "start": names}, ("state", "start"))

    @cached_property
    def lyapunov_exponents(self) -> Array:
        """(N,) finite-time Lyapunov exponents over the steady part, largest first [1/s]."""
        return self.variation.exponents(self.trajectory.discard * self.trajectory.layout.period)

    @cached_property
    def largest_lyapunov_exponent(self) -> float:
        """Largest finite-time Lyapunov exponent over the steady part [1/s].

        It is the first of ``lyapunov_exponents``. For a driveline that passes through very many regions it is computed
        from four perturbations, at about the cost of the motion. All exponents would cost N times as much.
        """
        return self.variation.largest_exponent(self.trajectory.discard * self.trajectory.layout.period)

    @cached_property
    def predictability_horizon(self) -> float:
        """Time [s] up to which the motion is predicted point by point; infinite if it is predicted to the end.

        It is the first time at which a perturbation has grown by a factor 1e7. The error of deflections by rounding is
        then about 1e-8 half-gaps, and in 95 of 100 motions less than 3e-7.
        """
        return self.trajectory.first_cycle * self.trajectory.layout.period + self.variation.horizon(growth.GROWTH)

    def to_dataframe(self, kind: str = "bodies") -> pd.DataFrame:
        """Return samples or crossings as a table; ``data.to_dataframe()`` would have a row for every pair of names.

        Parameters
        ----------
        kind
            "bodies": angle, velocity and acceleration of every body, ``angle.NAME`` and so on, along a sweep also
            ``speed``, and displacements where bodies move sideways; "elements": deflection, force and region of every
            clearance, torque of every element, and forces of bearings and on the casing. Both
            have one row per sample, and the time [s] as index. "events": the crossings, as ``events`` has them.

        Returns
        -------
        pandas.DataFrame
            A new table [SI].

        Raises
        ------
        ModelError
            another kind.

        Examples
        --------
        >>> run = gr.simulate(gr.example("case3"), cycles=5, discard=1)
        >>> run.to_dataframe()["velocity.hub"].index.name, len(run.to_dataframe("events")) == len(run.events)
        ('time', True)
        """
        if kind == "events":
            return self.events.copy()
        if kind not in _TABLES:
            kinds = (*_TABLES, "events")
            rule = f"must be {' or '.join(shown(name) for name in kinds)}"
            raise ModelError(Problem("kind", shown(kind), rule, did_you_mean(kind, kinds)))
        return self._wide(*_TABLES[kind])

    def _wide(self, *names: str) -> pd.DataFrame:
        """Return one row per sample and one column per name and quantity; with angles also the speed of a sweep."""
        import pandas as pd

        t = self.trajectory
        variables, coordinates = self._labelled()
        columns = {} if self.speed is None or "angle" not in names else {"speed": self.speed}
        if t.sideways is not None:
            sides = {"acceleration": tuple(_SIDEWAYS)[:3], "force": ("bearing_force", "casing_force")}
            names = tuple(more for name in names for more in (name, *sides.get(name, ())))
        for name in names:
            labels = coordinates[variables[name][0][1]][1]
            columns.update({f"{name}.{label}": variables[name][1][:, i] for i, label in enumerate(labels)})
        return pd.DataFrame(columns, index=pd.Index(t.time, name="time"))

    @property
    def cost(self) -> Cost:
        """Steps and function calls of the run."""
        return self.trajectory.cost

    @property
    def notes(self) -> list[str]:
        """Everything the user must know about this run."""
        return list(self.trajectory.notes)

    def write(self, path: Path) -> None:
        """Write a new file: the whole run as netCDF-4 (.nc), or its samples as CSV (.csv)."""
        writers: dict[str, Callable[[Path], None]] = {".nc": self._write_netcdf, ".csv": self._write_csv}
        writers[path.suffix](path)

    def _attributes(self) -> dict[str, Any]:
        # versions of the packages
        t = self.trajectory
        packages = ("numpy", "scipy", "numba")
        provenance = {
            "gearrattle": version_of("gearrattle"),
            "python": platform.python_version(),
            **{name: version_of(name) for name in packages},
            "algorithm": t.cost.algorithm,
        }
        # model, output grid, cost and notes
        return {
            "format": format_name("run"),
            "title": self.model.name,
            "period": t.layout.period,
            "units": self.model.units,
            "provenance": json.dumps(provenance),
            "model": readable_text(self.model),
            "cost": json.dumps(asdict(t.cost)),
            "notes": json.dumps(list(t.notes)),
            "energy": json.dumps(None if t.energy is None else _listed(t.energy)),
            "samples_per_cycle": t.samples_per_cycle,
            "cycles": t.cycles,
            "discard": t.discard,
            "first_cycle": t.first_cycle,
        }

    def _write_netcdf(self, path: Path) -> None:
        import h5netcdf

        # labels of the axes
        t = self.trajectory
        log = self.trajectory.events
        variables, coordinates = self._labelled()
        text = h5netcdf.core.h5py.string_dtype()
        with h5netcdf.File(path, "w") as file:
            for axis, (_, labels, *attributes) in coordinates.items():
                file.dimensions[axis] = len(labels)
                if axis == "time":
                    file.create_variable(axis, (axis,), "f8", data=labels).attrs.update(*attributes)
                else:
                    file.create_variable(axis, (axis,), text, data=np.array(labels, dtype=object))
            # samples, and states at the start
            for name, (axes, values, attributes) in variables.items():
                kind = _WHOLE.get(name, "f8")
                file.create_variable(name, axes, kind, data=values.astype(kind)).attrs.update(attributes)
            file.create_variable("initial_region", ("clearance",), "i2", data=t.initial_region.astype("i2"))
            file.create_variable("final_force_integral", ("clearance",), "f8", data=t.final_force_integral)
            for key, value in self._attributes().items():
                file.attrs[key] = value
            # crossings
            group = file.create_group("events")
            group.dimensions = {"event": len(log)}
            for name in ("time", "velocity", "force_integral"):
                group.create_variable(name, ("event",), "f8", data=getattr(log, name))
            for name in ("clearance", "from_region", "to_region"):
                group.create_variable(name, ("event",), "i2", data=getattr(log, name).astype("i2"))
            group["clearance"].attrs["meaning"] = "index into the root's clearance"
            # auxiliaries and points of records
            if t.auxiliaries is not None:
                write_auxiliaries(file, t.auxiliaries)
            write_points(file, self.model.to_stored()[1])

    def _write_csv(self, path: Path) -> None:
        self._wide(*_TABLES["bodies"], "deflection", "force").to_csv(path)


def check_run(value: object, also: tuple[type, ...] = ()) -> None:
    """Refuse a value that is neither a run nor of the types ``also``; the ModelError says how to get a run."""
    if isinstance(value, (Run, *also)):
        return
    if isinstance(value, str | os.PathLike):
        path = str(value)
        remedy = f"gr.open_run({path!r}) opens a saved run, gr.read({path!r}) a measured file"
    else:
        path = type(value).__name__
        remedy = "gr.simulate makes a run, gr.open_run opens a saved one"
    kinds = " or a ".join(f"gr.{kind.__name__}" for kind in (Run, *also))
    raise ModelError(Problem("run", path, f"must be a {kinds}", remedy))


def _read_only(array: Any) -> Any:
    """Return a view that cannot be written."""
    view = np.asarray(array).view()
    view.flags.writeable = False
    return view


def _listed(energy: EnergyAudit) -> dict[str, list[float]]:
    return {key: np.asarray(value).tolist() for key, value in vars(energy).items()}


def _energy(listed: dict[str, list[float]] | None) -> EnergyAudit | None:
    if listed is None:
        return None
    begin, end = listed.pop("stored")
    return EnergyAudit(**{key: np.array(value) for key, value in listed.items()}, stored=(begin, end))


def open_run(path: str | os.PathLike[str]) -> Run:
    """Read a run written by ``Run.save``.

    Parameters
    ----------
    path
        a netCDF-4 file.

    Returns
    -------
    Run
        The complete run.

    Raises
    ------
    ModelError
        the file does not exist, or is not a netCDF file of a run.

    Examples
    --------
    >>> gr.simulate(gr.example("case3"), cycles=5, discard=1).save("run.nc")
    PosixPath('run.nc')
    >>> run = gr.open_run("run.nc")
    >>> len(run.events) > 0
    True
    """
    rule = "must be a netCDF file written by Run.save"
    try:
        with opened_hdf5(path) as stored:
            return _read(stored, path)
    except FileNotFoundError:
        raise ModelError(Problem(str(path), "", "there is no such file")) from None
    except ModelError:
        raise
    except Refused as error:
        raise ModelError(Problem(str(path), "", error.rule, error.remedy)) from None
    except MemoryError:
        raise
    except Exception as error:  # for a damaged file, h5py and the readers of its parts raise many types
        words = " ".join(str(error).split())[:120] or type(error).__name__
        remedy = "it is damaged, or no such file: save the run again"
        raise ModelError(Problem(str(path), words, rule, remedy)) from None


def _read(stored: Any, path: str | os.PathLike[str]) -> Run:
    """Read a run from an open file that may be damaged in any way."""
    import h5netcdf

    # model, crossings and samples
    with h5netcdf.File(stored, "r") as file:
        check_format(file.attrs.get("format", ""), path, "run")
        model = loads(str(file.attrs["model"]), str(path), read_points(file))
        group = file.groups["events"]
        logged: dict[str, Any] = {
            **{name: np.array(group[name][...]) for name in ("time", "velocity", "force_integral")},
            **{name: np.array(group[name][...], np.int64) for name in ("clearance", "from_region", "to_region")},
        }
        sampled: dict[str, Any] = {name: np.array(file[name][...]) for name in _SAMPLED}
        sampled["region"] = sampled["region"].astype(np.int64)
        # trajectory under the layout of the model
        layout = assemble(model).layout
        trajectory = Trajectory(
            layout=layout,
            time=np.array(file["time"][...]),
            **sampled,
            events=EventLog(**logged),
            initial_region=np.array(file["initial_region"][...], np.int64),
            final_force_integral=np.array(file["final_force_integral"][...]),
            samples_per_cycle=_count(file.attrs["samples_per_cycle"]),
            cycles=_count(file.attrs["cycles"]),
            discard=_count(file.attrs["discard"]),
            cost=Cost(**json.loads(str(file.attrs["cost"]))),
            notes=tuple(json.loads(str(file.attrs["notes"]))),
            energy=_energy(json.loads(str(file.attrs["energy"]))),
            first_cycle=_count(file.attrs.get("first_cycle", 0)),
            auxiliaries=read_auxiliaries(file) if has_auxiliaries(file) else None,
            sideways=_read_sideways(file) if layout.direction_names else None,
        )
        # consistency of what was stored
        check_stored(trajectory, path)
        check_names(file, layout, path)
    return Run(trajectory, model)


def _read_sideways(file: Any) -> Sideways:
    """Read displacements and forces of bearings."""
    return Sideways(**{value: np.array(file[name][...]) for name, (value, _, _) in _SIDEWAYS.items()})


def _count(value: Any) -> int:
    """Return a whole number from a file."""
    number = int(value)
    if number != value:
        raise ValueError(f"{value} where a whole number is needed")
    return number
