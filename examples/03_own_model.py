"""A model of one's own, written as text, and a parameter changed.

At idle the gearbox drags with 3 N m. The damper's first stage, 20 N m/rad up to 6 degrees, carries at most 2.1 N m,
so the damper rests on its stiff stage and leaves it again and again. A first stage up to 10 degrees carries the drag.
"""

from math import sqrt

import gearrattle as gr

model = gr.loads("""
schema = 1
name = "Idling engine, two-stage clutch damper, gearbox"
[[inertia]]
name = "flywheel"
J = "0.3 kg*m^2"
[[inertia]]
name = "gearbox"
J = "0.012 kg*m^2"
drag = "0.01 N*m*s/rad"
drag_torque = "3 N*m"
[[coupling]]
name = "damper"
between = ["flywheel", "gearbox"]
stages = [
  { stiffness = "20 N*m/rad",   damping = "0.05 N*m*s/rad", until = "6 deg" },
  { stiffness = "1.2 kN*m/rad", damping = "0.3 N*m*s/rad" },
]
[excitation]
speed = "800 rpm"
[[torque]]
on = "flywheel"
mean = "3 N*m"
harmonics = [{ order = 2, amplitude = "120 N*m", phase = "90 deg" }]
""")
wider = model.with_({"coupling.damper.stages.0.until": "10 deg"})

regimes = []
for name, variant in (("6 deg", model), ("10 deg", wider)):
    verdict = gr.criteria(gr.simulate(variant))
    print(f"{name:>6}: rests in region {gr.equilibrium(variant).region['damper']}. {verdict.sentence}")
    regimes.append(verdict.parts[0].regime)
    assert verdict.verdict == "quiet"  # no gap: a damper that changes stage does not rattle

assert regimes[0] != "quiet"  # it leaves its first stage, on both sides
assert regimes[1] == "quiet"

frequency = gr.modes(model, region={"damper": 0}).frequencies[1]  # two inertias on one spring
assert abs(frequency - sqrt(20 * (1 / 0.3 + 1 / 0.012))) < 1e-9
