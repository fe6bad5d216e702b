"""``gearrattle serve``: the workbench, a page of this machine on which drivelines are drawn, run and compared."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from gearrattle.cli.shared_options import Whole
from gearrattle.workbench.server import serve as serve_folder


def serve(
    folder: Path = Path(),
    /,
    *,
    port: Whole = 0,
    host: Annotated[str, Parameter(help="Address to listen on; any but loopback needs a password.")] = "127.0.0.1",
    workers: Whole | None = None,
    memory: Annotated[float | None, Parameter(help="GB that a job may hold; default: half of the machine's.")] = None,
) -> None:
    """Open the workbench: draw, run, hear and compare drivelines on a page of this machine.

    Parameters
    ----------
    folder
        Models and measured files; runs are kept in its hidden folder .gearrattle.
    port
        To listen on; default: a free one.
    workers
        Jobs that run at a time; default: one less than there are cores.
    """

    def announce(line: str) -> None:
        print(line, flush=True)

    limit = None if memory is None else 1e9 * memory
    serve_folder(folder, host=host, port=port, workers=workers, memory=limit, announce=announce)
