"""A planetary set integrated by SciPy, independent of the source: forces written out gear by gear.

    delta_s,i = R_s (s - c) + R_p (p_i - c) - e_i,      delta_r,i = R_r (r - c) - R_p (p_i - c)

DOP853 with relative tolerance 1e-13 between corners; it stops at every corner of every mesh and begins anew. Eight
thousand steps a turn at least: SciPy sees no visit that begins and ends within a step, and with a quarter of these
steps it missed some in three of a hundred sets.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = np.ndarray


@dataclass(frozen=True)
class Set:
    """A planetary set with a spring from the carrier to ground and a torque on the sun.

    Attributes
    ----------
    inertia
        J of sun, ring, carrier (without planets' masses) and of every planet [kg m^2].
    radii
        of sun, planet and ring [m].
    stiffness, damping
        of sun and ring meshes [N/m, N s/m].
    half_gap
        of sun and ring meshes [m].
    error
        amplitude [m] and order of the sun meshes' error.
    phases
        of every planet's error [rad].
    mass, distance
        of a planet [kg], of its axis from the middle [m].
    holds
        stiffness and damping of ring and carrier to ground [N m/rad, N m s/rad].
    omega
        reference speed [rad/s].
    mean, swing
        torque on the sun and the amplitude of its first order [N m].
    """

    inertia: Array
    radii: tuple[float, float, float]
    stiffness: tuple[float, float]
    damping: tuple[float, float]
    half_gap: tuple[float, float]
    error: tuple[float, float]
    phases: Array
    mass: float
    distance: float
    holds: Array
    omega: float
    mean: float
    swing: float

    @property
    def planets(self) -> int:
        """How many planets it has."""
        return len(self.phases)

    def tables(self) -> dict[str, Any]:
        """Return the same as tables of a model file."""
        names = ["sun", "ring", "carrier", *(f"p{i}" for i in range(self.planets))]
        pair = ("sun", "ring")
        holds = zip(("ring", "carrier"), self.holds, strict=True)
        return {
            "schema": 1,
            "inertia": [{"name": n, "J": float(j)} for n, j in zip(names, self.inertia, strict=True)],
            "coupling": [
                {"name": f"hold-{n}", "between": [n, "ground"], "stiffness": float(k), "damping": float(c)}
                for n, (k, c) in holds
            ],
            "planetary": [
                {
                    "name": "set",
                    "sun": "sun",
                    "ring": "ring",
                    "carrier": "carrier",
                    "planets": names[3:],
                    "radii": dict(zip(("sun", "planet", "ring"), self.radii, strict=True)),
                    "stiffness": dict(zip(pair, self.stiffness, strict=True)),
                    "damping": dict(zip(pair, self.damping, strict=True)),
                    "backlash": {key: 2.0 * gap for key, gap in zip(pair, self.half_gap, strict=True)},
                    "transmission_error": {"sun": [{"order": self.error[1], "amplitude": self.error[0]}]},
                    "mesh_phase": {"sun": self.phases.tolist()},
                    "planet_mass": self.mass,
                    "centre_distance": self.distance,
                }
            ],
            "excitation": {"speed": self.omega},
            "torque": [{"on": "sun", "mean": self.mean, "harmonics": [{"order": 1, "amplitude": self.swing}]}],
        }

    def without_error(self, angle: Array) -> Array:
        """(2 N,) deflections of perfect teeth: sun meshes, then ring meshes [m]; of velocities, their rates [m/s]."""
        sun, planet, ring = self.radii
        relative = angle - angle[2]
        turned = planet * relative[3:]
        return np.concatenate([sun * relative[0] + turned, ring * relative[1] - turned])

    def deflections(self, time: float, angle: Array) -> Array:
        """(2 N,) sun meshes, then ring meshes [m]."""
        amplitude, order = self.error
        deflection = self.without_error(angle)
        deflection[: self.planets] -= amplitude * np.sin(order * self.omega * time + self.phases)
        return deflection

    def rates(self, time: float, velocity: Array) -> Array:
        """(2 N,) their rates [m/s]."""
        amplitude, order = self.error
        rate = self.without_error(velocity)
        rate[: self.planets] -= amplitude * order * self.omega * np.cos(order * self.omega * time + self.phases)
        return rate

    def slope(self, time: float, state: Array, sides: Array) -> Array:
        """State derivative with every mesh on a given side: -1, 0 (in its gap) or 1."""
        count, n = self.planets, self.planets + 3
        angle, velocity = state[:n], state[n:]
        of = np.repeat([0, 1], count)
        half, stiff, damp = (np.array(pair)[of] for pair in (self.half_gap, self.stiffness, self.damping))
        delta, rate = self.deflections(time, angle), self.rates(time, velocity)
        force = np.where(sides == 0, 0.0, stiff * (delta - sides * half) + damp * rate)
        sun, planet, ring = self.radii
        on_sun, on_ring = force[:count], force[count:]
        torque = np.zeros(n)
        torque[0] = self.mean + self.swing * np.sin(self.omega * time) - sun * on_sun.sum()
        torque[1] = -ring * on_ring.sum()
        torque[2] = (sun + planet) * on_sun.sum() + (ring - planet) * on_ring.sum()
        torque[3:] = planet * (on_ring - on_sun)
        torque[1:3] -= self.holds[:, 0] * angle[1:3] + self.holds[:, 1] * velocity[1:3]
        inertia = self.inertia.copy()
        inertia[2] += count * self.mass * self.distance**2
        return np.concatenate([velocity, torque / inertia])


def integrate(case: Set, state: Array, end: float) -> tuple[Array, int]:
    """Return the state at the end and the number of crossings, from a state at t = 0 that lies on no corner."""
    half = np.repeat(case.half_gap, case.planets)
    time, crossings, step = 0.0, 0, 2.0 * np.pi / case.omega / 8000.0
    delta = case.deflections(0.0, state[: case.planets + 3])
    sides = np.where(np.abs(delta) < half, 0, np.sign(delta)).astype(int)
    last = np.zeros(half.size, np.bool_)  # what has just crossed stands on its corner, on either side of it by rounding
    while time < end:
        span = solve_ivp(
            lambda t, y: case.slope(t, y, sides),
            (time, end),
            state,
            "DOP853",
            max_step=step,
            rtol=1e-13,
            atol=1e-18,
            events=[_event(case, sides, half, watched) for watched in (~last, last) if watched.any()],
        )
        state, time = span.y[:, -1], float(span.t[-1])
        if span.status == 1:
            delta = case.deflections(time, state[: case.planets + 3])
            k = int(np.argmin(_room(delta, sides, half)))
            sides[k] = 0 if sides[k] else int(np.sign(delta[k]))
            last = np.arange(half.size) == k
            crossings += 1
    return state, crossings


def _room(delta: Array, sides: Array, half: Array) -> Array:
    """(2 N,) how far every mesh is from leaving its side."""
    return np.where(sides == 0, half - np.abs(delta), sides * delta - half)


def _event(case: Set, sides: Array, half: Array, watched: NDArray[np.bool_]) -> Any:
    """What SciPy watches: the first of some meshes to leave its side."""

    def room(time: float, state: Array) -> float:
        return float(np.min(_room(case.deflections(time, state[: case.planets + 3]), sides, half)[watched]))

    room.terminal, room.direction = True, -1.0  # type: ignore[attr-defined]
    return room


def random_set(seed: int) -> Set:
    """Return a set of two to five planets that rattles or does not, with times of the order of its period."""
    random = np.random.default_rng(seed)
    count = int(random.integers(2, 6))
    sun, planet = random.uniform(0.02, 0.05, 2)
    radii = (float(sun), float(planet), float(sun + 2.0 * planet))
    spread = random.uniform(0.5, 2.0, 3 + count)
    inertia = np.array([4e-3, 2e-2, 1e-2, *([4e-4] * count)]) * spread
    stiffness = 10.0 ** random.uniform(5.5, 7.0, 2)
    return Set(
        inertia=inertia,
        radii=radii,
        stiffness=(float(stiffness[0]), float(stiffness[1])),
        damping=(float(random.uniform(5.0, 60.0)), float(random.uniform(5.0, 60.0))),
        half_gap=(float(random.uniform(1e-5, 4e-5)), float(random.uniform(1e-5, 4e-5))),
        error=(float(random.uniform(0.0, 4e-6)), float(random.integers(5, 13))),
        phases=random.uniform(0.0, 2.0 * np.pi, count),
        mass=float(random.uniform(0.1, 0.5)),
        distance=float(sun + planet),
        holds=np.array([[1e4, 2.0], [3e3, 2.0]]) * random.uniform(0.5, 2.0, (2, 1)),
        omega=float(random.uniform(100.0, 300.0)),
        mean=float(random.uniform(0.0, 3.0)),
        swing=float(random.uniform(0.5, 15.0)),
    )
