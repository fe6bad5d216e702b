"""Drivelines whose causes are known."""

from __future__ import annotations

TWO_BODIES = """
schema = 1
name = "two bodies"
[[inertia]]
name = "flywheel"
J = "0.14 kg*m^2"
[[inertia]]
name = "shaft"
J = "0.0047 kg*m^2"
[[coupling]]
name = "damper"
between = ["flywheel", "shaft"]
stiffness = "68.75 N*m/rad"
damping = "0.05 N*m*s/rad"
[excitation]
speed = "780 rpm"
[[torque]]
on = "flywheel"
harmonics = [{ order = 2, amplitude = "90 N*m" }]
"""

LINEAR = """
schema = 1
name = "in contact"
[[inertia]]
name = "flywheel"
J = "0.14 kg*m^2"
[[inertia]]
name = "shaft"
J = "0.0047 kg*m^2"
[[inertia]]
name = "gear"
J = "0.002 kg*m^2"
drag_torque = "20 N*m"
[[coupling]]
name = "damper"
between = ["flywheel", "shaft"]
stiffness = "300 N*m/rad"
damping = "0.3 N*m*s/rad"
[[mesh]]
name = "pair"
between = ["shaft", "gear"]
radii = ["40 mm", "50 mm"]
stiffness = "3e6 N/m"
damping = "800 N*s/m"
backlash = "100 um"
transmission_error = [{ order = 3, amplitude = "2 um", phase = "40 deg" }]
[excitation]
speed = "780 rpm"
[[torque]]
on = "flywheel"
mean = "16 N*m"
harmonics = [{ order = 2, amplitude = "20 N*m" }, { order = 3, amplitude = "6 N*m" }]
"""

_GEARS = (
    ("14.7", "53.0", 140),
    ("22.2", "45.5", 120),
    ("28.7", "39.0", 100),
    ("33.35", "34.35", 90),
    ("37.2", "30.5", 70),
    ("40.05", "27.65", 60),
)
_MESH = """
[[mesh]]
name = "m{number}"
between = ["input_shaft", "gear{number}"]
radii = ["{shaft} mm", "{gear} mm"]
stiffness = "3.2e8 N/m"
damping = "800 N*s/m"
backlash = "{backlash} um"
"""

GEARBOX = """
schema = 1
name = "six-speed gearbox in neutral"
inertia = [
  { name = "flywheel", J = "0.14 kg*m^2" },
  { name = "hub", J = "5e-4 kg*m^2" },
  { name = "input_shaft", J = "0.0025 kg*m^2", drag_torque = "0.3 N*m" },
  { name = "gear1", J = "1.9e-3 kg*m^2", drag_torque = "0.30 N*m" },
  { name = "gear2", J = "1.05e-3 kg*m^2", drag_torque = "0.22 N*m" },
  { name = "gear3", J = "5.6e-4 kg*m^2", drag_torque = "0.15 N*m" },
  { name = "gear4", J = "3.5e-4 kg*m^2", drag_torque = "0.10 N*m" },
  { name = "gear5", J = "2.2e-4 kg*m^2", drag_torque = "0.07 N*m" },
  { name = "gear6", J = "1.6e-4 kg*m^2", drag_torque = "0.05 N*m" },
]
[[coupling]]
name = "damper"
between = ["flywheel", "hub"]
stages = [
  { stiffness = "1.2 N*m/deg", until = "4 deg", hysteresis = "1.5 N*m" },
  { stiffness = "8 N*m/deg", until = "12 deg", hysteresis = "8 N*m" },
  { stiffness = "25 N*m/deg", hysteresis = "20 N*m" },
]
[[coupling]]
name = "spline"
between = ["hub", "input_shaft"]
stiffness = "10 kN*m/rad"
damping = "0.1 N*m*s/rad"
clearance = "0.2 deg"
[excitation]
speed = "780 rpm"
[[torque]]
on = "flywheel"
mean = "0.8558 N*m"
harmonics = [{ order = 2, amplitude = "90 N*m" }, { order = 4, amplitude = "25 N*m" }]
""" + "".join(
    _MESH.format(number=i, shaft=shaft, gear=gear, backlash=backlash)
    for i, (shaft, gear, backlash) in enumerate(_GEARS, start=1)
)
