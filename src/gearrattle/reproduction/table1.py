"""Tables 1 and 2: the sixteen dimensionless parameters, recomputed by eqs. (15)-(19) from round dimensional values
(inferred), and the clearances of the three cases, read back from the models.
"""

from __future__ import annotations

from gearrattle.report.tables import Table
from gearrattle.reproduction import printed_values
from gearrattle.reproduction.number_formats import figure
from gearrattle.reproduction.paper_cases import DAMPING, DRAG, HALF_GAP, RADIUS, SPEED, STIFFNESS, J, load_case
from gearrattle.reproduction.reproduction_record import CONSTRUCTED, DIFFERS, Row, Section, row


def parameters() -> dict[str, float]:
    """Table 1 from the dimensional values, in the paper's order."""
    j = dict(enumerate(J.values(), start=1))
    drag = dict(enumerate(DRAG.values(), start=1))
    k = dict(enumerate((*list(STIFFNESS.values())[:2], STIFFNESS["gear"] * RADIUS**2), start=1))
    c = dict(enumerate((*list(DAMPING.values())[:2], DAMPING["gear"] * RADIUS**2), start=1))
    pairs = ((1, 1), (1, 2), (2, 2), (2, 3), (3, 3), (3, 4))
    return {
        **{f"xi_{i}{i}": drag[i] / (j[i] * SPEED) for i in range(1, 5)},
        **{f"eta_{a}{b}": c[a] / (j[b] * SPEED) for a, b in pairs},
        **{f"Omega_{a}{b}^2": k[a] / (j[b] * SPEED**2) for a, b in pairs},
    }


def agrees(text: str, value: float) -> bool:
    """Whether a value rounds to the digits printed; a trailing "1482.0" counts as printed to 0.1."""
    mantissa, _, power = text.lower().partition("e")
    places = len(mantissa.partition(".")[2])
    return abs(float(text) - value) <= 0.5000001 * 10.0 ** ((int(power) if power else 0) - places)


def section() -> Section:
    """Compare the sixteen parameters."""
    ours = parameters()
    right = {name: agrees(text, ours[name]) for name, text in printed_values.TABLE_1.items()}
    lines = tuple(
        (name, text, figure(ours[name], 5), "yes" if right[name] else "no")
        for name, text in printed_values.TABLE_1.items()
    )
    table = Table(("parameter", "paper", "ours", "to the digits printed"), lines, frozenset({0, 3}), "Table 1")
    words = (
        "The paper prints dimensionless parameters only. Ours follow from J, K and C in round numbers that we inferred "
        "(omega = 150 rad/s, R = 50 mm, half-backlash 50 um): agreement speaks for the inference, no more."
    )
    return Section("table-1", "Tables 1 and 2: the model", words, (*_rows(ours, right), *_table_2()), (table,))


def _table_2() -> tuple[Row, ...]:
    """Read the parameters of Table 2 back from the models that are simulated."""
    return tuple(_case(case, line) for case, line in printed_values.TABLE_2.items())


def _case(case: int, line: printed_values.Clearances) -> Row:
    # components of the model
    model = load_case(case)
    clutch, spline = model.couplings
    mesh = model.meshes[0]
    # half-gaps and ratios in units of the table
    angle = HALF_GAP / RADIUS
    error = mesh.transmission_error[0].amplitude / HALF_GAP if mesh.transmission_error else 0.0
    free = (float(spline.stiffness_ratio), float(spline.damping_ratio)) if spline.clearance else (1.0, 1.0)
    ours = printed_values.Clearances(
        clutch=(float(clutch.stiffness_ratio), float(clutch.damping_ratio), round(clutch.clearance / angle, 9)),
        spline=(*free, round(spline.clearance / angle, 9) if spline.clearance else float("inf")),
        mesh=(0.0, 0.0, round(0.5 * mesh.backlash / HALF_GAP, 9)),
        error=round(error, 9),
    )
    # row against the printed case
    return row(
        f"Table 2, case {case}",
        line.in_words(),
        ours.in_words(),
        CONSTRUCTED if ours == line else DIFFERS,
        "the models are built from these values" if ours == line else "the model is not that of the table",
        **{
            f"{name}_{index}": value
            for name in ("clutch", "spline", "mesh")
            for index, value in zip(("alpha", "beta", "b"), getattr(ours, name), strict=True)
        },
    )


def _rows(ours: dict[str, float], right: dict[str, bool]) -> tuple[Row, ...]:
    # inertia ratios that two printed quantities give
    wrong = [name for name, is_right in right.items() if not is_right]
    by_stiffness = float(printed_values.TABLE_1["Omega_12^2"]) / float(printed_values.TABLE_1["Omega_11^2"])
    by_damping = float(printed_values.TABLE_1["eta_12"]) / float(printed_values.TABLE_1["eta_11"])
    # rows against the printed parameters
    return (
        row(
            "Table 1, all but Omega_22^2",
            "fifteen parameters",
            f"{sum(right.values())} of 16 to the digits printed",
            CONSTRUCTED if wrong == ["Omega_22^2"] else DIFFERS,
            "the dimensional values were inferred from these digits",
            agreeing=sum(right.values()),
        ),
        row(
            "Table 1, Omega_22^2",
            "1482.0",
            figure(ours["Omega_22^2"], 5),
            DIFFERS,
            "K2 / (J2 omega^2) is 1481.5 for the values that give the other fifteen; probably rounded to 1482 first",
            omega=ours["Omega_22^2"],
        ),
        row(
            "Table 1, ratio I1/I2",
            f"{by_stiffness:.1f} from Omega^2, {by_damping:.1f} from eta",
            figure(J["flywheel"] / J["hub"], 4),
            DIFFERS,
            "the printed values are rounded, so no one set of inertias gives them all exactly",
            ratio=J["flywheel"] / J["hub"],
        ),
    )
