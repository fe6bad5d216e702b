"""Connections to the workbench that say nothing: each has so long to say what it asks for, and few wait at a time.

Whoever opens a connection holds memory and a file of the server before any check of who asks. So a connection has
seconds to send its first head, and where too many have not yet, the one that waits longest is closed: a browser sends a
head with its connection, and never waits.

Takes connections; passes their requests on.
"""

from __future__ import annotations

import asyncio
from typing import Any, ClassVar

from uvicorn.protocols.http.h11_impl import H11Protocol

_LONGEST = 10.0  # seconds until the end of the first head
_MOST_SILENT = 64


class Connection(H11Protocol):
    """HTTP over a connection that is closed unless its first head comes in time."""

    _silent: ClassVar[dict[Connection, asyncio.TimerHandle]] = {}
    """Connections without a head so far, the one that waits longest first, and what closes each."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for a head; the connection that waits longest makes room."""
        super().connection_made(transport)
        self._silent[self] = self.loop.call_later(_LONGEST, self._close)
        if len(self._silent) > _MOST_SILENT:
            next(iter(self._silent))._close()

    def data_received(self, data: bytes) -> None:
        """Take what has come; with a whole head the wait is over."""
        super().data_received(data)
        if self.cycle is not None:
            self._spoken()

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Pass the connection on as a socket; its head was whole."""
        self._spoken()
        super().handle_websocket_upgrade(event)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        self._spoken()
        super().connection_lost(exc)

    def _spoken(self) -> None:
        timer = self._silent.pop(self, None)
        if timer is not None:
            timer.cancel()

    def _close(self) -> None:
        self._spoken()
        self.transport.abort()
