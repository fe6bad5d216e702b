"""Sec. 7: R_lambda and natural frequencies against the stiffness contact ratio Gamma, Figs. 5 and 6.

The Jacobian of Table 1's model with f(delta_1) -> Gamma_c delta_1 and f(delta_3) -> Gamma_g delta_3 (Gamma multiplies
stiffness only), 8 x 8 with damping:

    A = [[0, I], [-J^-1 K / w^2, -J^-1 C / w]],    w = 1 (dimensional) or omega (dimensionless),

and R_lambda the largest over the smallest |eigenvalue|, the rigid-body pair left out (it is 0 and the mean drag rate).
Mixed coordinates x = R theta of the gears are T A T^-1: a similarity, which leaves every eigenvalue as it is.
"""

from __future__ import annotations

import numpy as np

from gearrattle.report.plots.chart import Chart, Key, Line, Panel, Rule
from gearrattle.report.plots.palette import COLOURS, INK
from gearrattle.reproduction import printed_values
from gearrattle.reproduction.number_formats import figure
from gearrattle.reproduction.paper_cases import DAMPING, DRAG, RADIUS, SPEED, STIFFNESS, J
from gearrattle.reproduction.reproduction_record import DIFFERS, REPRODUCED, Row, Section, row
from gearrattle.trajectory import Array

_ROWS = np.array([[1.0, -1.0, 0.0, 0.0], [0.0, 1.0, -1.0, 0.0], [0.0, 0.0, RADIUS, -RADIUS]])
_INERTIA = np.array(list(J.values()))
_DRAG = np.array(list(DRAG.values()))
_K = np.array(list(STIFFNESS.values()))
_C = np.array(list(DAMPING.values()))


def jacobian(clutch: float, gear: float, time_scale: float = 1.0, mixed: bool = False) -> Array:
    """(8, 8) Jacobian with stiffness contact ratios Gamma_c, Gamma_g; ``time_scale`` is omega for dimensionless time, 1
    for seconds; ``mixed``: the gears move along the line of action [m] instead of turning.
    """
    stiffness = (_ROWS.T * (_K * [clutch, 1.0, gear])) @ _ROWS
    damping = (_ROWS.T * _C) @ _ROWS + np.diag(_DRAG)
    zero = np.zeros((4, 4))
    one = np.eye(4)
    a = np.block(
        [[zero, one], [-stiffness / _INERTIA[:, None] / time_scale**2, -damping / _INERTIA[:, None] / time_scale]]
    )
    if mixed:
        scale = np.tile([1.0, 1.0, RADIUS, RADIUS], 2)
        a = a * scale[:, None] / scale
    return np.asarray(a, dtype=np.float64)


def stiffness_ratio(matrix: Array) -> float:
    """R_lambda: largest over smallest |eigenvalue|, the rigid-body pair left out."""
    size = np.sort(np.abs(np.linalg.eigvals(matrix)))
    return float(size[-1] / size[2])


def conditioning(matrix: Array) -> float:
    """Largest over smallest singular value, the rigid body's left out."""
    size = np.linalg.svd(matrix, compute_uv=False)
    return float(size[0] / size[-2])


def natural(clutch: float, gear: float) -> Array:
    """(3,) elastic natural frequencies without damping [rad/s]."""
    stiffness = (_ROWS.T * (_K * [clutch, 1.0, gear])) @ _ROWS
    root = np.sqrt(_INERTIA)
    squares = np.sort(np.linalg.eigvalsh(stiffness / np.outer(root, root)))
    return np.asarray(np.sqrt(squares[1:]))


def section() -> Section:
    """Compare sec. 7."""
    words = (
        "Linear algebra only: no loads are needed. The paper's curves are figures without numbers but for the two "
        "values its text names."
    )
    return Section("stiffness", "Section 7: stiffness ratios", words, _rows(), charts=(_chart(),))


