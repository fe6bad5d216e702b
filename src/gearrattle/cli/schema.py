"""``gearrattle schema``: the model file's format, for editors."""

from __future__ import annotations


def schema() -> None:
    """Print the JSON Schema of model files; editors use it to complete and check them."""
    import gearrattle
    from gearrattle.json_types import json_text

    print(json_text(gearrattle.json_schema()))
