"""The torque of a four-cylinder engine, from the pressure in one cylinder and the geometry of the crank.

The pressure here is a made-up one: polytropic compression and expansion, and combustion that adds pressure within some
forty degrees. What the pistons give the crank over two turns is the work that the gas does, which checks the mean:

    4 pi * mean torque = cylinders * integral of p dV.
"""

import numpy as np

import gearrattle as gr

BORE, STROKE, ROD, RATIO = 0.081, 0.0955, 0.144, 17.0

angle = np.linspace(0.0, 4.0 * np.pi, 1441)
share = 0.5 * STROKE / ROD
way = 0.5 * STROKE * (1 - np.cos(angle)) + ROD * (1 - np.sqrt(1 - (share * np.sin(angle)) ** 2))
volume = 0.25 * np.pi * BORE**2 * (way + STROKE / (RATIO - 1))
away = np.remainder(angle + 2.0 * np.pi, 4.0 * np.pi) - 2.0 * np.pi
closed = np.abs(away) < np.pi
burnt = 0.5 * (1.0 + np.tanh((away - 0.2) / 0.2))
pressure = np.where(closed, 1e5 * (volume.max() / volume) ** 1.33 * (1.0 + 1.2 * burnt), 1e5)

engine = {"cylinders": 4, "bore": BORE, "stroke": STROKE, "rod": ROD, "mass": "0.75 kg", "crankcase": "1 bar",
          "pressure": {"angle": angle.tolist(), "value": pressure.tolist()}}  # fmt: skip
for speed in ("800 rpm", "3000 rpm"):
    torque = gr.gas_torque(**engine, speed=speed, orders=8)
    harmonics_text = ", ".join(f"order {w.order:g}: {w.amplitude:.1f} N m" for w in torque.harmonics)
    print(f"{speed:>8}: mean {torque.mean:.1f} N m; {harmonics_text}")

work = 4.0 * float(np.sum(0.5 * (pressure[1:] + pressure[:-1]) * np.diff(volume)))
print(f"work of a cycle: {torque.work:.2f} J by the torque, {work:.2f} J by the area of the indicator diagram")
assert abs(torque.work / work - 1.0) < 5e-3
assert {wave.order for wave in torque.harmonics} == {2.0, 4.0, 6.0, 8.0}
