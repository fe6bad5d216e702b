"""Manual transmission of four inertias, case 3, rattling: right-hand side and events, made from problem.json. Needs numpy alone."""

import numpy as np

NAME = 'transmission-3-rattling'
BODIES = ['flywheel', 'hub', 'input_gear', 'output_gear']
ELEMENTS = ['clutch', 'spline', 'gear']
SPEED = 150.0
INERTIA = np.array([0.3, 0.00045, 0.0105, 0.0015])
DRAG = np.array([0.00015, 0.000135, 0.00015, 3.75e-05])
MEAN = np.array([10.125, -0.2025, -9.4225, -0.5])  # torques
HARMONICS = np.array([[0.0, 0.0, 0.0, 0.0, 0.0], [1.0, 2.0, 3.0, 4.0, 5.0], [202.5, 81.0, 50.625, 24.3, 12.15], [0.0, 0.0, 0.0, 0.0, 0.0]])  # body, order, amplitude, phase of torques
RAMPS = []  # body, begin, duration, change of torque
ROWS = np.array([[1.0, -1.0, 0.0, 0.0], [0.0, 1.0, -1.0, 0.0], [0.0, 0.0, 0.05, -0.05]])  # deflections = ROWS @ angles - errors
ERROR = np.array([[2.0], [20.0], [5e-06], [0.0]])  # element, order, amplitude, phase of errors
CORNERS = np.array([[-0.16, 0.16], [-0.05867, 0.05867], [-5e-05, 5e-05]]).reshape(3, 2)
FIRST = [-1, -1, -1]  # region of each element's first piece
LAWS = np.array([[[1500.0, 1.5, 1500.0], [15000.0, 0.0, 15000.0], [720000000.0, 0.0, 720000000.0]], [[0.225, 0.00225, 0.225], [0.0075, 0.0, 0.0075], [4500.0, 0.0, 4500.0]], [[239.76, 0.0, -239.76], [880.05, 0.0, -880.05], [36000.0, 0.0, -36000.0]]])  # stiffness, damping, offset; element; piece
START = np.array([0.22692177777777778, 0.060331777777777776, 0.0010002777777777779, 0.0, 0.0, 0.0, 0.0, 0.0])
SAMPLES, PER_TURN = 180, 60.0

def _waves(t, rows):
    """amplitude sin(order speed t + phase) of columns (index, order, amplitude, phase), and the rates."""
    value, rate = np.zeros(rows.shape[1]), np.zeros(rows.shape[1])
    if rows.size:
        turn = rows[1] * SPEED
        angle = turn * t + rows[3]
        value, rate = rows[2] * np.sin(angle), rows[2] * turn * np.cos(angle)
    return value, rate


def deflection(t, y):
    """Deflections of the elements and their rates; y holds all angles, then all velocities."""
    n = INERTIA.size
    delta, rate = ROWS @ y[:n], ROWS @ y[n:]
    if ERROR.size:
        value, change = _waves(t, ERROR)
        index = ERROR[0].astype(int)
        delta = delta - np.bincount(index, value, len(ELEMENTS))
        rate = rate - np.bincount(index, change, len(ELEMENTS))
    return delta, rate


def torque(t):
    """Applied torques."""
    total = MEAN.copy()
    if HARMONICS.size:
        total += np.bincount(HARMONICS[0].astype(int), _waves(t, HARMONICS)[0], total.size)
    for body, begin, over, change in RAMPS:
        total[body] += change * min(max((t - begin) / over, 0.0), 1.0)
    return total


def region(t, y):
    """Index of the piece of every element's law; on a corner the rate decides, the inner piece where there is none."""
    delta, rate = deflection(t, y)
    index = np.sum(delta[:, None] > CORNERS, axis=1)
    for k, c in np.argwhere(delta[:, None] == CORNERS):
        inner = c if abs(FIRST[k] + c) < abs(FIRST[k] + c + 1) else c + 1
        index[k] = c + 1 if rate[k] > 0 else c if rate[k] < 0 else inner
    return index


def rhs(t, y, index=None):
    """Derivative of y. With ``index`` the laws are those of these pieces, whatever the deflections: smooth."""
    n = INERTIA.size
    delta, rate = deflection(t, y)
    if index is None:
        index = np.sum(delta[:, None] > CORNERS, axis=1)
    k, c, f = LAWS[:, ALL, index]
    force = k * delta + c * rate + f
    velocity = y[n:]
    return np.concatenate([velocity, (torque(t) - DRAG * velocity - ROWS.T @ force) / INERTIA])


def jacobian(t, y, index=None):
    """Derivative of rhs with respect to y; constant in a region."""
    n = INERTIA.size
    if index is None:
        index = np.sum(deflection(t, y)[0][:, None] > CORNERS, axis=1)
    k, c, _ = LAWS[:, ALL, index]
    matrix = np.zeros((2 * n, 2 * n))
    matrix[:n, n:] = np.eye(n)
    matrix[n:, :n] = -(ROWS.T * k) @ ROWS / INERTIA[:, None]
    matrix[n:, n:] = -((ROWS.T * c) @ ROWS + np.diag(DRAG)) / INERTIA[:, None]
    return matrix


def events(t, y):
    """Deflections less the corners of their elements, in the order of WATCHED: a change of sign is an event."""
    delta, _ = deflection(t, y)
    return delta[WATCHED[:, 0]] - CORNERS[WATCHED[:, 0], WATCHED[:, 1]]


ALL = np.arange(len(ELEMENTS))
WATCHED = np.argwhere(np.isfinite(CORNERS))  # rows (element, corner): between the pieces corner and corner + 1
KINKS = sorted({time for _, begin, over, _ in RAMPS for time in (begin, begin + over)})  # of the input
TIMES = 2.0 * np.pi * np.arange(SAMPLES + 1) / (SPEED * PER_TURN)
