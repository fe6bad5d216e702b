"""``gearrattle check``: is this a model, and can it bear its loads?"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import gearrattle
from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.shared_options import Changes, Json, ModelFile
from gearrattle.errors import shown_problems
from gearrattle.json_types import json_text
from gearrattle.model.components import COMPONENTS
from gearrattle.model.drag_points import drag_points
from gearrattle.model.plausibility import plausibility_notes
from gearrattle.wording import columns, counted, quantity

if TYPE_CHECKING:
    from gearrattle.analysis.statics import Equilibrium
    from gearrattle.model import Model


_UNITS = {"speed": " rad/s", "duration": " s", "sweep_to": " rad/s", "sweep_over": " s"}


def check(model: ModelFile, /, *, changes: Changes = (), json: Json = False) -> None:
    """Check a model file: print "ok" and what is in it, or every problem; notes on values that are hardly right."""
    from gearrattle.assembly import decay_notes, drag_notes, record_notes

    # read the model, and compute its equilibrium
    try:
        driveline = changed_model(model, changes)
        rest = gearrattle.equilibrium(driveline)
    except gearrattle.ModelError as error:
        if json:
            problems = [problem.to_dict() for problem in shown_problems(error.problems)]
            print(json_text({"ok": False, "count": len(error.problems), "problems": problems}))
        raise
    # notes, and what is in it
    notes = [
        *plausibility_notes(driveline),
        *decay_notes(driveline),
        *drag_notes(driveline),
        *record_notes(driveline),
        *rest.notes,
    ]
    if json:
        print(json_text({"ok": True, **_content(driveline, rest), **_drag(driveline), "notes": notes}))
        return
    print("ok")
    content = {key: value for key, value in _content(driveline, rest).items() if value != [] or key == "clearances"}
    width = 2 + max(map(len, content))
    for key, value in content.items():
        unit = _UNITS.get(key, "") if driveline.units == "SI" else ""
        print(f"{key.replace('_', ' '):<{width}}{_words(value, is_si=driveline.units == 'SI')}{unit}")
    _print_drag(driveline)
    for note in notes:
        print(f"note: {note}", file=sys.stderr)


def _drag(model: Model) -> dict[str, Any]:
    """Return the drag parts with their torques; empty for a model without drag parts."""
    points = drag_points(model)
    keys = ("path", "on", "speed", "torque", "slope")
    return {"drag_parts": [{key: getattr(point, key) for key in keys} for point in points]} if points else {}


def _print_drag(model: Model) -> None:
    """Print the drag of every body by part."""
    if not drag_points(model):
        return
    from gearrattle.report.drag_table import drag_table

    table = drag_table(model)
    assert table is not None
    print(f"\n{table.title}\n{columns(table.head, table.rows, table.words)}")


def _content(model: Model, rest: Equilibrium) -> dict[str, Any]:
    """Return the content of a model as numbers and words."""
    from gearrattle.assembly import assemble

    return {
        "name": model.name,
        "units": model.units,
        "inertias": [body.name for body in model.inertias],
        **{
            component.plural.replace(" ", "_"): [c.name for c in model.components.values() if isinstance(c, component)]
            for component in COMPONENTS.values()
        },
        "clearances": list(assemble(model).layout.clearance_names),
        "torques_on": [torque.on for torque in model.torques],
        **({"balance": rest.balance} if rest.balance else {}),
        **({"motions_of": [motion.on for motion in model.motions]} if model.motions else {}),
        **({"ramps": ramps} if (ramps := _ramps(model)) else {}),
        **({"records": records} if (records := _records(model)) else {}),
        "speed": model.excitation.omega,
        **({"duration": length} if (length := model.excitation.duration) else {}),
        **({"sweep_to": sweep.end, "sweep_over": sweep.over} if (sweep := model.excitation.sweep) else {}),
    }


def _ramps(model: Model) -> list[str]:
    """Return the levels and times of the ramps of torques in words."""
    is_si = model.units == "SI"
    return [f"{ramp.in_words(is_si=is_si)} on {torque.on}" for torque in model.torques for ramp in torque.ramps]


def _records(model: Model) -> list[str]:
    """Return for every record in words its number of points, its interpolation, and its duration."""
    from gearrattle.assembly import records_of

    signals = [record.signal for record in records_of(model) if not record.path.endswith(".ramps")]
    return [f"{counted(s.time.size, 'point')} ({s.interpolation}), {s.time[-1] - s.start:.6g} s" for s in signals]


def _words(value: Any, *, is_si: bool) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{quantity(mean, 'N m' if is_si else '')} at {name}" for name, mean in value.items())
    if isinstance(value, list):
        return ", ".join(value) if value else "none"
    return f"{value:g}" if isinstance(value, float) else str(value)
