"""Harmonic balance with overtones: the periodic motion that a fixed point of equivalent linearisation leads to, and its
Floquet multipliers.

Equivalent linearisation keeps one gain for all orders and drops what the corners add: its *distortion*

    r_k(t) = F_k(delta_k, delta_k') - mean - K_k x_k - C_k x_k',      x_k = delta_k - its mean,

K, C the equivalent slopes and dampings. Fed back through the linear system at every order h up to N,

    X(h) = X_0(h) - W D(h)^-1 W^T R(h),      D(h) = W^T (K + i h w C) W + i h w diag(drag) - (h w)^2 J,

where X_0 is the linearised response, the motion is a solution of the equations with period T once it comes out as it
went in (alternating between frequency and time: T. M. Cameron, J. H. Griffin 1989, J. Appl. Mech. 56, 149-154). The
iteration is damped, then Newton's with steps by GMRES (D. A. Knoll, D. E. Keyes 2004, J. Comput. Phys. 193, 357-397);
where neither settles, the fixed point is left unconfirmed.

A periodic motion is met only if it is stable. Between crossings the equations are linear, so a disturbance goes through
the period as a product of exponentials; a step dc of the damping at a crossing of element k adds -J^-1 w_k dc (w_k . q)
to its velocities (P. C. Mueller 1995, Chaos, Solitons and Fractals 5, 1671-1681). Stable: no eigenvalue beyond one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.contact_ratios.contact_ratio_record import best_line, beyond, elastic, largest_slope, slopes
from gearrattle.engine.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

FEWEST = 64
MOST = 512
ABOVE = 1.5
"""Highest order kept over the order of the fastest mode in contact, within bounds."""
SETTLED = 1e-6  # relative change of every clearance's oscillation at which the iteration ends
MARGIN = 1e-3  # excess of a multiplier over one that rounding and interpolation may give for a rigid motion
_SAMPLES = 4  # samples for every harmonic
_DAMPED = 0.5
_MOST_DAMPED = 200
_RUNAWAY = 1e3
_MOST_NEWTON = 25
_KRYLOV = 60
_FORCING = 1e-2
_STEP = 1e-6
_PATIENCE = 10  # Newton steps in which the residual must halve
_HALVED = tuple(0.5**i for i in range(9))


@dataclass(frozen=True)
class Balance:
    """Periodic motion that a fixed point leads to, if there is one.

    Attributes
    ----------
    multiplier
        largest modulus of its Floquet multipliers; NaN where there is no motion.
    gain, mean_slope
        (K,) contact ratios of the motion by clearance, as shares of the largest slope.
    """

    settled: bool
    multiplier: float
    gain: Array
    mean_slope: Array

    @property
    def stable(self) -> bool:
        """Whether the motion exists and a small disturbance decays or stays small."""
        return self.settled and self.multiplier <= 1.0 + MARGIN


class Overtones:
    """Map from the harmonic amplitudes of a periodic oscillation to those that its distortion causes.

    Parameters
    ----------
    system
        the driveline; all its orders are whole numbers per period.
    slope, damping
        (m,) equivalent ones of every element.
    means
        (m, S) oscillations to (m,) mean deflections.
    """

    def __init__(self, system: PiecewiseSystem, slope: Array, damping: Array, means: Callable[[Array], Array]) -> None:
        self.system = system
        self.slope = slope
        self.damping = damping
        self.means = means
        inputs = system.inputs
        rows = system.rows
        # overtones up to a multiple of the fastest mode in contact
        contact = np.array([law.stiffness.max() for law in system.laws])
        root = np.sqrt(system.inertia)
        fastest = np.linalg.eigvalsh((rows.T * contact) @ rows / np.outer(root, root))[-1]
        base = 2.0 * np.pi / inputs.period
        orders = int(np.clip(ABOVE * np.sqrt(max(fastest, 0.0)) / base, FEWEST, MOST))
        orders = max(orders, 2 * int(inputs.cycles.max(initial=0.0)))
        self.samples = _SAMPLES * orders
        # linear receptance of the deflections at every overtone
        self.omega = base * np.arange(1, orders + 1)
        w = self.omega[:, None, None]
        spring = (rows.T * slope) @ rows
        loss = (rows.T * damping) @ rows + np.diag(system.drag)
        across: Complex = np.linalg.inv(spring - w * w * np.diag(system.inertia) + 1j * w * loss)
        self.response: Complex = rows @ across @ rows.T
        # linearised response to the inputs
        self.linear: Complex = np.zeros((orders, len(system.laws)), dtype=np.complex128)
        for j in np.flatnonzero(inputs.cycles > 0.0):
            h = round(float(inputs.cycles[j])) - 1
            torque = inputs.torque_cosine[:, j] - 1j * inputs.torque_sine[:, j]
            error = inputs.error_cosine[:, j] - 1j * inputs.error_sine[:, j]
            push = torque + rows.T @ ((slope + 1j * self.omega[h] * damping) * error)
            self.linear[h] += rows @ (across[h] @ push) - error

    def waves(self, spectrum: Complex) -> tuple[Array, Array]:
        """(m, S) oscillations and their rates, from (N, m) amplitudes."""
        full = np.zeros((self.samples // 2 + 1, spectrum.shape[1]), dtype=np.complex128)
        full[1 : len(spectrum) + 1] = 0.5 * self.samples * spectrum
        oscillation: Array = np.fft.irfft(full, self.samples, axis=0)
        full[1 : len(spectrum) + 1] *= 1j * self.omega[:, None]
        rate: Array = np.fft.irfft(full, self.samples, axis=0)
        return oscillation.T, rate.T

    def next(self, spectrum: Complex) -> Complex:
        """(N, m) the amplitudes that the distortion of given ones causes."""
        oscillation, rate = self.waves(spectrum)
        means = self.means(oscillation)
        distortion = np.zeros_like(oscillation)
        for k in self.system.clearances:
            law = self.system.laws[k]
            delta = means[k] + oscillation[k]
            share = beyond(law.corners, delta)  # of intervals: unlike samples, continuous in the deflections
            damping = (
                law.damping[0] - self.damping[k] + np.diff(law.damping) @ (0.5 * (share + np.roll(share, 1, axis=1)))
            )
            distortion[k] = elastic(law, delta) - self.slope[k] * oscillation[k] + damping * rate[k]
        kept = np.fft.rfft(distortion, axis=1).T[1 : len(spectrum) + 1] * (2.0 / self.samples)
        return np.asarray(self.linear - np.einsum("hkl,hl->hk", self.response, kept))

    def settle(self) -> Complex | None:
        """(N, m) the amplitudes that the map leaves as they are; None if none are found.

        By damped iteration, and where that does not do, by Newton's method, its steps by GMRES.
        """
        spectrum = self.linear
        limit = _RUNAWAY * np.abs(self.linear).max(initial=0.0)
        for _ in range(_MOST_DAMPED):
            change = self.next(spectrum) - spectrum
            if self._small(change, spectrum):
                return spectrum
            spectrum = spectrum + _DAMPED * change
            if not np.abs(spectrum).max() <= limit:
                break
        return self._newton()

    def _small(self, change: Complex, spectrum: Complex) -> bool:
        moving = [k for k in self.system.clearances if self.system.laws[k].stiffness.max() > 0.0]
        size = np.linalg.norm(spectrum[:, moving], axis=0)
        return bool(np.all(np.linalg.norm(change[:, moving], axis=0) <= SETTLED * size))

    def _newton(self) -> Complex | None:
        """The fixed point by Newton's method with halved steps, from the linearised response."""
        from scipy.sparse.linalg import LinearOperator, gmres

        shape = self.linear.shape
        scale = np.linalg.norm(self.linear, axis=0)
        scale[scale == 0.0] = 1.0

        # complex amplitudes of deflections as a real vector, scaled by the linearised response
        def unpack(x: Array) -> Complex:
            return np.asarray((x[: x.size // 2] + 1j * x[x.size // 2 :]).reshape(shape) * scale)

        def pack(spectrum: Complex) -> Array:
            return np.concatenate([(spectrum / scale).real.ravel(), (spectrum / scale).imag.ravel()])

        def change(at: Array) -> Array:
            return pack(self.next(unpack(at))) - at

        # iterate from the linearised response until the residual is small
        x = pack(self.linear)
        residual = change(x)
        norms: list[float] = []
        for _ in range(_MOST_NEWTON):
            norms.append(float(np.linalg.norm(residual)))
            if len(norms) > _PATIENCE and norms[-1] > 0.5 * norms[-1 - _PATIENCE]:
                return None
            if self._small(unpack(residual), unpack(x)):
                return unpack(x)
            # Newton direction by GMRES, the Jacobian by differences
            step = _STEP * float(np.linalg.norm(x))

            def slope(p: Array, x: Array = x, residual: Array = residual, step: float = step) -> Array:
                h = step / (float(np.linalg.norm(p)) or 1.0)
                return (change(x + h * p) - residual) / h

            operator = LinearOperator((x.size, x.size), matvec=slope, dtype=np.float64)
            direction, _ = gmres(operator, -residual, rtol=_FORCING, restart=_KRYLOV, maxiter=1)
            # line search by halving
            for share in _HALVED:
                trial = change(x + share * direction)
                if np.linalg.norm(trial) < (1.0 - 0.1 * share) * norms[-1]:
                    break
            else:
                return None
            x = x + share * direction
            residual = trial
        return None

    def ratios(self, spectrum: Complex) -> tuple[Array, Array]:
        """(K,) gains and mean slopes."""
        oscillation, _ = self.waves(spectrum)
        means = self.means(oscillation)
        ratio_pairs = []
        for k in self.system.clearances:
            law = self.system.laws[k]
            delta = means[k] + oscillation[k]
            gain = best_line(elastic(law, delta), delta)
            size = largest_slope(law)
            at_mean = float(law.stiffness[law.piece_at(float(means[k]))])
            ratio_pairs.append(((at_mean if np.isnan(gain) else gain) / size, slopes(law, delta) / size))
        gains, mean_slopes = np.array(ratio_pairs).reshape(-1, 2).T
        return gains, mean_slopes

    def multiplier(self, spectrum: Complex) -> float:
        """Largest modulus of the Floquet multipliers."""
        oscillation, _ = self.waves(spectrum)
        return float(multipliers(self.system, self.means(oscillation)[:, None] + oscillation)[0])


def multipliers(system: PiecewiseSystem, deflection: Array) -> Array:
    """Return (2n,) moduli of the Floquet multipliers of a periodic motion, largest first; one is of a shift in time.

    ``deflection`` holds (m, S) samples over one period, joined by straight lines.
    """
    from scipy.linalg import expm

    # the linear system in the pieces that the motion is in
    inverse = 1.0 / system.inertia[:, None]
    size = system.size
    pieces = [law.piece_at(float(d)) for law, d in zip(system.laws, deflection[:, 0], strict=True)]
    kept: dict[tuple[int, ...], Array] = {}

    def generator() -> Array:
        key = tuple(pieces)
        if key not in kept:
            blocks = system.stiffness_of(key), system.damping_of(key)
            kept[key] = np.block([[np.zeros((size, size)), np.eye(size)], [-inverse * block for block in blocks]])
        return kept[key]

    # the flow's gradient over one period: an exponential up to every crossing, a saltation over it
    matrix = np.eye(2 * size)
    before = 0.0
    for at, k, piece in (*_crossings(system, deflection), (1.0, -1, 0)):
        matrix = expm(generator() * ((at - before) * system.inputs.period)) @ matrix
        before = at
        if k >= 0:
            law = system.laws[k]
            row = system.rows[k]
            step = law.damping[piece] - law.damping[pieces[k]]
            matrix[size:] -= step * inverse * np.outer(row, row @ matrix[:size])
            pieces[k] = piece
    return np.asarray(np.sort(np.abs(np.linalg.eigvals(matrix)))[::-1])


def _crossings(system: PiecewiseSystem, deflection: Array) -> list[tuple[float, int, int]]:
    """Share of the period, element and piece entered, of every crossing in one period, in order of time."""
    crossings = []
    for k in system.clearances:
        law = system.laws[k]
        here = deflection[k]
        after = np.roll(here, -1)
        for c, corner in enumerate(law.corners):
            above = after >= corner
            for i in np.flatnonzero(above != (here >= corner)):
                share = (corner - here[i]) / (after[i] - here[i])
                crossings.append(((float(i) + float(share)) / here.size, k, c + int(above[i])))
    return sorted(crossings)


def balance(system: PiecewiseSystem, slope: Array, damping: Array, means: Callable[[Array], Array]) -> Balance:
    """Seek the periodic motion that a fixed point stands for.

    Parameters
    ----------
    system
        the driveline; all its orders are whole numbers per period.
    slope, damping
        (m,) equivalent ones of every element [N m/rad, N m s/rad or N/m, N s/m].
    means
        (m, S) oscillations to (m,) mean deflections.
    """
    map_ = Overtones(system, slope, damping, means)
    spectrum = map_.settle()
    if spectrum is None:
        none = np.full(len(system.clearances), np.nan)
        return Balance(False, float("nan"), none, none)
    gain, mean_slope = map_.ratios(spectrum)
    return Balance(True, map_.multiplier(spectrum), gain, mean_slope)
