"""What is called on every kind of model: each public function with small arguments, and what it needs before it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

import gearrattle as gr
from gearrattle.recording import Channel, Recording


@dataclass(frozen=True)
class Kit:
    """A model of one kind, and what is made of it once.

    Attributes
    ----------
    model
        the driveline.
    folder
        to write into; empty at first.
    """

    model: gr.Model
    folder: Path

    @property
    def band(self) -> Any:
        """Upper end of a band that holds some modes."""
        return 1.0 if self.model.units == "dimensionless" else "60 Hz"

    @property
    def variation(self) -> dict[str, Any]:
        """A distribution of two values, so that Sobol' indices have something to tell apart."""
        inertia = self.model.inertias[0].J
        uniform = {"distribution": "uniform", "from": 0.9 * inertia, "to": 1.1 * inertia}
        return {"inertia.engine.J": uniform, "inertia.engine.drag": {**uniform, "from": 0.1, "to": 0.2}}

    @property
    def span(self) -> tuple[float, float]:
        """A short range of a value that every kind of model has."""
        inertia = self.model.inertias[0].J
        return inertia, 1.002 * inertia

    def axis(self, count: int) -> dict[str, list[float]]:
        """An axis of a study that every kind of model has."""
        return {"inertia.engine.J": (self.model.inertias[0].J * np.linspace(1.0, 1.1, count)).tolist()}

    @cached_property
    def run(self) -> gr.Run:
        """Its motion."""
        return gr.simulate(self.model)

    @cached_property
    def recording(self) -> Recording:
        """Its motion as a rig would have measured it."""
        data = self.run.data
        velocity = data.velocity.sel(inertia="engine").values
        speed = data.speed.values if "speed" in data else self.model.excitation.omega + 0.01 * velocity
        channels = [
            Channel("v", "velocity", "engine", "rad/s", velocity),
            Channel("a", "acceleration", "engine", "rad/s^2", data.acceleration.sel(inertia="engine").values),
            Channel("n", "speed", "", "rad/s", speed),
            Channel("T", "torque", "engine", "N*m", np.sin(self.run.trajectory.time * self.model.excitation.omega)),
        ]
        return Recording(self.run.trajectory.time, tuple(channels), "rig")

    @cached_property
    def model_file(self) -> Path:
        """The model as a file."""
        path = self.folder / "model.toml"
        path.write_text(self.model.to_toml(), encoding="utf-8")
        return path

    @cached_property
    def run_file(self) -> Path:
        """The motion as a file."""
        path = self.folder / "run.nc"
        self.run.save(path)
        return path

    @cached_property
    def recording_file(self) -> Path:
        """The recording as a file."""
        path = self.folder / "rig.h5"
        gr.write(self.recording, path)
        return path

    @cached_property
    def stream_folder(self) -> Path:
        """A stream of two chunks."""
        folder = self.folder / "stream"
        for _ in gr.stream(self.model, chunk=2, store=folder):
            pass
        return folder

    @cached_property
    def modelica(self) -> Path:
        """The model as Modelica text."""
        return gr.export_model(self.model, self.folder / "exported.mo", partial=True).path

    @cached_property
    def study(self) -> Any:
        """A study of nine cases, kept in a folder."""
        return gr.study(self.model, self.axis(9), workers=1, output=self.folder / "study")

    @cached_property
    def samples(self) -> Any:
        """A study of what scatters."""
        return gr.study(self.model, vary=self.variation, samples=8, method="sobol", workers=1)


Call = Callable[[Kit], Any]

