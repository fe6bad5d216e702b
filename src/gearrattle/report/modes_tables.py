"""The tables of the page on modes: modes in words, energies, excitation, crossings."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from gearrattle.analysis.campbell import Campbell, Crossing
from gearrattle.analysis.statics import Modes
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.tables import Table
from gearrattle.trajectory import Array
from gearrattle.wording import counted

MOST_CROSSINGS = 120
MOST_NAMES = 5


def rate(frequency: float, *, si: bool) -> str:
    """Write a natural frequency in Hz; in a model without units, the number itself."""
    return f"{numeral(frequency / math.tau, 5)} Hz" if si else numeral(frequency, 5)


def turning(speed: float, *, si: bool) -> str:
    """Write a speed in rpm; in a model without units, the number itself."""
    return f"{numeral(speed * 30.0 / math.pi)} rpm" if si else numeral(speed)


def percent(share: float) -> str:
    """Write a share in per cent; a dash if it does not exist."""
    if math.isnan(share):
        return "–"
    return "< 0.01 %" if 0.0 < share < 1e-4 else f"{numeral(100.0 * share, 3 if share >= 0.1 else 2)} %"


def listed(shares: Mapping[str, float]) -> str:
    """Write the first few shares by name in one line."""
    entries = [f"{name} {percent(share)}" for name, share in shares.items()]
    return ", ".join((*entries[:MOST_NAMES], *("…" for _ in entries[MOST_NAMES : MOST_NAMES + 1]))) or "–"


def modes_in_words(modes: Modes, model_speed: float, *, si: bool) -> Table:
    """One row per mode: frequency, damping, largest shares of strain and kinetic energy, and excitation."""
    # frequency, damping ratio and largest energy shares of every mode
    head = ("mode", "frequency" + (", Hz" if si else ""), "order", "damping", "works in", "moves", "excited by")
    rows = []
    for mode, frequency in enumerate(modes.frequencies.tolist()):
        rigid = frequency == 0.0
        damping = float(modes.damping_ratios[mode])
        lists = modes.works_in(mode), modes.moves(mode), modes.excited_by(mode)
        rows.append(
            (
                f"{mode + 1}",
                "rigid" if rigid else numeral(frequency / math.tau if si else frequency, 5),
                "–" if rigid else numeral(frequency / model_speed, 3),
                percent(damping),
                *(listed(shares).replace(" %", "\u00a0%") for shares in lists),
            )
        )
    # definition of the shares
    note = (
        "Order: at the model's speed. Works in: shares of the strain energy from 5 % on. Moves: shares of the kinetic "
        "energy from 5 % on. Excited by: the share of the energy of a unit impulse on that inertia, or of a sudden "
        "step of "
        "that transmission error, that goes into the mode, from 0.1 % on."
    )
    # repeated frequencies: only sums of shares have a meaning
    groups = [" and ".join(str(mode + 1) for mode in group) for group in modes.repeated()]
    if groups:
        note += (
            f" Modes {'; '.join(groups)} have the same frequency: any combination of them is a mode too, and only sums "
            "of their shares mean something."
        )
    return Table(head, tuple(rows), frozenset({4, 5, 6}), "", note)


def frequencies_table(modes: Modes, *, si: bool) -> Table:
    """One row per mode: frequency, damping and shape in numbers."""
    head = ("mode", "frequency [Hz]" if si else "frequency", "damping [%]", *modes.inertia_names)
    rows = [
        (
            f"{mode + 1}",
            f"{frequency / math.tau if si else frequency:.6g}",
            "–" if math.isnan(damping) else f"{100.0 * damping:.4g}",
            *(f"{value:.4f}" for value in modes.shapes[:, mode].tolist()),
        )
        for mode, (frequency, damping) in enumerate(zip(modes.frequencies, modes.damping_ratios, strict=True))
    ]
    return Table(head, tuple(rows))


def energies_in_words(modes: Modes) -> Table:
    """One row per mode: elements with its strain energy, and its excitation."""
    rows = []
    for mode, frequency in enumerate(modes.frequencies.tolist()):
        works = "rigid motion" if frequency == 0.0 else listed(modes.works_in(mode))
        rows.append((f"{mode + 1}", works, listed(modes.excited_by(mode)).replace("–", "nothing")))
    return Table(("mode", "works in", "excited by"), tuple(rows), frozenset({1, 2}))


def energy_tables(modes: Modes, *, si: bool) -> tuple[Table, ...]:
    """Shares of strain and kinetic energy, and participations."""
    # units, and notes below the tables
    unit = " [1/(kg m²)]" if si else ""
    if modes.has_directions:
        unit += f", in a direction of a force{' [1/kg]' if si else ''}"
    largest = "angle or displacement 1" if modes.has_directions else "angle 1"
    of_angles = " [kg m² or kg]" if modes.has_directions else " [kg m²]"
    inertia = f"Modal inertia with the largest {largest}{of_angles if si else ''}: " + ", ".join(
        f"mode {mode + 1} {numeral(value, 3)}" for mode, value in enumerate(modes.modal_inertia.tolist())
    )
    strain = (
        "Down a column 100 %. The share is also by how many per cent the square of the frequency rises where the "
        "stiffness rises by one per cent."
    )
    kinetic = (
        "Columns and rows add up to 100 %. By as many per cent the square of the frequency falls where the inertia "
        "rises by one per cent."
    )
    constants = f"phi_i² / (phiᵀ J phi): a row adds up to 1 / J_i. {inertia}."
    # a table for each of the three shares
    parts = (
        (modes.element_names, modes.strain_energy, percent, "Strain energy", strain),
        (modes.inertia_names, modes.kinetic_energy, percent, "Kinetic energy", kinetic),
        (modes.inertia_names, modes.participation, _short, f"Participation of a torque{unit}", constants),
    )
    head = ("", *(f"mode {mode + 1}" for mode in range(len(modes.frequencies))))
    return tuple(
        Table(head, _rows(names, shares, write), frozenset({0}), title, note)
        for names, shares, write, title, note in parts
        if names
    )


def _rows(names: tuple[str, ...], table: Array, write: Callable[[float], str]) -> tuple[tuple[str, ...], ...]:
    return tuple((name, *map(write, row)) for name, row in zip(names, table.tolist(), strict=True))


def _short(value: float) -> str:
    return numeral(value, 3)


def crossings_table(diagram: Campbell, *, si: bool) -> Table:
    """Every crossing, by speed; of very many crossings, those with the strongest excitation of their mode."""
    several = len(diagram.states) > 1
    strongest = set(sorted(diagram.crossings, key=lambda crossing: -crossing.share)[:MOST_CROSSINGS])
    shown = [crossing for crossing in diagram.crossings if crossing in strongest]
    state = ("contact ratios",) if several else ()
    unit = ", rpm" if si else ""
    head = (f"speed{unit}", "of the model's", "order", "mode", "frequency", "excited by", "share", *state)
    rows = tuple(_crossing(diagram, crossing, several=several, si=si) for crossing in shown)
    note = "Share: how much of the energy of what turns with the order goes into the mode; not an amplitude."
    if len(shown) < len(diagram.crossings):
        note += (
            f" {len(shown)} of {counted(len(diagram.crossings), 'crossing')}, those of the largest shares; "
            "summary.json has all."
        )
    return Table(head, rows, frozenset({5, 7}), "Crossings", note)


def _crossing(diagram: Campbell, crossing: Crossing, *, several: bool, si: bool) -> tuple[str, ...]:
    ratios = ", ".join(f"{name} {ratio:g}" for name, ratio in diagram.states[crossing.state].items())
    return (
        turning(crossing.speed, si=si).removesuffix(" rpm"),
        percent(crossing.speed / diagram.model_speed),
        f"{crossing.order:g}",
        f"{crossing.mode + 1}",
        rate(crossing.frequency, si=si),
        crossing.source,
        percent(crossing.share),
        *((ratios,) if several else ()),
    )
