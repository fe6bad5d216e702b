"""Command line of gearrattle: one file per command.

``main`` is the entry point. It imports a command only when the user calls it, converts every error to one message on
stderr and an exit code, and never shows a traceback (unless GEARRATTLE_DEBUG=1). Results are printed on stdout,
progress and messages on stderr. Exit codes: 0 done, 1 computation or machine failed, 2 bad input or usage, 130 Ctrl-C,
143 SIGTERM.

A new command needs a file with a function, and a line in ``COMMANDS``.
"""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

import gearrattle
from gearrattle.errors import ModelError, Problem
from gearrattle.files import allowed_root
from gearrattle.threads import one_thread

if TYPE_CHECKING:
    from cyclopts import App

COMMANDS = {
    "run": ("gearrattle.cli.run_command:run", "The whole procedure: check, modes, simulate, judge, report."),
    "check": ("gearrattle.cli.check_command:check", "Is this a model, and can it bear its loads?"),
    "advise": ("gearrattle.cli.advise_command:advise", "What to do before simulating, and what a run will show."),
    "modes": ("gearrattle.cli.modes_command:modes", "Natural frequencies, damping ratios and shapes."),
    "scale": ("gearrattle.cli.scale_command:scale", "The model without dimensions: coefficients, conditioning."),
    "stiffness": (
        "gearrattle.cli.stiffness_command:stiffness",
        "Eigenvalues, R_lambda, and which fixed steps are stable.",
    ),
    "reduce": ("gearrattle.cli.reduce_command:reduce", "A smaller model for a band, and its error."),
    "condense": (
        "gearrattle.cli.condense_command:condense",
        "Matrices of few coordinates for a band, and their error.",
    ),
    "fit": ("gearrattle.cli.fit_command:fit", "Parameters from measured modes, responses or motions."),
    "loop": ("gearrattle.cli.loop_command:loop", "Stages of a damper from its measured torque-angle loop."),
    "simulate": ("gearrattle.cli.simulate_command:simulate", "The motion alone, saved as netCDF-4 or CSV."),
    "periodic": ("gearrattle.cli.periodic_command:periodic", "A motion that repeats, stable or not; or all of them."),
    "continue": ("gearrattle.cli.continue_command:continue_", "Motions that repeat, over a value of the model."),
    "stream": ("gearrattle.cli.stream_command:stream", "A long motion in chunks; stop it and go on."),
    "compare": ("gearrattle.cli.compare_command:compare", "Algorithms side by side, judged by the exact solution."),
    "validate": (
        "gearrattle.cli.validate_command:validate",
        "A simulated motion against a measured one.",
    ),
    "study": ("gearrattle.cli.study_command:study", "Many variants of one driveline; stop it and go on."),
    "screen": ("gearrattle.cli.screen_command:screen", "Which loose gear rattles at which speed and load, as a map."),
    "prove-quiet": (
        "gearrattle.cli.prove_quiet_command:prove_quiet",
        "Where in a box of tolerances quiet is proven.",
    ),
    "threshold": ("gearrattle.cli.threshold_command:threshold", "The smallest change at which a driveline is quiet."),
    "remedy": ("gearrattle.cli.remedy_command:remedy", "Which change, or pair of changes, makes a driveline quiet."),
    "reproduce": (
        "gearrattle.cli.reproduce_command:reproduce",
        "The 1995 paper's numbers beside ours, and why they differ.",
    ),
    "look": ("gearrattle.cli.look_command:look", "Channels, units and rates of a measured file."),
    "orders": ("gearrattle.cli.orders_command:orders", "Orders and spectra along a run-up, simulated or measured."),
    "spectra": (
        "gearrattle.cli.spectra_command:spectra",
        "Density of a signal; transfer function and coherence of two.",
    ),
    "figures": ("gearrattle.cli.figures_command:figures", "Figures of a result for print: PDF, EPS, SVG, PNG, TIFF."),
    "share": (
        "gearrattle.cli.share_command:share",
        "A saved result as one file: zip, PDF, slides, Excel.",
    ),
    "criteria": ("gearrattle.cli.criteria_command:criteria", "The verdict on a saved motion."),
    "metrics": ("gearrattle.cli.metrics_command:metrics", "Rattle metrics of a saved motion or a measured file."),
    "listen": ("gearrattle.cli.listen_command:listen", "Impacts as sound: WAV files, levels, loudness."),
    "fmu": ("gearrattle.cli.fmu_command:fmu", "The driveline as an FMU, for co-simulation in another tool."),
    "serve": ("gearrattle.cli.serve_command:serve", "The workbench: a page to draw, run and compare drivelines."),
    "import": ("gearrattle.cli.import_command:import_", "A model from openTorsion, ROSS or Modelica."),
    "export": (
        "gearrattle.cli.export_command:export",
        "A model for openTorsion, Modelica or your own solver; matrices.",
    ),
    "examples": ("gearrattle.cli.examples_command:examples", "Models that come with the package; copies all examples."),
    "schema": ("gearrattle.cli.schema_command:schema", "The format of model files and study files, for editors."),
}
"""Every command: where its function is, and what it does."""

_COLLECTED = 20_000
"""Number of new objects between two garbage collections. Libraries make a million objects that remain; visiting them
in every collection took a tenth of a command's time."""

__all__ = ["COMMANDS", "app", "main"]


def app() -> App:
    """Build the command line's parser; no command is imported yet."""
    from cyclopts import App, Parameter

    built = App(
        name="gearrattle",
        help=(
            "Does it rattle, where, how badly? Exact simulation of drivelines with clearances. Every command takes "
            "--root DIR: files under DIR may be named by input files, beside those under an input file's own folder."
        ),
        version=gearrattle.__version__,
        default_parameter=Parameter(negative=""),  # no --no-json, no --empty-set
        help_format="rst",
        suppress_keyboard_interrupt=False,
        result_action="return_value",
    )
    for order, (name, (target, words)) in enumerate(COMMANDS.items()):
        built.command(target, name=name, help=words, sort_key=order)
    return built


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line (without the name of the program; None: that of the process) and return the exit code."""
    if arguments is None:
        one_thread()
        gc.set_threshold(_COLLECTED)
    try:
        from gearrattle.cli.failures import guarded

        return guarded(lambda: _dispatch(arguments))
    except KeyboardInterrupt:
        return 130


def _dispatch(arguments: Sequence[str] | None) -> None:
    words = sys.argv[1:] if arguments is None else list(arguments)
    root, rest = _root_of(words)
    with allowed_root(root):
        app()(rest, print_error=False, exit_on_error=False)


def _root_of(words: list[str]) -> tuple[str | None, list[str]]:
    """Remove ``--root DIR``, which every command accepts, from the command line and return it.

    ModelError if it is not a folder.
    """
    root = None
    rest = []
    ahead = iter(words)
    for word in ahead:
        if word == "--":
            rest += [word, *ahead]
        elif word == "--root" or word.startswith("--root="):
            root = word.removeprefix("--root=") if word != "--root" else next(ahead, "")
            if not os.path.isdir(root):
                raise ModelError(Problem("--root", f'"{root}"', "must be a folder", "its files may then be named"))
        else:
            rest.append(word)
    return root, rest
