"""The spectrum of one channel of a run or a recording, over frequency, for the page to lay one over the other.

Takes a run or a recording; gives JSON.
"""

from __future__ import annotations

from typing import Any

from gearrattle.assembly import assemble
from gearrattle.json_types import json_value
from gearrattle.recording import Recording
from gearrattle.results import Run
from gearrattle.signals.spectral.densities import psd


def density(source: Run | Recording, channel: str) -> dict[str, Any]:
    """Return the power spectral density of a channel, and the frequency of the shaft that orders refer to.

    Parameters
    ----------
    source
        the run or the recording.
    channel
        its name.
    """
    data = psd(source, channel)
    shaft = assemble(source.model).layout.omega if isinstance(source, Run) else None
    return {
        "channel": channel,
        "unit": str(data["density"].attrs.get("units", "")),
        "frequency_unit": str(data["frequency"].attrs.get("units", "")),
        "frequency": json_value(data["frequency"].values),
        "psd": json_value(data["density"].values),
        "shaft": shaft,
    }
