"""The examples that come with the package: model files by name.

A wheel has a copy of the folder ``examples`` inside the package; in a source tree this folder is at the top level.
"""

from __future__ import annotations

from pathlib import Path

from gearrattle.errors import ModelError, Problem
from gearrattle.model.model import Model
from gearrattle.model.model_file import load
from gearrattle.model.table import did_you_mean, shown

_MODELS = ("*.toml", "paper/*.toml")
_PACKAGE = Path(__file__).resolve().parents[1]


def example(name: str) -> Model:
    """Return a model that comes with the package.

    Parameters
    ----------
    name
        name of the file without ending, such as "case3" or "manual_transmission". The page "Examples" of the
        documentation describes all examples; ``gearrattle examples`` lists them and copies the files.

    Returns
    -------
    Model
        The model, as ``load`` returns it. The three cases of the 1995 paper, its transmission of eight inertias, and
        drivelines with friction, a run-up, a measured speed and alternating mesh stiffness are among them.

    Raises
    ------
    ModelError
        no example has this name; the message lists all names.

    Examples
    --------
    >>> import gearrattle as gr
    >>> [inertia.name for inertia in gr.example("case3").inertias]
    ['flywheel', 'hub', 'input_gear', 'output_gear']
    """
    files = example_files()
    if not isinstance(name, str) or name not in files:
        rule = f"there is no such example; there are {', '.join(files)}"
        raise ModelError(Problem("name", shown(name), rule, did_you_mean(name, files)))
    return load(files[name])


def example_files() -> dict[str, Path]:
    """Return the examples' model files by name, in alphabetical order; ModelError if they are not installed."""
    folder = examples_folder()
    return dict(sorted((path.stem, path) for pattern in _MODELS for path in folder.glob(pattern)))


def examples_folder() -> Path:
    """Return the folder of the examples; ModelError if it is not installed."""
    for folder in (_PACKAGE / "examples", _PACKAGE.parents[1] / "examples"):
        if (folder / "paper").is_dir():
            return folder
    rule = "the package was installed without its examples"
    remedy = "install the wheel again"
    raise ModelError(Problem("examples", "", rule, remedy))
