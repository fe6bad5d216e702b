"""Numbers that the paper prints: C. Padmanabhan, R. C. Barlow, T. E. Rook, R. Singh, "Computational Issues Associated
with Gear Rattle Analysis", ASME J. Mech. Design 117 (1995) 185-192. Nothing here is ours.

Steps are in units of 1/omega, omega = 150 rad/s being inferred (see docs/reproduction.md).
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Performance:
    """A line of Table 3 or 4.

    Attributes
    ----------
    step
        "average step h_i"; None: failed to converge (all numbers of this line are then None).
    time
        run time, min:sec.
    """

    label: str
    algorithm: str
    step: float | None
    steps: int | None
    calls: int | None
    time: str | None

    @property
    def seconds(self) -> float:
        """Run time [s]; NaN where it failed."""
        if self.time is None:
            return float("nan")
        minutes, seconds = self.time.split(":")
        return 60.0 * int(minutes) + int(seconds)


TABLE_3 = (
    Performance("RK2", "rk2", 0.001, 800000, 1600000, "25:47"),
    Performance("RK4", "rk4", 0.0128, 64000, 256000, "17:02"),
    Performance("RKF", "rkf", 0.0058, 142034, 846206, "27:37"),
    Performance("RKV", "rkv", 0.0074, 116533, 1185328, "28:20"),
    Performance("GRS", "gear", 0.0040, 315600, 462100, "16:29"),
    Performance("ADM", "adams", 0.0039, 301000, 427400, "24:45"),
    Performance("BUS", "bulirsch-stoer", 0.0145, 51607, 1152692, "22:15"),
)
"""Case 1, two clearances."""
TABLE_4 = (
    Performance("RK2", "rk2", 0.001, 850000, 1700000, "28:08"),
    Performance("RK4", "rk4", 0.0128, 67000, 268000, "18:44"),
    Performance("RKF", "rkf", 0.0400, 125034, 1150312, "33:24"),
    Performance("RKV", "rkv", 0.0377, 170441, 2090359, "50:03"),
    Performance("GRS", "gear", 0.0404, 246600, 921000, "19:55"),
    Performance("ADM", "adams", 0.0365, 411500, 678400, "33:59"),
    Performance("BUS", "bulirsch-stoer", None, None, None, None),
)
"""Case 3, three clearances, transmission error 0.10."""
RK2_STEP = 0.001
RK4_STEP = 0.0128

TABLE_1 = {
    "xi_11": "3.333e-06",
    "xi_22": "0.002",
    "xi_33": "9.524e-05",
    "xi_44": "1.667e-04",
    "eta_11": "0.005",
    "eta_12": "3.333",
    "eta_22": "0.111",
    "eta_23": "0.005",
    "eta_33": "7.143",
    "eta_34": "50.000",
    "Omega_11^2": "0.222",
    "Omega_12^2": "148.148",
    "Omega_22^2": "1482.0",
    "Omega_23^2": "63.49",
    "Omega_33^2": "7619.0",
    "Omega_34^2": "5.333e04",
}
"""Dimensionless parameters, as printed."""


@dataclass(frozen=True)
class Clearances:
    """A case of Table 2: alpha, beta and half-width b (printed as h) of each element, in units of psi_c or x_c.

    Attributes
    ----------
    clutch, spline, mesh
        (alpha, beta, b); (1, 1, inf) is linear.
    error
        amplitude of the transmission error, in units of x_c.
    """

    clutch: tuple[float, float, float]
    spline: tuple[float, float, float]
    mesh: tuple[float, float, float]
    error: float

    def in_words(self) -> str:
        """The values in a line."""
        parts = [
            f"{name} " + ("linear" if b == float("inf") else f"alpha {alpha:g}, beta {beta:g}, b {b:g}")
            for name, (alpha, beta, b) in (("clutch", self.clutch), ("spline", self.spline), ("mesh", self.mesh))
        ]
        return "; ".join([*parts, f"transmission error {self.error:g}"])


_LINEAR = (1.0, 1.0, float("inf"))
_LASH = (0.0, 0.0, 58.67)
_BACKLASH = (0.0, 0.0, 1.0)
TABLE_2 = {
    1: Clearances((0.10, 0.25, 160.0), _LINEAR, _BACKLASH, 0.0),
    2: Clearances((0.01, 0.025, 160.0), _LASH, _BACKLASH, 0.1),
    3: Clearances((0.001, 0.01, 160.0), _LASH, _BACKLASH, 0.1),
}
"""Cases 1 to 3."""
EIGHT = (0.0, 346.0, 7412.0, 10134.0, 18526.0, 48442.0, 50869.0, 68632.0)
"""Sec. 3: natural frequencies of the eight-inertia model [rad/s]."""
PSI_2 = (-0.01, 0.98, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
"""Sec. 3: nine entries for eight inertias."""
PSI_3 = (0.0, 1.0, 0.0, 0.0, -0.3, -0.3, -0.5, -0.5)
FIRST_MODE_HZ = 22.0
"""Sec. 3: "the first mode (22 Hz)"; in the same section it is at 346 rad/s."""

COHERENCES = {
    "RK4": ("rk4", (0.76, 0.23, 0.53, 0.37)),
    "RKV": ("rkv", (0.9, 0.23, 0.58, 0.35)),
    "GRS": ("gear", (0.79, 0.41, 0.54, 0.59)),
}
"""Sec. 9, case 2, reference RK2: mean over five harmonics of the accelerations of inertias 1 to 4."""

TABLE_5 = (
    (1, "theta_1''", 1052, 983, "6.56"),
    (1, "theta_3''", 1510, 1540, "-1.95"),
    (2, "theta_1''", 1481, 1260, "14.9"),
    (2, "theta_3''", 2090, 1862, "10.9"),
    (3, "theta_1''", 2094, 1963, "6.26"),
    (3, "theta_3''", 2168, 2247, "-3.64"),
)
"""Case, quantity, experiment, simulation [rad/s^2], sigma [%]."""

R_LAMBDA_DIMENSIONAL = 75.0
R_LAMBDA_MIXED = 20.0
"""Sec. 7 of Fig. 6(b): "about seventy five" and "barely crosses twenty"."""
LOAD_SAVING = 0.30
"""Sec. 9: computing time of variable-step algorithms at a mean of 0.5 against 0.05."""
LIGHT = 0.05
MODERATE = 0.5
"""Sec. 9: ratios of mean to alternating load."""
