"""Orders of a run-up, simulated and as a rig would measure them: the same numbers by two routes.

The five-speed transmission runs up from 800 to 3000 rpm. Its flywheel sees torques of orders 2, 4 and 6 only, so their
orders are known in advance: J times the acceleration's amplitude is nearly the torque's, as the damper is soft.
"""

import numpy as np

import gearrattle as gr

model = gr.example("run_up")
run = gr.simulate(model)

cuts = gr.spectral.order_cuts(run, "acceleration.flywheel", [2, 4, 6], turns=4, over="speed")
rpm = cuts.speed * 30.0 / np.pi
torque = 0.15 * cuts.amplitude.sel(order=2)
expected_torque = np.interp(rpm, [700.0, 1500.0, 3000.0], [50.0, 70.0, 40.0])
for n, torque_at_speed, wanted in list(zip(rpm.values, torque.values, expected_torque, strict=True))[::6]:
    print(f"{n:6.0f} rpm: order 2 of the inertia torque {torque_at_speed:5.2f} N m, of the applied {wanted:5.2f} N m")
assert float(abs(torque / expected_torque - 1.0).max()) < 0.02

# The same motion as a rig's record: an acceleration and a speed, resampled over the shaft's angle.
time = run.trajectory.time
record = gr.measured.Recording(
    time,
    (
        gr.measured.Channel("a", "acceleration", "flywheel", "rad/s^2", run.trajectory.acceleration[:, 0]),
        gr.measured.Channel("n", "speed", "", "rad/s", run.speed),
    ),
    "rig",
)
torque_at_speed = gr.spectral.order_map(record, "acceleration.flywheel", turns=4, over="speed")
same = torque_at_speed.amplitude.sel(order=[2.0, 4.0]).interp(speed=cuts.speed.values[1:-1])
assert float(abs(same.values / cuts.amplitude.sel(order=[2.0, 4.0]).values[1:-1] - 1.0).max()) < 0.02

spectra = gr.spectral.waterfall(run, "acceleration.fifth_gear", speed_step="100 rpm")
print(f"waterfall of a rattling gear: {dict(spectra.sizes)}, bins of {spectra.attrs['resolution']:.3g} Hz")
print(spectra.attrs["notes"])
