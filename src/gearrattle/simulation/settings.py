"""Settings of a run by precedence: call argument, file, default."""

from __future__ import annotations

from numbers import Integral
from typing import Any

from gearrattle.assembly import default_cycles
from gearrattle.derived_values import kept
from gearrattle.model import DEFAULTS, Initial, Model


def settled(model: Model, arguments: dict[str, Any]) -> Model:
    """The model with every simulation setting filled in and checked; arguments are None where the call is silent.

    ``cycles`` given without ``discard`` at the same level (call or file) keeps at most half of it for settling: discard
    = min(discard, cycles // 2). A sweep of the speed is followed to its end, and judged from its start; so is a run of
    a stated duration, and one with ramps of a torque. The settings of the last call return the same model again, with
    all its derived values. ModelError for a setting that the file format refuses, and for discard >= cycles.
    """
    key = tuple((name, type(value), value) for name, value in arguments.items())
    if not all(isinstance(value, str | int | float | None) for value in arguments.values()):
        return _settled(model, arguments)
    last = _last(model)
    used = last.get(key)
    if used is None:
        used = _settled(model, arguments)
        last.clear()
        last[key] = used
    return used


@kept
def _last(_: Model) -> dict[tuple[tuple[str, type, Any], ...], Model]:
    """Cache of the model as it was settled last, with the arguments of that call."""
    return {}


def _settled(model: Model, arguments: dict[str, Any]) -> Model:
    file = model.simulation
    overrides = {key: value for key, value in arguments.items() if value is not None}
    cycles = overrides.get("cycles", file.cycles if file.cycles is not None else default_cycles(model))
    usual = 0 if _is_event(model) else DEFAULTS.discard
    discard = overrides.get("discard", file.discard if file.discard is not None else usual)
    explicit = "discard" in overrides or ("cycles" not in overrides and file.discard is not None)
    if not explicit and isinstance(cycles, Integral) and int(cycles) >= 1:
        discard = min(discard, int(cycles) // 2)
    changes = {"cycles": cycles, "discard": discard}
    for key in ("algorithm", "initial", "samples_per_cycle"):
        changes[key] = overrides.get(
            key, getattr(file, key) if getattr(file, key) is not None else getattr(DEFAULTS, key)
        )
    for key in ("tolerance", "step"):
        if key in overrides:
            changes[key] = overrides[key]
    plain = {key: _plain(value) for key, value in changes.items()}
    return model.with_simulation(plain)


def _is_event(model: Model) -> bool:
    """Whether the run is judged from its start."""
    excitation = model.excitation
    has_ramps = any(torque.ramps for torque in model.torques)
    return excitation.sweep is not None or excitation.duration is not None or has_ramps


def _plain(value: Any) -> Any:
    """Initial states back to the tables of the file format; everything else as it is."""
    if isinstance(value, Initial):
        return value.to_plain()
    if isinstance(value, dict):
        return {key: [float(x) if not isinstance(x, str) else x for x in entry] for key, entry in value.items()}
    return value
