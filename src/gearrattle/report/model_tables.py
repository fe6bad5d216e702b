"""Tables of the model and of the computation's cost."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from gearrattle.assembly import own_mean
from gearrattle.model.balance import BALANCE
from gearrattle.model.element_groups import element_groups
from gearrattle.pipeline import Findings
from gearrattle.report.drag_table import drag_table
from gearrattle.report.plots.numerals import engineering, grouped, numeral, quantity
from gearrattle.report.provenance import versions
from gearrattle.report.summary import switches
from gearrattle.report.tables import Table
from gearrattle.trajectory import Trajectory
from gearrattle.wording import counted

if TYPE_CHECKING:
    from gearrattle.model import Element, Model, Piece


def model_tables(findings: Findings) -> list[Table]:
    """Return tables of the bodies, the elements and the excitation."""
    model = findings.model
    drag = drag_table(model, findings.motion.trajectory)
    return [_inertias(model), *([] if drag is None else [drag]), _elements(model), _excitation(findings)]


def _inertias(model: Model) -> Table:
    unit = _unit(model)
    moves = any(body.mass for body in model.inertias)
    rows = tuple(
        (
            body.name,
            quantity(body.J, unit("kg m²")),
            quantity(body.drag, unit("N m s/rad")) if body.drag else "by parts" if body.drag_parts else "–",
            quantity(body.drag_torque, unit("N m")) if body.drag_torque else "by parts" if body.drag_parts else "–",
            *([quantity(body.mass, unit("kg")) if body.mass else "–"] if moves else []),
        )
        for body in model.inertias
    )
    mass = ("mass",) if moves else ()
    return Table(("body", "inertia", "viscous drag", "drag torque", *mass), rows, title="Bodies")


def _elements(model: Model) -> Table:
    head = ("element", "between", "drive side: stiffness, from the centre outward", "coast side", "damping")
    rows = tuple((name, *_element(elements[0], _unit(model))) for name, elements in element_groups(model).items())
    title = "Couplings, meshes and bearings" if model.bearings else "Couplings and meshes"
    return Table(head, rows, frozenset(range(5)), title)


def _element(element: Element, unit: Callable[[str], str]) -> tuple[str, ...]:
    """The row of an element without its name: its two bodies, its law and its damping."""
    slope, deflection, damping = ("N/m", "m", "N s/m") if element.along_line else ("N m/rad", "rad", "N m s/rad")
    alike = element.coast == element.drive
    coast = "as drive" if alike else _stages(element.coast, unit(slope), unit(deflection))
    if element.along_line and element.radii[0] > 0.0:
        coast += "; base radii " + ", ".join(engineering(radius, unit("m")) for radius in element.radii)
    others = [body for body, _ in element.arms if body not in element.between]
    between = " – ".join(element.between) + "".join(f", on {body}" for body in others)
    drive = _stages(element.drive, unit(slope), unit(deflection))
    return (between, drive, coast, _dampings(element, unit(damping)))


def _stages(pieces: tuple[Piece, ...], stiffness: str, deflection: str) -> str:
    words = []
    for piece in pieces:
        slope = "free" if piece.stiffness == 0.0 else quantity(piece.stiffness, stiffness)
        if piece.hysteresis:
            slope += f" with a loop of {quantity(piece.hysteresis, stiffness.removesuffix('/rad'))}"
        words.append(slope if piece.until is None else f"{slope} to {engineering(piece.until, deflection, 4)}")
    return ", then ".join(words)


def _dampings(element: Element, unit: str) -> str:
    description = ", then ".join(quantity(piece.damping, unit) for piece in element.drive)
    return f"{description}; clipped" if element.contact_damping == "clipped" else description


def _excitation(findings: Findings) -> Table:
    # reference speed and its sweep
    model = findings.model
    unit = _unit(model)
    omega = model.excitation.omega
    speed = numeral(omega)
    if model.units == "SI":
        speed = f"{quantity(omega, 'rad/s')} = {numeral(omega * 30.0 / math.pi)} rpm = {numeral(omega / math.tau)} Hz"
    rows = [("reference speed", speed, "")]
    if (sweep := model.excitation.sweep) is not None:
        end = f"{quantity(sweep.end, unit('rad/s'))} over {engineering(sweep.over, unit('s'))}"
        rows.append(("its sweep", f"from there to {end}", ""))
    # torques: mean, harmonics, ramps, records
    for index, torque in enumerate(model.torques):
        mean = f"mean {quantity(own_mean(model, index), unit('N m'))}"
        rows.append((f"torque on {torque.on}", mean + ", the balance of its train" * (torque.mean == BALANCE), ""))
        rows += [
            ("", f"order {numeral(term.order)}: {quantity(term.amplitude, unit('N m'))}", _phase(term.phase))
            for term in torque.harmonics
        ]
        rows += [("", ramp.in_words(is_si=model.units == "SI"), "") for ramp in torque.ramps]
        if (signal := torque.signal) is not None:
            length = engineering(float(signal.time[-1] - signal.time[0]), unit("s"))
            points = f"{counted(signal.time.size, 'point')}, {signal.interpolation}"
            rows.append(("", f"a record of {points}, over {length}", signal.source))
    # prescribed motions: records, harmonics
    for motion in model.motions:
        if motion.signal is not None:
            kind = "speed" if motion.angle is None else "angle"
            points = f"{counted(motion.signal.time.size, 'point')}, {motion.signal.interpolation}"
            rows.append((f"motion of {motion.on}", f"a record of its {kind}, {points}", ""))
        rows += [
            (
                f"motion of {motion.on}",
                f"order {numeral(term.order)}: {engineering(term.amplitude, unit('rad'))}",
                _phase(term.phase),
            )
            for term in motion.harmonics
        ]
    # transmission errors
    for element in model.elements:
        length = unit("m" if element.along_line else "rad")
        rows += [
            (
                element.error_words,
                f"order {numeral(term.order)}: {engineering(term.amplitude, length)}",
                _phase(term.phase),
            )
            for term in element.errors
        ]
    return Table(("", "value", "phase"), tuple(rows), frozenset({0, 1}), "Excitation")


def _phase(phase: float) -> str:
    return f"{numeral(math.degrees(phase))}°"


def _unit(model: Model) -> Callable[[str], str]:
    return lambda unit: unit if model.units == "SI" else ""


def cost_table(findings: Findings) -> Table:
    """Return the cost of the simulation."""
    trajectory = findings.motion.trajectory
    cost = trajectory.cost
    time_unit = "s" if findings.model.units == "SI" else ""
    rows = (
        ("algorithm", cost.algorithm),
        ("cycles simulated, discarded", f"{trajectory.cycles}, {trajectory.discard}"),
        ("common period T", engineering(trajectory.layout.period, time_unit, 6)),
        ("samples a cycle", f"{trajectory.samples_per_cycle}"),
        ("crossings found", grouped(cost.events)),
        *_switched(trajectory),
        ("steps", grouped(cost.steps)),
        ("function calls", grouped(cost.function_calls)),
        ("Jacobian calls", grouped(cost.jacobian_calls)),
        (
            "average step, of all tried",
            f"{_step(cost.average_step, time_unit)}, {_step(cost.average_trial_step, time_unit)}",
        ),
        ("computing time", engineering(cost.wall_time, "s")),
    )
    return Table(("simulation", ""), rows, title="Cost")


def _switched(trajectory: Trajectory) -> list[tuple[str, str]]:
    """A row with the number of switches of friction and of contact damping, if any."""
    count = sum(switches(trajectory).values())
    return [("switches of friction, clipped damping and tooth pairs", grouped(count))] if count else []


def _step(step: float, unit: str) -> str:
    return engineering(step, unit)


def versions_table() -> Table:
    """Return the versions of the software that computed the numbers."""
    return Table(("software", "version"), tuple(versions().items()), title="Versions")
