"""Motions that are hard to march: one that must come back, and one that cannot."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.engine.solvers.samples_in_si import StepLimit
from gearrattle.errors import ConvergenceError
from gearrattle.model.model_file import loads
from tests.engine.solvers.short_sweep import MODEL, integrated
from tests.engine.system.drivelines import random_chain

pytestmark = pytest.mark.compiled

RINGING = """
schema = 1
[[inertia]]
name = "wheel"
J = 0.01
[[inertia]]
name = "pinion"
J = 1e-6
[[inertia]]
name = "hub"
J = 1e-6
[[coupling]]
name = "spline"
between = ["wheel", "pinion"]
clearance = 1e-3
stiffness = 1e4
[[coupling]]
name = "key"
between = ["pinion", "hub"]
stiffness = {stiffness}
[excitation]
frequency = 20.0
[[torque]]
on = "wheel"
harmonics = [{{ order = 1.0, amplitude = 1.0 }}]
[simulation]
cycles = 1
[simulation.initial]
angle = [0.0, 3e-4, -3e-4]
velocity = [0.0, 0.0, 0.0]
"""
"""The key rings inside the gap of the spline, and nothing stops it: every oscillation takes steps of its own."""


def test_a_run_up_much_shorter_than_the_run_returns_the_motion_of_its_model() -> None:
    model = loads(MODEL)
    t = gr.simulate(model).trajectory
    times, elements, angle, velocity = integrated(model, t.end)
    assert t.layout.clearance[t.events.clearance].tolist() == elements.tolist()
    assert len(times) == 148
    apart = np.abs(t.events.time - times) / t.end
    assert apart[:5].max() < 1e-13
    assert apart[:25].max() < 1e-11
    assert apart.max() < 1e-6  # errors of both sides grow on the way
    assert t.angle[-1] == pytest.approx(angle, abs=1e-6)
    assert t.velocity[-1] == pytest.approx(velocity, abs=1e-2)


def test_a_motion_of_too_many_steps_is_refused_with_element_time_and_remedy() -> None:
    with pytest.raises(ConvergenceError) as caught:
        gr.simulate(loads(RINGING.format(stiffness=1e20)))
    assert 0.0 < caught.value.time < 0.05 / 1024
    message = str(caught.value)
    assert message.startswith("exact: the motion needs too many steps: key moves too fast for its inertias, at t = ")
    assert "less stiffness or damping in the element named" in message


def test_a_study_does_the_other_cases() -> None:
    axes = {"coupling.key.stiffness": [1e4, 1e5, 1e20, 1e6, 1e7]}
    data = gr.study(loads(RINGING.format(stiffness=1e4)), axes, ["crossings per cycle"], scheduler="threads")
    assert np.isfinite(data["crossings per cycle"].values).tolist() == [True, True, False, True, True]


def test_steps_count_as_too_many_only_without_progress() -> None:
    system = random_chain(0)  # its fastest input has seven periods in T
    limit, part = StepLimit(system), 1.0 / 7 / 1024
    assert not any(limit.is_exceeded(1_000_000 * i, i * 0.6 * part) for i in range(20))
    stuck = [limit.is_exceeded(20_000_000 + 500_000 * i, 12 * part + 0.1 * part * i) for i in range(8)]
    assert stuck == [False] * 5 + [True] * 3
    assert not limit.is_exceeded(100, 0.0)  # another run


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
@pytest.mark.long
def test_ctrl_c_is_heard_while_a_march_hardly_gets_on() -> None:
    program = (
        "import signal, time\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "import gearrattle as gr\n"
        "from gearrattle.model.model_file import loads\n"
        f"model, told = loads({RINGING.format(stiffness=2e15)!r}), []\n"
        "def progress(part):\n"
        "    told or print('marching', flush=True)\n"
        "    told.append(part)\n"
        "try:\n"
        "    gr.simulate(model, progress=progress)\n"
        "except KeyboardInterrupt:\n"
        "    print(time.perf_counter(), flush=True)\n"
    )
    for _ in range(3):  # a busy machine may be late once, the program must not be
        with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE) as process:
            assert process.stdout is not None
            try:
                assert process.stdout.readline() == b"marching\n"
                time.sleep(0.3)
                assert process.poll() is None
                pressed = time.perf_counter()  # of the same clock in all processes
                process.send_signal(signal.SIGINT)
                took = float(process.stdout.readline()) - pressed
            finally:
                process.kill()
        if took <= 0.5:
            break
    assert took <= 0.5
