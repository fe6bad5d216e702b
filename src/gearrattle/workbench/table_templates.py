"""Tables that the editor can add to a driveline, with their titles, symbols, ends and templates.

All of these follow from the classes that read the tables, so a new component needs no change here or in JavaScript.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gearrattle.model import Criteria, Excitation, Inertia, Motion, Simulation, Torque
from gearrattle.model.components import COMPONENTS
from gearrattle.model.table_symbol import Shown
from gearrattle.workbench.references import ends_of

TABLES: Mapping[str, type[Shown]] = {
    "inertia": Inertia,
    **COMPONENTS,
    "torque": Torque,
    "motion": Motion,
    "excitation": Excitation,
    "simulation": Simulation,
    "criteria": Criteria,
}


def shelf() -> list[dict[str, Any]]:
    """Return title, symbol, ends and template of every table, in the order in which an editor shows them.

    ``ends`` are the places of a template where names of bodies stand: ``path`` in the row, ``title``, whether ground
    may stand there, and whether there may be ``many``.
    """
    return [
        {
            "table": table,
            "title": shown.noun[:1].upper() + shown.noun[1:],
            "words": (shown.__doc__ or "").split("\n")[0],
            "ends": _ends(table, shown.template),
            "symbol": shown.symbol.path,
            "width": shown.symbol.width,
            "template": dict(shown.template),
        }
        for table, shown in TABLES.items()
    ]


def _ends(table: str, template: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return where the template of a table names bodies."""
    if table not in COMPONENTS:
        on = template.get("on")
        return [{"path": ["on"], "title": "on", "ground": False, "many": False}] if on else []
    refused = {body.location for body in COMPONENTS[table].bodies(template) if body.no_ground}
    return [
        {
            "path": list(location),
            "title": _title(location),
            "ground": not {location, location[:1]} & refused,
            "many": len(location) == 2 and location[0] != "between",
        }
        for location in ends_of(table, template)
    ]


def _title(location: tuple[int | str, ...]) -> str:
    """Return what an end is called."""
    if location[0] == "between":
        return "from" if location[1] == 0 else "to"
    return str(location[0])
