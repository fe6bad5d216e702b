"""A run-up of 4.6 ms in a run of 120 ms, and its motion by a plain integration of what the model says."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from gearrattle.assembly import assemble
from gearrattle.model import Model

MODEL = """
schema = 1
[[inertia]]
name = "i0"
J = 0.12758475796334434
drag_torque = 1.1049629986409795
[[inertia]]
name = "i1"
J = 0.023808065060875277
drag_torque = 2.462896785412944
[[inertia]]
name = "i2"
J = 0.0019676235315664813
[[inertia]]
name = "i3"
J = 0.2213229704994238
[[mesh]]
name = "e0"
between = ["i0", "i1"]
radii = [0.25010149438232643, 0.25190852218399323]
stiffness = 2942594.55008354
damping = 31.69995998597747
backlash = 0.0002339277566067839
transmission_error = [
  { order = 7.0, amplitude = 5.2927732244607766e-05, phase = -3.992189950161368 },
  { order = 2.0, amplitude = 4.111889553895069e-06, phase = -0.42637457604689644 },
]
[[mesh]]
name = "e1"
between = ["i0", "i2"]
radii = [0.13686433275377502, 0.04748496916757044]
stiffness = 20910248.707104456
damping = 11.73018949838098
backlash = 3.8090927956044006e-05
transmission_error = [
  { order = 20.0, amplitude = 1.5724496742075925e-06, phase = -3.291948437285164 },
  { order = 1.0, amplitude = 6.6147183212621925e-06, phase = 2.544128970918802 },
]
[[mesh]]
name = "e2"
between = ["i1", "i3"]
radii = [0.040227211301063784, 0.03591748723233745]
stiffness = 7574581.9535673205
damping = 4595.380366384649
backlash = 1.3378181430524177e-05
transmission_error = [
  { order = 40.0, amplitude = 5.005763235626625e-07, phase = -0.22928007235164571 },
  { order = 1.0, amplitude = 3.17449004127781e-07, phase = 2.371788741377209 },
]
[excitation]
sweep = { from = 104.56490792898573, to = 232.33767470256788, over = 0.0045911357702684485 }
[[torque]]
on = "i0"
mean = -227.0141313604927
harmonics = [{ order = 0.5, amplitude = 179.3126680436142, phase = 3.357649425416298 }]
[simulation.initial]
angle = [3.7636839716579274e-06, -5.223486288359949e-06, -5.116943210057315e-07, -8.092162889663137e-07]
velocity = [-0.0005920785899750292, -0.009960439039837482, 0.005556199066993931, -0.015810314175440005]
"""

STEP = 5e-5
"""[s]; no clearance crosses two corners in so little."""


def integrated(model: Model, end: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Integrate by DOP853 from corner to corner, the sines of the model taken as they are written.

    Returns
    -------
    tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
        (E,) times and (E,) elements of the crossings, (n,) angles and velocities at the end.
    """
    system = assemble(model).system
    sweep = model.excitation.sweep
    rate, n = (sweep.end - sweep.begin) / sweep.over, system.size
    names = [inertia.name for inertia in model.inertias]

    def course(t):
        inside = min(t, sweep.over)
        speed = sweep.begin + rate * inside
        return (sweep.begin + 0.5 * rate * inside) * inside + speed * (t - inside), speed

    def errors(t):
        phi, speed = course(t)
        waves = [[(h.amplitude, h.order, h.order * phi + h.phase) for h in m.transmission_error] for m in model.meshes]
        e = [sum(a * np.sin(x) for a, _, x in own) for own in waves]
        return np.array(e), np.array([sum(a * k * speed * np.cos(x) for a, k, x in own) for own in waves])

    def torque(t):
        phi, out = course(t)[0], np.array([-inertia.drag_torque for inertia in model.inertias])
        for torque in model.torques:
            waves = sum(h.amplitude * np.sin(h.order * phi + h.phase) for h in torque.harmonics)
            out[names.index(torque.on)] += torque.mean + waves
        return out

    def fall(t, y, pieces):
        e, slope = errors(t)
        delta, speed = system.rows @ y[:n] - e, system.rows @ y[n:] - slope
        force = [
            law.stiffness[p] * d + law.damping[p] * v + law.offset[p]
            for law, p, d, v in zip(system.laws, pieces, delta, speed, strict=True)
        ]
        return np.concatenate([y[n:], (torque(t) - system.rows.T @ np.array(force)) / system.inertia])

    def reaching(k, bound, sign):
        def gap(t, y, _pieces):
            return sign * (bound - (system.rows[k] @ y[:n] - errors(t)[0][k]))

        gap.terminal, gap.direction = True, -1.0
        return gap

    start = model.simulation.initial
    t = 0.0
    y = np.array([*start.angle, *start.velocity])
    times = []
    elements = []
    pieces = [law.piece_at(float(d)) for law, d in zip(system.laws, system.rows @ y[:n] - errors(0.0)[0], strict=True)]
    while t < end:
        bounds = [(k, *law.bounds(p)) for k, (law, p) in enumerate(zip(system.laws, pieces, strict=True))]
        ways = [(k, b, s) for k, low, high in bounds for b, s in ((low, -1), (high, 1)) if np.isfinite(b)]
        piece_end = sweep.over if t < sweep.over else end
        events = [reaching(*way) for way in ways]
        actual = solve_ivp(
            fall, (t, piece_end), y, "DOP853", rtol=1e-12, atol=1e-15, max_step=STEP, events=events, args=(pieces,)
        )
        t, y = float(actual.t[-1]), actual.y[:, -1]
        if actual.status == 1:
            k, _, way = ways[next(i for i, at in enumerate(actual.t_events) if len(at))]
            pieces[k] += way
            times.append(t)
            elements.append(k)
    return np.array(times), np.array(elements), y[:n], y[n:]
