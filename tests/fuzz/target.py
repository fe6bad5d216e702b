"""What one target is, and the driveline that most targets begin with.

Takes nothing; gives ``Target``.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import gearrattle as gr
from gearrattle.errors import ConvergenceError
from gearrattle.results import Run
from tests.fuzz.mutations import Kind

ROOT = Path(__file__).parents[2]
SMALL = """schema = 1
name = "small"
inertia = [ { name = "engine", J = 0.2, drag = 0.05 }, { name = "wheel", J = 0.02, drag_torque = 0.4 } ]
[[coupling]]
name = "joint"
between = ["engine", "wheel"]
stiffness = 800.0
damping = 0.2
clearance = 0.01
[excitation]
speed = 80.0
[[torque]]
on = "engine"
mean = 0.4
harmonics = [ { order = 1, amplitude = 6.0 } ]
[simulation]
cycles = 2
discard = 1
samples_per_cycle = 8
"""


class LawError(AssertionError):
    """An answer breaks the law of its target: what it should have been, in words."""


class NotSimulatedError(ConvergenceError):
    """A target came as far as a motion, and that is computed by no target."""


NO_MOTION = NotSimulatedError("not simulated")


@dataclass(frozen=True)
class Target:
    """One way to read a file.

    Attributes
    ----------
    name
        of it.
    file
        name of the damaged file.
    seeds
        writes sound files into a folder and returns their contents.
    run
        reads the damaged file; takes its path.
    kind
        what it consists of: a text and JSON are damaged by their tokens and values.
    around
        what the folder holds besides; takes the folder.
    while_open
        a context in which the target runs.
    """

    name: str
    file: str
    seeds: Callable[[Path], list[bytes]]
    run: Callable[[Path], object]
    kind: Kind = "bytes"
    around: Callable[[Path], object] = lambda _: None
    while_open: Callable[[], Any] = ExitStack


@cache
def small_run() -> Run:
    """Return the motion of the small driveline."""
    return gr.simulate(gr.loads(SMALL), audit=False)


def of_texts(*those: Path | str) -> Callable[[Path], list[bytes]]:
    """Return what gives the contents of files, and texts as they are."""
    return lambda _: [one.encode() if isinstance(one, str) else one.read_bytes() for one in those]
