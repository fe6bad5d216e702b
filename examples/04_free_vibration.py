"""Free vibration through a gap, against its closed form.

x'' + w^2 dz(x, b) = 0 with amplitude A > b: the mass swings against a spring on either side and coasts through the gap
of 2 b between them, so T = 2 pi / w + 4 b / (w (A - b)).
"""

from math import pi

import gearrattle as gr

w, b, A = 2.0, 0.5, 1.25
model = gr.loads(f"""
schema = 1
units = "dimensionless"
[[inertia]]
name = "mass"
J = 1.0
[[coupling]]
name = "gap"
between = ["mass", "ground"]
stiffness = {w**2}
clearance = {b}
[excitation]
frequency = 1.0
[simulation]
initial = {{ angle = [{A}], velocity = [0.0] }}
""")

run = gr.simulate(model, cycles=100, samples_per_cycle=8)
times = run.events.time.to_numpy()
laps = (len(times) - 1) // 4  # four crossings a period
period = (times[4 * laps] - times[0]) / laps
closed = 2 * pi / w + 4 * b / (w * (A - b))

print(f"period {period:.15f}, closed form {closed:.15f}, over {laps} periods")
assert abs(period - closed) < 1e-13 * closed