CALLS: Mapping[str, Call] = {
    "loads": lambda kit: gr.loads(kit.model.to_toml()),
    "load": lambda kit: gr.load(kit.model_file),
    "export_model: equations": lambda kit: gr.export_model(kit.model, kit.folder / "equations.py"),
    "export_model: matrices": lambda kit: gr.export_model(kit.model, kit.folder / "matrices.npz"),
    "export_model: Modelica": lambda kit: gr.export_model(kit.model, kit.folder / "model.mo"),
    "import_model": lambda kit: gr.import_model(kit.modelica),
    "drag_points": lambda kit: gr.drag_points(kit.model),
    "equilibrium": lambda kit: gr.equilibrium(kit.model),
    "modes": lambda kit: gr.modes(kit.model),
    "campbell": lambda kit: gr.campbell(kit.model),
    "stiffness": lambda kit: gr.stiffness(kit.model),
    "reduce": lambda kit: gr.reduce(kit.model, kit.band),
    "condense": lambda kit: gr.condense(kit.model, kit.band),
    "nondimensionalize": lambda kit: gr.nondimensionalize(kit.model),
    "nondimensionalize: restore": lambda kit: _restored(gr.nondimensionalize(kit.model)),
    "torque_angle": lambda kit: gr.torque_angle(kit.model, "joint", -0.05, 0.05),
    "identification.fit": lambda kit: gr.identification.fit(
        kit.model, modes_data(kit.model), ["inertia.engine.J"], starts=1
    ),
    "advise": lambda kit: gr.advise(kit.model),
    "run": lambda kit: gr.run(kit.model),
    "save": lambda kit: gr.save(gr.modes(kit.model), kit.folder / "modes"),
    "export_fmu": lambda kit: gr.export_fmu(kit.model, kit.folder / "x.fmu"),
    "share": lambda kit: gr.share(kit.run, kit.folder / "run.zip"),
    "simulate": lambda kit: kit.run,
    "simulate: rk4": lambda kit: gr.simulate(kit.model, "rk4", step=1e-4),
    "criteria": lambda kit: gr.criteria(kit.run),
    "cause": lambda kit: (gr.cause(kit.run), gr.cause(kit.run, body=kit.model.inertias[0].name)),
    "metrics": lambda kit: gr.metrics(kit.run),
    "metrics: recording": lambda kit: gr.metrics(kit.recording, kit.model),
    "contact_ratio: run": lambda kit: gr.contact_ratio(kit.run),
    "contact_ratio: model": lambda kit: gr.contact_ratio(kit.model),
    "open_run": lambda kit: gr.open_run(kit.run_file),
    "stream": lambda kit: kit.stream_folder,
    "open_stream": lambda kit: gr.criteria(gr.open_stream(kit.stream_folder)),
    "periodic": lambda kit: gr.periodic(kit.model),
    "continuation": lambda kit: gr.continuation(kit.model, "inertia.engine.J", kit.span),
    "compare": lambda kit: gr.compare(kit.model, ["rk4"], budget=2.0),
    "write": lambda kit: kit.recording_file,
    "read": lambda kit: gr.read(kit.recording_file),
    "measured.look": lambda kit: gr.measured.look(kit.recording_file),
    "measured.drive: torque": lambda kit: gr.simulate(
        gr.measured.drive(kit.model, kit.recording, "T", "engine"), cycles=2
    ),
    "measured.drive: motion": lambda kit: gr.simulate(
        gr.measured.drive(kit.model, kit.recording, "v", "engine"), cycles=2
    ),
    "validate": lambda kit: gr.validate(kit.run, kit.recording),
    "validate_run_up": lambda kit: gr.validate_run_up(kit.run, kit.recording, [1.0], turns=1),
    "spectral.psd": lambda kit: gr.spectral.psd(kit.run, "acceleration.engine"),
    "spectral.cross_psd": lambda kit: gr.spectral.cross_psd(kit.run, "acceleration.engine", "velocity.engine"),
    "spectral.coherence": lambda kit: gr.spectral.coherence(kit.run, "acceleration.engine", "velocity.engine"),
    "spectra": lambda kit: gr.spectra(kit.run, "acceleration.engine", "velocity.engine"),
    "spectral.order_map": lambda kit: gr.spectral.order_map(kit.run, "acceleration.engine", turns=1),
    "spectral.order_cuts": lambda kit: gr.spectral.order_cuts(kit.run, "acceleration.engine", [1.0], turns=1),
    "spectral.waterfall": lambda kit: gr.spectral.waterfall(kit.run, "acceleration.engine"),
    "listen": lambda kit: gr.listen(kit.run),
    "view": lambda kit: gr.view(kit.run),
    "figures: run": lambda kit: list(gr.figures(kit.run)),
    "figures: study": lambda kit: list(gr.figures(kit.study)),
    "screen": lambda kit: gr.screen(kit.model, [80.0, 90.0]),
    "threshold": lambda kit: gr.threshold(kit.model, "inertia.engine.J", kit.span, count=3, workers=1),
    "remedies": lambda kit: gr.remedies(
        kit.model, {"inertia.engine.J": {"factor": (0.99, 1.01)}}, speeds=[], pairs=False, workers=1
    ),
    "prove_quiet": lambda kit: gr.prove_quiet(kit.model, {"inertia.engine.J": kit.span}, boxes=50),
    "study: 2 cases": lambda kit: gr.study(kit.model, kit.axis(2), workers=1),
    "study: 9 cases": lambda kit: kit.study,
    "study: Sobol'": lambda kit: kit.samples,
    "study: function": lambda kit: gr.study(kit.model, kit.axis(2), (), function=_loudness, workers=1),
    "open_study": lambda kit: (kit.study, gr.open_study(kit.folder / "study"))[1],
    "studies.regime_boundary": lambda kit: gr.studies.regime_boundary(kit.study),
    "studies.rattle_probability": lambda kit: gr.studies.rattle_probability(kit.samples),
    "studies.sensitivities": lambda kit: gr.studies.sensitivities(_saltelli(kit), "crossings per cycle"),
    "optimize": lambda kit: gr.optimize(
        kit.model,
        {"inertia.engine.J": {"from": kit.model.inertias[0].J, "to": 1.1 * kit.model.inertias[0].J}},
        {"crossings per cycle": "min"},
        population=8,
        generations=2,
        workers=1,
    ),
    "bifurcation": lambda kit: gr.bifurcation(
        kit.model, "inertia.engine.J", kit.axis(3)["inertia.engine.J"], workers=1
    ),
    "basins": lambda kit: gr.basins(kit.model, {"angle.engine": [0.0, 0.001, 0.002]}, workers=1),
    "conditions": lambda kit: gr.conditions(
        kit.model,
        {"path": "inertia.engine.drag", "values": [0.01, 0.02]},
        {"path": "inertia.engine.J", "values": kit.axis(2)["inertia.engine.J"]},
        workers=1,
    ),
}
"""By public name, with a word where one name is called in several ways."""

WITHOUT_MODEL = frozenset({"example", "factor", "identification.fit_loop", "gas_torque", "studies.samples_needed"})
"""Public functions that take neither a model nor anything made of one."""


def modes_data(model: gr.Model) -> dict[str, Any]:
    """The highest natural frequency as data of a fit."""
    frequencies, dimensionless = gr.modes(model).frequencies, model.units == "dimensionless"
    frequency = float(frequencies[-1]) or 1.0
    return {"mode": [{"number": len(frequencies), "frequency": frequency if dimensionless else f"{frequency} rad/s"}]}


def _restored(scaled: gr.typing.Nondimensional) -> gr.Run:
    return scaled.restore(gr.simulate(scaled.model))


def _saltelli(kit: Kit) -> Any:
    outputs = ["crossings per cycle"]
    return gr.study(kit.model, None, outputs, vary=kit.variation, samples=4, method="saltelli", workers=1)


def _loudness(run: gr.Run) -> dict[str, float]:
    return {"largest speed": float(np.abs(run.trajectory.velocity).max())}
