"""The server of the workbench: its socket, its start address, and its end."""

from __future__ import annotations

import contextlib
import ipaddress
import math
import os
import secrets
import socket
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from gearrattle.errors import ModelError, NotInstalled, Problem
from gearrattle.files import Refused
from gearrattle.workbench.workspace_folder import Folder
from gearrattle.writing import Lock

PASSWORD = "GEARRATTLE_PASSWORD"
"""Environment variable of the password that a host other than loopback needs: command lines are seen by all users."""
_SHORTEST = 12
_MOST_WORKERS = 1000
_LAST_PORT = 65535
_CONNECTIONS = 200
_TURN = 5e-4  # s, switch interval of threads: short, so that files of the page are sent while modules are imported


def serve(
    folder: Path,
    *,
    host: str = "127.0.0.1",
    port: int = 0,
    workers: int | None = None,
    memory: float | None = None,
    announce: Callable[[str], None] = print,
) -> None:
    """Serve the workbench of a folder until it is interrupted.

    Parameters
    ----------
    folder
        the workspace folder: models, measured files, and the jobs in its hidden folder ``.gearrattle``.
    host
        address to listen on. Any other than loopback needs a password in ``GEARRATTLE_PASSWORD``.
    port
        to listen on; 0: a free one.
    workers
        jobs that run at a time; default: one less than there are cores, at least one.
    memory
        bytes that a job may hold; default: half of the machine's.
    announce
        is called with the start address, before anything else.

    Raises
    ------
    ModelError
        the folder, the host or the port cannot be served, or a limit is no possible one; an extra is missing.
    """
    # check the extra and the arguments
    try:
        import uvicorn

        from gearrattle.workbench.access import Access
        from gearrattle.workbench.application import Limits, Server, application
        from gearrattle.workbench.connections import Connection
    except ImportError:
        rule = "needs starlette, uvicorn and websockets"
        raise NotInstalled.of("workbench", "serve", "", rule) from None
    if not folder.is_dir():
        raise ModelError(Problem("FOLDER", f'"{folder}"', "must be a folder", "make it first"))
    _check_limits(workers, memory)
    # lock the folder and open the socket
    password = _password(host)
    workspace = Folder(folder.resolve())
    lock = _locked(workspace)
    listening = _listening(host, port)
    # application behind its access checks
    token = secrets.token_urlsafe(32)
    number = listening.getsockname()[1]
    limits = Limits(workers or max(1, (os.cpu_count() or 2) - 1), memory or 0.5 * _memory())
    app = application(workspace, limits)
    config = uvicorn.Config(
        Access(app, host, token, password),
        lifespan="on",
        http=Connection,
        ws="websockets-sansio",
        ws_max_size=65536,
        limit_concurrency=_CONNECTIONS,
        timeout_keep_alive=15,
        timeout_graceful_shutdown=2,
        access_log=False,
        log_level="warning",
        server_header=False,
        date_header=False,
    )
    # announce the start address, and serve until interrupted
    try:
        announce(f"http://{_shown(host)}:{number}/?token={token}")
        if password:
            announce(
                f"who reaches port {number} and has the password can read and write {folder}; nothing is encrypted"
            )
        sys.setswitchinterval(_TURN)
        with _within(workspace.root):
            Server(config, app.state).run(sockets=[listening])
    finally:
        listening.close()
        lock.release()


@contextlib.contextmanager
def _within(folder: Path) -> Iterator[None]:
    """Work in the folder: a model names files under the working directory too, which may hold much besides the folder.

    Processes that compute jobs start there; none of them may take a file of the folder for a module.
    """
    os.environ["PYTHONSAFEPATH"] = "1"
    with contextlib.chdir(folder):
        yield


def _check_limits(workers: int | None, memory: float | None) -> None:
    """Refuse numbers that no server can have."""
    problems = []
    if workers is not None and not 1 <= workers <= _MOST_WORKERS:
        remedy = "leave it out for one less than there are cores"
        problems.append(Problem("--workers", str(workers), f"must be 1 ... {_MOST_WORKERS}", remedy))
    if memory is not None and not 0.0 < memory < math.inf:
        remedy = "leave it out for half of the machine's memory"
        problems.append(Problem("--memory", f"{memory / 1e9:g}", "must be a number of GB above 0", remedy))
    if problems:
        raise ModelError(problems)


def _password(host: str) -> str:
    """Return the password of a host, empty on loopback; ModelError if it is needed and missing, or short."""
    if is_loopback(host):
        return ""
    password = os.environ.get(PASSWORD, "")
    if len(password) < _SHORTEST:
        rule = (
            f"others on the network can reach it, so it needs a password of {_SHORTEST} characters or more in the "
            f"environment variable {PASSWORD}; the connection is not encrypted"
        )
        raise ModelError(Problem("--host", host, rule, "leave --host out to serve this machine alone"))
    return password


def is_loopback(host: str) -> bool:
    """Whether a host is this machine alone.

    Examples
    --------
    >>> from gearrattle.workbench.server import is_loopback
    >>> is_loopback("127.0.0.1"), is_loopback("0.0.0.0")
    (True, False)
    """
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _locked(folder: Folder) -> Lock:
    """Take the right to compute jobs in a folder, of one server at a time."""
    folder.make_jobs()
    try:
        return Lock(folder.jobs.parent)
    except Refused as refused:
        problem = Problem("FOLDER", str(folder.root), refused.rule, "use the page of that server, or another folder")
        raise ModelError(problem) from None


def _listening(host: str, port: int) -> socket.socket:
    if not 0 <= port <= _LAST_PORT:
        raise ModelError(Problem("--port", str(port), f"must be 0 ... {_LAST_PORT}", "leave it out for a free one"))
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        listening = socket.socket(family, kind, protocol)
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(address)
        listening.listen(128)
    except (OSError, OverflowError) as error:
        words = (getattr(error, "strerror", "") or str(error)).lower()
        raise ModelError(Problem("--port", f"{host}:{port}", words, "leave --port out for a free one")) from None
    return listening


def _shown(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def _memory() -> float:
    """Bytes of memory of this machine; 8 GB where it does not say."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (ValueError, OSError, AttributeError):
        return 8e9
