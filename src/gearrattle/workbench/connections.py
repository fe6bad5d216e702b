"""Limits for connections to the workbench that have not sent the head of their first request.

An open connection uses memory and a file descriptor of the server before ``access`` can check the request. So a
connection has a few seconds to send its first head, and if too many connections wait, the oldest is closed. A browser
sends a head as soon as it is connected.
"""

from __future__ import annotations

import asyncio
from typing import Any, ClassVar

from uvicorn.protocols.http.h11_impl import H11Protocol

_LONGEST = 10.0  # seconds until the end of the first head
_MOST_WAITING = 64


class Connection(H11Protocol):
    """HTTP over a connection that is closed unless its first head comes in time."""

    _waiting: ClassVar[dict[Connection, asyncio.TimerHandle]] = {}
    """Connections without a head so far, the oldest first, and the timers that close them."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for a head; the connection that waits longest makes room."""
        super().connection_made(transport)
        self._waiting[self] = self.loop.call_later(_LONGEST, self._close)
        if len(self._waiting) > _MOST_WAITING:
            next(iter(self._waiting))._close()

    def data_received(self, data: bytes) -> None:
        """Take what has come; with a whole head the wait is over."""
        super().data_received(data)
        if self.cycle is not None:
            self._stop_waiting()

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Pass the connection on as a socket; its head was whole."""
        self._stop_waiting()
        super().handle_websocket_upgrade(event)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        self._stop_waiting()
        super().connection_lost(exc)

    def _stop_waiting(self) -> None:
        """Take the connection from those without a head."""
        timer = self._waiting.pop(self, None)
        if timer is not None:
            timer.cancel()

    def _close(self) -> None:
        """Close the connection without an answer."""
        self._stop_waiting()
        self.connections.discard(self)  # at once: the limit of uvicorn counts it until the loop has closed it
        self.transport.abort()