def _rows() -> tuple[Row, ...]:
    # R_lambda in three formulations
    forms = {
        "dimensional": jacobian(0.1, 1.0),
        "dimensionless": jacobian(0.1, 1.0, SPEED),
        "mixed": jacobian(0.1, 1.0, SPEED, mixed=True),
    }
    ratio = {name: stiffness_ratio(a) for name, a in forms.items()}
    summary = ", ".join(f"{value:.1f} {name}" for name, value in ratio.items())
    # spread of natural frequencies, and condition numbers
    apart = [float(f[-1] / f[0]) for f in (natural(0.1, 0.05), natural(0.1, 1.0))]
    condition = [conditioning(forms[name]) for name in ("dimensional", "dimensionless")]
    # rows against the printed values
    return (
        row(
            "Fig. 6(b), largest R_lambda, Gamma_c = 0.1",
            f"about {printed_values.R_LAMBDA_DIMENSIONAL:g} dimensional, barely "
            f"{printed_values.R_LAMBDA_MIXED:g} dimensionless and mixed",
            summary,
            DIFFERS,
            "R_lambda is a ratio of eigenvalues of one matrix; scaling time and turning angles into lengths are "
            "similarity transforms times a factor and cannot change it. Which convention gives 75 is not said",
            ratio=ratio["dimensional"],
            ratio_mixed=ratio["mixed"],
        ),
        row(
            "Fig. 6(a), R_lambda at Gamma_g = 1, Gamma_c = 1",
            "two curves, the dimensionless lower",
            f"{stiffness_ratio(jacobian(1.0, 1.0)):.1f} in every formulation",
            DIFFERS,
            "as in part (b): the curves must coincide",
            ratio=stiffness_ratio(jacobian(1.0, 1.0)),
        ),
        row(
            "Sec. 7, non-dimensional form reduces ill-conditioning",
            "R_lambda is lower",
            f"condition number {figure(condition[0], 2)} dimensional, {figure(condition[1], 2)} dimensionless",
            REPRODUCED if condition[1] < condition[0] else DIFFERS,
            "what scaling does change is the condition number, and that by orders of magnitude",
            dimensional=condition[0],
            dimensionless=condition[1],
        ),
        row(
            "Fig. 5, natural frequencies are closer at low Gamma_g",
            "three curves",
            f"highest over lowest: {apart[0]:.0f} at Gamma_g = 0.05, {apart[1]:.0f} at 1",
            REPRODUCED if apart[0] < apart[1] else DIFFERS,
            "the trend; the curves are not printed as numbers",
            low=apart[0],
            high=apart[1],
        ),
    )


def _chart() -> Chart:
    # R_lambda and natural frequencies over Gamma_g
    gamma = np.linspace(0.02, 1.0, 50)
    ratios = [
        Line(gamma, np.array([stiffness_ratio(jacobian(c, g)) for g in gamma]), f"Gamma_c = {c:g}", COLOURS[i])
        for i, c in enumerate((1.0, 0.1))
    ]
    waves = np.array([natural(0.1, g) for g in gamma])
    modes = tuple(Line(gamma, waves[:, i], f"mode {i + 1}", INK) for i in range(3))
    rules = tuple(
        Rule(at, label=f"paper: {at:g}") for at in (printed_values.R_LAMBDA_MIXED, printed_values.R_LAMBDA_DIMENSIONAL)
    )
    # panels of Figs. 5 and 6
    panels = (
        Panel(
            "Natural frequencies, Gamma_c = 0.1",
            "rad/s",
            "Gamma_g",
            modes,
            x_range=(0.0, 1.0),
            y_log=True,
            y_range=(1e1, 1e5),
        ),
        Panel("R_lambda", "", "Gamma_g", tuple(ratios), rules=rules, x_range=(0.0, 1.0), y_range=(0.0, 400.0)),
    )
    # caption and legend
    caption = (
        "Left: Fig. 5, undamped. Right: Fig. 6, both parts, in every formulation; dashed: the largest values the paper "
        "names for Gamma_c = 0.1, dimensional and dimensionless."
    )
    legend = tuple(Key(line.name, line.colour) for line in ratios)
    return Chart(
        "fig-5-6", "Figures 5 and 6", caption, panels, columns=2, panel_height=220, share_x=False, legend=legend
    )
