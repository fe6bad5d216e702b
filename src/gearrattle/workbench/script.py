"""Python script that repeats a job.

It reads the model file in its folder, calls the same function with the same options, and saves the same result.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

_HEAD = '''"""{title}

Written by the workbench of gearrattle {version}. Run it in the folder of model.toml.
"""

import gearrattle as gr

model = gr.load("model.toml")
'''
_RUN = """result = gr.{call}(model{options})
print(result.sentence)
result.save("result")
"""
_DATA = """result = gr.{call}(model{options})
print(result)
gr.save(result, "result")
"""
_FIGURES = 'gr.figures(result).save("print", "pdf")  # every figure, 175 mm wide\n'
_OWN = (
    "run",
    "simulate",
    "advise",
    "periodic",
    "continuation",
    "modes",
    "reduce",
    "stiffness",
    "equilibrium",
    "threshold",
    "remedies",
)
"""Tasks whose function returns a result with a method ``save``; others return labelled data."""


_CALLS = {"fit": "identification.fit"}
"""Functions that have another name than their task."""
_FIRST = {
    "continuation": ("path", "range"),
    "compare": ("algorithms",),
    "threshold": ("path", "range"),
    "fit": ("data", "free"),
    "validate": ("measurement",),
}
"""Options that follow the model without a name."""
_READ = "measurement"


def script(task: str, options: Mapping[str, Any], title: str, version: str) -> str:
    """Return the Python script that repeats a job: the public function of its task with its keyword arguments."""
    first = [name for name in _FIRST.get(task, ()) if name in options]
    named = [name for name in options if name not in first]
    words = "".join(f", {_value(name, options[name])}" for name in first)
    words += "".join(f", {name}={options[name]!r}" for name in named)
    body = _RUN if task in _OWN else _DATA
    clean = title.replace("\\", " ").replace('"""', "'").strip() or task
    return (
        _HEAD.format(title=clean, version=version) + body.format(call=_CALLS.get(task, task), options=words) + _FIGURES
    )


def _value(name: str, value: object) -> str:
    """Return a value as it is written; a measured file is read."""
    return f"gr.read({value!r})" if name == _READ else repr(value)
