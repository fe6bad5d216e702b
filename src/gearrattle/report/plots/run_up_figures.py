"""A run-up in the report: spectra of every body's acceleration over speed, and the excited orders along it.

The maps are Campbell diagrams of the motion: order lines of the excitation, natural frequencies with every clearance
closed. What lies above half the sampling rate folds back onto them; the caption says where that can be.
"""

from __future__ import annotations

import numpy as np

from gearrattle.errors import ModelError
from gearrattle.pipeline import Findings
from gearrattle.report.plots.chart import Chart, Key
from gearrattle.report.plots.order_maps import CUTS, cuts_panel, level_unit, levels, map_panel, round_up, scale_keys
from gearrattle.signals.spectral.order_maps_of_signals import order_cuts
from gearrattle.signals.spectral.waterfalls import waterfall

_RIGID = 1e-6
_MOST = 8


def run_up_spectra(findings: Findings) -> Chart | None:
    """Draw the spectra of a run-up; None at one speed, or from too few samples."""
    # a waterfall of every body's acceleration; None without a sweep
    run = findings.motion
    si = findings.model.units == "SI"
    if findings.model.excitation.sweep is None:
        return None
    names = run.trajectory.layout.inertia_names
    try:
        maps = [waterfall(run, f"acceleration.{name}", overlap=0.75) for name in names]
    except ModelError:
        return None
    # one scale of levels for all maps
    top = round_up(max(float(np.nanmax(levels(data.values, squared=False))) for data in maps))
    # overlays: elastic natural frequencies and orders of the excitation
    natural = np.sort(findings.modes_contact.frequencies)
    elastic = natural[natural > _RIGID * natural.max(initial=0.0)].tolist()
    orders = run.trajectory.layout.orders.tolist()
    panels = tuple(
        map_panel(data, name, top=top, si=si, orders=orders, natural=elastic)
        for name, data in zip(names, maps, strict=True)
    )
    # caption and scale
    caption = (
        f"Amplitudes of the angular accelerations over speed, bins of {maps[0].attrs['resolution']:.3g} Hz. Rising: "
        "orders of the excitation; level: natural frequencies with every clearance closed, f1 the lowest above zero."
    )
    if maps[0].attrs["notes"]:
        caption += f" Mind: {maps[0].attrs['notes']}."
    keys = scale_keys(top, level_unit(str(maps[0].attrs["units"])))
    return Chart(
        "run_up_spectra",
        "Spectra over speed",
        caption,
        panels,
        columns=2 if len(panels) > 1 else 1,
        panel_height=230,
        share_x=False,
        legend=keys,
        group="run_up",
        tab="Spectra",
    )


def run_up_orders(findings: Findings) -> Chart | None:
    """Draw the excited orders of every body's acceleration over speed; None at one speed, or if no block fits."""
    # positive orders of the excitation; None without a sweep
    run = findings.motion
    si = findings.model.units == "SI"
    if findings.model.excitation.sweep is None:
        return None
    layout = run.trajectory.layout
    orders = [order for order in layout.orders.tolist() if order > 0.0]
    # as many order cuts as the sampling rate can show
    while orders:
        try:
            cuts = [
                order_cuts(run, f"acceleration.{name}", orders[:_MOST], turns=4, overlap=0.75)
                for name in layout.inertia_names
            ]
            break
        except ModelError:
            orders = orders[:-1]  # the samples do not show the highest at the highest speed
    else:
        return None
    # one panel per body
    shown = cuts[0].order.values.tolist()
    panels = tuple(
        cuts_panel(data.amplitude, name, si=si) for name, data in zip(layout.inertia_names, cuts, strict=True)
    )
    # caption: orders that are not drawn
    left = [f"{order:g}" for order in layout.orders.tolist() if order not in shown and order > 0.0]
    turns = f"{cuts[0].attrs['turns']:g}"
    caption = f"Amplitudes of excited orders of the angular accelerations, fitted over blocks of {turns} turns."
    if left:
        caption += f" Not drawn: order {', '.join(left)}; the samples do not show it at the highest speed"
        caption += f", or it is beyond {_MOST}." if len(shown) == _MOST else "."
    legend = tuple(Key(f"order {order:g}", CUTS[k]) for k, order in enumerate(shown))
    return Chart(
        "run_up_orders",
        "Orders over speed",
        caption,
        panels,
        columns=1,
        panel_height=116,
        legend=legend,
        group="run_up",
        tab="Orders",
    )
