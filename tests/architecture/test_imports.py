"""Imports name what exists, and heavy libraries stay unloaded until they are needed (layers: `make lint`)."""

from __future__ import annotations

import ast
import subprocess
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from runpy import run_path

import grimp
import pytest

from tests.architecture.places import ROOT, SOURCE, nodes_of
from tests.architecture.public import public_names

HEAVY = (
    "gearrattle.report",
    "numba",
    "scipy.signal",
    "scipy.integrate",
    "xarray",
    "pandas",
    "pint",
    "matplotlib",
    "h5netcdf",
)


def _python(code: str) -> str:
    """Run code in a fresh interpreter and return what it printed."""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_the_drawing_of_the_packages_is_that_of_the_imports() -> None:
    drawing = run_path(str(ROOT / "docs" / "images" / "packages.py"))["drawing"]
    assert (ROOT / "docs" / "images" / "packages.svg").read_text(encoding="utf-8") == drawing(), "make images"


def test_rooms_below_the_command_line_do_not_import_the_package_root() -> None:
    graph = grimp.build_graph("gearrattle", cache_dir=None)
    importers = graph.find_modules_that_directly_import("gearrattle")
    assert {name for name in importers if not name.startswith(("gearrattle.cli", "gearrattle.report"))} == set()


def test_a_name_that_is_also_that_of_a_file_comes_from_it() -> None:
    """Any other file of that name, once imported, would take the place of the name in its room."""
    shadowed = []
    for init in SOURCE.rglob("__init__.py"):
        room = ".".join(init.parent.relative_to(SOURCE.parent).parts)
        files = {path.stem for path in init.parent.iterdir() if path.suffix == ".py" or (path / "__init__.py").exists()}
        for node in ast.parse(init.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ImportFrom):
                names = {alias.asname or alias.name for alias in node.names} & files
                shadowed += [f"{room}.{name}" for name in names if node.module not in (room, f"{room}.{name}")]
    assert shadowed == []


@pytest.mark.slow
def test_names_imported_from_the_package_exist() -> None:
    """In every file, those that no test imports (benchmarks, manual) included."""
    missing = []
    for folder in ("src", "tests", "benchmarks", "examples", "docs"):
        for path in (ROOT / folder).rglob("*.py"):
            for node in nodes_of(path):
                if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "gearrattle":
                    missing += [f"{path}: {node.module}.{name.name}" for name in node.names if not _exists(node, name)]
    assert missing == []
    names = public_names()  # now that every module is imported
    assert [name for name, member in names.items() if not callable(member)] == [], "shadowed by a module of that name"


def _exists(node: ast.ImportFrom, name: ast.alias) -> bool:
    assert node.module is not None
    module = import_module(node.module)
    submodule = hasattr(module, "__path__") and find_spec(f"{node.module}.{name.name}") is not None
    return submodule or hasattr(module, name.name)


@pytest.mark.parametrize(
    "start",
    [
        "import gearrattle",
        "import sys; sys.argv = ['gearrattle', '--help']\n"
        "from gearrattle.cli import main\n"
        "try:\n    main()\nexcept SystemExit as stop:\n    assert not stop.code, stop.code",
    ],
    ids=["import", "help"],
)
def test_heavy_libraries_load_late(start: str) -> None:
    printed = _python(f"{start}\nimport sys\nprint('LOADED', *sorted(set(sys.modules) & set({HEAVY!r})))")
    assert printed.strip().splitlines()[-1] == "LOADED"


def test_no_source_is_read_at_the_start() -> None:
    """What describes the keys of a file stands in the source of its class, and is read for a schema alone."""
    code = "import linecache, gearrattle.model; print(*[name for name in linecache.cache if 'gearrattle' in name])"
    assert _python(code).strip() == ""


UNNEEDED = (
    "numba",
    "llvmlite",
    "pint",
    "dask",
    "scipy",
    "pandas",
    "xarray",
    "matplotlib",
    "gearrattle.signals",
)


def test_a_check_loads_no_compiler_and_no_registry_of_units() -> None:
    """Of a driveline of some bodies; three quarters of the time that a check took."""
    code = (
        "import sys\nfrom gearrattle.cli import main\n"
        "assert main(['check', 'examples/paper/case3.toml']) == 0\n"
        f"print('LOADED', *sorted(set(sys.modules) & set({UNNEEDED!r})))"
    )
    assert _python(code).strip().splitlines()[-1] == "LOADED"


@pytest.mark.parametrize(
    ("command", "unneeded"),
    [
        ("modes", ("numba", "pint", "dask", "scipy", "gearrattle.engine.periodic", "gearrattle.orbits.attractors")),
        ("scale", ("numba", "pint", "dask", "scipy.optimize", "gearrattle.engine.periodic")),
    ],
)
def test_what_needs_no_motion_loads_no_compiler(command: str, unneeded: tuple[str, ...]) -> None:
    code = (
        "import sys\nfrom gearrattle.cli import main\n"
        f"assert main([{command!r}, 'examples/paper/case3.toml']) == 0\n"
        f"print('LOADED', *sorted(set(sys.modules) & set({unneeded!r})))"
    )
    assert _python(code).strip().splitlines()[-1] == "LOADED"


@pytest.mark.slow
def test_a_simulation_on_a_terminal_loads_no_figures() -> None:
    """Nothing is drawn, judged or saved: a motion's answer is its cost and its crossings."""
    unneeded = ("gearrattle.report.plots", "gearrattle.quantities", "gearrattle.pipeline", "xarray", "h5py")
    code = (
        "import sys\nfrom gearrattle.cli import main\n"
        "assert main(['simulate', 'examples/paper/case3.toml', '--cycles', '2']) == 0\n"
        f"print('LOADED', *sorted(set(sys.modules) & set({unneeded!r})))"
    )
    assert _python(code).strip().splitlines()[-1] == "LOADED"


@pytest.mark.slow
def test_a_run_and_its_report_load_no_library_of_which_they_need_a_line(tmp_path: Path) -> None:
    """A second of the start: a taper is three cosines, a limit of confidence one quantile."""
    unneeded = ("scipy.signal", "scipy.stats", "scipy.integrate", "scipy.interpolate", "pandas", "xarray", "matplotlib")
    unneeded += ("pint", "dask", "gearrattle.engine.periodic", "gearrattle.orbits.attractors")
    code = (
        "import sys\nfrom gearrattle.cli import main\n"
        f"assert main(['run', 'examples/paper/case3.toml', '-o', {str(tmp_path / 'out')!r}]) in (0, 1)\n"
        f"print('LOADED', *sorted(set(sys.modules) & set({unneeded!r})))"
    )
    assert _python(code).strip().splitlines()[-1] == "LOADED"
