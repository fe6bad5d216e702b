"""``gearrattle screen``: which loose gear rattles at which speed and load, for a whole gearbox, by the threshold."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gearrattle
from gearrattle.cli import assignments
from gearrattle.cli.command_inputs import changed_model, is_model
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Changes, Json, Output, Settings, Whole, Words, number_or_text, typed
from gearrattle.errors import ModelError, Problem

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.model import Model

_SETTINGS = Settings()
_COUNT = 25


def screen(
    source: Path,
    /,
    *,
    speeds: str | None = None,
    count: Whole | None = None,
    loads: str | None = None,
    load: Words = (),
    changes: Changes = (),
    simulate: bool = False,
    check: bool = False,
    points: Whole | None = None,
    workers: Whole | None = None,
    output: Output = None,
    settings: Settings = _SETTINGS,
    json: Json = False,
) -> None:
    """Map which loose gear leaves its flank at which speed and load, by the linear driveline; nothing is integrated.

    Parameters
    ----------
    source
        Model file, or a study file of the kind "grid" whose axes are excitation.speed and at most one of loads.
    speeds
        Of the reference shaft: "600:2400 rpm", or a list, "800,1200 rpm"; numbers without a unit are in rad/s.
        Default: half to twice the model's.
    count
        Speeds of a range. Default: 25.
    loads
        Factors on the amplitudes of the torques, "0.5,1,2". Default: the model's own.
    load
        PATH=VALUE,VALUE,... instead: values of the model at the loads, which vary together. "x1,x3" are factors of what
        the model says, * in PATH stands for any text. May be repeated.
    simulate
        Also simulate and judge every case, with the settings below.
    check
        Also simulate and judge the cases nearest to the border, with the settings below.
    points
        Cases of --check. Default: 8.
    workers
        Processes or threads of --simulate and --check; default: as many as there are cores.
    """
    from gearrattle.report.screening_page import ScreeningPage

    model, asked, title = _asked(source, speeds, count, (loads, load), changes)
    model = _settled(model, settings, simulate=simulate or check, workers=workers)
    if points is not None and not check:
        rule = "is the number of cases of --check, and nothing is checked"
        raise ModelError(Problem("--points", f"{points}", rule, "add --check, or leave it out"))
    near = check if points is None else points

    def work(watch: Watch) -> ScreeningPage:
        watch.enter("screening")
        screening = gearrattle.screen(model, *asked, simulate=simulate, check=near, workers=workers, progress=watch)
        return ScreeningPage(screening, title)

    emit("screening", work, output, json=json, inputs=[source])


def _asked(
    source: Path,
    speeds: str | None,
    count: int | None,
    of_loads: tuple[str | None, Sequence[str]],
    changes: Sequence[str],
) -> tuple[Model, tuple[Any, Any], str]:
    """Return the model, the speeds and loads, and what to call the page."""
    loads, load = of_loads
    if source.suffix.lower() == ".toml" and source.exists() and not is_model(source):
        from gearrattle.studies.screening_study import screening_of
        from gearrattle.studies.study_file import read_study

        options = {"--speeds": speeds, "--count": count, "--loads": loads, "--load": load or None}
        clash = [name for name, value in options.items() if value is not None]
        if clash:
            rule = "a study file says its speeds and loads itself"
            raise ModelError(Problem(", ".join(clash), str(source), rule, "leave them out, or give the model file"))
        study = read_study(source).changed(assignments.changes("--set", changes))
        model, axes, by_path = screening_of(study, str(source))
        return model, (axes, by_path), study.name
    if loads is not None and load:
        rule = "loads are factors, or values by path"
        raise ModelError(Problem("--loads, --load", "both", rule, "leave one of them out"))
    model = changed_model(source, changes)
    given_loads = _factors(loads) if loads is not None else assignments.texts("--load", load) if load else None
    return model, (_speeds(model, speeds, count), given_loads), model.name or "driveline"


def _speeds(model: Model, speeds: str | None, count: int | None) -> Any:
    """Return the speeds as ``screen`` takes them."""
    from gearrattle.model.units import with_last_unit

    if speeds is not None and ":" not in speeds:
        if count is not None:
            rule = "is the number of speeds of a range, and --speeds is a list"
            raise ModelError(Problem("--count", f"{count}", rule, 'leave it out, or give "LOW:HIGH"'))
        return [number_or_text(speed) for speed in with_last_unit(speeds.split(","))]
    ends: list[Any] = [0.5 * model.excitation.omega, 2.0 * model.excitation.omega]
    if speeds is not None:
        ends = [number_or_text(end) for end in with_last_unit(speeds.split(":"))]
    if len(ends) != 2:
        raise ModelError(Problem("--speeds", f'"{speeds}"', 'must be LOW:HIGH or a list, such as "600:2400 rpm"'))
    return {"from": ends[0], "to": ends[1], "count": _COUNT if count is None else count}


def _factors(loads: str) -> list[float]:
    """Read factors."""
    try:
        return [float(factor) for factor in loads.split(",")]
    except ValueError:
        rule = "must be factors parted by commas"
        raise ModelError(Problem("--loads", f'"{loads}"', rule, '"0.5,1,2"; --load takes values by path')) from None


def _settled(model: Model, settings: Settings, *, simulate: bool, workers: int | None) -> Model:
    """Return the model with the settings of its simulations; ModelError for settings without simulations."""
    options = typed(settings) + (["--workers"] if workers is not None else [])
    if options and not simulate:
        rule = "is of simulations, and nothing is simulated"
        raise ModelError(Problem(", ".join(options), "given", rule, "add --simulate or --check, or leave it out"))
    return settings.on(model)
