"""Two loose gears of a five-speed transmission in neutral, over their backlash.

Less backlash does not stop the rattle, it makes the impacts more frequent. Whatever the gap, the mesh must hand each
loose gear exactly the momentum its drag takes away, which checks every contact impulse of the run at once:

    R * (integral of the mesh force) = drag_torque * time + drag * (change of angle) + J * (change of velocity).
"""

from pathlib import Path

import gearrattle as gr

model = gr.load(Path(__file__).parent / "manual_transmission.toml")

print("backlash    mesh          impacts/cycle  mean energy [mJ]  momentum error")
for backlash in (0.03, 0.06, 0.12, 0.24):
    run = gr.simulate(
        model.with_({f"mesh.{mesh.name}.backlash": f"{backlash} mm" for mesh in model.meshes}), cycles=60, discard=30
    )
    parts = {part.name: part for part in gr.criteria(run).parts}
    force_integral = dict(zip(run.data.clearance.values, run.trajectory.final_force_integral, strict=True))
    for mesh in model.meshes:
        gear = next(inertia for inertia in model.inertias if inertia.name == mesh.between[1])
        motion = run.data.sel(inertia=gear.name)
        turned = float(motion.angle[-1] - motion.angle[0])
        gained = float(motion.velocity[-1] - motion.velocity[0])
        taken = gear.drag_torque * run.trajectory.end + gear.drag * turned + gear.J * gained
        momentum_received = mesh.radii[1] * float(force_integral[mesh.name])
        part = parts[mesh.name]
        print(
            f"{backlash:5.2f} mm    {mesh.name:12}  {part.impacts_per_cycle:13.1f}"
            f"  {1e3 * part.mean_impact_energy:16.4f}  {abs(momentum_received / taken - 1):14.1e}"
        )
        assert part.regime == "double-sided"
        assert abs(momentum_received - taken) < 1e-11 * taken
