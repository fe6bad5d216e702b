"""Table 5: measured against computed accelerations; only the arithmetic of sigma can be checked.

sigma = 100 (experiment - simulation) / experiment
"""

from __future__ import annotations

from gearrattle.measured.validation import of_printed
from gearrattle.reproduction import printed_values
from gearrattle.reproduction.reproduction_record import DIFFERS, REPRODUCED, UNDECIDED, Row, Section, row


def section() -> Section:
    """Recompute sigma from the integers printed."""
    words = "Neither the driveline nor the loads of these tests are printed; sigma follows from the printed integers."
    simulations = row(
        "Table 5, simulated accelerations",
        "983 to 2247 rad/s^2",
        "no run",
        UNDECIDED,
        "nor the driveline that was tested",
    )
    return Section("table-5", "Table 5: experiment", words, (*map(_row, printed_values.TABLE_5), simulations))


def _row(line: tuple[int, str, int, int, str]) -> Row:
    case, quantity, experiment, simulation, text = line
    comparison = of_printed(experiment, simulation)
    ours = comparison.sigma
    places = len(text.partition(".")[2])
    item = f"Table 5, sigma, case {case}, {quantity}"
    printed_claim = f"{text} % of {experiment} and {simulation}"
    if round(ours, places) == float(text):
        return row(item, printed_claim, f"{ours:.{places}f} %", REPRODUCED, sigma=ours)
    why = f"of the printed integers; unrounded ones allow {comparison.high:.2f} to {comparison.low:.2f} %"
    return row(item, printed_claim, f"{ours:.{places}f} %", DIFFERS, why, sigma=ours)
