"""Any driveline the engine accepts gets its report."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import gearrattle as gr
from gearrattle import pipeline

DRIVELINES = {
    "linear and dimensionless": """
schema = 1
units = "dimensionless"
inertia = [{ name = "a", J = 1 }, { name = "b", J = 2 }]
coupling = [{ name = "s", between = ["a", "b"], stiffness = 4, damping = 0.1 }]
torque = [{ on = "a", harmonics = [{ order = 1, amplitude = 1 }] }]
excitation = { speed = 1.5 }
""",
    "one body, nothing else": """
schema = 1
inertia = [{ name = "a", J = 1 }]
excitation = { speed = 10 }
""",
    "at rest in the middle of a gap": """
schema = 1
inertia = [{ name = "a", J = 1 }]
coupling = [{ name = "s", between = ["ground", "a"], stiffness = 4, clearance = 0.1 }]
excitation = { speed = 10 }
""",
    "parallel elements, a mesh without a gap, unbalanced": """
schema = 1
inertia = [{ name = "a", J = 1 }, { name = "b", J = 2 }, { name = "c", J = 0.1, drag_torque = 1 }]
coupling = [
  { name = "s", between = ["a", "b"], stiffness = 400, damping = 1 },
  { name = "stop", between = ["b", "a"], stiffness = 4000, clearance = 0.01 },
]
mesh = [{ name = "m", between = ["b", "c"], radii = [0.1, 0.05], stiffness = 1e6, damping = 10 }]
torque = [{ on = "a", mean = 5, harmonics = [{ order = 0.5, amplitude = 20 }] }]
excitation = { speed = "60 rpm" }
""",
    "a prescribed motion through a coupling and a mesh": """
schema = 1
inertia = [{ name = "a", J = 0.1 }, { name = "b", J = 0.2, drag = 0.5 }, { name = "c", J = 0.1, drag_torque = 1 }]
coupling = [{ name = "s", between = ["a", "b"], stiffness = 400, damping = 1, clearance = 0.01 }]
[[mesh]]
name = "m"
between = ["a", "c"]
radii = [0.1, 0.05]
stiffness = 1e6
damping = 10
backlash = 1e-4
transmission_error = [{ order = 3, amplitude = 1e-6 }]
[[motion]]
on = "a"
speed = { time = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5], value = [0.0, 1.0, -1.0, 0.5, 2.0, 0.0] }
[excitation]
speed = 40
""",
    "staged and asymmetric": """
schema = 1
inertia = [{ name = "a", J = 0.1 }, { name = "b", J = 0.2, drag = 0.5 }]
[[coupling]]
name = "damper"
between = ["a", "b"]
stages = [{ stiffness = 0, until = 0.01 }, { stiffness = 30, until = 0.05, damping = 0.1 }, { stiffness = 300 }]
coast_stages = [{ stiffness = 60, until = 0.02 }, { stiffness = 200, damping = 0.2 }]
[[torque]]
on = "a"
harmonics = [{ order = 2, amplitude = 20 }]
[excitation]
speed = 40
""",
}


@pytest.mark.slow
@pytest.mark.parametrize("name", DRIVELINES)
@pytest.mark.parametrize(("cycles", "samples"), [(6, 32), (1, 1)])
def test_a_report_for_every_driveline(name: str, cycles: int, samples: int, tmp_path: Path) -> None:
    model = gr.loads(DRIVELINES[name])
    findings = pipeline.run(model, cycles=cycles, samples_per_cycle=samples)
    page = findings.save(tmp_path / "out").read_text(encoding="utf-8")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert summary["verdict"] == findings.verdict.verdict
    assert findings.verdict.sentence.split(":")[0] in page
    for body in model.inertias:
        assert f'<tspan class="name">{body.name}</tspan>' in page
    elements = {"s": "the motion of a through s", "m": "the motion of a through m and the transmission error of m"}
    prescribed = [f"work of {cause}" in page for cause in elements.values()]
    assert prescribed == [bool(model.motions)] * 2
    reopened = gr.open_run(tmp_path / "out" / "results.nc")
    assert len(reopened.trajectory.events) == len(findings.motion.trajectory.events)
