"""``gearrattle stream``: a long motion in chunks; every chunk is saved as soon as it is finished."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gearrattle
from gearrattle.cli.background import watched
from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.emit import print_result
from gearrattle.cli.shared_options import Changes, Json, ModelFile, OutputPath, Settings, Whole
from gearrattle.errors import Cancelled, GearRattleError
from gearrattle.json_types import json_text
from gearrattle.wording import counted
from gearrattle.writing import disk_is_full

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.simulation.stream import Stream

_DEFAULTS = Settings()
_GRACE = 2.0  # seconds after Ctrl-C in which a chunk that is being written may be finished


def stream(
    model: ModelFile,
    /,
    *,
    output: OutputPath = None,
    chunk: Whole | None = None,
    resume: bool = False,
    settings: Settings = _DEFAULTS,
    changes: Changes = (),
    json: Json = False,
) -> None:
    """Simulate and judge a long motion in the memory of one chunk; Ctrl-C keeps every finished chunk.

    Parameters
    ----------
    output
        Folder for the chunks; default: the model file's name with "-stream", here.
    chunk
        Cycles a chunk; the default makes chunks of about 100 000 samples, 5000 cycles at most.
    resume
        Go on with what the folder holds: same model, same options.
    """
    from gearrattle.report.result_kinds import presentation_of
    from gearrattle.report.saved import summary

    driveline = changed_model(model, changes)
    folder = output if output is not None else Path(f"{model.stem}-stream")
    under_way: list[Stream] = []

    # march chunk by chunk, and collect notes
    def work(watch: Watch) -> Stream:
        options: dict[str, Any] = {**settings.arguments(), "chunk": chunk, "store": folder, "resume": resume}
        motion = gearrattle.stream(driveline, **options, progress=watch)
        under_way.append(motion)
        for run in motion:
            for note in run.notes:
                notes.setdefault(note)
        return motion

    notes: dict[str, None] = {}
    # watch it; after a failure say what is kept
    try:
        motion = watched(work, _GRACE)
    except (KeyboardInterrupt, Exception) as error:
        raise _with_what_is_kept(error, under_way, folder) from error
    # print the verdict on the whole motion
    verdict = presentation_of(motion.verdict())
    for note in notes:
        print(f"note: {note}", file=sys.stderr)
    if json:
        print(json_text({"cycles": motion.cycles, "folder": str(folder), **summary(verdict)}))
        return
    print_result(verdict, json=False)
    print(f"{counted(motion.cycles, 'cycle')} kept in: {folder}")


def _with_what_is_kept(error: BaseException, under_way: list[Stream], folder: Path) -> BaseException:
    """Return the error with a text on which chunks are saved and how to resume, if any are."""
    done = under_way[0].close() if under_way else 0
    if not done:
        return error
    kept = f"{done} of {counted(under_way[0].cycles, 'cycle')} are kept in {folder}; --resume goes on"
    if isinstance(error, KeyboardInterrupt | Cancelled):
        return Cancelled(kept=f"interrupted: {kept}")
    if disk_is_full(error):
        return GearRattleError(f"the disk is full; {kept} when there is space again")
    print(kept, file=sys.stderr)
    return error
