"""``drive``: a channel of a recording becomes a torque or a prescribed motion of a model.

The new model carries the points of the channel (``model.signal``).
"""

from __future__ import annotations

from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model, check_model
from gearrattle.model.table import did_you_mean, listed, shown
from gearrattle.recording import Channel, Recording
from gearrattle.wording import with_article

_KEYS = {"torque": "signal", "velocity": "speed", "speed": "speed", "angle": "angle", "shaft angle": "angle"}
"""What a channel of each quantity is in a model: a torque's signal, a motion's speed or angle."""


def drive(
    model: Model,
    recording: Recording,
    channel: str = "",
    on: str = "",
    *,
    start: float | None = None,
    static: float | None = None,
    about: float | None = None,
    interpolation: str = "cubic",
) -> Model:
    """Drive a model with what was measured.

    A torque is added to those of the model; a velocity, speed or angle prescribes the motion of the inertia, in place
    of a motion and of the torques that the model has there.

    Parameters
    ----------
    model
        in SI.
    recording
        of four samples or more; two are enough for "linear", one for "step".
    channel
        its name; empty: the only channel that can drive.
    on
        the inertia; empty: the channel's subject.
    start
        time of the recording at which a run begins [s]; None: its first sample.
    static
        torque that the static start and everything linear take [N m]; None: the mean.
    about
        of a motion, the uniform speed about which the model's angles fluctuate [rad/s]; None: its mean.
    interpolation
        what stands between the samples: "cubic", the spline through all of them; of a torque or a speed also
        "linear", straight lines; of a torque also "step", each value until the next sample.

    Returns
    -------
    Model
        The new model; it needs no file.

    Raises
    ------
    ModelError
        no such channel or inertia, a quantity that drives nothing, an interpolation that it does not allow, a
        dimensionless model.

    Examples
    --------
    >>> time = np.linspace(0.0, 0.3, 301)
    >>> speed = 84.0 + 2.0 * np.sin(168.0 * time)
    >>> record = gr.measured.Recording(time, (gr.measured.Channel("n", "speed", "flywheel", "rad/s", speed),), "rig")
    >>> driven = gr.measured.drive(gr.example("case3"), record)
    >>> driven.motions[0].on
    'flywheel'
    """
    # the channel, and the inertia it drives
    check_model(model)
    chosen = recording[channel] if channel else _only(recording)
    if chosen.quantity not in _KEYS:
        rule = f"{chosen.quantity or 'a channel without a quantity'} drives nothing; {listed(_KEYS)} do"
        raise ModelError(Problem(recording.source, shown(chosen.name), rule, "a mapping can make one of another"))
    if model.units == "dimensionless":
        raise ModelError(Problem("model.units", "dimensionless", "a recording is in SI", "load the model in SI"))
    where = on or chosen.subject
    names = [inertia.name for inertia in model.inertias]
    if where not in names:
        rule = f"no inertia has this name; there are {listed(names)}"
        raise ModelError(Problem("on", shown(where), rule, did_you_mean(where, names) or "name the inertia: on=..."))
    # the points of the signal
    tables = model.to_tables()
    key = _KEYS[chosen.quantity]
    signal: dict[str, Any] = {
        "time": recording.time.tolist(),
        "value": chosen.values.tolist(),
        "start": float(recording.time[0]) if start is None else start,
        "source": f"{recording.source}: {chosen.name}",
        "interpolation": interpolation,
    }
    # a torque is added to the others; a motion replaces motion and torques of its inertia
    if key == "signal":
        if about is not None:
            raise ModelError(Problem("about", str(about), "belongs to a motion, and the channel is a torque"))
        row = {"on": where, "signal": signal if static is None else {**signal, "static": static}}
        tables["torque"] = [*tables.get("torque", ()), row]
    else:
        if static is not None:
            raise ModelError(
                Problem(
                    "static", str(static), f"belongs to a torque, and the channel is {with_article(chosen.quantity)}"
                )
            )
        motion = {"on": where, key: signal} if about is None else {"on": where, key: signal, "about": about}
        tables["motion"] = [*(row for row in tables.get("motion", ()) if row["on"] != where), motion]
        tables["torque"] = [row for row in tables.get("torque", ()) if row["on"] != where]
    return Model.from_tables(tables)


def _only(recording: Recording) -> Channel:
    """Return the only channel that can drive."""
    able = [channel for channel in recording.channels if channel.quantity in _KEYS]
    if len(able) == 1:
        return able[0]
    names = listed(channel.name for channel in able or recording.channels)
    rule = f"{len(able)} channels can drive a model; name one of {names}"
    raise ModelError(Problem(recording.source, "", rule, 'channel="..."'))
